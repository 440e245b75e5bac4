"""Outdoor air by wind, temperature, fans and windows; one-way air: closed forms of steady rooms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import PLASTER, box, climate, sun
from thermal.balance import BalanceOptions, simulate, simulate_zones
from thermal.blackbox import Fenestration
from thermal.climate import no_sun
from thermal.convection import local_wind_factor
from thermal.emitters import HeatedSlab, IdealLoads
from thermal.errors import ThermalInputError
from thermal.records import AIR_HEAT
from thermal.ventilation import (
    BLAST,
    DOE2,
    AirTransfer,
    Leakage,
    NeighbourAir,
    SupplyAir,
    WindowAiring,
    aim2,
    cross_flow,
    large_opening,
    sherman_grimsrud,
    single_sided,
    stack_height,
)
from thermal.zone import Gains, OpaqueSurface, Zone

OPTIONS = BalanceOptions(warm_tolerance=1e-9, warm_days=2000, tolerance=1e-9, iterations=20)
VOLUME, WIND, OUT = 50.0, 3.0, 2.0
HEAT = 101325.0 / (287.055 * (OUT + 273.15)) * AIR_HEAT  # of outdoor air [J/(m3 K)]


def sealed(name: str = "room", **changes) -> Zone:
    """A room whose walls pass no heat: in a steady state only its air and its plant count."""
    wall = OpaqueSurface("wall", 20.0, (PLASTER,), np.array([0.0, 1.0, 0.0]), "adiabatic")
    other = OpaqueSurface("other", 20.0, (PLASTER,), np.array([0.0, -1.0, 0.0]), "adiabatic")
    return Zone(name, VOLUME, (wall, other), **{"infiltration_ach": 0.0} | changes)


def load(zone: Zone, out: float = OUT) -> float:
    """Steady load of a room in constant weather [W], heating positive."""
    result = simulate(zone, climate(24, outdoor=out, wind=WIND), no_sun(24, 2, 0), options=OPTIONS)
    assert np.abs(result.residual).max() < 1e-6
    return float((result.heating - result.cooling)[-1])


KEPT = IdealLoads(20.0, 20.0)
V = WIND * local_wind_factor(1.5, "suburbs")  # no face outdoors: the height of a seated person


@pytest.mark.parametrize(
    ("leakage", "flow"),
    [
        (Leakage(), VOLUME / 3600.0),
        (Leakage(DOE2), VOLUME / 3600.0 * 0.224 * V),
        (Leakage((0.606, 0.03636, 0.1177, 0.01)), VOLUME / 3600 * (0.606 + 0.03636 * 18 + 0.1177 * V + 0.01 * V**2)),
        (
            replace(sherman_grimsrud(500.0, stack=0.000145, wind=0.000174), factors=(0, 0, 0, 0)),
            0.5 * np.sqrt(0.000145 * 18 + 0.000174 * V**2),
        ),
        (
            replace(aim2(0.05, 0.67, stack=0.054, wind=0.156, shelter=0.5), factors=(0, 0, 0, 0)),
            0.05 * np.hypot(0.054 * 18**0.67, 0.156 * (0.5 * V) ** 1.34),
        ),
    ],
)
def test_leaks_by_their_formulas(leakage, flow):
    zone = sealed(loads=KEPT, infiltration_ach=1.0, leakage=leakage)
    assert load(zone) == pytest.approx(HEAT * flow * 18.0, rel=1e-9)


def test_leaks_of_a_pressure_test_leave_the_infiltration_as_it_is():
    one = (1.0, 0.0, 0.0, 0.0)
    assert sherman_grimsrud(500.0, stack=0.000145, wind=0.000174).factors == one
    assert aim2(0.05, 0.67, stack=0.054, wind=0.156).factors == one


@pytest.mark.parametrize(
    ("fan", "expected"),
    [
        (SupplyAir(2.0), 18.0),
        (SupplyAir(2.0, recovery=0.75), 4.5),
        (SupplyAir(2.0, 16.0), 4.0),
        (SupplyAir(2.0, recovery=0.5, least_c=18.0), 2.0),  # recovered to 11, heated to 18
        (SupplyAir(2.0, recovery=0.75, bypass_above_c=19.0), 4.5),  # not while it is heated
        (SupplyAir(2.0, recovery=0.75, bypass_above_c=21.0), 4.5),
    ],
)
def test_supply_air_by_its_temperature(fan, expected):
    zone = sealed(loads=KEPT, supply=fan)
    assert load(zone) == pytest.approx(HEAT * 2.0 * VOLUME / 3600.0 * expected, rel=1e-9)
    result = simulate(zone, climate(24, outdoor=OUT), no_sun(24, 2, 0), options=OPTIONS)
    np.testing.assert_allclose(result.fan_air, 2.0 * VOLUME / 3600.0)
    heated = 7.0 if fan.least_c > 0 else 0.0
    np.testing.assert_allclose(result.coil, HEAT * 2.0 * VOLUME / 3600 * heated, rtol=1e-9)


@pytest.mark.parametrize(
    ("power", "air"),
    [
        (100.0, OUT + 100.0 / (0.25 * HEAT * 2.0 * VOLUME / 3600.0)),  # all recovered
        (400.0, 20.0),  # in part: it holds its temperature
        (800.0, OUT + 800.0 / (HEAT * 2.0 * VOLUME / 3600.0)),  # open
    ],
)
def test_bypass_opens_as_far_as_it_must(power, air):
    fan = SupplyAir(2.0, recovery=0.75, bypass_above_c=20.0)
    zone = sealed(gains=Gains(convective=power), supply=fan)
    result = simulate(zone, climate(24, outdoor=OUT), no_sun(24, 2, 0), options=OPTIONS)
    assert result.air_c[-1] == pytest.approx(air, abs=1e-6)
    assert np.abs(result.residual).max() < 1e-6
    assert result.heat_flow["supply air"][-1] == pytest.approx(-power)
    full = HEAT * 2.0 * VOLUME / 3600.0
    cooled = replace(zone, loads=IdealLoads(-np.inf, 19.0))  # the bypass opens first
    assert load(cooled) == pytest.approx(min(full * 17.0 - power, 0.0))
    tempered = replace(zone, supply=replace(fan, least_c=14.0))  # bypassed no further than that
    result = simulate(tempered, climate(24, outdoor=OUT), no_sun(24, 2, 0), options=OPTIONS)
    expected = {100.0: 14.0 + 100.0 / full, 400.0: 14.0 + 400.0 / full, 800.0: 14.0 + 800.0 / full}
    assert result.air_c[-1] == pytest.approx(expected[power], abs=1e-6)
    assert (result.coil[-1] > 0.0) == (power == 100.0)


def test_bypass_makes_no_heat_of_the_time_step():
    """A heated floor beside a bypass: of on and off by the step before came a fifth more heat."""
    hours = 24 * 14
    outdoor = 5.0 - 6.0 * np.cos((np.arange(hours) - 3.0) / 24 * 2 * np.pi)
    by_day = np.tile(np.repeat([0.0, 700.0, 0.0], [8, 10, 6]), 14)
    slab = HeatedSlab("floor", 0.05, heating_c=21.0, heating_limit=1200.0)
    fan = SupplyAir(2.0, recovery=0.8, bypass_above_c=22.5)
    room = box(loads=IdealLoads(), gains=Gains(by_day), supply=fan, slab=slab)
    dark = no_sun(hours, len(room.surfaces), 0)
    heats = []
    for step_s in (60.0, 600.0, 1200.0):
        result = simulate(room, climate(hours, outdoor=outdoor), dark, step_s=step_s)
        assert np.abs(result.residual).max() < 1e-6 * result.slab.max()
        heats.append(result.slab.sum())
    assert heats[1:] == pytest.approx([heats[0]] * 2, rel=0.01)


def test_open_door_carries_what_brown_and_solvason_say():
    """q = C/3 W sqrt(g H^3 dT/T) each way, of air at the mean temperature: both signs of dT."""
    door = large_opening(0.9, 2.0)
    assert door == pytest.approx(0.65 / 3 * 0.9 * np.sqrt(9.81 * 8.0))
    for beyond in (17.0, 24.0):
        mean = 0.5 * (20.0 + beyond) + 273.15
        heat = 101325.0 / (287.055 * mean) * AIR_HEAT
        q = 0.65 / 3 * 0.9 * np.sqrt(9.81 * 8.0 * abs(20.0 - beyond) / mean)
        zone = sealed(loads=KEPT, beside=(NeighbourAir(beyond, buoyant=door),))
        assert load(zone) == pytest.approx(heat * q * (20.0 - beyond), rel=1e-9)
        given = NeighbourAir(beyond, flow=0.05, buoyant=door, share=0.5)
        zone = sealed(loads=KEPT, beside=(given, NeighbourAir(20.0, flow=1.0)))
        assert load(zone) == pytest.approx(heat * (0.05 + q / 2) * (20 - beyond), rel=1e-9)


@pytest.mark.parametrize("power", [20.0, 2000.0])
def test_room_that_floats_beside_an_open_door_finds_its_excess(power):
    """P = rho c C/3 W sqrt(g H^3 / T) dT^1.5, though the flow hangs on what it makes."""
    door = large_opening(0.9, 2.0)
    beside = (NeighbourAir(np.full(24, 18.0), buoyant=door),)
    zone = sealed(gains=Gains(convective=power), beside=beside)
    result = simulate(zone, climate(24, outdoor=OUT), no_sun(24, 2, 0), options=OPTIONS)
    excess = result.air_c[-1] - 18.0
    mean = 18.0 + excess / 2 + 273.15
    heat = 101325.0 / (287.055 * mean) * AIR_HEAT
    assert heat * door * np.sqrt(excess / mean) * excess == pytest.approx(power, rel=1e-6)
    assert np.abs(result.residual).max() < 1e-6
    np.testing.assert_allclose(result.heat_flow["air exchange"], -power, rtol=1e-6)


def test_windows_flow_as_en_16798_7_says():
    """Single-sided by the greater, cross by both; their air has outdoor density's share."""
    site = WIND * local_wind_factor(10.0, "suburbs")
    density = 1.204 * 287.055 * (OUT + 273.15) / 101325.0
    wind, stack = single_sided(1.5, 1.2)
    zone = sealed(loads=KEPT, airing=WindowAiring(wind, stack, share=0.5, heating_while_open=True))
    q = 0.75 * np.sqrt(max(0.001 * site**2, 0.0035 * 1.2 * 18.0))
    assert load(zone) == pytest.approx(HEAT * 0.5 * q * density * 18.0, rel=1e-9)
    wind, stack = cross_flow([1.0, 1.0], [180.0, 0.0], 1.2)
    # at 0 degrees one side each: 0.25 (1/sqrt 2) twice; at 45 the same
    across = 0.5 / np.sqrt(2)
    q = np.hypot(0.67 * across * site * np.sqrt(0.75), np.sqrt(0.0035 * 1.2 * 18.0))
    zone = sealed(loads=KEPT, airing=WindowAiring(wind, stack, both=True, heating_while_open=True))
    assert load(zone) == pytest.approx(HEAT * q * density * 18.0, rel=1e-9)
    assert cross_flow([1.0, 1.0], [180.0, 180.0], 1.2)[0] == 0.0  # one facade: no wind through
    assert cross_flow([1.0, 1.0], [170.0, 190.0], 1.2)[0] == 0.0  # by the axis that passes less
    assert stack_height([0.9, 2.0], [2.1, 2.5]) == pytest.approx(1.6)


def test_windows_open_and_close_by_temperature_wind_and_outdoors():
    hours = 48
    room = sealed(gains=Gains(400.0, 0.0), airing=WindowAiring(0.01, 0.01, open_above_c=24.0, close_below_c=22.0))
    result = simulate(room, climate(hours, outdoor=10.0), no_sun(hours, 2, 0), step_s=60.0)
    assert 22.0 - 1.0 < result.air_c.min() and result.air_c.max() < 24.0 + 1.0
    assert (result.outdoor_air > 0).any()
    still = BalanceOptions(warm_days=0, start_c=26.0)
    for shut in ({"greatest_wind": 1.0}, {"least_outdoor_c": 12.0}, {"least_difference": 500.0}, {"share": 0.0}):
        zone = replace(room, airing=replace(room.airing, **shut))
        closed = simulate(zone, climate(hours, outdoor=10.0), no_sun(hours, 2, 0), options=still)
        assert (closed.outdoor_air == 0.0).all()
        assert closed.air_c.max() > 30.0


def aired_week(step_s: float, **airing):
    """A heated room with gains by day and wide windows, in mild weather."""
    hours = 24 * 7
    by_day = np.tile(np.repeat([0.0, 900.0, 0.0], [8, 10, 6]), 7)
    outdoor = 15.0 - 6.0 * np.cos((np.arange(hours) - 3.0) / 24 * 2 * np.pi)
    wind, stack = cross_flow([2.0, 1.0], [180.0, 270.0], 1.5)
    windows = WindowAiring(wind, stack, both=True, open_above_c=24.0, **airing)
    room = box(loads=IdealLoads(21.0), gains=Gains(by_day), airing=windows)
    dark = no_sun(hours, len(room.surfaces), 0)
    result = simulate(room, climate(hours, outdoor=outdoor, wind=4.0), dark, step_s=step_s)
    assert np.abs(result.residual).max() < 1e-6
    return result


@pytest.mark.parametrize(("step_s", "share"), [(600.0, 0.02), (1800.0, 0.04), (3600.0, 0.06)])
def test_opened_windows_make_no_heat_of_the_time_step(step_s, share):
    """Against steps of a minute; backward Euler itself is of first order in the step."""
    fine, coarse = aired_week(60.0, close_below_c=20.0), aired_week(step_s, close_below_c=20.0)
    assert fine.outdoor_air.max() > 0.1
    assert coarse.heating.sum() == pytest.approx(fine.heating.sum(), rel=share)
    assert coarse.heating.max() == pytest.approx(fine.heating.max(), rel=3 * share)
    assert coarse.air_c.mean() == pytest.approx(fine.air_c.mean(), abs=0.1)
    assert not ((coarse.heating > 1.0) & (coarse.outdoor_air > 0.1)).any()


def test_windows_that_are_open_while_heated_only_where_asked():
    """Closed at 15 degrees: the heating fights them where that is asked, else not."""
    shut = aired_week(600.0, close_below_c=15.0)
    fought = aired_week(600.0, close_below_c=15.0, heating_while_open=True)
    assert fought.heating.sum() > 2.0 * shut.heating.sum()
    assert fought.heating.max() > 1000.0


def test_coefficients_of_leaks_are_those_published():
    """EnergyPlus' Input Output Reference; a leakage area at 20 K and 4 m/s, by hand."""
    assert DOE2 == (0.0, 0.0, 0.224, 0.0) and BLAST == (0.606, 0.03636, 0.1177, 0.0)
    assert Leakage() == Leakage((1.0, 0.0, 0.0, 0.0), 0.0, 0.5, 0.0, 1.0)
    leak = sherman_grimsrud(500.0, stack=0.000145, wind=0.000319)
    flow = np.hypot(leak.stack * 20.0**leak.stack_exponent, leak.wind * 4.0**leak.wind_exponent)
    assert flow == pytest.approx(0.5 * np.sqrt(0.000145 * 20 + 0.000319 * 16))
    sealed = aim2(0.01, 0.67, stack=0.054, wind=0.156, shelter=0.5)
    flow = np.hypot(sealed.stack * 20.0**0.67, sealed.wind * 4.0**1.34)
    assert flow == pytest.approx(np.hypot(0.00054 * 20**0.67, 0.00156 * 2.0**1.34))


def test_cross_flow_is_between_facades():
    """EN 16798-7: A_cros of 2 and 3 m2 opposite each other; none between windows 45 degrees apart,
    which one way of dividing the facades takes for one."""
    wind, stack = cross_flow([2.0, 3.0], [0.0, 180.0], 1.5)
    assert wind == pytest.approx((0.67 * 0.5 / np.sqrt(1 / 4 + 1 / 9)) ** 2 * 0.75)
    assert stack == pytest.approx(0.25 * 25.0 * 0.0035 * 1.5)
    assert cross_flow([2.0, 3.0], [0.0, 315.0], 1.5) == (0.0, pytest.approx(stack))
    assert cross_flow([2.0, 3.0], [10.0, 280.0], 1.5)[0] == pytest.approx(wind)
    # three facades: each against all others together, two and two added
    areas = {180.0: 2.0, 90.0: 3.0, 270.0: 1.0}
    sides = [0.25 / np.sqrt(1 / a**2 + 1 / (6.0 - a) ** 2) for a in areas.values()]
    wind, stack = cross_flow([*areas.values()], [*areas], 1.5)
    assert wind == pytest.approx((0.67 * sum(sides)) ** 2 * 0.75)
    assert stack == pytest.approx(0.25 * 36.0 * 0.0035 * 1.5)


@pytest.mark.parametrize(
    ("make", "wrong", "right"),
    [
        (lambda n: aim2(1.0, n, stack=1.0, wind=1.0), (0.49, 1.01), (0.5, 1.0)),
        (lambda share: SupplyAir(1.0, recovery=share), (-0.01, 1.01), (0.0, 1.0)),
        (SupplyAir, (-0.01, np.array([1.0, -1.0])), (0.0, np.zeros(2))),
        (lambda share: WindowAiring(1.0, 1.0, share=share), (-0.01, 1.01, np.array([0.0, 2.0])), (0.0, 1.0)),
        (lambda c: WindowAiring(1.0, 1.0, open_above_c=22.0, close_below_c=c), (22.1,), (22.0, 20.0)),
        (lambda flow: AirTransfer("a", "b", flow), (-0.01, np.array([1.0, -1.0])), (0.0,)),
        (lambda name: AirTransfer("a", name, 1.0), ("a",), ("b",)),
        (lambda flow: NeighbourAir(20.0, flow=flow), (-0.01, np.array([1.0, -1.0])), (0.0,)),
        (lambda flow: NeighbourAir(20.0, buoyant=flow), (-0.01,), (0.0,)),
        (lambda share: NeighbourAir(20.0, share=share), (-0.01, np.array([0.5, -1.0])), (0.0,)),
        (lambda a: Leakage((1.0, 0.0, 0.0, a)), (-0.01,), (0.0,)),
    ],
)
def test_limits_of_air_are_allowed_and_what_lies_beyond_is_refused(make, wrong, right):
    for value in right:
        make(value)
    for value in wrong:
        with pytest.raises(ThermalInputError):
            make(value)


def test_air_that_cannot_be_is_refused():
    assert SupplyAir(1.0).recovery == 0.0
    for wind, flow in ((-1.0, 1.0), (1.0, -1.0)):
        with pytest.raises(ThermalInputError, match="negative flow"):
            WindowAiring(wind, flow)
        with pytest.raises(ThermalInputError, match="negative"):
            Leakage(stack=flow, wind=wind)


def test_one_way_air_from_room_to_room():
    """Outdoor air is supplied to a, flows on to b: b takes its air at a's temperature."""
    flow = 2.0 * VOLUME / 3600.0
    first = sealed("a", supply=SupplyAir(2.0), loads=IdealLoads(20.0, 20.0))
    second = sealed("b", loads=IdealLoads(23.0, 23.0))
    dark = [no_sun(24, 2, 0)] * 2
    a, b = simulate_zones(
        [first, second], climate(24, outdoor=OUT), dark, transfers=[AirTransfer("a", "b", flow)], options=OPTIONS
    )
    np.testing.assert_allclose(a.heating, HEAT * flow * 18.0, rtol=1e-9)
    np.testing.assert_allclose(b.heating, HEAT * flow * 3.0, rtol=1e-9)
    free = replace(second, loads=IdealLoads())
    _, b = simulate_zones(
        [first, free],
        climate(24, outdoor=OUT),
        dark,
        transfers=[AirTransfer("a", "b", np.full(24, flow))],
        options=OPTIONS,
    )
    np.testing.assert_allclose(b.air_c, 20.0, atol=1e-6)


def test_radiant_share_of_an_ideal_plant():
    """Air held exactly; the surfaces get their share; a limit holds for the whole."""
    hours = 96
    outdoor = 5.0 + 8.0 * np.sin(np.arange(hours) / 24 * 2 * np.pi)
    before = -np.inf
    for share in (0.0, 0.4, 0.8, 1.0):
        loads = IdealLoads(20.0, 26.0, heating_radiant=share)
        room = box(window=Fenestration("glass", 2.5), loads=loads, outside="adiabatic")
        result = simulate(room, climate(hours, outdoor=outdoor), sun(hours, room, strength=0.2))
        held = result.heating > 1.0
        assert held.any()
        np.testing.assert_allclose(result.air_c[held & np.roll(held, 1) & np.roll(held, -1)], 20.0, atol=1e-6)
        assert np.abs(result.residual).max() < 1e-6 * np.abs(result.heating).max()
        warmer = result.mrt_c[held].mean()
        assert warmer > before
        before = warmer
    tight = replace(loads, heating_limit=50.0)
    weak = simulate(replace(room, loads=tight), climate(hours, outdoor=outdoor), sun(hours, room, strength=0.2))
    assert weak.heating.max() == pytest.approx(50.0)
    assert weak.air_c.min() < 20.0


def test_heated_slab_gives_in_proportion_and_keeps_the_account():
    hours = 24 * 30
    room = box(outside="adiabatic", loads=IdealLoads())
    slab = HeatedSlab("floor", 0.05, heating_c=21.0, heating_limit=1200.0, band=2.0)
    heated = replace(room, slab=slab)
    result = simulate(heated, climate(hours, outdoor=-5.0), no_sun(hours, len(room.surfaces), 0))
    assert np.abs(result.residual).max() < 1e-6 * result.slab.max()
    # steady: the power of the band at this air temperature, and the floor warmer than the air
    last = result.air_c[-1]
    assert 20.0 < last < 22.0
    assert result.slab[-1] == pytest.approx(1200.0 * (21.0 - last + 1.0) / 2.0, rel=1e-3)
    floor = result.surface_in_c[-1, room.index_of("floor")]
    assert floor > last + 0.5
    assert result.heat_flow["heated slab"][-1] == pytest.approx(result.slab[-1])
    lost = -(result.heat_flow["facade"] + result.heat_flow["air exchange"])[-1]
    assert lost == pytest.approx(result.slab[-1], rel=2e-2)


def test_heated_slab_between_equal_rooms_is_in_the_account():
    """Its power is a flow of its own where the slab has the same room below it."""
    hours = 24 * 5
    room = box(outside="twin", loads=IdealLoads())
    slab = HeatedSlab("floor", 0.05, heating_c=21.0, heating_limit=1200.0)
    dark = no_sun(hours, len(room.surfaces), 0)
    result = simulate(replace(room, slab=slab), climate(hours, outdoor=-5.0), dark)
    assert result.slab.max() > 0
    np.testing.assert_allclose(result.heat_flow["heated slab"], result.slab)
    assert np.abs(result.residual).max() < 1e-6 * result.slab.max()
