"""What lies open between two rooms: doorways, and rooms that touch with nothing between them."""

from __future__ import annotations

import ifcopenshell.api.feature
import manifold3d
import numpy as np
import pytest
import shapely

from bim.ifc.building import read_ifc
from bim.isolated_solids import united
from bim.model import Building
from bim.planes import plane_through
from bim.report.issue import issue_text
from bim.solids import packed, unpacked
from tests.bim.small_ifc import DEPTH, HEIGHT, WIDTH, SmallIfc, box_model
from tests.issues import of_code, texts

SOUTH = 3.0  # depth of the room with the window [m]
DOORWAY = (1.5, 0.0, 1.0, 2.1)  # x, sill, width, height


def two_rooms(*, thick: float = 0.0) -> SmallIfc:
    """Rooms lit and dark of the box, so far apart, with nothing between yet; saved by `read`."""
    small, _ = box_model(space=False)
    small.box("IfcSpace", "lit", (0, 0, 0), (WIDTH, SOUTH, HEIGHT))
    north = SOUTH + thick
    small.box("IfcSpace", "dark", (0, north, 0), (WIDTH, DEPTH - north, HEIGHT))
    return small


def read(small: SmallIfc, path, **options) -> Building:
    small.model.write(str(path / "rooms.ifc"))
    return read_ifc(path / "rooms.ifc", **options)


def partition(small: SmallIfc, low: float, thick: float, *places: tuple, beyond: float = 0.1) -> None:
    """A wall across the box with openings that nothing fills, cut so far beyond it [m]."""
    wall = small.box("IfcWall", "partition", (0, low, 0), (WIDTH, thick, HEIGHT))
    for x, sill, width, height in places:
        size = (width, thick + 2 * beyond, height)
        opening = small.box("IfcOpeningElement", "doorway", (x, low - beyond, sill), size)
        ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)


def open_areas(building: Building, room: str) -> list[float]:
    faces = building.space(room).faces
    return sorted(face.area for face in faces if face.pane is not None and face.pane.is_open)


def test_a_doorway_is_a_face_of_both_rooms(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, DOORWAY)
    building = read(small, tmp_path)
    for room in ("lit", "dark"):
        assert open_areas(building, room) == pytest.approx([2.1], rel=1e-6)
    assert not any(f.pane for s in building.spaces for f in s.faces if f.adjacency != "space")
    assert building.account.inner_only == ()  # an opening is no glass


def test_a_doorway_cut_deeper_than_it_is_wide(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, DOORWAY, beyond=0.8)
    assert open_areas(read(small, tmp_path), "dark") == pytest.approx([2.1], rel=1e-6)


def test_each_of_two_doorways_is_open(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, (0.3, 0.0, 0.9, 2.0), (2.5, 1.0, 0.8, 0.5))
    assert open_areas(read(small, tmp_path), "dark") == pytest.approx([0.4, 1.8], rel=1e-6)


def test_what_stands_in_a_doorway_closes_it(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, DOORWAY)
    small.box("IfcColumn", "block", (1.4, SOUTH + 0.08, 0.0), (1.2, 0.04, 1.05))
    assert open_areas(read(small, tmp_path), "lit") == pytest.approx([1.05], rel=1e-6)


@pytest.mark.parametrize("virtual", [False, True])
def test_rooms_that_touch_are_open_where_nothing_stands(tmp_path, virtual):
    """They are drawn to the axis of a wall that ends 1.1 m before the other one."""
    small = two_rooms()
    small.box("IfcWall", "half", (0, SOUTH - 0.1, 0), (WIDTH - 1.1, 0.2, HEIGHT))
    if virtual:
        small.box("IfcVirtualElement", "line", (WIDTH - 1.1, SOUTH, 0), (1.1, 0.001, HEIGHT))
    building = read(small, tmp_path)
    for room in ("lit", "dark"):
        assert open_areas(building, room) == pytest.approx([1.1 * HEIGHT], rel=1e-6)


def test_rooms_drawn_to_the_axis_of_a_wall_are_not_open(tmp_path):
    small = two_rooms()
    partition(small, SOUTH - 0.15, 0.3)
    building = read(small, tmp_path)
    assert not open_areas(building, "lit") and not open_areas(building, "dark")


def test_rooms_drawn_to_the_axis_of_a_wall_are_open_at_its_doorway_once(tmp_path):
    small = two_rooms()
    partition(small, SOUTH - 0.15, 0.3, DOORWAY)
    building = read(small, tmp_path)
    assert open_areas(building, "dark") == pytest.approx([2.1], rel=1e-6)
    (said,) = of_code(building, "rooms-open-to-each-other")
    assert said.values["rooms"] == ("dark", "lit") and said.values["count"] == 1
    assert said.values["area"] == pytest.approx(2.1, abs=0.05)


def test_rooms_open_by_a_door_and_by_more_are_reported_once(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, (0.2, 0.0, 0.9, 2.0), (1.5, 0.0, 2.0, 2.5))
    building = read(small, tmp_path)
    assert open_areas(building, "dark") == pytest.approx([1.8, 5.0], rel=1e-6)
    (said,) = of_code(building, "rooms-open-to-each-other")
    assert said.values["rooms"] == ("dark", "lit") and said.values["count"] == 2
    assert said.values["area"] == pytest.approx(6.8, abs=0.05)
    assert "--join open joins all" in issue_text(said, "command").fix
    assert read(small, tmp_path, join=["open"]).space("dark").name == "lit + dark"


def test_a_void_in_a_slab_is_open(tmp_path):
    small, _ = box_model(space=False)
    small.box("IfcSpace", "below", (0, 0, 0), (WIDTH, DEPTH, 1.4))
    small.box("IfcSpace", "gallery", (0, 0, 1.6), (WIDTH, DEPTH, 1.4))
    slab = small.box("IfcSlab", "between", (0, 0, 1.4), (WIDTH, DEPTH, 0.2))
    hole = small.box("IfcOpeningElement", "void", (1.0, 1.0, 1.3), (1.2, 2.0, 0.4))
    ifcopenshell.api.feature.add_feature(small.model, feature=hole, element=slab)
    building = read(small, tmp_path)
    for room in ("below", "gallery"):
        assert open_areas(building, room) == pytest.approx([2.4], rel=1e-6)


def test_rooms_are_joined_where_they_open_by_more_than_a_door(tmp_path):
    """3.3 m2 of nothing; the doorway to the third room stays."""
    small = two_rooms()
    small.box("IfcWall", "half", (0, SOUTH - 0.1, 0), (WIDTH - 1.1, 0.2, HEIGHT))
    apart = read(small, tmp_path)
    assert "--join open joins all" in texts(apart)
    building = read(small, tmp_path, join=["open"])
    (room,) = building.spaces
    assert room.name == "lit + dark"
    assert room.room_volume == pytest.approx(WIDTH * DEPTH * HEIGHT, rel=1e-5)
    (said,) = of_code(building, "rooms-joined-by-size")
    assert said.values["rooms"] == ("lit", "dark") and said.values["limit"] == 3
    assert said.values["area"] == pytest.approx(3.3, abs=0.05)


def test_a_doorway_does_not_join(tmp_path):
    small = two_rooms(thick=0.2)
    partition(small, SOUTH, 0.2, DOORWAY)
    assert len(read(small, tmp_path, join=["open"]).spaces) == 2


def test_air_shut_in_between_two_rooms_does_not_keep_them_apart():
    """Faces of two rooms that touch, with a dent of 1 l in one that the other covers."""
    cube = manifold3d.Manifold.cube((2.0, 2.0, 2.0))
    dent = manifold3d.Manifold.cube((0.1, 0.1, 0.1)).translate((1.9, 1.5, 1.5))
    plane = plane_through(np.array([2.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    way = shapely.box(0.2, 0.2, 1.0, 1.0), plane, -0.001, 0.001
    found = united([packed(cube - dent), packed(cube.translate((2.0, 0.0, 0.0)))], [way])
    assert found is not None and unpacked(found).volume() == pytest.approx(16.0, rel=1e-9)
