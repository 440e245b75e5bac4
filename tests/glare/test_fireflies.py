"""What the evidence on fireflies counts, and a picture of its box against paths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mitsuba_cfs as cfs
from scenes.demo import WEATHER
from scenes.evidence.validation import fireflies


def test_a_pixel_is_held_against_the_brightest_around_it() -> None:
    finer = np.zeros((12, 12))
    finer[5, 7] = 3.0
    found = fireflies.brightest(finer)
    assert found.shape == (6, 6)
    assert np.argwhere(found == 3.0).min(axis=0).tolist() == [1, 2]
    assert np.argwhere(found == 3.0).max(axis=0).tolist() == [3, 4]


@pytest.mark.slow
@pytest.mark.usefixtures("variant")
def test_nothing_bright_shines_out_of_the_box_under_an_overhang() -> None:
    """Three random hours; what is beyond the limit is dim."""
    lit = fireflies.overhang(cfs.read_epw(Path(WEATHER)), 160)
    found = fireflies.held(lit, 3, samples=16)
    assert found.bright.sum() == 0
    # 848 of 1,767,200 pixels in the evidence; without the roulette by what is left, 96 of 60,324
    assert found.beyond.sum() < 1e-3 * found.pixels
