"""The simple hourly method as three nodes, and plans of window states beside all sequences."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from tests.thermal.rooms import box, climate, sun
from thermal.balance import simulate
from thermal.blackbox import Fenestration
from thermal.climate import Climate
from thermal.emitters import IdealLoads
from thermal.predictive import Forecast, PredictedHours, noisy_forecast, predicted_year
from thermal.reduced import MASS_FILM, SURFACE_FILM, ReducedZone, reduced_zone, responses
from thermal.ventilation import Leakage
from thermal.zone import Dimming, Gains, Layer, OpaqueSurface, Zone, dimmed_share

DIMMING = Dimming(500.0, 0.2, 0.3, off=True, sensor_factor=0.9)
AIR, WINDOWS, OPAQUE, MASS, MASS_AREA, AREA = 20.0, 15.0, 10.0, 6e6, 50.0, 90.0


def steady(outdoor: float, behind: float, internal: float, sun: float, power: float) -> np.ndarray:
    """Air, surfaces and mass of the standard's network in a steady state, by its three balances."""
    to_mass, to_air = MASS_FILM * MASS_AREA, SURFACE_FILM * AREA
    em = 1 / (1 / OPAQUE - 1 / to_mass)
    rest = 0.5 * internal + sun
    matrix = [[AIR + to_air, -to_air, 0], [-to_air, to_air + WINDOWS + to_mass, -to_mass], [0, -to_mass, to_mass + em]]
    right = [
        AIR * outdoor + 0.5 * internal + power,
        WINDOWS * outdoor + (1 - MASS_AREA / AREA - WINDOWS / (MASS_FILM * AREA)) * rest,
        em * behind + MASS_AREA / AREA * rest,
    ]
    return np.linalg.solve(matrix, right)


def test_a_steady_state_is_that_of_three_nodes() -> None:
    out, mass_c, power = np.zeros(6), 10.0, 300.0
    responses(AIR, WINDOWS, OPAQUE, MASS, MASS_AREA, AREA, 3.0, 8.0, 250.0, 400.0, out)
    for _ in range(3000):
        mass_c = out[3] + out[4] * mass_c + out[5] * power
    air, _, mass = steady(3.0, 8.0, 250.0, 400.0, power)
    assert mass_c == pytest.approx(mass, abs=1e-9)
    assert out[0] + out[1] * mass_c + out[2] * power == pytest.approx(air, abs=1e-9)


def test_an_hour_stores_what_does_not_leave() -> None:
    """Of a sudden power, mass and losses account for all: mass moves by its heat over C_m."""
    out = np.zeros(6)
    responses(1e-6, 1e-6, 1e-6, MASS, MASS_AREA, AREA, 0.0, 0.0, 0.0, 0.0, out)
    assert out[5] * MASS / 3600.0 == pytest.approx(1.0, rel=1e-3)  # closed: all stays


def zone_of(hours: int, **changed) -> ReducedZone:
    values = {
        "windows": np.array([15.0, 12.0]),
        "opaque": OPAQUE,
        "mass": MASS,
        "mass_area": MASS_AREA,
        "area": AREA,
        "air": np.full(hours, AIR),
        "outdoor_c": np.linspace(-5, 12, hours),
        "behind_c": np.full(hours, 5.0),
        "heating_c": np.full(hours, 20.0),
        "cooling_c": np.full(hours, 24.0),
        "heating_limit": np.inf,
        "cooling_limit": np.inf,
    } | changed
    return ReducedZone(**values)


def acting(hours: int, seed: int = 3, **changed) -> PredictedHours:
    random = np.random.default_rng(seed)
    values = {
        "sun": random.uniform(0, 2500, (hours, 2)),
        "daylight": random.uniform(0, 800, (hours, 2, 1)),
        "lamps": np.full(hours, 400.0),
        "zones": ((1.0, DIMMING),),
        "internal": np.full(hours, 200.0),
        "penalty": np.zeros((hours, 2)),
    } | changed
    return PredictedHours(**values)


def cost_of(zone: ReducedZone, hours: PredictedHours, states, start_c: float) -> float:
    """Energy of a sequence of states [Wh], hour by hour."""
    mass_c, total, out = start_c, 0.0, np.zeros(6)
    for h, m in enumerate(states):
        shares = zip(hours.zones, hours.daylight[h, m], strict=True)
        lamps = hours.lamps[h] * sum(of * (dimmed_share(lx, one) if one else 1.0) for (of, one), lx in shares)
        responses(
            zone.air[h],
            zone.windows[m],
            zone.opaque,
            zone.mass,
            zone.mass_area,
            zone.area,
            zone.outdoor_c[h],
            zone.behind_c[h],
            hours.internal[h] + lamps,
            hours.sun[h, m],
            out,
        )
        free = out[0] + out[1] * mass_c
        power = max((20.0 - free) / out[2], 0) if free < 24 else (24.0 - free) / out[2]
        mass_c = out[3] + out[4] * mass_c + out[5] * power
        total += lamps + abs(power) + hours.penalty[h, m]
    return total


ZONES = ((0.5, DIMMING), (0.3, Dimming(300.0)), (0.2, None))  # the last without a photosensor


@pytest.mark.parametrize(("mass", "seed", "zones"), [(MASS, 3, 1), (5e5, 3, 1), (5e5, 4, 3), (5e5, 5, 3)])
def test_a_plan_is_the_cheapest_of_all_sequences(mass, seed, zones) -> None:
    zone, hours = zone_of(8, mass=mass), acting(8, seed)
    if zones > 1:
        day = np.random.default_rng(seed).uniform(0, 800, (8, 2, 3))
        hours = replace(hours, daylight=day, zones=ZONES)
    plan = predicted_year(zone, hours, ahead=8, start_c=21.0)
    every = {s: cost_of(zone, hours, s, 21.0) for s in product((0, 1), repeat=8)}
    chosen = cost_of(zone, hours, plan.states.tolist(), 21.0)
    assert plan.heating.sum() + plan.cooling.sum() + plan.lamps.sum() == pytest.approx(chosen)
    assert chosen <= 1.001 * min(every.values())  # the grid is a kelvin wide
    assert chosen < 0.98 * np.median(list(every.values()))


@pytest.mark.parametrize("move_wh", [60.0, 500.0])
def test_a_plan_with_moves_that_cost_is_the_cheapest_of_all_sequences(move_wh) -> None:
    """Two groups of two states: each that moves in an hour costs; before the first all are open."""
    random, hours = np.random.default_rng(5), 5
    zone = zone_of(hours, windows=np.array([15.0, 13.5, 13.5, 12.0]))
    many = {"sun": random.uniform(0, 2500, (hours, 4)), "daylight": random.uniform(0, 800, (hours, 4, 1))}
    acts = acting(hours, **many, penalty=np.zeros((hours, 4)), counts=(2, 2), move_wh=move_wh)
    plan = predicted_year(zone, acts, ahead=hours, start_c=21.0)
    assert (plan.states != predicted_year(zone, replace(acts, move_wh=0.0), ahead=hours).states).any()

    def whole(states) -> float:
        groups = np.array([[0, 0], *((s // 2, s % 2) for s in states)])
        return cost_of(zone, acts, states, 21.0) + move_wh * np.count_nonzero(np.diff(groups, axis=0))

    least = min(map(whole, product(range(4), repeat=hours)))
    assert whole(plan.states.tolist()) <= 1.001 * least
    again = predicted_year(zone, replace(acts, penalty=acts.penalty + 1.0), ahead=3, start_c=21.0)
    assert np.count_nonzero(np.diff(again.states)) <= hours


def test_errors_of_a_forecast_do_not_depend_on_how_many_are_drawn_together() -> None:
    errors = {"sun_error": 0.3, "temperature_error_k": 1.0, "seed": 4}
    few = noisy_forecast(700, 30, **errors)
    walks = np.random.default_rng(4).standard_normal((2, 700, 30)).cumsum(axis=2) / np.sqrt(24.0)
    walks -= walks[:, :, :1]
    assert few.sun == pytest.approx(np.maximum(1 + 0.3 * walks[0], 0), rel=1e-5, abs=1e-6)
    assert few.warmer_k == pytest.approx(walks[1], rel=1e-5, abs=1e-6)
    year = noisy_forecast(8760, 8760, **errors)
    assert year.sun.shape == (1, 8760), "one plan of the year has one forecast"
    zone, acts = zone_of(40, mass=5e5), acting(40)
    once = noisy_forecast(40, 40, sun_error=1.0, temperature_error_k=8.0, seed=4)
    plan = predicted_year(zone, acts, ahead=40, forecast=once)
    whole = Forecast(0, np.repeat(once.sun, 40, axis=0), np.repeat(once.warmer_k, 40, axis=0))
    same = predicted_year(zone, acts, ahead=40, forecast=whole)
    assert np.array_equal(plan.states, same.states) and plan.heating == pytest.approx(same.heating)


def test_a_receding_plan_comes_near_and_a_penalty_goes_before_energy() -> None:
    zone, hours = zone_of(96), acting(96)
    whole = predicted_year(zone, hours, ahead=96)
    day = predicted_year(zone, hours, ahead=24)

    def energy(year) -> float:
        return float((year.heating + year.cooling + year.lamps).sum())

    assert energy(whole) <= energy(day) * 1.002 < energy(whole) * 1.02
    assert (day.states == 0).any()
    glaring = acting(96, penalty=np.tile([1e6, 0.0], (96, 1)))
    assert (predicted_year(zone, glaring, ahead=24).states == 1).all()


def test_forecasts_know_the_present_hour_alone_exactly() -> None:
    forecast = noisy_forecast(4000, 25, sun_error=0.25, temperature_error_k=1.5, seed=1)
    assert np.all(forecast.sun[:, 0] == 1) and np.all(forecast.warmer_k[:, 0] == 0)
    assert forecast.warmer_k[:, 24].std() == pytest.approx(1.5, rel=0.05)
    assert forecast.warmer_k[:, 6].std() == pytest.approx(0.75, rel=0.05)
    assert forecast.sun.min() >= 0
    zone, hours = zone_of(72), acting(72)
    one = predicted_year(zone, hours, ahead=1, forecast=Forecast(shift=24))
    assert np.array_equal(one.states, predicted_year(zone, hours, ahead=1).states)
    day = predicted_year(zone, hours, ahead=24, forecast=Forecast(shift=24))
    assert not np.array_equal(day.states, predicted_year(zone, hours, ahead=24).states)


def test_the_reduced_model_of_a_zone() -> None:
    """Concrete outside, wool, plaster inside: mass up to the wool; a tenth of a metre of a slab."""
    plaster, wool = Layer(0.02, 0.5, 1200.0, 1000.0), Layer(0.1, 0.04, 50.0, 1000.0)
    concrete = Layer(0.2, 2.0, 2400.0, 1000.0)
    wall = OpaqueSurface("wall", 12.0, (concrete, wool, plaster), np.array([0.0, -1.0, 0.0]))
    floor = OpaqueSurface("floor", 20.0, (concrete,), np.array([0.0, 0.0, -1.0]), "adiabatic")
    hours = 24
    weather = Climate(
        np.zeros(hours), np.zeros(hours), np.zeros(hours), np.zeros(hours), np.zeros(hours), np.full(hours, 1e5)
    )
    zone = Zone("z", 60.0, (wall, floor), infiltration_ach=0.6, bridges=2.0)
    facade = np.zeros((hours, 2))
    facade[12, 0] = 500.0
    reduced = reduced_zone(zone, weather, facade, np.zeros((1, 0), dtype=np.int64))
    kappa = np.array([0.02 * 1200e3, 0.1 * 2400e3])
    assert reduced.mass == pytest.approx(12 * kappa[0] + 20 * kappa[1])
    assert reduced.mass_area == pytest.approx(reduced.mass**2 / (12 * kappa[0] ** 2 + 20 * kappa[1] ** 2))
    assert reduced.opaque == pytest.approx(12 / (0.13 + 0.04 + 0.04 + 2.5 + 0.1))
    assert reduced.air[0] == pytest.approx(60 * 0.6 / 3600 * 1200)
    assert reduced.windows.tolist() == [2.0]
    assert reduced.behind_c[12] == pytest.approx(0.6 * 0.04 * 500)


def test_the_reduced_model_has_leaks_by_wind_and_temperature() -> None:
    """At 3 m in the country, outdoors 10 degC, wind 5 m/s: (270/10)^.14 (3/270)^.14 of it there."""
    wall = OpaqueSurface("w", 12.0, (Layer(0.2, 2.0, 2400.0, 1000.0),), np.array([0.0, -1.0, 0.0]), height=3.0)
    cold, air = replace(climate(1, outdoor=np.full(1, 10.0)), wind_speed=np.full(1, 5.0)), 60 / 3600
    test = Leakage(stack=0.01, wind=0.02)
    for leakage, ach, expected in (
        (Leakage((0.6, 0.03, 0.1, 0.01)), 0.5, 0.5 * air * (0.6 + 0.3 + 0.1 * 4.22442 + 0.01 * 4.22442**2)),
        (test, 0.0, np.hypot(0.01 * 10**0.5, 0.02 * 4.22442)),
    ):
        zone = Zone("z", 60.0, (wall,), infiltration_ach=ach, leakage=leakage, loads=IdealLoads(20.0, 26.0))
        none = np.zeros((1, 1)), np.zeros((1, 0), dtype=np.int64)
        reduced = reduced_zone(zone, cold, *none, terrain="country")
        assert reduced.air[0] == pytest.approx(1200.0 * expected, rel=1e-4)


def test_the_reduced_model_has_the_loads_of_the_detailed_balance() -> None:
    """Nothing is fitted: a year of a concrete room, heating 9 % and cooling 1 % lower."""
    hours = np.arange(24 * 365)
    outdoor = 9 - 12 * np.cos(2 * np.pi * hours / len(hours))
    outdoor += 5 * np.sin(2 * np.pi * (hours % 24 - 9) / 24)
    weather, glass = climate(len(hours), outdoor=outdoor, sky=outdoor - 8), Fenestration("g", 1.1)
    used = ((hours % 24 >= 8) & (hours % 24 < 18)).astype(float)
    zone = box(window=glass, gains=Gains(150 * used, 150 * used), loads=IdealLoads(20.0, 26.0))
    solar = sun(len(hours), zone, strength=0.6 - 0.4 * np.cos(2 * np.pi * hours / len(hours)))
    detailed = simulate(zone, weather, solar, step_s=3600.0)
    outer, *_, inner = glass.inward_shares()
    absorbed = (solar.absorbed_outer * outer + solar.absorbed_inner * inner) @ [4.5]
    reduced = reduced_zone(zone, weather, solar.facade, np.zeros((1, 1), dtype=np.int64))
    acts = PredictedHours(
        (solar.inside.sum(axis=1) + absorbed)[:, None],
        np.zeros((len(hours), 1, 1)),
        np.zeros(len(hours)),
        ((1.0, None),),
        300 * used,
        np.zeros((len(hours), 1)),
    )
    year = predicted_year(reduced, acts, ahead=1)
    assert year.heating.sum() == pytest.approx(detailed.heating.sum(), rel=0.12)
    assert year.cooling.sum() == pytest.approx(detailed.cooling.sum(), rel=0.05)
    both = detailed.heating - detailed.cooling, year.heating - year.cooling
    assert np.corrcoef(*both)[0, 1] > 0.98


def test_a_zone_insulated_inside_has_a_model_without_mass() -> None:
    foam, brick = Layer(0.1, 0.03, 30.0, 1400.0), Layer(0.2, 0.8, 1800.0, 900.0)
    wall = OpaqueSurface("wall", 12.0, (brick, foam), np.array([0.0, -1.0, 0.0]))
    zone = Zone("z", 60.0, (wall,), infiltration_ach=0.6, loads=IdealLoads(20.0, 26.0))
    cold = climate(24, outdoor=np.zeros(24), sky=np.zeros(24))
    one = reduced_zone(zone, cold, np.zeros((24, 1)), np.zeros((1, 0), dtype=np.int64))
    none = np.zeros((24, 1))
    acts = PredictedHours(none, none[..., None], np.zeros(24), ((1.0, None),), np.zeros(24), none)
    assert one.mass == 0.0
    assert predicted_year(one, acts, ahead=2).heating.min() > 0
