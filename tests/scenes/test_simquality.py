"""SimQuality by study files: steps through walls, shapes by rays of its own, (slow) their sun."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.sky.sun import direction
from scenes.heat.study import study_inputs
from scenes.heat.study_file import read_study
from tests.validation import simquality

FILES = sorted(simquality.STUDIES.glob("TF09.*.toml"))


@pytest.fixture(scope="module")
def reference(reference_data) -> Path:
    folder = reference_data / "simquality"
    if not folder.is_dir():
        pytest.skip("SimQuality's values (../shared/reference/simquality) are not here")
    return folder


def hidden(points: np.ndarray, sun: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether triangles [T, 3, 3] stand between points [N, 3] and a sun [3] (Moeller, Trumbore)."""
    found = np.zeros(len(points), dtype=bool)
    for a, b, c in triangles:
        across = np.cross(sun, c - a)
        scale = (b - a) @ across
        if abs(scale) < 1e-12:
            continue
        from_a = points - a
        u, turned = from_a @ across / scale, np.cross(from_a, b - a)
        v, distance = turned @ sun / scale, turned @ (c - a) / scale
        found |= (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 1e-6)
    return found


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_shapes_shade_as_the_suite_says(file: Path, reference: Path) -> None:
    """The share of 60 x 60 points of the window that rays reach: within the suite's 0.05."""
    suite = pd.read_csv(reference / simquality.TABLE, sep="\t")
    suns = direction(np.radians(suite["Altitude [Deg]"].to_numpy()), np.radians(suite["Azimuth [Deg]"].to_numpy()))
    inputs = study_inputs(read_study(file))
    building, (space,) = inputs.building, inputs.spaces
    corners = space.windows[0].triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    steps = (np.arange(60) + 0.5) / 60
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps))
    points = low + np.stack([u, u, v], axis=1) * (high - low)  # one of x and y has no width
    shades = np.concatenate([element.triangles for element in building.elements])
    found = [1.0 - hidden(points, sun, shades).mean() for sun in suns]
    column = suite[f"Var09.{file.stem[-1]} [---]"].to_numpy()
    before = suns @ space.windows[0].normal > 0.01  # not in the plane of the window
    assert before.sum() >= 9
    np.testing.assert_allclose(np.array(found)[before], column[before], atol=0.05)


def test_sun_of_the_files_stands_where_the_suite_has_it(reference: Path) -> None:
    """Within the table's digits; in Lima by what approximate formulas of the sun are off."""
    from scenes.heat.files import read_files

    suite = pd.read_csv(reference / simquality.TABLE, sep="\t")
    weather = read_files(read_study(FILES[0])).weather
    interval = (suite[simquality.MINUTES] % 1440 // 30).to_numpy()
    theirs = direction(np.radians(suite["Altitude [Deg]"].to_numpy()), np.radians(suite["Azimuth [Deg]"].to_numpy()))
    ours = simquality.sun_directions(weather)[interval]
    assert np.degrees(np.arccos(np.einsum("hi,hi->h", ours, theirs))).max() < 0.06
    angles = simquality.sun_angles(reference)
    assert len(angles) > 3900 and angles.mean() < 0.5 and angles.max() < 1.5  # as gensky's formula


def test_step_through_walls_is_the_suites() -> None:
    """TF03, boxes without windows: 0.1 K; an interval of 10 minutes is up to 0.25 K of the step."""
    found = simquality.step_response()
    assert len(found) == 20
    np.testing.assert_allclose(found["mitsuba-cfs"], found["suite"], atol=0.1)


@pytest.mark.slow
def test_sun_of_the_studies_lies_in_the_bounds_of_the_suite(reference: Path) -> None:
    """All but the one place where the sun stands in the plane of the window."""
    table = simquality.compare(reference)
    outside = table[~table["inside"]]
    assert len(table) == 60 and len(outside) <= 1
    assert set(outside["azimuth"]) <= {180.0} and set(outside["variant"]) <= {"6"}
