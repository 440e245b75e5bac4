"""CIE 171:2006, tests 5.9 to 5.14, against a quadrature that knows neither patches nor paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.validation import cie171
from tests.validation.cie171_cases import SKIES, SUN, cases, reported
from tests.validation.cie171_quadrature import Wall

pytestmark = pytest.mark.usefixtures("variant")

BAR, GRAZING_BAR = 0.005, 0.02  # of the task: 0.5 %, 2 % where light comes in at grazing angles
# Figures of the report that contradict one another, or are 5 % off by quadrature: see SOURCE.md
OFF = {("5.9 roof opening 4x4", 0), ("5.10 roof opening 4x4, glass", 0)}
WALL = "5.14 facade 2x1, wall 6 m away, height"
SOFT = {"5.11 facade opening 4x3", "5.13 facade 2x1, overhang", WALL}  # walls' and shelf's figures


def case_of(label: str, sensors: slice = slice(None)):
    case = next(one for one in cases() if one.label == label)
    return replace(case, points=case.points[sensors], normals=case.normals[sensors])


def test_the_reports_figures_are_those_of_the_quadrature(reference_data):
    """They have two decimals: half of the last one, and 0.5 % for what they were rounded from."""
    known = {(case.name, case.parameter): case for case in cases()}
    compared = 0
    for name, parameter, kind, values in reported(reference_data / "cie171/sky_component.tsv"):
        case = known.get((name, parameter))
        if case is None or name in SOFT or kind not in (8, 12):
            continue
        found = replace(case, points=case.points[:14:3], normals=case.normals[:14:3])
        for i, (ours, theirs) in enumerate(zip(found.quadrature(kind), values[:14:3], strict=True)):
            if (name, i) not in OFF:
                assert ours == pytest.approx(theirs, rel=0.005, abs=0.005), (name, kind, i)
                compared += 1
    assert compared >= 40


def test_past_the_wall_the_reports_figures_are_those_of_the_quadrature(reference_data):
    """5.14 where no wall is seen; where it is the report's 6 and 9 m contradict one another."""
    known, compared = {case.parameter: case for case in cases() if case.name == WALL}, 0
    for name, parameter, kind, values in reported(reference_data / "cie171/sky_component.tsv"):
        if name == WALL and kind in (5, 8, 16):
            free = slice(3, 8) if parameter == 3.0 else slice(6, 8)
            found = replace(
                known[parameter], points=known[parameter].points[free], normals=known[parameter].normals[free]
            ).quadrature(kind)
            assert found == pytest.approx(values[free], rel=0.005, abs=0.005), (parameter, kind)
            compared += len(found)
    assert compared == 27


def test_a_wall_outdoors_has_the_light_that_the_facade_leaves_it():
    """A uniform sky, facade and wall without end: E = (1 - sin t)/2 + r (1 + sin f)/2."""
    heights = np.array([0.5, 1.5, 2.5])
    top, foot = np.arctan((3.0 - heights) / 6.0), -np.arctan(heights / 6.0)
    wanted = (1 - np.sin(top)) / 2 + 0.3 * (1 + np.sin(foot)) / 2
    wall = Wall(3.0, 6.0, 0.3)
    found = wall.luminance(5, SUN, 0.3, heights)
    assert found == pytest.approx(0.3 / np.pi * wanted, rel=1e-3)
    high = wall.luminance(5, SUN, 0.3, np.array([7.5]))
    hidden = np.sin(np.arctan(7.5 / 6.0)) - np.sin(np.arctan(4.5 / 6.0))
    assert high == pytest.approx(0.3 / np.pi * (0.5 + 0.15 * (1 - hidden)), rel=1e-3)


def test_a_pane_of_the_quadrature_is_the_programs_pane():
    from mitsuba_cfs.bsdf.glazing import pane_values
    from tests.validation.cie171_quadrature import pane_transmittance

    cosine = np.linspace(0.01, 1, 50)
    ours, _, _ = pane_values(cie171.pane(), np.arccos(cosine))
    assert pane_transmittance(cosine, 0.88) == pytest.approx(ours, abs=1e-6)


@pytest.mark.parametrize("method", ["paths", "two-phase", "five-phase"])
def test_a_few_points_behind_glass_have_the_sky_that_they_see(method):
    """Beside a small window of Klems glass: patches alone were 11 % off, 20 % at grazing."""
    case = case_of("5.12 facade opening 2x1, glass", slice(6, 14, 3))
    sampling = replace(cie171.SAMPLING, sensor_samples=1 << 16, hour_samples=1 << 17)
    found = cie171.deviations(case, method, "klems", sampling)
    assert np.abs(found).max() < 2 * BAR  # noise of the few paths of a quick test: 0.2 %
    assert np.abs(found.mean(axis=1)).max() < BAR


@pytest.mark.slow
@pytest.mark.parametrize("method", ["paths", "two-phase", "five-phase"])
@pytest.mark.parametrize("label", [case.label for case in cases()])
def test_every_point_has_the_light_of_the_quadrature(label, method):
    case = case_of(label)
    found = np.abs(cie171.deviations(case, method, "klems"))
    noise = 0.0015 if method == "five-phase" else 0.003  # two sigma of the paths
    assert found[~case.grazing()].max() < BAR + noise
    assert found[case.grazing()].max() < GRAZING_BAR
    assert found.shape == (len(case.points), len(SKIES))
