"""Rooms of a zone with one air: what adds up, and the limit of rooms that exchange much air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from scenes.heat.air_nodes import with_air_nodes
from scenes.room.zone import RoomAlternatives, balances, coupled
from tests.scenes.test_coupled_heat import lit, two_boxes
from thermal.control import RoomCondition, by_threshold

TABLES = {
    "loads": {"heating_c": 22.0, "cooling_c": 25.0},
    "gains": {"equipment_w_m2": 5.0},
    "air": {"infiltration_ach": 0.3},
}


def _rooms(weather, skies, *, equal: bool):
    """Two boxes beside each other; the first one, too, has a wall outdoors if they are equal."""
    west, east = two_boxes()
    if equal:
        faces = tuple(
            replace(face, adjacency="outside") if round(face.normal[0], 3) == -1.0 else face for face in west.faces
        )
        west = replace(west, faces=faces)
    rooms = [lit(space, TABLES, weather, skies).zone for space in (west, east)]
    areas = [np.array([s.area for s in room.zone.surfaces]) for room in rooms]
    seen = [np.tile(area / area.sum(), (len(area), 1)) for area in areas]
    rooms = [room.with_view_factors(f) for room, f in zip(rooms, seen, strict=True)]
    return coupled(rooms, 0.0)[:2]


def _one(rooms, links):
    (one,), between, zone_of = with_air_nodes(rooms, links, {"w": "Dwelling", "e": "Dwelling"})
    assert between.shape == (1, 1) and between[0, 0] == 0.0
    assert set(zone_of.values()) == {"Dwelling"}
    return one


def test_equal_rooms_as_one_are_their_sum(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=True)
    apart = balances(rooms, weather, 3600.0)
    (together,) = balances([_one(rooms, links)], weather, 3600.0)
    # the walls outdoors face west and east: their sun differs, so that the rooms are near equal
    assert together.heating.sum() == pytest.approx(sum(r.heating.sum() for r in apart), rel=0.01)
    assert together.air_c == pytest.approx(np.mean([r.air_c for r in apart], axis=0), abs=0.4)


def test_one_air_is_the_limit_of_rooms_that_exchange_much_air(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=False)
    (together,) = balances([_one(rooms, links)], weather, 3600.0)
    apart = {}
    for flow in (0.0, 20.0):
        mixed = np.array([[0.0, flow], [flow, 0.0]])
        apart[flow] = balances(rooms, weather, 3600.0, air_links=mixed)
    sums = {flow: sum(r.heating.sum() for r in found) for flow, found in apart.items()}
    assert together.heating.sum() == pytest.approx(sums[20.0], rel=0.003)
    assert together.air_c == pytest.approx(apart[20.0][0].air_c, abs=0.05)
    assert np.abs(apart[0.0][0].air_c - apart[0.0][1].air_c).max() > 0.5  # apart they differ


def test_what_acts_on_the_air_adds_up(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=False)
    one, zones = _one(rooms, links), [room.zone for room in rooms]
    assert one.zone.volume == sum(zone.volume for zone in zones)
    assert one.space.floor_area == sum(room.space.floor_area for room in rooms)
    assert np.allclose(one.zone.infiltration_ach, 0.3)
    assert np.allclose(one.zone.gains.radiant, sum(zone.gains.radiant for zone in zones))
    shared = [s for s in one.zone.surfaces if s.partner]
    assert [s.outside for s in shared] == ["Dwelling"] * 2
    assert {s.partner for s in shared} == {s.name for s in shared}
    assert one.solar.inside.shape[1] == len(one.zone.surfaces)


def test_a_room_beside_an_air_node_keeps_its_wall_to_it(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=False)
    links = np.array([[0.0, 0.1], [0.1, 0.0]])
    found, between, _ = with_air_nodes(rooms, links, {"w": "Dwelling"})
    assert [room.zone.name for room in found] == ["Dwelling", rooms[1].zone.name]
    np.testing.assert_array_equal(between, links)
    (wall,) = [s for s in found[1].zone.surfaces if s.partner]
    assert wall.outside == "Dwelling" and wall.partner in {s.name for s in found[0].zone.surfaces}
    balances(found, weather, 3600.0, air_links=between)


def _shaded(room, *conditions):
    """The room with an alternative for each combination: of the conditions met, half the sun."""
    dimmed = [
        replace(room, solar=replace(room.solar, facade=room.solar.facade * 0.5 ** n.bit_count()))
        for n in range(2 ** len(conditions))
    ]
    return replace(room, alternatives=RoomAlternatives(conditions, conditions, tuple(dimmed)))


def test_shading_by_temperature_follows_that_of_the_air_node(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=False)
    warm, hot = RoomCondition(23.0, 22.5), RoomCondition(24.0, 23.0)
    one = _one([_shaded(rooms[0], warm, hot), _shaded(rooms[1], hot)], links)
    (result,) = balances([one], weather, 3600.0)
    air = result.air_c[:-1]
    met = [by_threshold(air, c.above, c.below) for c in (warm, hot)]
    np.testing.assert_array_equal(result.alternative[25:], (met[0] + 2 * met[1])[24:])
    assert 0 < met[1].sum() < met[0].sum()
    chosen = one.in_alternatives(result.alternative)
    (given,) = balances([chosen], weather, 3600.0)
    np.testing.assert_allclose(given.air_c[48:], result.air_c[48:], atol=1e-3)
    walls = len(rooms[0].zone.surfaces)
    shares = (0.5 ** (met[0] + met[1]), 0.5 ** met[1])
    for room, share, here in zip(rooms, shares, (slice(walls), slice(walls, None)), strict=True):
        expected = room.solar.facade[25:] * share[24:, None]
        np.testing.assert_allclose(chosen.solar.facade[25:, here], expected, rtol=1e-6)


def test_more_conditions_in_an_air_node_than_can_be_computed_are_refused(variant, weather, skies) -> None:
    rooms, links = _rooms(weather, skies, equal=False)
    limits = [RoomCondition(float(t), float(t)) for t in range(22, 27)]
    message = "Dwelling have 32 combinations of states; at most 16"
    with pytest.raises(DataError, match=message):
        _one([_shaded(rooms[0], *limits[:3]), _shaded(rooms[1], *limits[3:])], links)
