"""A sound box room with one defect planted in its file: recovered, or named with what it does."""

from __future__ import annotations

import ifcopenshell.api.aggregate
import ifcopenshell.api.geometry
import ifcopenshell.api.root
import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.ifc.defects import DRAWN_TWICE
from bim.model import Building
from bim.report.issue import Phrase, issue_text
from bim.shell import enclosed_volume, open_edges
from tests.bim.small_ifc import DEPTH, GLASS_AREA, HEIGHT, WALL, WIDTH, SmallIfc, box_room
from tests.issues import codes, of_code

VOLUME = WIDTH * DEPTH * HEIGHT
BOX_FACES = ((3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


@pytest.fixture(params=["IFC2X3", "IFC4"])
def schema(request) -> str:
    return request.param


def read(tmp_path, model) -> Building:
    path = tmp_path / "model.ifc"
    model.write(str(path))
    building = read_ifc(path)
    for space in building.spaces:
        assert open_edges(space.shell) == 0
        assert enclosed_volume(space.shell) == pytest.approx(space.volume, rel=1e-6)
    return building


def issue(building: Building, code: str):
    """The one issue of that code."""
    (result,) = of_code(building, code)
    return result


def named(model, ifc_class: str, name: str):
    return next(one for one in model.by_type(ifc_class) if one.Name == name)


def as_brep(model, product, low, size, *, faces=BOX_FACES, inverted: bool = False) -> None:
    """Replace the body of a product by a faceted box, some faces left out or all inside out."""
    x0, y0, z0 = low
    x1, y1, z1 = np.add(low, size)
    outline = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    corners = [
        model.create_entity("IfcCartesianPoint", (float(x), float(y), float(z))) for z in (z0, z1) for x, y in outline
    ]
    made = []
    for face in faces:
        loop = [corners[k] for k in (face[::-1] if inverted else face)]
        bound = model.create_entity("IfcFaceOuterBound", model.create_entity("IfcPolyLoop", loop), True)
        made.append(model.create_entity("IfcFace", [bound]))
    representation = product.Representation.Representations[0]
    whole = len(faces) == len(BOX_FACES)
    shell = model.create_entity("IfcClosedShell" if whole else "IfcOpenShell", made)
    body = (
        model.create_entity("IfcFacetedBrep", shell)
        if whole
        else model.create_entity("IfcShellBasedSurfaceModel", [shell])
    )
    representation.Items = [body]
    representation.RepresentationType = "Brep" if whole else "SurfaceModel"


@pytest.mark.parametrize("gap", [0.005, 0.015, 0.03])
@pytest.mark.parametrize("space", [True, False])
def test_slit_between_walls_is_named_and_closed(tmp_path, schema, gap, space):
    building = read(tmp_path, box_room(schema, gap=gap, space=space))
    assert issue(building, "walls-do-not-meet").values["gap_mm"] == pytest.approx(1000 * gap)
    (room,) = building.spaces
    # found rooms reach into the slit, and their details below 1 mm are smoothed
    assert room.room_volume == pytest.approx(VOLUME, rel=1e-9 if space else 2e-3)
    assert room.windows[0].area == pytest.approx(GLASS_AREA, rel=1e-3)
    if not space:
        repair = issue(building, "rooms-from-geometry").values["repair"]
        assert (repair == Phrase("gaps-closed", {"gap_mm": 100.0})) == (gap > 0.02)


def test_sound_room_has_no_problem_with_its_walls(tmp_path, schema):
    building = read(tmp_path, box_room(schema))
    assert not set(codes(building)) & {
        "walls-do-not-meet",
        "element-without-geometry",
        "window-without-geometry",
        "space-without-geometry",
        "body-not-sound",
        "space-repaired",
        "room-not-sound",
        "glass-out-of-opening",
        "glass-moved-into-opening",
        DRAWN_TWICE,
    }


# its opening reaches from 0.1 m before the wall to 0.1 m behind it, and the pane lies in its middle
@pytest.mark.parametrize(("off", "y"), [(0.1, -0.5), (2.0, -WALL / 2)], ids=["near", "astray"])
def test_window_out_of_its_wall(tmp_path, schema, off, y):
    model = box_room(schema)
    window = named(model, "IfcWindow", "W1")
    matrix = np.eye(4)
    matrix[1, 3] = -0.25 - off
    ifcopenshell.api.geometry.edit_object_placement(model, product=window, matrix=matrix)
    building = read(tmp_path, model)
    code = "glass-out-of-opening" if off < 1 else "glass-moved-into-opening"
    assert issue(building, code).values["offset_mm"] == pytest.approx(1000 * off)
    (glass,) = building.windows
    assert glass.area == pytest.approx(GLASS_AREA, rel=1e-5)
    assert glass.centre[1] == pytest.approx(y, abs=1e-5)


def test_wall_without_items_and_wall_without_representation(tmp_path, schema):
    model = box_room(schema)
    named(model, "IfcWall", "east").Representation.Representations[0].Items = ()
    named(model, "IfcWall", "west").Representation = None
    building = read(tmp_path, model)
    guids = {named(model, "IfcWall", name).GlobalId for name in ("east", "west")}
    reported = {p.where for p in building.issues if "geometry" in p.code}
    assert guids <= reported
    assert building.spaces[0].room_volume == pytest.approx(VOLUME, rel=1e-9)


def test_wall_and_space_inside_out(tmp_path, schema):
    model = box_room(schema)
    size = (WALL, DEPTH, HEIGHT)
    as_brep(model, named(model, "IfcWall", "east"), (WIDTH, 0, 0), size, inverted=True)
    as_brep(model, named(model, "IfcSpace", "R1"), (0, 0, 0), (WIDTH, DEPTH, HEIGHT), inverted=True)
    (room,) = read(tmp_path, model).spaces
    assert room.room_volume == pytest.approx(VOLUME, rel=1e-9)
    east = next(f for f in room.faces if f.normal[0] > 0.9)
    assert east.adjacency == "outside"
    assert east.construction.thickness == pytest.approx(WALL, abs=1e-3)


def test_open_shells_of_a_wall_and_a_space(tmp_path, schema):
    model = box_room(schema)
    wall, space = named(model, "IfcWall", "east"), named(model, "IfcSpace", "R1")
    as_brep(model, wall, (WIDTH, 0, 0), (WALL, DEPTH, HEIGHT), faces=BOX_FACES[:5])
    as_brep(model, space, (0, 0, 0), (WIDTH, DEPTH, HEIGHT), faces=BOX_FACES[1:])
    building = read(tmp_path, model)
    body = issue(building, "body-not-sound").values
    assert body == {"element": "IfcWall east", "repair": Phrase("holes-capped")}
    assert issue(building, "space-repaired").values["repair"] == Phrase("holes-capped")
    assert building.spaces[0].room_volume == pytest.approx(VOLUME, rel=1e-9)


def test_missing_material_gets_a_stated_default(tmp_path, schema):
    building = read(tmp_path, box_room(schema))
    incomplete = issue(building, "material-incomplete")
    assert incomplete.where == "unnamed" and "EN ISO 10456" in issue_text(incomplete).effect


def test_repeated_guid_of_rooms_keeps_both(tmp_path, schema):
    model = box_room(schema)
    one = named(model, "IfcSpace", "R1")
    small = SmallIfc(
        model, one.Representation.Representations[0].ContextOfItems, model.by_type("IfcBuildingStorey")[0], 1.0
    )
    small.box("IfcSpace", "R2", (10, 0, 0), (3, 3, 3), GlobalId=one.GlobalId)
    building = read(tmp_path, model)
    assert issue(building, "guid-repeated").values["count"] == 2
    assert len({space.guid for space in building.spaces}) == len(building.spaces) >= 1


def test_curtain_wall_panels_are_windows_and_its_spandrel_is_not(tmp_path, schema):
    model = box_room(schema, window=False)
    wall = named(model, "IfcWall", "south")
    small = SmallIfc(
        model, wall.Representation.Representations[0].ContextOfItems, model.by_type("IfcBuildingStorey")[0], 1.0
    )
    model.remove(wall)
    curtain = ifcopenshell.api.root.create_entity(model, ifc_class="IfcCurtainWall", name="facade")
    glass, grey = small.style("glass", 0.9, 0.8), small.style("frame", 0.4)
    parts = []
    for k in range(4):
        x = float(k)
        parts.append(small.box("IfcPlate", f"spandrel {k}", (x, -0.1, 0), (1, 0.02, 1), grey))
        parts.append(small.box("IfcPlate", f"pane {k}", (x, -0.1, 1), (1, 0.02, 2), glass))
    ifcopenshell.api.aggregate.assign_object(model, products=parts, relating_object=curtain)
    building = read(tmp_path, model)
    assert len(building.windows) == 4
    for window in building.windows:
        assert window.area == pytest.approx(2.0, rel=1e-3)
        assert window.normal[1] == pytest.approx(-1.0)
