"""Shading and airing that follow the temperature of the room itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import box, climate, sun
from thermal.balance import BalanceOptions, simulate, simulate_zones
from thermal.blackbox import Fenestration
from thermal.control import RoomCondition, TemperatureControl, WaitingRule, by_threshold, delayed, held, switched
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError
from thermal.ventilation import SupplyAir, WindowAiring
from thermal.zone import Gains

HOURS = 24 * 6
OUTDOOR = 17.0 - 6.0 * np.cos((np.arange(HOURS) - 3.0) / 24 * 2 * np.pi)
WARM, WARMER = RoomCondition(26.0, 24.5), RoomCondition(26.3, 26.3, "operative")
SHUT = Fenestration("shut", 0.8, emissivity_in=0.3)


def shaded_room():
    """A room with two states of its window, and the sun in each."""
    room = box(window=Fenestration("open", 1.2), infiltration_ach=1.0)
    room = replace(room, windows=(replace(room.windows[0], states=(*room.windows[0].states, SHUT)),))
    day = replace(sun(HOURS, room), state=np.zeros((HOURS, 1), np.int64))
    shade = replace(sun(HOURS, room, strength=0.2), state=np.ones((HOURS, 1), np.int64))
    return room, day, shade


def test_shading_follows_the_load_of_the_step_before():
    room, day, shade = shaded_room()
    room = replace(room, loads=IdealLoads(cooling_c=24.0))
    year = {"step_s": 3600.0, "options": BalanceOptions(warm_days=0, start_c=23.0)}
    for quantity, limit in (("cooling", 50.0), ("heating", 0.0)):
        condition = RoomCondition(limit, limit, quantity)
        control = TemperatureControl((condition,), (day, shade), (Gains(), Gains()))
        outdoor = climate(HOURS, outdoor=OUTDOOR)
        result = simulate(room, outdoor, day, control=control, **year)
        power = result.cooling if quantity == "cooling" else result.heating
        assert np.array_equal(result.alternative[1:] > 0, power[:-1] > limit)
        assert (result.alternative > 0).any() == (quantity == "cooling")


SLOW = replace(WARM, open_delay_rows=2, hold_rows=7)


@pytest.mark.parametrize("condition", [WARM, replace(WARM, quantity="operative"), SLOW])
def test_shading_follows_the_temperature_at_the_end_of_the_step_before(condition):
    """With one step an hour the hourly means are the ends of the steps.

    The balance with the states that it chose, given to it as an array, is the same balance.
    """
    room, day, shade = shaded_room()
    lamps = Gains(radiant=100.0)
    control = TemperatureControl((condition,), (day, shade), (Gains(), lamps))
    year = {"step_s": 3600.0, "options": BalanceOptions(warm_days=0, start_c=23.0)}
    result = simulate(room, climate(HOURS, outdoor=OUTDOOR), day, control=control, **year)
    temperature = result.operative_c if condition.quantity == "operative" else result.air_c
    at_once = by_threshold(temperature[:-1], condition.above, condition.below)
    expected = held(delayed(at_once, condition.open_delay_rows), condition.hold_rows)
    assert 10 < expected.sum() < 110 and (condition is not SLOW or (expected != at_once).any())
    np.testing.assert_array_equal(result.alternative[1:], expected)
    chosen = switched([day, shade], result.alternative)
    lit = replace(room, gains=Gains(radiant=100.0 * result.alternative))
    given = simulate(lit, climate(HOURS, outdoor=OUTDOOR), chosen, **year)
    np.testing.assert_allclose(given.air_c, result.air_c, atol=1e-9)
    assert np.abs(result.residual).max() < 1e-6


def test_a_rule_of_two_conditions_waits_before_it_opens_and_between_moves():
    """Three states, by two conditions; the waits are those of `delayed` and `held`."""
    room, day, shade = shaded_room()
    half = replace(sun(HOURS, room, strength=0.6), state=np.ones((HOURS, 1), np.int64))
    none, late = np.zeros(HOURS, np.int64), np.arange(HOURS) % 24 % 9 > 1
    asked = np.stack([none, np.where(late, 1, 0), np.full(HOURS, 1), np.where(late, 2, 1)])
    rule = WaitingRule("both", (WARM, WARMER), (0, 1, 2), asked, open_delay_rows=2, hold_rows=4)
    conditions, gains = (WARM, WARMER, rule), (Gains(),) * 3
    control = TemperatureControl(conditions, (day, half, shade), gains, read=(rule,))
    year = {"step_s": 3600.0, "options": BalanceOptions(warm_days=0, start_c=23.0)}
    result = simulate(room, climate(HOURS, outdoor=OUTDOOR), day, control=control, **year)
    warm = by_threshold(result.air_c[:-1], WARM.above, WARM.below)
    warmer = by_threshold(result.operative_c[:-1], WARMER.above, WARMER.below)
    at_once = asked[warm + 2 * warmer, np.arange(1, HOURS)]
    expected = held(delayed(at_once, 2), 4)
    assert set(expected) == {0, 1, 2}  # each shows, and so do both waits
    assert (delayed(at_once, 2) != at_once).any() and (expected != delayed(at_once, 2)).any()
    np.testing.assert_array_equal(result.alternative[1:], expected)
    assert np.abs(result.residual).max() < 1e-6
    with pytest.raises(ThermalInputError, match="comes after"):
        replace(control, conditions=(rule, WARM, WARMER))


def test_conditions_are_met_each_by_itself_and_each_zone_has_its_temperature():
    room, day, shade = shaded_room()
    other = replace(room, name="cold", loads=IdealLoads(cooling_c=23.0))
    dark = [replace(shade, inside=shade.inside * share) for share in (1.0, 0.5, 0.2, 0.1)]
    control = TemperatureControl((WARM, WARMER), tuple(dark), (Gains(),) * 4)
    sunny = replace(dark[0], inside=day.inside)
    control = replace(control, suns=(sunny, *dark[1:]))
    warm, cold, free = simulate_zones(
        [room, other, replace(room, name="free")],
        climate(HOURS, outdoor=OUTDOOR),
        [day, day, day],
        controls=[control, control, None],
        step_s=3600.0,
    )
    assert set(np.unique(warm.alternative)) >= {0, 1, 3}
    assert not cold.alternative.any() and not free.alternative.any()
    met = by_threshold(warm.air_c[:-1], 26.0, 24.5) + 2 * by_threshold(warm.operative_c[:-1], 26.3)
    np.testing.assert_array_equal(warm.alternative[25:], met[24:])


def test_state_by_temperature_does_not_depend_on_the_stretch_or_the_step():
    room, day, shade = shaded_room()
    control = TemperatureControl((WARM,), (day, shade), (Gains(), Gains()))
    weather = climate(HOURS, outdoor=OUTDOOR)
    coarse, fine = (simulate(room, weather, day, step_s=s, control=control) for s in (1200, 600))
    assert (coarse.alternative != fine.alternative).mean() < 0.02
    assert coarse.air_c.mean() == pytest.approx(fine.air_c.mean(), abs=0.05)


def test_control_without_an_alternative_for_each_case_is_refused():
    _, day, shade = shaded_room()
    with pytest.raises(ThermalInputError, match="alternative"):
        TemperatureControl((WARM, WARMER), (day, shade), (Gains(), Gains()))
    with pytest.raises(ThermalInputError, match="opens at a greater"):
        RoomCondition(20.0, 22.0)


WINDOWS = WindowAiring(0.02, 0.002, open_above_c=24.0, close_below_c=22.0)


def aired(**changes):
    """A week of a room with gains by day, a fan and opened windows."""
    by_day = np.tile(np.repeat([0.0, 1500.0, 0.0], [8, 10, 6]), HOURS // 24)
    room = box(
        gains=Gains(by_day),
        supply=SupplyAir(2.0, recovery=0.8),
        loads=IdealLoads(20.0, 26.0),
        airing=WINDOWS,
        infiltration_ach=0.0,
    )
    room = replace(room, **changes)
    weather = climate(HOURS, outdoor=OUTDOOR + changes.pop("warmer", 0.0))
    result = simulate(room, weather, sun(HOURS, room), step_s=3600.0)
    assert np.abs(result.residual).max() < 1e-6
    return result


def test_hybrid_windows_replace_the_fan_and_are_shut_while_the_room_is_cooled():
    both = aired()
    assert ((both.cooling > 1.0) & (both.outdoor_air - both.fan_air > 1e-6)).any()  # it can show
    hybrid = aired(airing=replace(WINDOWS, hybrid=True))
    opened = hybrid.outdoor_air - hybrid.fan_air > 1e-9
    assert 10 < opened.sum() < HOURS - 10
    assert not (opened & (hybrid.cooling > 1e-6)).any()
    assert (hybrid.fan_air[opened] == 0.0).all()
    np.testing.assert_allclose(hybrid.fan_air[~opened], 2.0 * 60.0 / 3600.0)
    assert (hybrid.cooling[~opened] > 100.0).any() and hybrid.air_c.max() < 26.0 + 1e-6


def test_windows_by_operative_temperature():
    """Where they are open in part the operative temperature is the limit, within the tolerance of
    the iterates."""
    by_air, by_operative = (
        aired(airing=replace(WINDOWS, operative=operative), loads=IdealLoads(20.0)) for operative in (False, True)
    )
    held = [
        np.isclose(values, 22.0, atol=tolerance).sum()
        for values, tolerance in ((by_air.air_c, 1e-6), (by_air.operative_c, 0.02), (by_operative.operative_c, 0.02))
    ]
    assert held[0] > 5 and held[2] > 5 and held[1] < 5
    opened = by_operative.outdoor_air - by_operative.fan_air > 1e-9
    assert by_operative.operative_c[opened].min() > 22.0 - 0.02
    assert by_operative.air_c[opened].min() < 22.0 - 0.2
