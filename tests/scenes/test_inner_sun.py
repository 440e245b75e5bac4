"""Sun through glass between rooms: absorbed in the room beyond, in the balance of both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.room.zone import RoomAlternatives, coupled, inner_sun_note
from tests.scenes.small_box import SMALL
from tests.validation.inner_sun import REFLECTANCE, two_rooms
from thermal.control import RoomCondition


@pytest.fixture(scope="module")
def zones():
    """The lit room and the dark one behind it, each alone and balanced with the other."""
    weather = read_epw(WEATHER)
    skies = skies_for(weather, SMALL.sampling)
    building = two_rooms(REFLECTANCE)
    front = building.spaces[0]
    systems = in_all_windows(front, read_system(VENETIAN_BLIND))
    guids = [space.guid for space in building.spaces]
    return {
        among: [
            operated_zone(room_inputs(building, space, systems, weather, SMALL, skies=skies, together=among))
            for space in building.spaces
        ]
        for among in ((), tuple(guids))
    }


def test_what_the_pane_lets_through_is_absorbed_behind_it(variant, zones) -> None:
    (alone, _), (front, rear) = zones.values()
    assert alone.sun_beyond == {} and inner_sun_note([alone], 1.0) == ()
    panes = [i for i, face in enumerate(front.space.faces) if face.pane is not None]
    at_pane = sum(front.sun_beyond[front.space.guid, i].sum() for i in panes)
    passed = sum(v.sum() for (guid, _), v in front.sun_beyond.items() if guid == rear.space.guid)
    assert 0 < at_pane < 0.3 * passed
    # what the pane absorbed as an opaque wall now goes on, and some of it returns
    before, after = alone.solar.inside.sum(), front.solar.inside.sum()
    assert before - after == pytest.approx(at_pane + passed, rel=0.03)
    (note,) = inner_sun_note([front, rear], 1.0)
    assert "kWh in the year" in note
    warm = (RoomCondition(23.0, 22.5),)
    by_temperature = RoomAlternatives(warm, warm, (front, front))
    _, more = inner_sun_note([replace(front, alternatives=by_temperature), rear], 1.0)
    assert more.startswith(note.split("rooms: ")[1].split(" kWh")[0])  # all of it
    assert more.endswith(f"the temperature of {front.space.label} moves it.")


def test_the_balance_has_the_sun_of_the_other_room(variant, zones) -> None:
    front, rear = list(zones.values())[1]
    together, _, _ = coupled([front, rear], 0.0)
    gained = together[1].solar.inside.sum(axis=1) - rear.solar.inside.sum(axis=1)
    guid = rear.space.guid
    expected = sum(v for (room, _), v in front.sun_beyond.items() if room == guid)
    np.testing.assert_allclose(gained, expected)
    floor = next(i for i, face in enumerate(rear.space.faces) if face.kind == "floor")
    surface = rear.room.surface_of_face[floor]
    assert together[1].solar.inside[:, surface].sum() > 0.2 * gained.sum()
    assert rear.solar.inside.sum() == 0.0  # the room itself has no window


def test_a_doorway_lets_all_of_it_through(variant, zones) -> None:
    weather, front = read_epw(WEATHER), list(zones.values())[1][0]
    building = two_rooms(REFLECTANCE)
    spaces = [
        replace(
            space,
            faces=tuple(f if f.pane is None else replace(f, pane=replace(f.pane, is_open=True)) for f in space.faces),
        )
        for space in building.spaces
    ]
    building = replace(building, spaces=tuple(spaces))
    systems = in_all_windows(spaces[0], read_system(VENETIAN_BLIND))
    room = room_inputs(building, spaces[0], systems, weather, SMALL, together=[s.guid for s in spaces])
    opened = operated_zone(room)
    panes = [i for i, face in enumerate(spaces[0].faces) if face.pane is not None]
    assert all(not opened.sun_beyond[spaces[0].guid, i].any() for i in panes)
    passed = [
        sum(v.sum() for (guid, _), v in zone.sun_beyond.items() if guid == spaces[1].guid) for zone in (front, opened)
    ]
    assert passed[1] == pytest.approx(passed[0] / 0.75, rel=0.12)  # diffuse transmittance of glass
