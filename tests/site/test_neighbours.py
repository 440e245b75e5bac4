"""Losses of daylight and sun against closed forms behind long walls, and against BRE's own figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.sensors import sensor_grid
from bim.shoebox import shoebox
from mitsuba_cfs.sky.epw import read_epw
from scenes.comply.openings import openings_of
from scenes.demo import WEATHER
from scenes.site.neighbours import (
    Site,
    apsh_met,
    reference_point,
    room_table,
    sees_sky,
    sunlight_hours,
    vertical_sky_component,
    vsc_met,
    window_table,
)
from scenes.site.sun_year import sun_year
from tests.comply.obstructions import facing_wall, wall

SOUTH = np.array([0.0, -1.0, 0.0])


@pytest.fixture(scope="module")
def sun():
    return sun_year(read_epw(WEATHER))


def site(*elements) -> Site:
    return Site.of(replace(shoebox(), elements=elements))


def behind_a_wall(angle: float) -> float:
    """VSC behind an endless wall parallel to the window whose top is at an angle [rad], of the overcast sky."""
    return (np.pi / 2 * (1 - np.sin(angle)) + 4 / 3 * np.cos(angle) ** 2) / 3 / (7 * np.pi / 9)


@pytest.mark.parametrize("angle_deg", [0.0, 10.0, 25.0, 45.0, 70.0])
def test_vsc_behind_an_endless_wall(angle_deg):
    height = 100 * np.tan(np.radians(angle_deg))
    one = site(facing_wall(100.0, height, half_width=1e5)).outdoors
    value = vertical_sky_component(np.zeros(3), SOUTH, one, np.zeros(1, dtype=bool))
    step = np.radians(1.5)  # the wall's top may cut a row of cells: half a row's share of the sky
    assert value == pytest.approx(behind_a_wall(np.radians(angle_deg)), abs=0.5 * step * 0.4)


def test_vsc_of_an_open_site_and_behind_25_degrees_is_bres():
    """BRE: just under 40 % of an open site; 27 % is a uniform obstruction of 25 degrees."""
    assert 100 * behind_a_wall(0.0) == pytest.approx(39.6, abs=0.05)
    assert 100 * behind_a_wall(np.radians(25.0)) == pytest.approx(27.0, abs=0.5)


@pytest.mark.parametrize("angle_deg", [15.0, 35.0])
def test_sunlight_hours_behind_an_endless_wall(sun, angle_deg):
    height = 100 * np.tan(np.radians(angle_deg))
    one = site(facing_wall(100.0, height, half_width=1e6)).outdoors
    year, winter = sunlight_hours(np.zeros(3), SOUTH, one, np.zeros(1, dtype=bool), sun)
    _, y, z = sun.directions.T
    lit = sun.shines & (y < 0) & (z / np.maximum(-y, 1e-12) > np.tan(np.radians(angle_deg)))
    assert year == pytest.approx(lit.sum() / sun.shines.sum(), abs=1e-4)
    assert winter == pytest.approx((lit & sun.winter).sum() / sun.shines.sum(), abs=1e-4)
    assert 0 < winter < year < 1


def test_the_no_sky_line_is_where_the_head_of_the_window_clears_the_wall():
    """A point x behind a window whose head is h above it sees sky while h / x > H / (x + D)."""
    room = shoebox()
    (space,) = room.spaces
    (opening,) = openings_of(space)
    distance, top = 10.0, 12.0
    level = space.floor_level + 0.85
    one = Site.of(replace(room, elements=(facing_wall(distance, top, half_width=1e5),)))
    points, _ = sensor_grid(space, 0.25, 0.85, 0.0)
    depth = (opening.centre - points) @ opening.normal
    h, high = opening.head - level, top - level
    limit = h * distance / (high - h)
    seen = sees_sky(points, space, one.outdoors)
    near = np.abs(depth - limit) < 0.05  # the uppermost point lies a little under the head
    assert depth.min() < limit < depth.max()
    assert np.array_equal(seen[~near], (depth < limit)[~near])


def test_the_reference_point_lies_in_the_outer_face_of_the_wall():
    """Jambs of 0.2 m outside the glass do not shade the window's own VSC; a wall opposite does."""
    (space,) = shoebox().spaces
    (opening,) = openings_of(space)
    half = 0.5 * opening.width + 0.01
    x, y = opening.centre[0], opening.centre[1]
    jambs = [
        wall((x + s * half, y, -1), (x + s * half, y - 0.2, -1), (x + s * half, y - 0.2, 4), (x + s * half, y, 4))
        for s in (-1, 1)
    ]
    one = site(*jambs).outdoors
    point = reference_point(opening, one, np.zeros(2, dtype=bool))
    assert y - point[1] == pytest.approx(0.22, abs=0.021)
    value = vertical_sky_component(point, opening.normal, one, np.zeros(2, dtype=bool))
    assert value == pytest.approx(behind_a_wall(0.0), abs=0.002)


def test_a_tower_takes_light_and_the_limits_say_so(sun):
    before = Site.of(shoebox())
    after = Site.of(replace(shoebox(), elements=(facing_wall(10.0, 15.0),)))
    (window,) = window_table(before, after, sun).to_dict("records")
    assert window["vsc_before_percent"] == pytest.approx(39.6, abs=0.3)
    assert window["vsc_after_percent"] < 27 and not window["vsc_met"] and not window["apsh_met"]
    (same,) = window_table(before, before, sun).to_dict("records")
    assert same["vsc_met"] and same["apsh_met"]
    (room,) = room_table(before, after, height=0.85).to_dict("records")
    assert room["sky_visible_before_percent"] == 100.0 and not room["no_sky_line_met"]


@pytest.mark.parametrize(
    ("before", "after", "met"), [(39, 27, True), (39, 26.9, False), (30, 24, True), (30, 23.9, False)]
)
def test_vsc_is_met_from_27_percent_or_0_8_of_its_value(before, after, met):
    assert vsc_met(before, after) is met


@pytest.mark.parametrize(
    ("year", "winter", "met"),
    [
        ((60, 25), (20, 5), True),
        ((60, 24), (20, 5), False),
        ((60, 25), (20, 4.9), False),
        ((30, 24), (4, 3.2), True),
        ((20, 16), (4, 1), True),
        ((20, 15.9), (4, 3.3), False),
    ],
)
def test_sunlight_is_met_by_hours_by_ratio_or_by_a_small_loss(year, winter, met):
    row = {"apsh_before_percent": year[0], "apsh_after_percent": year[1]}
    row |= {"apsh_winter_before_percent": winter[0], "apsh_winter_after_percent": winter[1]}
    assert apsh_met(row) is met
