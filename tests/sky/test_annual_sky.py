"""Parts and sums of a year of skies, by numbers that are added by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.sparse import csr_array

from mitsuba_cfs.sky.annual import AnnualSky, annual_sky, given_sky, hour_numbers
from mitsuba_cfs.sky.weather import Weather


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


def test_the_sun_alone_for_the_methods_is_made_once(sky):
    alone = sky.lit_sun
    assert (alone.toarray() if hasattr(alone, "toarray") else alone).tolist() == sky.sun.tolist()
    assert sky.lit_sun is alone is sky.lit_sun_in(np.arange(3))
    for lit in (sky.sun, csr_array(sky.sun.T)):
        some = replace(sky)
        some._lit_sun.append(lit)
        part = some.lit_sun_in(np.array([2, 0]))
        dense = part.toarray().T if isinstance(part, csr_array) else part
        assert type(part) is type(lit) and dense.tolist() == sky.sun[:, [2, 0]].tolist()
    assert sky.sun_alone().tolist() == sky.sun.tolist()
    assert sky.sun_alone([2]).tolist() == [[3], [0]]
    bare = replace(sky, sun=None)
    for made in (lambda: bare.lit_sun, bare.sun_alone):
        with pytest.raises(ValueError, match="made without the sun alone"):
            made()
    assert [list(one) for one in bare.totals(np.ones(3, bool))] == [[21, 7], [0, 0], [0, 0]]


@pytest.mark.parametrize("dark", [False, True])
def test_the_sun_in_some_hours_is_that_of_the_whole_sky(sky, dark):
    wide = sky if not dark else replace(sky, whole=np.zeros((100, 3)), sun=np.eye(100)[:, [5, 7, 50]])
    chosen = np.array([2, 0])
    some = wide.lit_sun_in(chosen)
    assert isinstance(some, np.ndarray) != dark
    found = some.toarray().T if dark else some
    assert found.tolist() == wide.sun_alone(chosen).tolist()


def test_parts_by_number_or_mask_are_of_the_hours_alone(sky):
    solar = replace(sky, solar=sky.whole / 100)
    part = solar.part(np.array([False, True, True]))
    assert part.whole.tolist() == [[7, 9], [2, 4]] and part.illuminance.tolist() == [1, 2]
    assert part.solar.tolist() == [[0.07, 0.09], [0.02, 0.04]] and part.hours == 5
    assert len(solar.part([]).lit) == 0 and solar.part([0, 2]).lit.tolist() == [1, 4]
    for wrong in ([3], [-1], [0, 3]):
        with pytest.raises(ValueError, match="hours: expected numbers from 0 to 2"):
            solar.part(wrong)


def test_skies_have_the_sun_alone_and_no_heat_unless_asked():
    """A sun at 60 degrees and one below the horizon, which is not lit."""
    suns = [[0.0, 0.5, np.sqrt(0.75)], [0.0, 0.8, -0.6]]
    given = given_sky(suns, [500.0, 0.0], [100.0, 0.0], 1, day_of_year=[100.0, 100.0])
    assert given.sun is not None and given.solar is None
    assert given.lit.tolist() == [0] and given.hours == 2
    times = pd.date_range("2023-04-10 12:00", periods=2, freq="12h")
    year = Weather("site", 40.0, 0.0, 0.0, 0.0, 1.0, times, np.array([500.0, 0.0]), np.array([100.0, 0.0]))
    sky = annual_sky(year, 1)
    assert sky.sun is not None and sky.solar is None and sky.lit.tolist() == [0]
    bare = annual_sky(year, 1, sun=False, solar=True)
    assert bare.sun is None and bare.solar.shape == bare.whole.shape


def test_numbers_of_hours():
    assert hour_numbers([0, 4], 5).tolist() == [0, 4]
    assert hour_numbers([], 0).tolist() == []
    with pytest.raises(ValueError, match="hours: expected numbers from 0 to 0"):
        hour_numbers([1], 1)
    for wrong in ([5], [-1], [[0]]):
        with pytest.raises(ValueError, match="hours: expected numbers from 0 to 4"):
            hour_numbers(wrong, 5)


def test_a_result_of_the_weather_is_made_once_for_its_arguments(sky):
    calls = []

    def doubled(weather, number):
        calls.append(number)
        return 2 * number

    assert [sky.once(doubled, "weather", number) for number in (3, 3, 4)] == [6, 6, 8]
    assert calls == [3, 4]


def test_a_sky_is_of_subdivision_4_and_to_true_north_unless_asked():
    suns = [[0.0, 0.5, np.sqrt(0.75)]]
    given = given_sky(suns, [500.0], [100.0], day_of_year=[100.0])
    assert given.whole.shape == (2306, 1)
    times = pd.date_range("2023-04-10 12:00", periods=1, freq="1h")
    year = Weather("site", 40.0, 0.0, 0.0, 0.0, 1.0, times, np.array([500.0]), np.array([100.0]))
    sky = annual_sky(year)
    assert sky.whole.shape == (2306, 1)
    np.testing.assert_array_equal(sky.whole, annual_sky(year, 4, rotation_deg=0.0).whole)
    turned = annual_sky(year, 4, rotation_deg=0.01).whole
    assert np.abs(sky.whole - turned).max() > 0


@pytest.mark.parametrize("patches", [2, 40])
def test_the_sun_in_some_hours_as_products_take_it(sky, patches):
    """Of few patches as it is, of many, which are dark but one, sparse [h, P]."""
    sun = np.concatenate([sky.sun, np.zeros((patches - 2, 3))])
    sky = replace(sky, sun=sun, whole=np.ones((patches, 3)))
    for hours in ([0, 1, 2], [2, 0], []):
        part = sky.lit_sun_in(np.array(hours, dtype=np.int64))
        dense = part if isinstance(part, np.ndarray) else part.toarray().T
        assert np.array_equal(dense, sun[:, hours])
    assert isinstance(sky.lit_sun_in(np.array([1])), np.ndarray) == (patches == 2)
