"""Exposure to sunlight against pvlib on open sites and against closed forms behind obstructions."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from pvlib import solarposition

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply.openings import openings_of
from scenes.comply.outdoors import outdoors_of
from scenes.comply.sunlight import reference_point, sun_day, sun_exposure, true_intervals, united
from scenes.demo import WEATHER
from tests.comply.obstructions import facing_wall, wall

MINUTE = 1 / 60
LEAST = 11.0


@pytest.fixture(scope="module")
def weather():
    return read_epw(WEATHER)


def seconds_of_sun(weather, day, condition):
    """Hours in which a condition of altitude and azimuth [deg] holds: pvlib, each second."""
    times = pd.date_range(pd.Timestamp(weather.midpoints[0].year, *day), periods=86400, freq="s")
    utc = (times - pd.Timedelta(hours=weather.timezone_h)).tz_localize("UTC")
    sun = solarposition.get_solarposition(
        utc,
        weather.latitude_deg,
        weather.longitude_deg,
        weather.elevation_m,
        pressure=float(np.mean(weather.pressure_pa)),
        temperature=float(np.mean(weather.dry_bulb_c)),
    )
    altitude, azimuth = sun["apparent_elevation"].to_numpy(), sun["azimuth"].to_numpy()
    return np.count_nonzero((altitude >= LEAST) & condition(altitude, azimuth)) / 3600


def hours(building, weather, day=(3, 21)):
    space = building.spaces[0]
    return sun_exposure(space, outdoors_of(building), sun_day(weather, *day, LEAST))


@pytest.mark.parametrize("day", [(2, 1), (3, 21)])
@pytest.mark.parametrize("facing", [180.0, 100.0, 300.0])
def test_open_site_against_pvlib(weather, day, facing):
    """Flush glass: the sun counts while it stands before the facade, to one minute."""
    found = hours(shoebox(facing_deg=facing), weather, day).hours

    def before(_, azimuth):
        return np.cos(np.radians(azimuth - facing)) > 0

    assert found == pytest.approx(seconds_of_sun(weather, day, before), abs=MINUTE)


def test_reveals_hide_the_sun_at_the_sides(weather):
    """From the middle of 1.2 m of glass behind a wall of 0.4 m one sees 56.3 degrees aside."""
    window = WindowRectangle(1.4, 0.0, 1.2, 3.0)
    found = hours(shoebox(windows=[window], recess=0.4), weather).hours
    widest = np.degrees(np.arctan2(0.6, 0.4))

    def inside(altitude, azimuth):
        # the head, 1.8 m above the point of reference, hides nothing below 77 degrees
        return np.abs(azimuth - 180) < widest

    assert found == pytest.approx(seconds_of_sun(weather, (3, 21), inside), abs=MINUTE)


def test_a_long_wall_opposite_hides_what_is_below_its_edge(weather):
    """Top edge 7 m above the reference point at 15 m: tan(altitude) < 7/15 cos(azimuth)."""
    found = hours(shoebox(elements=[facing_wall(15.0, 8.2)]), weather, (2, 1)).hours

    def above(altitude, azimuth):
        aside = np.cos(np.radians(azimuth - 180))
        return (aside > 0) & (np.tan(np.radians(altitude)) > 7 / 15 * aside)

    wanted = seconds_of_sun(weather, (2, 1), above)
    assert 1 < wanted < 8
    assert found == pytest.approx(wanted, abs=MINUTE)


def test_an_overhang_hides_what_is_above_its_edge(weather):
    """A slab 1.5 m deep, 1 m above the reference point, over the whole facade."""
    slab = wall((-90, 0, 2.2), (90, 0, 2.2), (90, -1.5, 2.2), (-90, -1.5, 2.2), kind="IfcSlab")
    found = hours(shoebox(elements=[slab]), weather).hours

    def below(altitude, azimuth):
        aside = np.cos(np.radians(azimuth - 180))
        return (aside > 0) & (np.tan(np.radians(altitude)) < 1 / 1.5 * aside)

    assert found == pytest.approx(seconds_of_sun(weather, (3, 21), below), abs=MINUTE)


def test_openings_count_together_but_once(weather):
    """East and west windows add; two in one facade have the same sun."""
    sides = [WindowRectangle(1, 1, 1, 1, side=side) for side in ("left", "right")]
    both = hours(shoebox(windows=sides), weather)
    assert both.hours == pytest.approx(sum(one.hours for one in both.openings), abs=1e-9)
    pair = [WindowRectangle(x, 1, 1, 1) for x in (0.5, 2.5)]
    twin = hours(shoebox(windows=pair), weather)
    assert twin.hours == pytest.approx(twin.openings[0].hours, abs=1e-9)


def test_the_reference_point_is_on_the_inner_wall(weather):
    """1.2 m above the floor or 0.3 m above the sill; the middle of a rooflight."""

    def point(sill, **more):
        building = shoebox(windows=[WindowRectangle(0.5, sill, 2.0, 1.0, **more)], recess=0.3)
        (opening,) = openings_of(building.spaces[0])
        assert opening.recess == pytest.approx(0.3)
        return reference_point(opening, building.spaces[0].floor_level)

    assert point(0.5) == pytest.approx([1.5, 0.0, 1.2], abs=1e-9)
    assert point(1.1) == pytest.approx([1.5, 0.0, 1.4], abs=1e-9)
    assert point(2.0, side="ceiling") == pytest.approx([1.5, 2.5, 3.0], abs=1e-9)


def test_intervals_to_the_second():
    """Edges inside a minute are found; an interval that touches the ends is whole."""
    found = true_intervals(lambda t: (t > 10.3) & (t < 99.9) | (t >= 1400.2), 0.0, 1440.0)
    assert found == [pytest.approx((10.3, 99.9), abs=0.01), pytest.approx((1400.2, 1440), abs=0.01)]


def test_union_of_intervals():
    assert united([[(1.0, 3.0), (5.0, 6.0)], [(2.0, 4.0)], []]) == [(1.0, 4.0), (5.0, 6.0)]
