"""Rooms found between building elements, with gaps; telling inside from outside."""

from __future__ import annotations

import numpy as np
import pytest

import bim.leaks
from bim.enclosure import (
    LOWEST_ROOM,
    SMALLEST_ROOM,
    interior_parts,
    main_wall_direction,
    outer_part,
    rooms_enclosed_by,
    touching_parts,
)
from bim.ifc.building import read_ifc
from bim.leaks import COARSEST, may_enclose
from bim.report.issue import Phrase
from bim.shell import enclosed_volume, open_edges
from bim.solids import solid_of, triangles_of
from tests.bim.small_ifc import DEPTH, GLASS_AREA, HEIGHT, WALL, WALLS, WIDTH, box_room, empty_project
from tests.issues import of_code

VOLUME = WIDTH * DEPTH * HEIGHT


def box(low, size) -> np.ndarray:
    """Triangles of a box, normals out."""
    x0, y0, z0 = low
    x1, y1, z1 = np.add(low, size)
    outline = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    corners = np.array([[x, y, z] for z in (z0, z1) for x, y in outline], dtype=float)
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    index = [k for a, b, c, d in quads for k in ((a, b, c), (a, c, d))]
    return corners[index].reshape(-1, 3, 3)


def room(gap: float = 0.0) -> list[np.ndarray]:
    """Walls, floor and roof as six boxes; the roof hovers `gap` above the walls."""
    size = (WIDTH + 2 * WALL, DEPTH + 2 * WALL, 0.2)
    slabs = [box((-WALL, -WALL, z), size) for z in (-0.2, HEIGHT + gap)]
    return [*slabs, *(box(low, size) for low, size in WALLS.values())]


@pytest.mark.parametrize("gap", [0.0, 0.005, 0.015])
def test_room_between_walls_with_a_gap(gap):
    (found,) = rooms_enclosed_by(room(gap)).rooms
    # the room reaches up to the roof, and half the closing distance into the gap: below 0.2 %
    assert enclosed_volume(found) == pytest.approx(VOLUME * (1 + gap / HEIGHT), rel=2e-3)


def test_a_wall_without_a_closed_body_bounds_a_room():
    """Its long faces have holes without reveals; an open body that is not flat fills nothing."""
    parts = room()
    (x0, y, z0), (w, t, h) = WALLS["south"]
    wall = box((x0, y, z0), (w, t, h))
    outside, inside = wall[4:6], wall[8:10]  # its long faces, y low and y high
    rest = np.concatenate([wall[:4], wall[6:8], wall[10:]])
    holed = [
        np.array([[(x, face[0, 0, 1], z) for x, z in corners]])
        for face in (outside, inside)
        for corners in (((x0, z0), (x0 + w, z0), (x0 + w, 0.9)), ((x0, h), (x0 + w, h), (x0, 2.4)))
    ]
    parts[2] = np.concatenate([rest, *holed])
    assert solid_of(parts[2]) is None
    found = rooms_enclosed_by(parts)
    assert found.hulls == 1
    assert enclosed_volume(found.rooms[0]) == pytest.approx(VOLUME, rel=2e-3)
    tower = box((1.0, 1.0, 0.0), (2.0, 2.0, HEIGHT))[2:]  # open at its foot
    assert rooms_enclosed_by([*room(), tower]).hulls == 0


def test_gap_of_30_mm_stays_open_unless_asked_for():
    assert rooms_enclosed_by(room(0.03)).rooms == ()
    assert len(rooms_enclosed_by(room(0.03), gap=0.05).rooms) == 1


def test_turned_walls_are_widened_along_themselves():
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    (found,) = rooms_enclosed_by([part @ turn.T for part in room(0.015)]).rooms
    assert enclosed_volume(found) == pytest.approx(VOLUME * (1 + 0.015 / HEIGHT), rel=2e-3)
    angle = np.arctan2(*main_wall_direction(np.concatenate(room()) @ turn.T)[0, [1, 0]])
    assert np.mod(angle - 0.5, np.pi / 2) == pytest.approx(0, abs=1e-9)


def test_touching_parts_ray_from_outside_and_winding_agree():
    outside, inside, other = (box((0, 0, 0), (9, 9, 9)), box((1, 1, 1), (2, 2, 2)), box((5, 5, 5), (1, 1, 1)))
    surface = np.concatenate([inside[:, ::-1], outside, other[:, ::-1]])
    labels = touching_parts(surface)
    assert len(np.unique(labels)) == 3
    assert np.all((labels == outer_part(surface, labels)) == (np.arange(36) // 12 == 1))
    volumes = sorted(-enclosed_volume(part) for part in interior_parts(surface))
    np.testing.assert_allclose(volumes, [1, 8])


def test_solid_without_void_has_no_interior():
    triangles, _ = triangles_of(solid_of(box((0, 0, 0), (1, 1, 1))).manifold)
    assert interior_parts(triangles) == []


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_file_without_spaces_gets_its_room_and_window(tmp_path, schema):
    path = tmp_path / "model.ifc"
    box_room(schema, space=False).write(str(path))
    building = read_ifc(path)
    (space,) = building.spaces
    assert space.room_volume == pytest.approx(VOLUME, rel=1e-3)  # details below 1 mm are smoothed
    assert space.windows[0].area == pytest.approx(GLASS_AREA, rel=1e-3)
    assert open_edges(space.shell) == 0
    (found,) = of_code(building, "rooms-from-geometry")
    assert found.values["lack"] == Phrase("no-spaces")
    assert space.guid == read_ifc(path).spaces[0].guid  # the same in every run


def test_a_house_that_leaks_says_where_and_a_wider_tolerance_closes_it(tmp_path) -> None:
    """A slit of 0.3 m between the south and the east wall, from floor to roof."""
    path = tmp_path / "m.ifc"
    box_room(space=False, window=False, gap=0.3).write(str(path))
    building = read_ifc(path)
    assert not building.spaces
    (issue,) = [one for one in building.issues if one.code == "room-leaks"]
    x, y, z = (issue.values[key] for key in "xyz")
    assert WIDTH - 0.3 < x < WIDTH + WALL and 0 < y < 0.3 and 0 < z < HEIGHT
    assert issue.values["width"] == pytest.approx(0.3, abs=1.5 * issue.values["size"])
    assert any("east" in name for name in issue.values["elements"])
    path.with_name("m.corrections.toml").write_text("close_gaps = 0.4")
    (space,) = read_ifc(path).spaces
    assert space.volume == pytest.approx(WIDTH * DEPTH * HEIGHT, rel=0.02)


@pytest.mark.parametrize("gap", [0.02, 0.1])
def test_a_room_of_the_smallest_size_is_searched_for_anywhere(gap, monkeypatch) -> None:
    """With cubes of the greatest size, turned and moved at random."""
    width = (SMALLEST_ROOM / LOWEST_ROOM) ** 0.5
    hall = [box((0, 0, -0.2), (width + 0.4, width + 0.4, 0.2))]
    hall += [box((0, 0, LOWEST_ROOM), (width + 0.4, width + 0.4, 0.2))]
    hall += [box((x, 0, 0), (0.2, width + 0.4, LOWEST_ROOM)) for x in (0.0, width + 0.2)]
    hall += [box((0.2, y, 0), (width, 0.2, LOWEST_ROOM)) for y in (0.0, width + 0.2)]
    random = np.random.default_rng(1)
    for _ in range(40):
        c, s = np.cos(angle := random.uniform(0, 6)), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        offset = random.uniform(0, 1, 3)
        moved = [part @ turn.T + offset for part in hall]
        box_size = np.ptp(np.concatenate(moved), axis=(0, 1)) + 2.0
        monkeypatch.setattr(bim.leaks, "MOST_FILLED", np.prod(box_size) / COARSEST**3)
        assert may_enclose(moved, gap)
        assert not may_enclose(moved[1:5], gap)  # without a floor and one wall


def test_a_roof_without_walls_ends_the_search_early(tmp_path) -> None:
    """A glazed roof over a court: no room, and no floor is invented below it."""
    small = empty_project()
    for x in range(12):
        small.box("IfcPlate", f"pane {x}", (x, 0.0, 20.0), (0.9, 12.0, 0.03))
        small.box("IfcMember", f"bar {x}", (x + 0.9, 0.0, 19.9), (0.1, 12.0, 0.2))
    path = tmp_path / "court.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    assert not building.spaces and of_code(building, "no-walls-for-rooms")
