"""What the evidence on fireflies counts, and a picture of its box against paths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mitsuba_cfs as cfs
from scenes.demo import WEATHER
from tests.validation import fireflies


def test_a_pixel_is_held_against_the_brightest_around_it() -> None:
    finer = np.zeros((12, 12))
    finer[5, 7] = 3.0
    found = fireflies.brightest(finer)
    assert found.shape == (6, 6)
    assert np.argwhere(found == 3.0).min(axis=0).tolist() == [1, 2]
    assert np.argwhere(found == 3.0).max(axis=0).tolist() == [3, 4]


@pytest.mark.slow
@pytest.mark.usefixtures("variant")
def test_nothing_shines_out_of_the_box_under_an_overhang() -> None:
    """Three random hours; in the corners pictures by paths that share light are too dark."""
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), 160)
    found = fireflies.held(lit, 3, samples=8)
    # by shared light alone, with beams smoothed over tiles, 18 pixels of twelve hours
    assert found.beyond.sum() == 0
    assert found.looked.sum() > 0
