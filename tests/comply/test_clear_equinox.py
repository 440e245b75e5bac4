"""LEED's clear hours and LM-83's direct sun against Radiance under the same skies and suns."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.clear_equinox import ASE, NEED, ROOMS, Sides, compared


@pytest.fixture(scope="module")
def both(variant, tmp_path_factory) -> Sides:
    pytest.importorskip("pyradiance")
    return compared(ROOMS["south-east"], tmp_path_factory.mktemp("equinox"))


def light_agrees(both: Sides) -> None:
    """The eight clear hours: 2 % in sum, half of the sensors within 3 % (noise 1.5 %)."""
    ours = both.ours.open[both.hours]
    assert ours.sum() / both.clear.sum() == pytest.approx(1.0, abs=0.02)
    assert np.median(np.abs(ours / both.clear - 1)) < 0.03
    points = 100 / ours.shape[1]
    found, wanted = both.shares(NEED)
    assert abs(found - wanted) < 2.1 * points  # sensors at a limit, by noise


def sun_agrees(both: Sides) -> None:
    """Hours of the disc at the edge of the window or at 1000 lx: 1 % of a sensor's."""
    ours, theirs = both.sunlit()
    assert np.abs(ours - theirs).max() <= 0.01 * theirs.max()
    ten = both.calendar.ten
    light = both.ours.direct[ten].sum() / both.direct[ten].sum()
    assert light == pytest.approx(1.0, abs=0.01)  # the glass by rings of 10 degrees
    found, wanted = both.shares(ASE)
    assert found == pytest.approx(wanted, abs=0.1) and 10 < wanted < 90


@pytest.mark.slow
def test_clear_hours_are_those_of_radiance(both):
    light_agrees(both)


@pytest.mark.slow
def test_direct_sun_is_that_of_radiance(both):
    sun_agrees(both)
