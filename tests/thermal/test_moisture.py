"""Moisture of the air: printed saturation pressures, closed forms, limits held."""

from __future__ import annotations

import math

import numpy as np
import pytest

from thermal.moisture import (
    EVAPORATION,
    VAPOUR_HEAT,
    MoistZone,
    humidity_ratio,
    relative_humidity,
    saturation_pressure,
    zone_humidity,
)

HOURS = 48
FLOW, VOLUME, SOURCE = 0.02, 60.0, 1e-4
P, OUT_C, OUT_W = np.full(HOURS, 101325.0), np.full(HOURS, 5.0), np.full(HOURS, 0.004)
DENSITY = 101325.0 / (287.055 * 278.15)


def zone(**changes) -> MoistZone:
    given = {
        "volume": VOLUME,
        "air_c": np.full(HOURS, 21.0),
        "outdoor_air": np.full(HOURS, FLOW),
        "vapour": np.full(HOURS, SOURCE),
    }
    return MoistZone(**given | changes)


def test_saturation_pressure_as_printed():
    """ASHRAE Handbook of Fundamentals, Psychrometrics, table 3 [Pa]."""
    found = saturation_pressure([-20.0, -10.0, 0.0, 20.0, 30.0])
    np.testing.assert_allclose(found, [103.24, 259.9, 611.2, 2338.8, 4246.0], rtol=5e-4)
    w = humidity_ratio(0.5, 25.0, 101325.0)
    assert w == pytest.approx(0.00988, abs=2e-5)
    assert relative_humidity(w, 25.0, 101325.0) == pytest.approx(0.5)


def test_ventilated_room_goes_exponentially_to_its_steady_state():
    (found,) = zone_humidity([zone()], OUT_W, OUT_C, P)
    steady = 0.004 + SOURCE / (DENSITY * FLOW)
    k = FLOW * 3600.0 / VOLUME
    h = np.arange(HOURS)
    expected = steady + (0.004 - steady) * np.exp(-k * h) * -np.expm1(-k) / k
    np.testing.assert_allclose(found.ratio, expected, rtol=1e-12)
    assert (found.humidify == 0).all() and (found.dehumidify == 0).all()


def test_a_nearly_closed_room_follows_the_same_exponential():
    """Air change k below 1e-4 an hour, where the closed form loses its digits: its series by k."""
    k = 9e-5
    flow = np.full(HOURS, k * VOLUME / 3600.0)
    (found,) = zone_humidity([zone(outdoor_air=flow)], OUT_W, OUT_C, P)
    steady = 0.004 + SOURCE / (DENSITY * flow[0])
    gone = sum((-1) ** n * k**n / math.factorial(n + 1) for n in range(1, 6))
    assert found.ratio[0] - 0.004 == pytest.approx((0.004 - steady) * gone, rel=1e-8)


def test_limits_are_held_and_their_latent_loads_are_the_difference():
    (dry,) = zone_humidity([zone(dehumidify_to=0.35)], OUT_W, OUT_C, P)
    high = humidity_ratio(0.35, 21.0, 101325.0)
    assert dry.ratio[-1] == pytest.approx(high, rel=1e-9)
    taken = DENSITY * FLOW * 0.004 + SOURCE - DENSITY * FLOW * high
    heat = EVAPORATION + VAPOUR_HEAT * 21.0
    assert taken > 0
    assert dry.dehumidify[-1] == pytest.approx(taken * heat, rel=1e-9)
    (moist,) = zone_humidity([zone(humidify_to=0.5, vapour=np.zeros(HOURS))], OUT_W, OUT_C, P)
    low = humidity_ratio(0.5, 21.0, 101325.0)
    assert moist.relative[-1] == pytest.approx(0.5, rel=1e-9)
    assert moist.humidify[-1] == pytest.approx(DENSITY * FLOW * (low - 0.004) * heat, rel=1e-9)


def test_closed_room_gathers_its_vapour_and_condenses_at_saturation():
    (found,) = zone_humidity([zone(outdoor_air=np.zeros(HOURS))], OUT_W, OUT_C, P)
    rise = SOURCE * 3600.0 / (DENSITY * VOLUME)
    np.testing.assert_allclose(np.diff(found.ratio[:2]), rise, rtol=1e-6)
    assert found.relative.max() <= 1.0 + 1e-8
    assert found.relative[-1] == pytest.approx(1.0)
    assert (found.dehumidify == 0).all()  # of itself, on cold walls: no plant's cold


def test_air_from_the_next_room_brings_its_vapour():
    """b takes only a's air: in the end it has a's ratio and its own source's more."""
    between = np.zeros((2, 2))
    between[1, 0] = FLOW
    rooms = [zone(), zone(outdoor_air=np.zeros(HOURS))]
    a, b = zone_humidity(rooms, OUT_W, OUT_C, P, between)
    assert b.ratio[-1] == pytest.approx(a.ratio[-1] + SOURCE / (DENSITY * FLOW), rel=1e-6)
    turned = zone_humidity(rooms, OUT_W, OUT_C, P, between.T)
    assert turned[1].relative[-1] == pytest.approx(1.0)  # nothing flows into b then


def test_air_from_a_room_held_dry_brings_its_held_ratio():
    """a is held at a limit, so that b's steady ratio is that limit and its own source's more."""
    between = np.zeros((2, 2))
    between[1, 0] = FLOW
    rooms = [zone(dehumidify_to=0.35), zone(outdoor_air=np.zeros(HOURS))]
    a, b = zone_humidity(rooms, OUT_W, OUT_C, P, between)
    high = humidity_ratio(0.35, 21.0, 101325.0)
    assert a.ratio[-1] == pytest.approx(high, rel=1e-9)
    assert b.ratio[-1] == pytest.approx(high + SOURCE / (DENSITY * FLOW), rel=1e-6)


def closed_room(air_c: list[float], outdoor: list[float], **held: float):
    hours = len(air_c)
    zone = MoistZone(50.0, np.array(air_c), np.zeros(hours), np.zeros(hours), **held)
    (humidity,) = zone_humidity([zone], np.array(outdoor), np.full(hours, 5.0), np.full(hours, 101_325.0))
    return humidity


def test_a_closed_room_begins_with_the_first_hours_outdoor_air_within_its_limits():
    """Later hours have other air outdoors and other limits; nothing is added or taken at the start."""
    assert closed_room([20.0] * 3, [0.004, 0.009, 0.009]).ratio == pytest.approx([0.004] * 3)
    saturated = humidity_ratio(1.0, 0.0, 101_325.0)
    assert closed_room([0.0, 20.0, 20.0], [0.009] * 3).ratio == pytest.approx([saturated] * 3)
    half = humidity_ratio(0.5, 20.0, 101_325.0)
    humid = closed_room([20.0, 10.0, 10.0], [0.001] * 3, humidify_to=0.5)
    assert humid.ratio == pytest.approx([half] * 3) and humid.humidify.max() < 1e-3
    dry = humidity_ratio(0.2, 10.0, 101_325.0)
    held = closed_room([10.0, 20.0, 20.0], [0.009] * 3, dehumidify_to=0.2)
    assert held.ratio == pytest.approx([dry] * 3) and held.dehumidify.max() < 1e-3
