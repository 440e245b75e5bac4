"""The room: closed forms, conservation of energy, coupling of zones, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erfc

from tests.thermal.rooms import CONCRETE, INSULATION, PLASTER, box, climate, sun
from thermal.balance import BalanceOptions, simulate, simulate_zones
from thermal.blackbox import Fenestration, layer_absorptances
from thermal.climate import Solar, no_sun
from thermal.conduction import u_value
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError
from thermal.network import exchange_star
from thermal.zone import Gains, Layer, OpaqueSurface, WindowElement, Zone

SOUTH = np.array([0.0, -1.0, 0.0])
FILMS = {"inside_convection": "constant", "outside_convection": "constant", "outside_film": 20.0}
INSIDE_FILM = 3.076  # "constant" of a vertical face


def one_wall(layers, **changes) -> Zone:
    """A zone with a single outdoor wall: no longwave inside."""
    wall = OpaqueSurface("wall", 10.0, layers, SOUTH, emissivity_out=0.0)
    changes = {"infiltration_ach": 0.0} | changes
    return Zone("cell", 30.0, (wall,), **changes)


def test_steady_wall_has_its_u_value():
    layers = (PLASTER, INSULATION, CONCRETE)
    zone = one_wall(layers, loads=IdealLoads(heating_c=20.0))
    options = BalanceOptions(**FILMS, warm_tolerance=1e-7)
    result = simulate(zone, climate(24), no_sun(24, 1, 0), options=options)
    u = u_value(layers, r_outer=1 / 20.0, r_inner=1 / INSIDE_FILM)
    assert result.heating[-1] == pytest.approx(u * 10.0 * 20.0, rel=1e-5)
    inside = 20.0 - u * 20.0 / INSIDE_FILM
    assert result.surface_in_c[-1, 0] == pytest.approx(inside, abs=0.01)


DAY = 2.0 * np.pi / 86400.0  # [rad/s]


def chain(layers) -> np.ndarray:
    """Temperature and flow at the outer face from those at the inner one, at a period of a day."""
    matrix = np.eye(2, dtype=complex)
    for x in layers:
        root = np.sqrt(1j * DAY * x.density * x.heat_capacity / x.conductivity)
        c, s = np.cosh(root * x.thickness), np.sinh(root * x.thickness)
        flow = x.conductivity * root
        matrix = matrix @ np.array([[c, s / flow], [flow * s, c]])
    return matrix


def periodic_load(zone: Zone, films, radiant: float, outer: float) -> complex:
    """Load of a room held at one temperature by a radiant gain of 1 W that swings once a day."""
    area = np.array([face.area for face in zone.surfaces])
    exchange = radiant * exchange_star(area, np.ones(len(area)))
    np.fill_diagonal(exchange, 0.0)
    taken = []
    for face in zone.surfaces:
        (a, b), (c, d) = chain(face.layers)
        twin = face.outside == "twin"
        taken.append((a - 1.0) / b if twin else (outer * a + c) / (outer * b + d))
    own = area * (np.array(taken) + films) + exchange.sum(axis=1)
    faces = np.linalg.solve(np.diag(own) - exchange, area / area.sum())
    return complex((films * area) @ faces)


@pytest.mark.parametrize(("step", "late"), [(600.0, 1.0), (3600.0, 5.0)])
def test_the_load_of_a_periodic_gain_is_the_closed_form(step, late):
    zone = box()
    faces = tuple(replace(f, emissivity_in=1.0, emissivity_out=0.0) for f in zone.surfaces)
    t = np.arange(0.5, 30 * 86400 / step) * step
    zone = replace(
        zone,
        surfaces=faces,
        infiltration_ach=0.0,
        air_capacity_factor=0.0,
        gains=Gains(radiant=1000.0 + 500.0 * np.sin(DAY * t)),
        loads=IdealLoads(26.0, 26.0),
    )
    options = BalanceOptions(
        inside_convection="stated",
        inside_films=(2.7, 1.7, 1.7),
        inside_radiation=5.0,
        outside_convection="constant",
        outside_film=20.0,
        warm_days=0,
        start_c=26.0,
    )
    weather, dark = climate(len(t), outdoor=26.0), no_sun(len(t), len(faces), 0)
    year = simulate(zone, weather, dark, step_s=step, row_s=step, options=options)
    last = slice(-round(86400 / step), None)
    swing = np.mean((year.cooling - year.heating)[last] * np.exp(-1j * DAY * t[last])) * 2j / 500.0
    closed = periodic_load(zone, np.array([2.7, 2.7, 2.7, 2.7, 1.7, 1.7]), 5.0, 20.0)
    assert abs(swing) == pytest.approx(abs(closed), rel=0.003)  # 0.2555: the rest is stored
    assert np.degrees(abs(np.angle(swing / closed))) < late  # half a step late


def test_semi_infinite_wall_follows_the_closed_form():
    hours, film = 24, 20.0
    wall = Layer(2.0, 1.0, 2000.0, 1000.0)  # the front of heat goes 0.4 m in a day
    options = BalanceOptions(**FILMS, warm_days=0, start_c=0.0, cell=0.002)
    result = simulate(
        one_wall((wall,)), climate(hours, outdoor=10.0), no_sun(hours, 1, 0), step_s=60.0, options=options
    )
    t = (np.arange(hours * 60) + 1.0) * 60.0
    root = film / 1.0 * np.sqrt(5e-7 * t)  # Carslaw and Jaeger 1959, 2.7: convective boundary
    closed = 10.0 * (1.0 - np.exp(root**2) * erfc(root))
    expected = closed.reshape(hours, 60).mean(axis=1)
    # backward Euler is first order: half a step late, 30 s of the closed form's slope
    slope = np.abs(np.diff(closed, prepend=0.0)).reshape(hours, 60).mean(axis=1)
    assert np.all(np.abs(result.surface_out_c[:, 0] - expected) < 0.6 * slope + 0.005)


def test_a_single_iterate_goes_on_from_the_step_before():
    """Temperatures that go on as they changed give the films that the iterates end at."""
    outdoor = 10.0 + 8.0 * np.sin(np.arange(48) / 24 * 2 * np.pi)
    zone = box(window=Fenestration("glass", 1.2, 0.04, 0.13))
    air = []
    for given in ({"iterations": 1}, {"iterations": 30, "tolerance": 1e-9}):
        options = BalanceOptions(warm_tolerance=1e-6, warm_days=500, **given)
        place = climate(48, outdoor=outdoor)
        air.append(simulate(zone, place, sun(48, zone), options=options).air_c)
    assert np.ptp(air[1]) > 1.0
    apart = np.abs(air[0] - air[1]).max()
    assert apart < 0.004  # [K]; 0.007 from the temperatures of the step before


def test_window_in_the_room_returns_u_and_g():
    """At the measuring condition (its own films, no longwave) the balance gives U and g back."""
    r_o, r_i, u, tau, rho, g = 1 / 20.0, 1 / INSIDE_FILM, 1.2, 0.47, 0.21, 0.60
    layers = layer_absorptances(tau, rho, g, u, r_outer=r_o, r_inner=r_i)
    system = Fenestration("system", u, r_o, r_i, emissivity_in=0.0, emissivity_out=0.0)
    wall = OpaqueSurface("wall", 10.0, (PLASTER,), SOUTH, "adiabatic", emissivity_in=0.0)
    window = WindowElement("window", 2.0, SOUTH, (system,))
    loads = IdealLoads(heating_c=20.0, cooling_c=20.0)
    zone = Zone("cell", 30.0, (wall,), (window,), infiltration_ach=0.0, loads=loads)
    options = BalanceOptions(**FILMS, tolerance=1e-10, warm_tolerance=1e-9)
    dark = simulate(zone, climate(24), no_sun(24, 1, 1), options=options)
    assert dark.heating[-1] == pytest.approx(u * 2.0 * 20.0, rel=1e-6)
    light = Solar(
        absorbed_outer=np.full((24, 1), 500.0 * float(layers.outer)),
        absorbed_inner=np.full((24, 1), 500.0 * float(layers.inner)),
        inside=np.full((24, 1), 500.0 * tau * 2.0),
        facade=np.zeros((24, 1)),
    )
    bright = simulate(zone, climate(24, outdoor=20.0), light, options=options)
    assert bright.cooling[-1] == pytest.approx(g * 500.0 * 2.0, rel=1e-6)


@pytest.mark.parametrize("step_s", [600.0, 3600.0])
def test_energy_closes_every_hour_and_over_the_run(step_s):
    hours = 24 * 10
    weather = climate(hours, outdoor=5 + 8 * np.sin(np.arange(hours) / 24 * 2 * np.pi), sky=-10.0)
    window = Fenestration("system", 1.2, extra_inner=6.0, extra_outer=10.0)
    zone = box(window=window, gains=Gains(80.0, 60.0), loads=IdealLoads(20.0, 26.0, 300.0, 200.0))
    result = simulate(zone, weather, sun(hours, zone), step_s=step_s)
    scale = sum(np.abs(flow).mean() for flow in result.heat_flow.values())
    assert np.max(np.abs(result.residual)) < 1e-6 * scale
    assert abs(result.residual.sum()) < 1e-6 * scale
    assert result.heat_flow["glass sun"].mean() == pytest.approx(4.5 * (sun(hours, zone).absorbed_outer).mean())


def half_of_symmetric(layers):
    """The inner half of a symmetric partition, "adiabatic" at its mid-plane."""
    total = sum(layer.thickness for layer in layers) / 2
    kept: list[Layer] = []
    for layer in reversed(layers):
        if total <= 1e-12:
            break
        part = min(layer.thickness, total)
        kept.append(Layer(part, layer.conductivity, layer.density, layer.heat_capacity))
        total -= part
    return tuple(reversed(kept))


def test_symmetric_partition_is_half_a_partition_with_adiabatic_middle():
    hours = 72
    weather = climate(hours, outdoor=10 + 10 * np.sin(np.arange(hours) / 24 * 2 * np.pi))
    whole = box()
    halves = tuple(
        OpaqueSurface(s.name, s.area, half_of_symmetric(s.layers), s.normal, "adiabatic") if s.outside == "twin" else s
        for s in whole.surfaces
    )
    half = Zone("room", 60.0, halves)
    options = BalanceOptions(cell=0.005)
    a = simulate(whole, weather, sun(hours, whole), options=options)
    b = simulate(half, weather, sun(hours, half), options=options)
    # the two grids place their nodes differently: 5 mm cells agree to the grid's error
    np.testing.assert_allclose(a.air_c, b.air_c, atol=0.005)


def test_two_equal_rooms_behave_like_twins_and_heat_flows_to_the_colder():
    hours = 24 * 6
    weather = climate(hours, outdoor=5.0)
    alone = box(gains=Gains(100.0, 50.0))

    def room(name: str, other: str, side: str, gains: Gains) -> Zone:
        surfaces = tuple(
            OpaqueSurface(s.name, s.area, s.layers, s.normal, other, "party") if s.name == side else s
            for s in alone.surfaces
        )
        named = tuple(
            OpaqueSurface("party", s.area, s.layers, s.normal, other, "party") if s.outside == other else s
            for s in surfaces
        )
        return Zone(name, 60.0, named, gains=gains)

    def pair(second: Gains):
        a = room("a", "b", "east", Gains(100.0, 50.0))
        b = room("b", "a", "west", second)
        return simulate_zones([a, b], weather, [no_sun(hours, 6, 0)] * 2)

    single = simulate(alone, weather, no_sun(hours, 6, 0))
    a, b = pair(Gains(100.0, 50.0))
    np.testing.assert_allclose(a.air_c, single.air_c, atol=1e-3)  # warm-up ends within 0.01 K
    np.testing.assert_allclose(a.air_c, b.air_c, atol=1e-6)
    a, b = pair(Gains(0.0, 0.0))
    assert a.air_c[-1] > b.air_c[-1] + 1.0
    flow = a.heat_flow["partitions"][-1]
    assert flow < -1.0
    for result in (a, b):
        assert np.max(np.abs(result.residual)) < 1e-6


def test_open_door_brings_two_rooms_together():
    hours = 48
    weather = climate(hours, outdoor=5.0)
    warm, cool = box(gains=Gains(300.0)), box()
    cool = Zone("cool", 60.0, cool.surfaces)
    dark = [no_sun(hours, 6, 0)] * 2
    closed = simulate_zones([warm, cool], weather, dark)
    open_ = simulate_zones([warm, cool], weather, dark, air_links=[[0, 0.1], [0.1, 0]])
    gap = [r[0].air_c[-1] - r[1].air_c[-1] for r in (closed, open_)]
    assert 0 < gap[1] < 0.35 * gap[0]
    total = sum(r.heat_flow["air exchange"] for r in open_)
    outdoor = [r.air_c - weather.outdoor_c for r in open_]
    assert np.all(np.sign(total) == -np.sign(sum(outdoor)))
    assert max(np.max(np.abs(r.residual)) for r in open_) < 1e-6


def test_ideal_loads_hold_set_points_and_limits():
    hours = 48
    cold = climate(hours, outdoor=-10.0)
    zone = box(loads=IdealLoads(heating_c=21.0))
    result = simulate(zone, cold, no_sun(hours, 6, 0))
    np.testing.assert_allclose(result.air_c, 21.0, atol=1e-9)
    limited = box(loads=IdealLoads(heating_c=21.0, heating_limit=50.0))
    result = simulate(limited, cold, no_sun(hours, 6, 0))
    np.testing.assert_allclose(result.heating, 50.0, atol=1e-9)
    assert np.all(result.air_c < 21.0)


def test_shading_state_switches_the_thermal_state():
    hours = 48
    good, bad = Fenestration("closed", 0.6), Fenestration("open", 2.5)
    window = WindowElement("window", 4.5, SOUTH, (bad, good))
    base = box(loads=IdealLoads(heating_c=20.0))
    zone = Zone("room", 60.0, base.surfaces, (window,), infiltration_ach=0.0, loads=base.loads)
    dark = no_sun(hours, 6, 1)
    state = np.zeros((hours, 1), dtype=int)
    state[24:] = 1
    switched = Solar(dark.absorbed_outer, dark.absorbed_inner, dark.inside, dark.facade, state=state)
    result = simulate(zone, climate(hours), switched)
    assert result.heating[30] < 0.8 * result.heating[20]


def test_each_state_has_its_emissivities():
    """A state beside others is as by itself; where states change, the account still closes."""
    hours = 48
    bare = Fenestration("bare", 5.0)
    coated = Fenestration("coated", 5.0, emissivity_in=0.2, emissivity_out=0.1)
    room, alone = box(window=bare), box(window=coated)
    (window,) = room.windows
    both = replace(room, windows=(replace(window, states=(bare, coated)),))
    shine = sun(hours, room)
    cold = climate(hours, outdoor=-5.0, sky=-20.0)
    states = np.ones((hours, 1), dtype=int)
    expected = simulate(alone, cold, shine)
    result = simulate(both, cold, replace(shine, state=states))
    np.testing.assert_allclose(result.mrt_c, expected.mrt_c, atol=1e-9)
    np.testing.assert_allclose(result.window_outer_c, expected.window_outer_c, atol=1e-9)
    assert np.abs(simulate(room, cold, shine).window_inner_c - expected.window_inner_c).max() > 0.5
    states[::3] = 0
    mixed = simulate(both, cold, replace(shine, state=states))
    assert np.abs(mixed.residual).max() < 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda z: simulate(z, climate(24), no_sun(23, 6, 0)), "solar"),
        (lambda z: simulate(z, climate(24), no_sun(24, 5, 0)), "inside"),
        (lambda z: simulate(z, climate(24), no_sun(24, 6, 0), step_s=700.0), "time step"),
        (lambda z: climate(24, outdoor=[np.nan] * 24), "weather outdoor_c"),
        (lambda z: OpaqueSurface("x", 0.0, (PLASTER,), SOUTH), "surface x"),
        (lambda z: OpaqueSurface("x", 1.0, (), SOUTH), "no layers"),
        (lambda z: Layer(0.1, -1.0, 1.0, 1.0), "conductivity"),
        (lambda z: box(window=Fenestration("w", 1.2), window_area=95.0), "larger than all walls"),
        (lambda z: IdealLoads(heating_c=25.0, cooling_c=20.0), "set points"),
    ],
)
def test_bad_input_names_the_item(change, words):
    with pytest.raises(ThermalInputError, match=words):
        change(box())
