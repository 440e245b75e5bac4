"""Open doorways in honeybee and gbXML files: air that two rooms share."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest

import tests.bim.test_read_gbxml as drawn
from bim.doorways import panes_between, source_rooms, touching, wall_depth
from bim.gbxml.building import read_gbxml
from bim.gbxml.write import SCHEMA, write_gbxml
from bim.honeybee.building import read_honeybee
from bim.honeybee.write import write_honeybee
from bim.shell import open_edges
from tests.bim import honeybee_models
from tests.bim.small_ifc import DEPTH, HEIGHT, WIDTH
from tests.bim.test_passages import DOORWAY, SOUTH, partition, read, two_rooms
from tests.issues import of_code

THICK = 0.2
FORMATS = {"hbjson": (write_honeybee, read_honeybee), "gbxml": (write_gbxml, read_gbxml)}


def open_rooms(tmp_path, thick: float):
    """Rooms that a doorway of 2.1 m2 through a wall so thick joins, or 1.1 m of no wall."""
    small = two_rooms(thick=thick)
    if thick:
        partition(small, SOUTH, thick, DOORWAY)
    else:
        small.box("IfcWall", "half", (0, SOUTH - 0.1, 0), (WIDTH - 1.1, 0.2, HEIGHT))
    return read(small, tmp_path)


@pytest.mark.parametrize("thick", [THICK, 0.0])
def test_the_way_through_a_wall_belongs_to_the_first_room(tmp_path, thick):
    building = open_rooms(tmp_path, thick)
    moved, sides = touching(building)
    assert len(sides) == 2 and all(sides[other] == key for key, other in sides.items())
    ((_, ((face, back),)),) = panes_between(moved.spaces, moved.spaces[0]).items()
    assert face.area == pytest.approx(2.1 if thick else 1.1 * HEIGHT)
    assert face.triangles.mean(axis=(0, 1)) == pytest.approx(back.triangles.mean(axis=(0, 1)))
    reveals = [f for f in moved.spaces[0].faces if f.name.startswith(f"{face.name} reveal")]
    assert sum(f.area for f in reveals) == pytest.approx(thick * 2 * (1.0 + 2.1))
    assert all(open_edges(space.shell) == 0 for space in moved.spaces)


@pytest.mark.parametrize("thick", [THICK, 0.0])
@pytest.mark.parametrize("suffix", FORMATS)
def test_an_open_doorway_comes_back_as_air(tmp_path, suffix, thick):
    """Read again the rooms are closed, say that they are open, and can be joined."""
    building = open_rooms(tmp_path, thick)
    write, read_again = FORMATS[suffix]
    path = tmp_path / f"rooms.{suffix}"
    write(building, path)
    found = read_again(path)
    assert not any(open_edges(space.shell) for space in found.spaces)
    volumes = [WIDTH * SOUTH * HEIGHT, WIDTH * (DEPTH - SOUTH - thick) * HEIGHT]
    volumes[0] += 2.1 * thick
    assert [s.room_volume for s in found.spaces] == pytest.approx(volumes, rel=0.02)  # + recess
    area = 2.1 if thick else 1.1 * HEIGHT
    said = [issue.values["area"] for issue in of_code(found, "room-boundary-open")]
    assert said == pytest.approx([area, area], abs=0.05)
    (one,) = read_again(path, join=["lit + dark"]).spaces
    assert one.volume == pytest.approx(sum(s.volume for s in found.spaces), rel=1e-6)
    assert open_edges(one.shell) == 0


def test_honeybee_air_boundaries_name_each_other(tmp_path):
    write_honeybee(open_rooms(tmp_path, THICK), tmp_path / "a.hbjson")
    rooms = json.loads((tmp_path / "a.hbjson").read_text())["rooms"]
    air = {
        face["identifier"]: (room["identifier"], face["boundary_condition"])
        for room in rooms
        for face in room["faces"]
        if face["face_type"] == "AirBoundary"
    }
    assert len(air) == 2
    for own, (_, condition) in air.items():
        other, room = condition["boundary_condition_objects"]
        assert condition["type"] == "Surface" and other != own and air[other][0] == room


def test_gbxml_air_is_one_surface_of_two_spaces(tmp_path):
    write_gbxml(open_rooms(tmp_path, THICK), tmp_path / "a.gbxml")
    root = ElementTree.parse(tmp_path / "a.gbxml").getroot()
    (air,) = root.findall(f".//{{{SCHEMA}}}Surface[@surfaceType='Air']")
    spaces = [one.get("spaceIdRef") for one in air.findall(f"{{{SCHEMA}}}AdjacentSpaceId")]
    assert spaces == ["space-0", "space-1"]


def _glass_between(folder, suffix, *, one_sided: bool = False):
    """Two rooms with 2 m2 of glass between them, in the file of a format."""
    path = folder / f"glass.{suffix}"
    if suffix == "gbxml":
        named = 'openingType="FixedWindow" windowTypeIdRef="unit"'
        path.write_text(drawn.two_rooms().replace('openingType="NonSlidingDoor"', named))
        return read_gbxml(path)
    model = honeybee_models.two_rooms()
    ring = [[5.0, 4.0, 1.0], [5.0, 6.0, 1.0], [5.0, 6.0, 2.0], [5.0, 4.0, 2.0]]
    sides = {"here": (0, 1, ring, "there"), "there": (1, 3, ring[::-1], "here")}
    for name, (room, face, corners, other) in sides.items():
        behind = {"type": "Surface", "boundary_condition_objects": [other, "face", "room"]}
        pane = honeybee_models.opening(name, corners, boundary_condition=behind)
        pane["properties"]["energy"]["construction"] = "Glazing"
        if name == "here" or not one_sided:
            model["rooms"][room]["faces"][face]["apertures"] = [pane]
    path.write_text(json.dumps(model))
    return read_honeybee(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_glass_between_rooms_is_one_pane_of_both(tmp_path, suffix):
    building = _glass_between(tmp_path, suffix)
    office, hall = building.spaces
    ((other, ((face, back),)),) = panes_between(building.spaces, office).items()
    assert other == hall.guid and wall_depth(face, back) == pytest.approx(0.0, abs=1e-9)
    assert face.pane.visible_transmittance == back.pane.visible_transmittance == 0.7
    assert face.pane.area == pytest.approx(2.0) and face.pane.normal == pytest.approx([1, 0, 0])
    (issue,) = of_code(building, "glass-between-rooms")
    assert issue.values["rooms"] == ("Hall", "Office")
    (source,) = source_rooms(building, replace(hall, windows=()))
    assert source.guid == office.guid


def test_glass_that_one_room_alone_has_is_named(tmp_path):
    building = _glass_between(tmp_path, "hbjson", one_sided=True)
    assert not panes_between(building.spaces, building.spaces[0])
    (issue,) = of_code(building, "glass-on-one-side")
    assert issue.where == "here"
