"""Shading control: each rule's closed form, and a room whose state switches."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.thermal.rooms import box, climate, sun
from thermal.balance import simulate
from thermal.blackbox import Fenestration
from thermal.climate import Solar
from thermal.control import (
    always,
    by_cut_off,
    by_glare,
    by_schedule,
    by_threshold,
    cut_off_angle,
    delayed,
    held,
    latched,
    profile_angle,
    sun_depth,
    switched,
    with_few_moves,
)
from thermal.errors import ThermalInputError
from thermal.zone import WindowElement, Zone


def test_irradiance_control_has_hysteresis():
    light = np.array([0, 150, 250, 180, 120, 90, 180, 250], dtype=float)
    assert by_threshold(light, 200.0).tolist() == [0, 0, 1, 0, 0, 0, 0, 1]
    assert by_threshold(light, 200.0, 100.0).tolist() == [0, 0, 1, 1, 1, 0, 0, 1]


def test_schedule_and_always():
    assert by_schedule(np.arange(24) // 12, 30).tolist() == [0] * 12 + [1] * 12 + [0] * 6
    assert np.all(always(2, 5) == 2)


def rated(values: NDArray, limit: float, calls: list[int]):
    """The excess of DGP [M, H] over a limit, as `by_glare` asks for it; notes how many hours."""

    def excess(number: int, hours: NDArray) -> NDArray:
        calls.append(len(hours))
        return values[number, hours] - limit

    return excess


def test_glare_takes_the_most_open_state_that_is_good_enough():
    dgp = np.array([[0.30, 0.50, 0.60, 0.60], [0.25, 0.34, 0.40, 0.55], [0.2, 0.2, 0.34, 0.45]])
    calls: list[int] = []
    assert by_glare([0, 0.5, 1], rated(dgp, 0.35, calls), 4).tolist() == [0, 1, 2, 2]
    assert calls == [4, 3, 2], "only hours in which more open states have glare"


def test_glare_closes_the_window_that_causes_it():
    """Two windows of equal size, open or closed: of equally open ones the one with least glare."""
    # both open, the first closed, the second closed, both closed
    dgp = np.array([[0.2, 0.6, 0.6, 0.9], [0.1, 0.3, 0.5, 0.8], [0.1, 0.5, 0.2, 0.7], [0.1] * 4])
    assert by_glare([0, 0.5, 0.5, 1], rated(dgp, 0.35, []), 4).tolist() == [0, 1, 2, 3]
    # the large window stays open where closing the small one is enough
    dgp[1:3, 1] = 0.3, 0.1
    assert by_glare([0, 0.2, 0.8, 1], rated(dgp, 0.35, []), 4)[1] == 1


def test_a_delay_holds_back_openings_alone():
    asked = np.array([0, 2, 0, 0, 0, 1, 0, 1, 0, 0, 0])
    assert delayed(asked, 0).tolist() == asked.tolist()
    assert delayed(asked, 2).tolist() == [0, 2, 2, 2, 0, 1, 1, 1, 1, 1, 0]


def test_a_state_holds_for_its_least_time():
    asked = np.array([0, 1, 0, 1, 0, 0, 0, 1, 1])
    assert held(asked, 1).tolist() == asked.tolist()
    assert held(asked, 3).tolist() == [0, 1, 1, 1, 0, 0, 0, 1, 1]


def test_cut_off_of_the_reference_blind():
    # 80 mm slats 72 mm apart at 45 degrees: tan = (0.9 - 0.7071)/0.7071
    assert np.degrees(cut_off_angle(np.radians(45.0), 0.08, 0.072)) == pytest.approx(15.26, abs=0.01)
    # level slats as far apart as they are wide: 45 degrees
    assert np.degrees(cut_off_angle(0.0, 0.08, 0.08)) == pytest.approx(45.0)


def test_cut_off_opens_as_the_sun_rises_and_without_sun():
    elevation = np.radians([12.0, 25.0, 50.0, 50.0])
    local = np.stack([np.zeros(4), np.sin(elevation), np.cos(elevation)], axis=1)
    state = by_cut_off(local, [300, 300, 300, 0], np.radians([0.0, 45.0, 70.0]), 0.08, 0.08)
    # cut-off at 45, 22.5 and 10 degrees
    assert state.tolist() == [2, 1, 0, 0]
    np.testing.assert_allclose(profile_angle(local)[:3], elevation[:3])


def test_switched_room_equals_each_state_while_it_holds():
    hours = 96
    states = (Fenestration("open", 1.2), Fenestration("shut", 0.8))
    base = box(window=states[0])
    window = WindowElement("window", 4.5, base.windows[0].normal, states)
    zone = Zone("room", 60.0, base.surfaces, (window,))
    bright, dim = sun(hours, zone), sun(hours, zone, strength=0.2)
    weather = climate(hours, outdoor=8.0)
    shut_all = switched([bright, dim], always(1, hours))
    expected = simulate(
        Zone("room", 60.0, base.surfaces, (WindowElement("w", 4.5, window.normal, states[1:]),)), weather, dim
    )
    np.testing.assert_allclose(simulate(zone, weather, shut_all).air_c, expected.air_c, atol=1e-9)
    half = switched([bright, dim], np.repeat([0, 1], hours // 2))
    np.testing.assert_array_equal(half.inside[: hours // 2], bright.inside[: hours // 2])
    np.testing.assert_array_equal(half.inside[hours // 2 :], dim.inside[hours // 2 :])
    result = simulate(zone, weather, half)
    assert result.air_c[-1] < simulate(zone, weather, bright).air_c[-1]


def test_unknown_states_are_refused():
    zone = box(window=Fenestration("open", 1.2))
    light: Solar = sun(24, zone)
    with pytest.raises(ThermalInputError, match="shading state"):
        switched([light], np.ones(24, dtype=int))
    with pytest.raises(ThermalInputError, match="24 states"):
        by_schedule([0, 1], 24)


def test_closed_until_an_event_and_few_moves_a_day():
    states = np.array([0, 1, 0, 2, 1, 0, 0, 1])
    ends = np.arange(8) == 5
    assert latched(states, ends).tolist() == [0, 1, 1, 2, 2, 0, 0, 1]
    assert with_few_moves(states, 2, np.arange(8) // 4).tolist() == [0, 1, 0, 0, 1, 0, 0, 0]
    assert with_few_moves(states, 2, np.arange(2, 10) // 4).tolist() == [0, 1, 0, 2, 2, 2, 0, 1]
    assert np.array_equal(with_few_moves(states, 8, np.zeros(8, int)), states)


def test_depth_of_the_sun_behind_a_window():
    """A window to the south with its head 2 m above the plane: 2 m / tan(profile angle)."""
    corners = [(x, 0.0, z) for x in (0.0, 1.0) for z in (1.0, 2.5)]
    angle = np.radians([30.0, 60.0])
    south = np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=1)
    depth = sun_depth(south, [0.0, -1.0, 0.0], corners, 0.5)
    assert depth == pytest.approx(2.0 / np.tan(angle))
    turned = [0.4, -0.6, 0.5]
    assert sun_depth([turned], [0.0, -1.0, 0.0], corners, 0.5) == pytest.approx(2.0 * 0.6 / 0.5)
    assert sun_depth([[0.0, 0.6, 0.8], [0.0, -0.6, -0.8]], [0, -1, 0], corners, 0.5).max() == 0
    leant = [(0.0, 0.0, 1.0), (0.0, 1.0, 2.0)]  # a roof window: its head is a metre inside
    found = sun_depth([[0.0, -0.6, 0.8]], [0.0, -np.sqrt(0.5), np.sqrt(0.5)], leant, 0.0)
    assert found == pytest.approx(1.0 + 2.0 * 0.6 / 0.8)
    assert np.isinf(sun_depth([[0.0, -0.6, 0.8]], [0, 0, 1], leant, 0.0)[0])
