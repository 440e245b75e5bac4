"""ISO 13370: printed U-values, a half-space solved on its own, the room that stands on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import CONCRETE, box, climate
from thermal.balance import BalanceOptions, simulate
from thermal.climate import no_sun
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError
from thermal.ground import (
    AIR_WH,
    CELLAR_AIR,
    MONTH,
    R_SE,
    R_SI_ACROSS,
    R_SI_DOWN,
    SHIELDS,
    SOIL_LAYER,
    SOILS,
    YEAR,
    Footprint,
    Soil,
    basement,
    edge_transmittance,
    harmonic,
    over_unheated_basement,
    slab_on_ground,
    slab_u,
    suspended_floor,
)
from thermal.zone import Layer, OpaqueSurface, Zone

HOUSE = Footprint(100.0, 40.0, 0.3, SOILS["clay"])


@pytest.mark.parametrize(
    ("ratio", "u"), [(0.05, 0.13), (0.1, 0.22), (0.2, 0.37), (0.3, 0.49), (0.5, 0.70), (0.7, 0.86), (1.0, 1.05)]
)
def test_uninsulated_slab_on_clay_as_cibse_prints_it(ratio, u):
    """CIBSE Guide A (2006), table 3.15: walls of 0.3 m, to its two digits (quoted from memory)."""
    place = Footprint(100.0, 100.0 * ratio, 0.3, SOILS["clay"])
    assert slab_on_ground(place, 0.0).u_value == pytest.approx(u, abs=0.0051)


def half_space_flow(side: float, edge: float, cells: int = 400) -> float:
    """Flow [W per W/(m K) and K] through a square slab into a half-space, outdoors at zero.

    Between slab and outdoors the surface's temperature falls linearly over the wall's width.
    Source of heat at the surface: q = k/(2 pi) times the integral of (T(x) - T(x'))/r^3 over the
    surface; that over the slab is closed, sum of +- sqrt(a^2 + b^2)/(a b) over its corners.
    """
    half = side / 2
    far = half * np.geomspace(1.0, 2000.0, cells)  # outside the slab, by distance along one axis
    near = half + edge * np.linspace(0.0, 1.0, cells + 1) ** 2
    lines = np.unique(np.concatenate([near, far[far > near[-1]]]))
    inner = half * np.sin(np.linspace(0.0, np.pi / 2, cells + 1))
    lines = np.concatenate([inner[:-1], lines])
    middle, width = 0.5 * (lines[1:] + lines[:-1]), np.diff(lines)
    x, y = np.meshgrid(middle, middle, indexing="ij")
    area = np.outer(width, width)
    beyond = np.maximum(np.maximum(x, y) - half, 0.0)
    outside = np.maximum(x, y) > half
    temperature = np.clip(1.0 - beyond / edge, 0.0, 1.0)
    kernel = np.zeros_like(x)
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = x + sx * half, y + sy * half
        kernel += sx * sy * np.sqrt(a * a + b * b) / (a * b)
    kernel = np.where(outside, -kernel, 0.0)
    return 4 * float((kernel * (1.0 - temperature) * area)[outside].sum()) / (2 * np.pi)


def test_bare_slab_meets_the_half_space():
    """IEA BESTEST GC10a's slab (12 m, 0.24 m, 1.9 W/(m K), 20 K): ISO's formula is 3 % above.

    The half-space itself gives 2433 W there, as Delsante's closed form.
    """
    flow = 1.9 * 20.0 * half_space_flow(12.0, 0.24)
    assert flow == pytest.approx(2433.0, rel=0.005)
    place = Footprint(144.0, 48.0, 0.24, Soil(1.9, 2.4e6))
    assert slab_u(place, 0.24) * 144.0 * 20.0 == pytest.approx(flow, rel=0.04)


def test_edge_insulation_saves_and_more_saves_more():
    bare = slab_on_ground(HOUSE, 0.5)
    some = slab_on_ground(HOUSE, 0.5, edge=(0.5, 1.0))
    deep = slab_on_ground(HOUSE, 0.5, edge=(1.0, 1.0))
    flat = slab_on_ground(HOUSE, 0.5, edge=(1.0, 1.0), vertical=False)
    assert bare.u_value > some.u_value > deep.u_value
    assert bare.swing > flat.swing > deep.swing > 0  # vertical reaches twice as far
    d = HOUSE.equivalent_thickness(0.5)
    assert edge_transmittance(HOUSE, d, 1.0, 0.0, vertical=True) == 0.0


def test_limits_of_basement_and_crawl_space():
    """A basement of no depth is a slab; a crawl space without ground is its floor and its air."""
    floor, wall = basement(HOUSE, 0.5, 1.0, 0.05)
    slab = slab_on_ground(HOUSE, 0.5)
    assert floor.u_value == pytest.approx(slab.u_value, rel=0.02)
    assert floor.swing == pytest.approx(slab.swing, rel=0.03)
    # a shallow wall: 2/pi (1 + 1/2) of its own U, the formula's limit
    own = 1.0 / (0.13 + 1.0 + R_SE)
    assert wall.u_value == pytest.approx(3.0 / np.pi * own, rel=0.03)
    windy = suspended_floor(HOUSE, 1.0, height=0.5, wall_u=1.0, vents=0.5, wind=50.0)
    own_floor = 1.0 / (2 * R_SI_DOWN + 1.0)
    assert windy.u_value == pytest.approx(own_floor, rel=0.01)
    assert windy.swing == pytest.approx(own_floor, rel=0.01)
    calm = suspended_floor(HOUSE, 1.0, height=0.5, wall_u=1.0, vents=0.0015, wind=3.0)
    assert slab_on_ground(HOUSE, 1.0).u_value * 0.8 < calm.u_value < own_floor
    cellar = over_unheated_basement(HOUSE, 1.0, depth=2.0, height=0.5, wall_u=1.0)
    assert 0.2 < cellar.u_value < own_floor


def test_cellar_passes_on_what_its_air_loses():
    """ISO 13370, 7.4: its floor, then ground, walls above it and 0.3 air changes."""
    floor, wall = basement(HOUSE, 0.0, 0.0, 2.0)
    area, perimeter = HOUSE.area, HOUSE.perimeter
    ground = area * floor.u_value + 2.0 * perimeter * wall.u_value
    lost = ground + 0.5 * perimeter * 1.5 + 0.33 * 0.3 * area * 2.5
    own = 1.0 / (2 * R_SI_DOWN + 1.0)
    found = over_unheated_basement(HOUSE, 1.0, depth=2.0, height=0.5, wall_u=1.5)
    assert found.u_value == pytest.approx(1.0 / (1.0 / own + area / lost))
    open_walls = over_unheated_basement(HOUSE, 1.0, depth=2.0, height=0.5, wall_u=1e6)
    assert open_walls.u_value == pytest.approx(own, rel=1e-3)
    assert open_walls.swing == pytest.approx(own, rel=1e-3)
    assert 0.0 < found.swing < own


def test_penetration_depths_of_the_three_soils():
    """ISO 13370, table H.1: 2.2, 3.2 and 4.2 m."""
    found = [SOILS[name].penetration for name in ("clay", "sand", "rock")]
    np.testing.assert_allclose(found, [2.2, 3.2, 4.2], atol=0.05)


def test_harmonic_finds_mean_swing_and_coldest_hour():
    hours = np.arange(8760) + 0.5
    outdoor = 8.0 - 11.0 * np.cos(2 * np.pi * (hours - 400.0) / YEAR) + np.sin(hours / 24 * 6.283)
    mean, swing, coldest = harmonic(outdoor, hours)
    assert (mean, swing) == pytest.approx((8.0, 11.0), abs=0.01)
    assert coldest == pytest.approx(400.0, abs=1.0)


def test_room_on_its_slab_loses_what_iso_says():
    """A heated room's flow to the ground in the transient balance: mean, swing and lag of C.3.

    The half metre of soil and the concrete (1.5 MJ/(m2 K) behind some 1.5 m2 K/W) delay the
    flow that the room feels once more, by RC = 26 days at the most, and damp it by a tenth.
    """
    hours = np.arange(2 * 8760) + 1.0  # the second year counts: the first begins in January's soil
    outdoor = 10.0 - 10.0 * np.cos(2 * np.pi * (hours - 500.0) / YEAR)
    element = slab_on_ground(HOUSE, CONCRETE.resistance)
    year = harmonic(outdoor, hours)
    beyond = element.temperature(20.0, *year, hours)
    room = box(loads=IdealLoads(20.0, 20.0), infiltration_ach=0.0)
    up = 1.0 / R_SI_DOWN
    floor = OpaqueSurface(
        "slab", 20.0, element.layers((CONCRETE,)), np.array([0, 0, -1.0]), "known", emissivity_in=0.0, beyond_c=beyond
    )
    other = OpaqueSurface(
        "roof", 20.0, (Layer(0.1, 0.1, 0.0, 0.0),), np.array([0, 0, 1.0]), "adiabatic", emissivity_in=0.0
    )
    room = Zone("on the ground", 60.0, (floor, other), infiltration_ach=0.0, loads=room.loads)
    options = BalanceOptions(inside_convection="constant", warm_tolerance=1e-4)
    result = simulate(room, climate(2 * 8760, outdoor=outdoor), no_sun(2 * 8760, 2, 0), step_s=3600.0, options=options)
    film, beyond = (result.heating - result.cooling)[8760:], beyond[8760:]
    assert np.abs(result.residual).max() < 1e-6
    # the film of the balance is not R_si: compare at equal total resistance
    shown = 1.0 / element.u_value - R_SI_DOWN
    h = film.mean() / 20.0 / (20.0 - result.surface_in_c[8760:, 0].mean())
    assert h < up
    u = 1.0 / (shown + 1.0 / h)
    assert film.mean() / 20.0 == pytest.approx(u * (20.0 - beyond.mean()), rel=2e-3)
    assert beyond.mean() == pytest.approx(10.0, abs=0.01)
    found, said = harmonic(film / 20.0, hours[8760:]), harmonic(u * (20.0 - beyond), hours[8760:])
    assert 0.9 < found[1] / said[1] < 1.0
    later = np.mod(found[2] - said[2] + YEAR / 2, YEAR) - YEAR / 2
    assert 0.0 < later < 26 * 24.0
    # the formula's own greatest flow: a month after the coldest hour (half a year off the least)
    lag = np.mod(said[2] - YEAR / 2 - 500.0, YEAR)
    assert lag == pytest.approx(YEAR / 12, abs=1.0)
    assert said[1] / u == pytest.approx(10.0 * element.swing / element.u_value, rel=1e-3)


def test_neighbour_at_a_known_temperature_has_its_u():
    """U A (T_i - T_n) in the steady state, films 0.13 beyond and the balance's own inside."""
    wall = Layer(0.1, 0.5, 0.0, 0.0)
    film = Layer(1.0, 1.0 / 0.13, 0.0, 0.0)
    surface = OpaqueSurface(
        "party", 12.0, (film, wall), np.array([1.0, 0, 0]), "known", emissivity_in=0.0, beyond_c=np.full(24, 12.0)
    )
    other = OpaqueSurface("rest", 20.0, (wall,), np.array([-1.0, 0, 0]), "adiabatic", emissivity_in=0.0)
    room = Zone("room", 30.0, (surface, other), infiltration_ach=0.0, loads=IdealLoads(22.0, 22.0), bridges=1.5)
    options = BalanceOptions(inside_convection="constant", warm_tolerance=1e-9, tolerance=1e-9)
    found = simulate(room, climate(24, outdoor=2.0), no_sun(24, 2, 0), options=options)
    u = 1.0 / (0.13 + wall.resistance + 1 / 3.076)
    np.testing.assert_allclose(found.heat_flow["ground and neighbours"], -12 * u * 10, rtol=1e-6)
    np.testing.assert_allclose(found.heat_flow["thermal bridges"], -1.5 * 20.0, rtol=1e-9)
    np.testing.assert_allclose(found.heating, 12 * u * 10 + 1.5 * 20.0, rtol=1e-6)


def test_slabs_by_the_printed_equations():
    """ISO 13370 (4), (5), annexes D and H: B' = 5 m, d = 0.3 + 1.5 (0.17 + R + 0.04)."""
    b, k, depth = 5.0, 1.5, np.sqrt(3.15e7 * 1.5 / (np.pi * 3.0e6))
    thick = 0.3 + k * (0.17 + 4.0 + 0.04)
    assert slab_on_ground(HOUSE, 4.0).u_value == pytest.approx(k / (0.457 * b + thick))
    d = 0.3 + k * (0.17 + 1.0 + 0.04)
    plain = 2 * k / (np.pi * b + d) * np.log(np.pi * b / d + 1)
    bare = slab_on_ground(HOUSE, 1.0)
    assert bare.u_value == pytest.approx(plain)
    swing = np.log(depth / d + 1)
    assert bare.swing == pytest.approx(0.37 * 40 * k * swing / 100)
    assert (bare.lag, bare.resistance, bare.r_si) == (1.0, 1.0, 0.17)
    edged = slab_on_ground(HOUSE, 1.0, edge=(0.8, 2.0), vertical=False)
    psi = edge_transmittance(HOUSE, d, 0.8, 2.0, vertical=False)
    more = _more(psi, 0.8, k, d)
    assert more == pytest.approx((1.5 - 0.035) * 2.0)  # less the soil that it replaces
    assert edged.u_value == pytest.approx(plain + 2 * psi / b)
    left = np.exp(-0.8 / depth)
    inner = (1 - left) * np.log(depth / (d + more) + 1) + left * swing
    assert edged.swing == pytest.approx(0.37 * 40 * k * inner / 100)
    assert edge_transmittance(HOUSE, d, 0.4, 2.0, vertical=True) == pytest.approx(psi)
    upright = slab_on_ground(HOUSE, 1.0, edge=(0.4, 2.0))
    assert (upright.u_value, upright.swing) == pytest.approx((edged.u_value, edged.swing))


def _more(psi: float, width: float, k: float, d: float) -> float:
    """d' of (D.2) [m] from the Psi that it gives."""
    whole = np.log(width / d + 1) + np.pi * psi / k
    return width / (np.exp(whole) - 1) - d


def test_crawl_space_by_the_printed_equations():
    """ISO 13370 (8) to (10): U_g of its ground, U_x of walls and wind, in series with the floor."""
    b, k = 5.0, 1.5
    d = 0.3 + k * (0.17 + 0.04)
    ground = 2 * k / (np.pi * b + d) * np.log(np.pi * b / d + 1)
    around = 2 * 0.5 * 0.8 / b + 1450 * 0.002 * 4.0 * 0.05 / b
    floor = 1 / (2 * 0.17 + 1.0)
    space = suspended_floor(HOUSE, 1.0, height=0.5, wall_u=0.8, vents=0.002, wind=4.0)
    assert space.u_value == pytest.approx(1 / (1 / floor + 1 / (ground + around)))
    sheltered, exposed = (
        suspended_floor(HOUSE, 1.0, height=0.5, wall_u=0.8, vents=0.002, wind=4.0, shield=shield)
        for shield in ("sheltered", "exposed")
    )
    assert sheltered.u_value < space.u_value < exposed.u_value
    depth = np.sqrt(3.15e7 * k / (np.pi * 3.0e6))
    edge = 0.37 * 40 * k * np.log(depth / d + 1) / 100
    assert space.swing == pytest.approx(floor * (edge + around) / (k / depth + around + floor))
    assert (space.lag, space.resistance, space.r_si, space.soil) == (0.0, 1.0, 0.17, None)
    with pytest.raises(ThermalInputError, match="is none of sheltered"):
        suspended_floor(HOUSE, 1.0, height=1, wall_u=1, vents=0, wind=0, shield="none")


def test_basement_by_the_printed_equations():
    """ISO 13370 (11) to (14) and H.7 at 2 m: floor (d + z/2 against B'), walls, the swing."""
    b, k, z, depth = 5.0, 1.5, 2.0, np.sqrt(3.15e7 * 1.5 / (np.pi * 3.0e6))
    d, w = 0.3 + k * (0.17 + 0.5 + 0.04), k * (0.13 + 1.0 + 0.04)
    floor, wall = basement(HOUSE, 0.5, 1.0, z)
    below = np.pi * b + d + z / 2
    assert floor.u_value == pytest.approx(2 * k / below * np.log(np.pi * b / (d + z / 2) + 1))
    sides = 2 * k / (np.pi * z) * (1 + 0.5 * d / (d + z)) * np.log(z / w + 1)
    assert wall.u_value == pytest.approx(sides)
    left = np.exp(-z / depth)
    assert floor.swing == pytest.approx(0.37 * 40 * k * left * np.log(depth / d + 1) / 100)
    assert wall.swing == pytest.approx(0.37 * k * 2 * (1 - left) * np.log(depth / w + 1) / z)
    assert (floor.lag, wall.lag, floor.r_si, wall.r_si) == (1.0, 1.0, 0.17, 0.13)


def test_layers_and_temperature_beyond_give_the_heat_flow_of_the_standard():
    """Steady flow through soil and virtual layer is U (T_i - T_e); the swing adds H_pe."""
    slab = slab_on_ground(HOUSE, 1.0)
    virtual, soil, _ = slab.layers((CONCRETE,))
    total = virtual.resistance + soil.resistance + 1.0 + 0.17
    assert total == pytest.approx(1.0 / slab.u_value)
    assert (soil.thickness, soil.conductivity) == (0.5, 1.5)
    assert soil.density * soil.heat_capacity == pytest.approx(3.0e6)
    hours = np.arange(0.0, YEAR)
    beyond = slab.temperature(20.0, 10.0, 9.0, 500.0, hours)
    flow = slab.u_value * (20.0 - beyond)
    assert flow.mean() == pytest.approx(slab.u_value * 10.0)
    assert np.ptp(flow) / 2 == pytest.approx(slab.swing * 9.0, rel=1e-5)
    assert hours[np.argmax(flow)] == pytest.approx(500.0 + YEAR / 12, abs=1)  # a month late
    floor = suspended_floor(HOUSE, 1.0, height=0.5, wall_u=0.8, vents=0.002, wind=4.0)
    (air, _) = floor.layers((CONCRETE,))
    assert air.resistance == pytest.approx(1.0 / floor.u_value - 1.0 - 0.17)


def test_constants_of_the_standard():
    """ISO 13370, 7.4 and tables 7 and 8; ISO 6946, table 7; ISO 52016-1, 6.5.8.2."""
    assert (YEAR, MONTH) == (8760.0, 730.0)
    assert (R_SE, R_SI_DOWN, R_SI_ACROSS, SOIL_LAYER) == (0.04, 0.17, 0.13, 0.5)
    assert (CELLAR_AIR, AIR_WH) == (0.3, 0.33)
    assert SHIELDS == {"sheltered": 0.02, "average": 0.05, "exposed": 0.10}
    soils = {"clay": (1.5, 3.0e6), "sand": (2.0, 2.0e6), "rock": (3.5, 2.0e6)}
    assert {name: (s.conductivity, s.heat_capacity) for name, s in SOILS.items()} == soils


def test_what_is_no_ground_is_refused():
    for area, perimeter, wall in ((0.0, 40.0, 0.3), (100.0, 0.0, 0.3), (100.0, 40.0, -0.01), (100.0, 40.0, 3.01)):
        with pytest.raises(ThermalInputError, match="ground"):
            Footprint(area, perimeter, wall, SOILS["clay"])
    for wall in (0.0, 3.0):
        Footprint(0.5, 0.5, wall, SOILS["clay"])
    for depth in (0.04, 50.5):
        with pytest.raises(ThermalInputError, match="depth of the basement"):
            basement(HOUSE, 0.5, 1.0, depth)
    basement(HOUSE, 0.5, 1.0, 50.0)
    better = replace(slab_on_ground(HOUSE, 1.0), resistance=20.0)
    with pytest.raises(ThermalInputError, match="insulates better than U says"):
        better.layers((CONCRETE,))


def test_thin_ground_leaves_a_tenth_to_the_virtual_layer():
    """Where half a metre of soil resists more than U says: nine tenths of it are soil."""
    element = replace(slab_on_ground(HOUSE, 1.0), u_value=1 / (0.17 + 1.0 + 0.2))
    virtual, soil, _ = element.layers((CONCRETE,))
    assert (virtual.resistance, soil.resistance) == pytest.approx((0.02, 0.18))
    assert soil.thickness == pytest.approx(0.18 * 1.5) and virtual.density == 0.0


def test_cellar_by_its_printed_swing():
    """ISO 13370, H.8: ground by 2 - exp(-z/delta), outdoors by walls and air, over all of them."""
    k, z, reach = 1.5, 2.0, np.sqrt(3.15e7 * 1.5 / (np.pi * 3.0e6))
    own, air = 1 / (2 * 0.17 + 1.0), 0.33 * 0.3 * 100 * 2.5
    outdoors = 0.5 * 40 * 1.5 + air
    d = 0.3 + k * (0.17 + 0.6 + 0.04)
    ground = 0.37 * 40 * k * (2 - np.exp(-z / reach)) * np.log(reach / d + 1)
    whole = (100 + z * 40) * k / reach + outdoors + 100 * own
    cellar = over_unheated_basement(HOUSE, 1.0, depth=z, height=0.5, wall_u=1.5, floor_resistance=0.6)
    assert cellar.swing == pytest.approx(own * (ground + outdoors) / whole)
    assert (cellar.lag, cellar.resistance, cellar.r_si, cellar.soil) == (1.0, 1.0, 0.17, None)


def test_slab_as_thick_as_its_dimension_is_an_insulated_one():
    """(4) holds below B' = 5 m, (5) from it on."""
    for thickness, u in (
        (4.999, 2 * 1.5 / (np.pi * 5 + 4.999) * np.log(np.pi * 5 / 4.999 + 1)),
        (5.0, 1.5 / (0.457 * 5 + 5.0)),
    ):
        assert slab_u(HOUSE, thickness) == pytest.approx(u, rel=1e-12)


def test_harmonic_of_a_cosine():
    hours = np.arange(0.5, YEAR)
    outdoor = 9.0 - 11.0 * np.cos(2 * np.pi * (hours - 700.0) / YEAR)
    assert harmonic(outdoor, hours) == pytest.approx((9.0, 11.0, 700.0))
    warm = 9.0 + 11.0 * np.cos(2 * np.pi * (hours - 700.0) / YEAR)
    assert harmonic(warm, hours)[2] == pytest.approx(700.0 + YEAR / 2)
