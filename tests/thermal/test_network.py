"""Longwave and films: closed forms, symmetry, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import CONCRETE, INSULATION, box, climate
from tests.validation.room_exchange import absorbed_after_reflections, area_view_factors, spread_evenly, window_share
from thermal.balance import BalanceOptions, simulate
from thermal.blackbox import Fenestration, LayerResistance
from thermal.climate import no_sun
from thermal.convection import doe2_outside, iso15099_inside, local_wind_factor, tarp_inside
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError
from thermal.network import (
    OUTDOOR,
    PARTITION,
    PARTNER,
    closed_exchange,
    exchange_from_view_factors,
    exchange_star,
    frame_surface,
    framed,
    known_surfaces,
    named_faces,
    network,
    outside_factors,
    window_mix,
)
from thermal.zone import OpaqueSurface, WindowElement, Zone

OPTIONS = BalanceOptions(warm_tolerance=1e-9, warm_days=2000, tolerance=1e-9, iterations=20)


def test_parallel_plates_exchange_by_the_closed_form():
    x = exchange_from_view_factors([2.0, 2.0], [0.9, 0.3], [[0.0, 1.0], [1.0, 0.0]])
    assert x[0, 1] == pytest.approx(2.0 / (1 / 0.9 + 1 / 0.3 - 1))
    assert x[0, 1] == pytest.approx(x[1, 0])


def test_exchange_is_symmetric_and_sums_to_area_times_emissivity():
    rng = np.random.default_rng(1)
    area, eps = rng.uniform(1, 20, 7), rng.uniform(0.1, 1.0, 7)
    f = rng.uniform(0.5, 1.5, (7, 7)) * area
    f /= f.sum(axis=1, keepdims=True)
    x = exchange_from_view_factors(area, eps, f)
    np.testing.assert_allclose(x, x.T, atol=1e-9)
    np.testing.assert_allclose(x.sum(axis=1), area * eps, rtol=1e-6)


def test_star_agrees_with_view_factors_in_a_cube():
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    area, eps = np.full(6, 9.0), np.full(6, 0.9)
    star = exchange_star(area, eps)
    exact = exchange_from_view_factors(area, eps, area_view_factors(area, normals))
    off = ~np.eye(6, dtype=bool)
    # the star lets a face "see" itself, so its other exchanges carry the same total in a cube
    np.testing.assert_allclose(star[off].sum(), exact[off].sum(), rtol=0.02)


def test_hemisphere_shares_sum_to_one():
    for z in (-1.0, 0.0, 0.5, 1.0):
        assert sum(outside_factors(z)) == pytest.approx(1.0)
    sky, air, ground = outside_factors(0.0)
    assert (sky, air, ground) == pytest.approx((0.5**1.5, 0.5 - 0.5**1.5, 0.5))


def test_what_hides_the_sky_counts_with_the_ground():
    sky, air, below = outside_factors(0.0, 0.6)
    assert (sky, air) == pytest.approx((0.6 * 0.5**1.5, 0.6 * (0.5 - 0.5**1.5)))
    assert sky + air + below == pytest.approx(1.0)
    assert outside_factors(1.0, 0.25) == pytest.approx((0.25, 0.0, 0.75))
    assert outside_factors(-1.0, 0.25) == pytest.approx((0.0, 0.0, 1.0))


def test_films_know_up_and_down():
    # EQUATIONS.md 5.1: 1.520 unstable, 0.760 stable, 1.31 vertical
    assert tarp_inside(21.0, 20.0, -1.0) == pytest.approx(1.520, abs=1e-3)
    assert tarp_inside(19.0, 20.0, -1.0) == pytest.approx(0.760, abs=1e-3)
    assert tarp_inside(19.0, 20.0, 1.0) == pytest.approx(1.520, abs=1e-3)
    assert tarp_inside(28.0, 20.0, 0.0) == pytest.approx(2.62)
    assert tarp_inside(20.0, 20.0, 0.0) == 0.1


def test_outside_film_is_natural_in_still_air_and_rough_walls_cool_more():
    still = doe2_outside(30.0, 22.0, 0.0, 0.0, 1.52)
    assert still == pytest.approx(2.62)
    smooth, rough = (doe2_outside(30.0, 22.0, 0.0, 8.0, r) for r in (1.0, 2.17))
    assert smooth == pytest.approx(np.hypot(2.62, 8.0))
    assert rough > smooth


def test_wind_profile():
    # EQUATIONS.md section 4: V_met (270/10)^.14 (z/370)^.22 in suburbs
    assert local_wind_factor(10.0, "suburbs") == pytest.approx(27**0.14 * (10 / 370) ** 0.22)
    assert local_wind_factor(10.0, "country") == pytest.approx(1.0)
    with pytest.raises(ValueError, match="terrain"):
        local_wind_factor(10.0, "sea")


def test_glass_film_near_the_plane_wall():
    # by hand at 290.65 K: Ra = 9.81 * 10 * 1.5^3 / (290.65 * 1.49e-5 * 2.10e-5) = 3.64e9, laminar,
    # Nu = 0.56 Ra^(1/4) = 137.6, h = 137.6 * 0.0254 / 1.5; property tables agree to 2 %
    assert iso15099_inside(10.0, 20.0, 1.5, 101325.0) == pytest.approx(2.33, rel=0.02)


def test_glass_film_is_weaker_in_thin_air():
    """Laminar: Nu as the fourth root of Ra, which goes with the square of the density."""
    sea, mountain = (iso15099_inside(15.0, 20.0, 1.5, pressure) for pressure in (101325.0, 81060.0))
    assert mountain == pytest.approx(sea * 0.8**0.5, rel=1e-9)


def test_room_light_is_conserved():
    rng = np.random.default_rng(5)
    area = rng.uniform(2, 20, 6)
    rho = rng.uniform(0.1, 0.8, 6)
    hit = rng.uniform(0, 100, (4, 6))
    exchange = np.tile(area / area.sum(), (6, 1))
    kept = absorbed_after_reflections(hit, rho, exchange)
    np.testing.assert_allclose(kept.sum(axis=1), hit.sum(axis=1))
    # with view factors by area the series is EnergyPlus' uniform spread exactly
    np.testing.assert_allclose(kept, spread_evenly(hit, rho, area), rtol=1e-9)


def test_view_factors_by_area_leave_out_what_faces_the_same_way():
    """Of three faces the second is 9 degrees off the first, then 11: by cos 10 degrees apart."""
    for degrees, first in ((9.0, [0, 0, 1]), (11.0, [0, 2 / 5, 3 / 5])):
        normals = [[1, 0, 0], [*np.cos(np.radians([degrees, 90 - degrees])), 0], [-1, 0, 0]]
        np.testing.assert_allclose(area_view_factors([1.0, 2.0, 3.0], normals)[0], first)
    small = area_view_factors([0.1, 0.2, 0.3], np.diag([1, -1, 1]) + np.diag([0, 0], 1))
    np.testing.assert_allclose(small.sum(axis=1), 1.0)
    with pytest.raises(ThermalInputError, match="sees no other"):
        area_view_factors([1.0, 1.0], [[1, 0, 0], [1, 0, 0]])


def test_star_of_two_faces_is_that_of_parallel_plates():
    """Carroll's F close two equal faces: A/(1/eps_1 + 1/eps_2 + 1/F_1 + 1/F_2 - 2), F = 2."""
    x = exchange_star([3.0, 3.0], [0.9, 0.3])
    assert x[0, 1] == pytest.approx(3.0 / (1 / 0.9 + 1 / 0.3 - 1), rel=1e-6)
    np.testing.assert_allclose(exchange_star([1.0, 1, 1], [1.0, 1, 0.0])[2], 0.0, atol=1e-5)
    cube = exchange_star(np.full(6, 2.0), np.full(6, 1.0))  # F = 1.2: A F / 6 to each, itself too
    np.testing.assert_allclose(cube, 2.0 * 1.2 / 6, rtol=1e-6)


def test_exchange_areas_are_closed_though_the_factors_are_noisy():
    areas = np.array([1.0, 2.0, 4.0])
    noisy = np.array([[0.0, 0.4, 0.7], [0.3, 0.0, 1.6], [0.6, 1.7, 1.9]])
    closed = closed_exchange(noisy, areas)
    np.testing.assert_allclose(closed.sum(axis=1), areas, rtol=1e-9)
    np.testing.assert_allclose(closed, closed.T, rtol=1e-12)
    for wrong, words in (
        (np.ones((2, 3)) / 3, r"expected \[2, 2\]"),
        ([[1.1, -0.1], [0.0, 1.0]], "negative"),
        ([[0.0, 0.89], [1.0, 0.0]], "rows sum to"),
    ):
        with pytest.raises(ThermalInputError, match=words):
            exchange_from_view_factors([1.0, 1.0], [0.9, 0.9], wrong)
    exchange_from_view_factors([1.0, 1.0], [0.9, 0.9], [[0.0, 0.91], [1.0, 0.0]])


def test_sun_in_a_room_of_two_faces_by_hand():
    """50 W on the first of two faces that see each other: series of r = 0.5 * 0.2."""
    kept = absorbed_after_reflections([[50.0, 0.0]], [0.5, 0.2], [[0.0, 1.0], [1.0, 0.0]])
    np.testing.assert_allclose(kept, [[25.0 / 0.9, 25.0 * 0.8 / 0.9]])
    # spread: 25 W reflected, by 1 m2 * 0.5 and 2 m2 * 0.8
    even = spread_evenly([[50.0, 0.0]], [0.5, 0.2], [1.0, 2.0])
    np.testing.assert_allclose(even, [[25 + 25 * 0.5 / 2.1, 25 * 1.6 / 2.1]])
    for hit, rho, f, words in (
        ([[1.0]], [0.5, 0.2], np.eye(2), "first hit: expected"),
        ([[1.0, 1.0]], [0.5, 0.2], np.eye(3), "view factors: expected"),
        ([[1.0, 1.0]], [0.5, 1.0], np.eye(2), "reflectance"),
        ([[1.0, 1.0]], [0.5, -0.1], np.eye(2), "reflectance"),
    ):
        with pytest.raises(ThermalInputError, match=words):
            absorbed_after_reflections(hit, rho, f)
    absorbed_after_reflections([[1.0, 1.0]], [0.0, 0.5], np.eye(2))


def test_the_windows_share_by_hand():
    # 8 W not reflected, of 1 - 0.2: the inner layer keeps 0.3 of 0.8
    assert window_share([8.0], 0.5, 0.3, 0.2) == pytest.approx(3.0)
    assert window_share(8.0, 0.5, 0.3 + 5e-7, 0.2) == pytest.approx(3.0, rel=1e-5)
    with pytest.raises(ThermalInputError, match="exceed 1 - reflectance"):
        window_share([8.0], 0.5, 0.3 + 2e-6, 0.2)
    with pytest.raises(ThermalInputError, match="reflects all light"):
        window_share([8.0], 0.0, 0.0, 1.0)


def _two_windows() -> Zone:
    """An opaque wall of insulation outside and concrete inside, and two windows beside it."""
    south = np.array([0.0, -1.0, 0.0])
    glass = Fenestration("pane", 1.1)
    windows = tuple(WindowElement(name, 2.0, south, (glass,)) for name in ("left", "right"))
    wall = OpaqueSurface("wall", 10.0, (INSULATION, CONCRETE), south, emissivity_in=0.6)
    return Zone("room", 60.0, (wall,), windows)


def test_a_network_numbers_windows_and_shares_radiant_gains():
    zone = _two_windows()
    net = network(
        [zone], [window_mix(zone, None, 1)], step_s=600.0, terrain="suburbs", cell=0.02, link=np.zeros((1, 1))
    )
    assert net.faces.window.tolist() == [-1, 0, 1]
    weight = np.array([10.0 * 0.6, 2.0 * 0.84, 2.0 * 0.84])
    np.testing.assert_allclose(net.radiation.shares(0), [weight / weight.sum()])


def test_the_faces_of_a_wall_keep_their_sides():
    """Half of the outermost and of the innermost cell, 7 cells of insulation and 10 of concrete."""
    zone = _two_windows()
    net = network(
        [zone], [window_mix(zone, None, 1)], step_s=600.0, terrain="suburbs", cell=0.02, link=np.zeros((1, 1))
    )
    halves = [0.5 * one.thickness / n * one.density * one.heat_capacity for one, n in ((INSULATION, 7), (CONCRETE, 10))]
    assert net.faces.port[0, :2] * 600.0 == pytest.approx(halves)
    between = [one.conductivity * n / one.thickness for one, n in ((INSULATION, 7), (CONCRETE, 10))]
    assert net.faces.port[0, 2:4] == pytest.approx(between)


@pytest.mark.parametrize("emissivity", [(0.001, 0.5), (0.0, 0.0)])
def test_radiant_gains_go_by_area_and_emissivity_or_by_area_alone(emissivity):
    """By A eps; where no face takes any longwave, by A."""
    south = np.array([0.0, -1.0, 0.0])
    walls = tuple(
        OpaqueSurface(str(area), area, (CONCRETE,), sign * south, "adiabatic", emissivity_in=eps)
        for area, sign, eps in zip((10.0, 30.0), (1, -1), emissivity, strict=True)
    )
    zone = Zone("room", 60.0, walls)
    net = network(
        [zone], [window_mix(zone, None, 1)], step_s=600.0, terrain="suburbs", cell=0.02, link=np.zeros((1, 1))
    )
    weight = np.array([10.0, 30.0]) * (emissivity if any(emissivity) else 1.0)
    np.testing.assert_allclose(net.radiation.shares(0)[0], weight / weight.sum(), rtol=1e-9)


def test_star_of_a_face_larger_than_all_others():
    """Its F has no bound: the small face sees it alone, to 0.1 %."""
    x = exchange_star([30.0, 2.0], [0.9, 0.4])
    exact = 1 / (0.1 / (0.9 * 30.0) + 1 / 2.0 + 0.6 / (0.4 * 2.0))
    assert x[0, 1] == pytest.approx(exact, rel=1e-3)


def test_a_frame_is_massless_and_has_its_u():
    window = WindowElement(
        "w", 2.0, np.array([0.0, -1.0, 0.0]), _two_windows().windows[0].states, frame_area=0.4, frame_u=1.6
    )
    (layer,) = frame_surface(window).layers
    assert layer.thickness / layer.conductivity == pytest.approx(1 / 1.6 - 0.17)
    assert layer.density * layer.heat_capacity == 0.0


def test_closed_exchange_areas_sum_to_the_areas():
    rng = np.random.default_rng(3)
    area = rng.uniform(0.01, 200.0, 9)
    closed = closed_exchange(rng.uniform(0.2, 2.0, (9, 9)) * area, area)
    np.testing.assert_allclose(closed.sum(axis=1), area, rtol=1e-7)


def _partitioned(partner: str = "there", back: str = "here", behind: str = "one") -> list[Zone]:
    """Two zones with a wall between them, drawn from either side."""
    east, outside = np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    here = OpaqueSurface("here", 12.0, (CONCRETE,), east, "other", partner=partner)
    there = OpaqueSurface("there", 12.0, (CONCRETE,), -east, behind, partner=back)
    facades = [OpaqueSurface(f"facade {k}", 8.0, (CONCRETE,), outside) for k in range(2)]
    return [Zone("one", 60.0, (facades[0], here)), Zone("other", 60.0, (there, facades[1]))]


def _network(zones: list[Zone]):
    mixes = [window_mix(zone, None, 1) for zone in zones]
    return network(zones, mixes, step_s=600.0, terrain="suburbs", cell=0.02, link=np.zeros((len(zones),) * 2))


def test_a_wall_between_zones_is_stored_by_its_first_side():
    faces = _network(_partitioned()).faces
    assert faces.kind.tolist() == [OUTDOOR, PARTITION, PARTNER, OUTDOOR]
    assert faces.partner.tolist() == [-1, 2, 1, -1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"back": "facade 0"}, "does not name it back"),
        ({"behind": "other"}, "does not name it back"),
        ({"behind": "outdoor"}, "does not name it back"),
        ({"partner": "nothing"}, "has no surface 'nothing'"),
    ],
)
def test_a_wall_between_zones_names_its_other_side_and_is_named_back(changes, message):
    with pytest.raises(ThermalInputError, match=message):
        _network(_partitioned(**changes))


def test_temperatures_beyond_faces_are_numbered_by_the_faces_that_have_them():
    """0 is the ground's; facades and the ground have none of their own."""
    up, hours = np.array([0.0, 0.0, 1.0]), np.zeros(2)
    kinds = ["outdoor", "known", "ground", "known", "adiabatic"]
    walls = tuple(
        OpaqueSurface(str(k), 5.0, (CONCRETE,), up, one, beyond_c=hours if one == "known" else None)
        for k, one in enumerate(kinds)
    )
    zone = Zone("room", 60.0, walls, _two_windows().windows)
    assert _network([zone]).faces.beyond.tolist() == [0, 1, 0, 2, 0, 0, 0]
    assert [one.name for one in known_surfaces([*walls, *zone.windows])] == ["1", "3"]


def _framed_zones() -> list[Zone]:
    """A zone of one wall and two windows, the first with a frame, and a zone of two walls."""
    first = _two_windows()
    windows = (replace(first.windows[0], frame_area=0.4), first.windows[1])
    return [replace(first, windows=windows), _partitioned()[0]]


def test_faces_are_numbered_zone_by_zone_walls_windows_frames():
    zones = _framed_zones()
    assert named_faces(zones, [zones[0].surfaces[0].name, "facade 0"]) == [0, 4]
    assert named_faces(zones, ["", "here"]) == [-1, 5]
    assert [window.name for window in framed(zones[0])] == ["left"]


def test_each_zone_has_its_own_shares_of_radiant_gains():
    """By area and emissivity: the second zone has walls of 8 and 12 m2."""
    alone = replace(_partitioned()[0], name="alone")
    walls = tuple(replace(s, outside="adiabatic", partner=None) for s in alone.surfaces)
    zones = [_two_windows(), replace(alone, surfaces=walls), replace(_two_windows(), name="third")]
    net = _network(zones)
    weights = ([10.0 * 0.6, 2.0 * 0.84, 2.0 * 0.84], [8.0, 12.0], [10.0 * 0.6, 2.0 * 0.84, 2.0 * 0.84])
    for z, weight in enumerate(weights):
        np.testing.assert_allclose(net.radiation.shares(z), [np.array(weight) / sum(weight)])
    assert net.radiation.first_face.tolist() == [0, 3, 5, 8]


def _shaded_windows() -> Zone:
    south = np.array([0.0, -1.0, 0.0])
    states = tuple(
        Fenestration(name, 1.1, emissivity_in=inner, emissivity_out=outer)
        for name, inner, outer in (("pane", 0.84, 0.8), ("shade", 0.3, 0.7))
    )
    left, right = (WindowElement(name, 2.0, south, s) for name, s in (("left", states), ("right", states[:1])))
    return replace(_two_windows(), windows=(left, right))


def test_windows_have_a_mix_of_emissivities_for_each_state():
    zone = _shaded_windows()
    mix = window_mix(zone, np.array([[0, 0], [1, 0], [0, 0]]), 3)
    found = [mix.emissivity[k].tolist() for k in mix.of_hour]
    assert found == [[0.84, 0.84], [0.3, 0.84], [0.84, 0.84]] and len(mix.emissivity) == 2
    same = window_mix(zone, np.array([[1, 0], [1, 0]]), 2)
    assert same.emissivity.tolist() == [[0.3, 0.84]] and same.of_hour.tolist() == [0, 0]
    bare = window_mix(replace(zone, windows=()), None, 2)
    assert bare.emissivity.shape == (1, 0) and bare.of_hour.tolist() == [0, 0]
    with pytest.raises(ThermalInputError, match="a state that no window has"):
        window_mix(zone, np.array([[0, 1]]), 1)


def test_a_window_of_fewer_states_keeps_its_last():
    zone = _shaded_windows()
    net = _network([zone])
    np.testing.assert_allclose(net.glass.emissivity_out, [[0.8, 0.7], [0.8, 0.8]])


def test_a_resistance_is_the_same_in_every_form():
    """0.6 m2 K/W as a constant, a line, a surface and a table: the room's steady load is that of all."""
    films, constant = 0.04 + 0.13, 0.6
    forms = {
        "constant": (constant,),
        "linear U": (1 / (constant + films), 0.0, films),
        "surface": (1 / constant, 0.0, 0.0, 0.0, 0.0, 0.0),
        "table": (-20.0, 30.0, 2.0, 0.0, 30.0, 2.0, *(1 / constant,) * 4),
    }
    loads = []
    for kind, coefficients in forms.items():
        glass = Fenestration("pane", 1 / (constant + films), resistance=LayerResistance(kind, coefficients))
        room = box(window=glass, outside="adiabatic", infiltration_ach=0.0, loads=IdealLoads(20.0, 20.0))
        result = simulate(room, climate(24, outdoor=2.0), no_sun(24, 6, 1), options=OPTIONS)
        loads.append(float((result.heating - result.cooling)[-1]))
    glass, wall = 4.5 / (constant + films), 7.5 / (films + INSULATION.resistance + CONCRETE.resistance)
    assert loads[0] == pytest.approx((glass + wall) * 18.0, rel=0.25)  # films are those of the weather
    np.testing.assert_allclose(loads, loads[0], rtol=1e-9)
