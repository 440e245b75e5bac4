"""Parts and sums of a year of skies, by numbers that are added by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.sky.annual import AnnualSky, hour_numbers


@pytest.fixture
def sky() -> AnnualSky:
    """Two patches, three lit hours of a year of five; the sun in the first patch."""
    whole = np.array([[5.0, 7.0, 9.0], [1.0, 2.0, 4.0]])
    sun = np.array([[4.0, 8.0, 3.0], [0.0, 0.0, 0.0]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    return AnnualSky(whole, up, np.arange(3.0), np.array([1, 2, 4]), 5, sun)


def test_sums_of_whole_sun_and_rest(sky):
    assert [list(one) for one in sky.totals(np.array([True, False, True]))] == [
        [14, 5],
        [7, 0],
        [7, 5],  # never below zero: of the second hour the rest is 0
    ]
    every = sky.totals(np.ones(3, bool))
    assert [list(one) for one in every] == [[21, 7], [15, 0], [7, 7]]
    assert sky.totals(np.ones(3, bool)) is sky.totals(np.ones(3, bool))  # made once
    assert list(sky.totals(np.array([True, False, False]))[0]) == [5, 1]  # not those of all hours


def test_parts_without_the_sun_and_the_whole_year(sky):
    assert sky.without_sun([1, 2]).tolist() == [[0, 6], [2, 4]]
    part = sky.part([2, 0])
    assert part.lit.tolist() == [4, 1] and part.sun.tolist() == [[3, 4], [0, 0]]
    assert sky.whole_year(np.array([[1.0, 2.0, 3.0]])).tolist() == [[0, 1, 2, 0, 3]]
    with pytest.raises(ValueError, match="made without the sun alone"):
        replace(sky, sun=None).without_sun()


def test_numbers_of_hours():
    assert hour_numbers([0, 4], 5).tolist() == [0, 4]
    assert hour_numbers([], 0).tolist() == []
    for wrong in ([5], [-1], [[0]]):
        with pytest.raises(ValueError, match="hours: expected numbers from 0 to 4"):
            hour_numbers(wrong, 5)
