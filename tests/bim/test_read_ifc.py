"""Reading IFC: a box room whose every figure is known, in both schemas, sound and defective."""

from __future__ import annotations

from itertools import pairwise

import ifcopenshell.api.aggregate
import ifcopenshell.api.root
import ifcopenshell.guid
import numpy as np
import pytest

from bim.defaults import FRAME_FRACTION, ROOM_REFLECTANCE
from bim.ifc.building import read_ifc
from bim.shell import enclosed_volume, open_edges
from mitsuba_cfs.errors import DataError
from tests.bim.small_ifc import (
    DEPTH,
    GLASS_AREA,
    GLASS_Y,
    HEIGHT,
    OPENING,
    WALL,
    WALLS,
    WIDTH,
    add_material,
    box_model,
    box_room,
)
from tests.issues import of_code, texts

RECESS = -GLASS_Y  # from the room's south face to the middle of the pane [m]
VOLUME = WIDTH * DEPTH * HEIGHT


def read(tmp_path, model):
    path = tmp_path / "model.ifc"
    model.write(str(path))
    return read_ifc(path)


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4", "IFC4X3"])
@pytest.mark.parametrize("unit", ["METRE", "MILLIMETRE"])
def test_sound_room(tmp_path, schema, unit):
    building = read(tmp_path, box_room(schema, unit=unit))
    (space,) = building.spaces
    assert (space.name, space.long_name, space.storey) == ("R1", "Room", "IfcBuildingStorey")
    assert space.room_volume == pytest.approx(VOLUME, rel=1e-9)
    # 1e-6: overlays of polygons are rounded to a micrometre
    recess = RECESS * OPENING[2] * OPENING[3]
    assert space.volume == pytest.approx(VOLUME + recess, rel=1e-6)
    assert space.floor_area == pytest.approx(WIDTH * DEPTH, rel=1e-6)
    assert open_edges(space.shell) == 0
    assert enclosed_volume(space.shell) == pytest.approx(space.volume, rel=1e-6)
    (window,) = space.windows
    assert window.area == pytest.approx(GLASS_AREA, rel=1e-6)
    assert window.opening_area == pytest.approx(OPENING[2] * OPENING[3], rel=1e-6)
    np.testing.assert_allclose(window.normal, [0, -1, 0], atol=1e-9)
    np.testing.assert_allclose(window.centre, [2.0, GLASS_Y, 1.65], atol=1e-5)
    assert (building.latitude_deg, building.longitude_deg) == (48.5, -7.5)


@pytest.mark.parametrize(
    ("long_name", "name", "shown"),
    [
        ("Town hall", "12", "Town hall"),
        ("// PROJECT/NAME //", "// PROJECT/NUMBER //", "model"),  # Revit's templates
        ("项目名称", "Project  Number", "model"),
        ("Nombre de proyecto", "4711", "4711"),
        (None, "Project of a school", "Project of a school"),
    ],
)
def test_a_project_that_has_its_templates_name_has_the_files(tmp_path, long_name, name, shown):
    model = box_room("IFC4")
    (project,) = model.by_type("IfcProject")
    project.LongName, project.Name = long_name, name
    assert read(tmp_path, model).name == shown


@pytest.mark.parametrize("ends", [(0.1,), (0.1, 0.2), (0.05, 0.1, 0.25)])
def test_a_wall_whose_layers_are_bodies_that_touch_ends_outdoors(tmp_path, ends):
    """Revit writes a body for each layer; where two touch a ray meets one surface."""
    small, walls = box_model()
    (x, y, z), (width, depth, height) = WALLS["north"]
    edges = (0.0, *ends, depth)
    layers = [((x, y + a, z), (width, b - a, height), None) for a, b in pairwise(edges)]
    small.show(walls["north"], layers)
    (space,) = read(tmp_path, small.model).spaces
    north = next(face for face in space.faces if face.normal[1] > 0.9 and face.kind == "wall")
    assert north.adjacency == "outside" and north.element == walls["north"].GlobalId


@pytest.mark.parametrize(
    ("schema", "named_by"),
    [
        ("IFC4", "aspects"),
        ("IFC4X3", "aspects"),
        ("IFC4", "styles"),
        ("IFC4", "contradicting aspects"),
        ("IFC4", "list"),
        ("IFC2X3", "list"),
    ],
)
def test_a_wall_of_a_body_for_each_layer_has_the_material_of_each(tmp_path, schema, named_by):
    """Constituents or a list of materials; aspects or styles say which body is of which."""
    small, walls = box_model(schema)
    (x, y, z), (width, depth, height) = WALLS["north"]
    ends = {"Default brick": 0.1, "Default mineral wool": 0.22, "Default gypsum board": depth}
    named = dict.fromkeys(ends)
    if named_by != "aspects":
        named = {name: small.style(name, 0.5) for name in ends}
    at = pairwise([0.0, *ends.values()])
    layers = [
        ((x, y + depth - b, z), (width, b - a, height), named[name]) for name, (a, b) in zip(ends, at, strict=True)
    ]
    small.show(walls["north"], layers)
    create = small.model.create_entity
    (body,) = walls["north"].Representation.Representations
    materials = [create("IfcMaterial", name) for name in ends]
    if named_by == "list":
        made = create("IfcMaterialList", materials)
    else:
        parts = [create("IfcMaterialConstituent", m.Name, None, m) for m in materials]
        made = create("IfcMaterialConstituentSet", "north", None, parts)
    if "aspects" in named_by:
        order = [*ends] if named_by == "aspects" else [*ends][::-1]
        for name, item in zip(order, body.Items, strict=True):
            shown = create("IfcShapeRepresentation", small.body, "Body", "SweptSolid", [item])
            create("IfcShapeAspect", [shown], name, None, None, walls["north"].Representation)
    create(
        "IfcRelAssociatesMaterial",
        ifcopenshell.guid.new(),
        walls["north"].OwnerHistory,
        RelatedObjects=[walls["north"]],
        RelatingMaterial=made,
    )
    building = read(tmp_path, small.model)
    (space,) = building.spaces
    north = next(face for face in space.faces if face.normal[1] > 0.9 and face.kind == "wall")
    layers = north.construction.layers
    assert [layer.name for layer in layers] == [*ends]
    assert [layer.thickness for layer in layers] == pytest.approx([0.1, 0.12, depth - 0.22])
    assert layers[1].conductivity < 0.05 < layers[0].conductivity
    contradiction = bool(of_code(building, "aspect-contradicts-style"))
    assert contradiction == (named_by == "contradicting aspects")


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_a_roof_whose_body_is_a_slabs_has_the_roofs_layers(tmp_path, schema):
    """Revit gives the layers to the roof, and its body to a slab that the roof is made of."""
    small, _ = box_model(schema, roof=False)
    slab = small.box("IfcSlab", "top", (-WALL, -WALL, HEIGHT), (WIDTH + 2 * WALL, 6.6, 0.2))
    roof = ifcopenshell.api.root.create_entity(small.model, ifc_class="IfcRoof", name="roof")
    ifcopenshell.api.aggregate.assign_object(small.model, products=[slab], relating_object=roof)
    add_material(small.model, roof, "Default mineral wool")
    (space,) = read(tmp_path, small.model).spaces
    (top,) = (face for face in space.faces if face.kind == "roof")
    assert [layer.name for layer in top.construction.layers] == ["Default mineral wool"]


def test_faces_know_what_lies_beyond_and_how_they_reflect(tmp_path):
    (space,) = read(tmp_path, box_room()).spaces
    by_kind = {face.kind: face for face in space.faces}
    assert by_kind["floor"].adjacency == "ground"
    assert by_kind["roof"].adjacency == "outside"
    walls = [face for face in space.faces if face.kind == "wall"]
    assert len(walls) == 4 and all(face.adjacency == "outside" for face in walls)
    reflectances = {kind: round(face.reflectance_visible, 3) for kind, face in by_kind.items()}
    assert reflectances == {"floor": 0.3, "roof": 0.8, "wall": 0.5, "reveal": 0.5, "window frame": 0.7}
    south = next(face for face in walls if face.normal[1] < -0.9)
    assert south.construction.thickness == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize(
    ("true_north", "normal"), [((0.0, 1.0), (0, -1)), ((1.0, 0.0), (1, 0)), ((-1.0, 1.0), (-(0.5**0.5), -(0.5**0.5)))]
)
def test_true_north_turns_the_south_window(tmp_path, true_north, normal):
    # north along the model's +x: the model's -y then lies to the east
    building = read(tmp_path, box_room(true_north=true_north))
    np.testing.assert_allclose(building.windows[0].normal, [*normal, 0], atol=1e-9)


def test_missing_north_is_reported(tmp_path):
    assert "TrueNorth" in texts(read(tmp_path, box_room(true_north=None)))


@pytest.mark.parametrize("inset", [0.02, 0.1])
def test_recess_bridges_a_space_that_stops_short_of_the_wall(tmp_path, inset):
    (space,) = read(tmp_path, box_room(space_inset=inset)).spaces
    recess = (RECESS + inset) * OPENING[2] * OPENING[3]
    assert space.volume - space.room_volume == pytest.approx(recess, rel=1e-5)
    assert open_edges(space.shell) == 0


def test_space_drawn_past_the_glass(tmp_path):
    building = read(tmp_path, box_room(space_inset=-0.25))
    (space,) = building.spaces
    assert "inside room" in texts(building)
    assert space.windows[0].area == pytest.approx(GLASS_AREA, rel=1e-6)
    np.testing.assert_allclose(space.windows[0].centre[1], -0.25, atol=1e-6)
    assert open_edges(space.shell) == 0


def test_window_without_transparent_pane_gets_the_default_frame(tmp_path):
    building = read(tmp_path, box_room(glazed=False))
    # 1e-5: the frame's width is rounded to a micrometre along 8 m of outline
    assert building.windows[0].area == pytest.approx(0.7 * OPENING[2] * OPENING[3], rel=1e-5)
    assert "no transparent pane" in texts(building)


def test_wrong_unit_is_found_and_mended(tmp_path):
    building = read(tmp_path, box_room(unit="wrong"))
    assert building.spaces[0].room_volume == pytest.approx(VOLUME, rel=1e-9)
    assert of_code(building, "length-unit-wrong")


def test_shifted_window_is_clipped_to_its_opening(tmp_path):
    building = read(tmp_path, box_room(shift=0.6))
    assert of_code(building, "glass-clipped")
    # the pane reaches 0.5 m past the opening: 0.6 m of shift less the frame of 0.1 m
    assert building.windows[0].area == pytest.approx(GLASS_AREA - 0.5 * 1.3, rel=1e-6)


def test_unhosted_window_cuts_the_wall_that_covers_it(tmp_path):
    building = read(tmp_path, box_room(hosted=False))
    found = texts(building)
    assert "fills no opening" in found and "covers the glass" in found
    assert building.windows[0].area == pytest.approx(GLASS_AREA, rel=1e-6)


@pytest.mark.parametrize("defect", [{"doubled_wall": True}, {"slab_as_wall": True}, {"gap": 0.03}])
def test_defects_of_elements_do_not_open_the_room(tmp_path, defect):
    (space,) = read(tmp_path, box_room(**defect)).spaces
    assert open_edges(space.shell) == 0
    assert space.room_volume == pytest.approx(VOLUME, rel=1e-9)
    assert next(face for face in space.faces if face.kind == "floor").adjacency == "ground"


@pytest.mark.parametrize(
    ("defect", "code"), [({"doubled_wall": True}, "element-drawn-twice"), ({"slab_as_wall": True}, "wall-lies-flat")]
)
def test_defects_of_elements_are_named(tmp_path, defect, code):
    sound, faulty = read(tmp_path, box_room()), read(tmp_path, box_room(**defect))
    assert of_code(faulty, code) and not of_code(sound, code)


def test_repeated_guid_is_named(tmp_path):
    model = box_room()
    walls = model.by_type("IfcWall")
    walls[1].GlobalId = walls[0].GlobalId
    assert f"{walls[0].GlobalId} The GlobalId is used 2 times" in texts(read(tmp_path, model))


def test_transparent_wall_is_a_window(tmp_path):
    model = box_room()
    wall = next(one for one in model.by_type("IfcWall") if one.Name == "east")
    style = next(one for one in model.by_type("IfcSurfaceStyle") if one.Name == "wall")
    style.Styles[0].Transparency = 0.0
    (item,) = wall.Representation.Representations[0].Items
    glass = next(one for one in model.by_type("IfcSurfaceStyle") if one.Name == "glass")
    item.StyledByItem[0].Styles = [glass]
    building = read(tmp_path, model)
    assert "is transparent: it is taken as a window" in texts(building)
    east = next(window for window in building.windows if window.normal[0] > 0.9)
    assert east.area == pytest.approx(DEPTH * HEIGHT, rel=1e-6)
    assert open_edges(building.spaces[0].shell) == 0


def test_file_without_spaces_or_windows_is_a_building_with_issues(tmp_path):
    empty = read(tmp_path, box_room(space=False, window=False))
    assert not empty.windows and of_code(empty, "no-window")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"not a model", "ISO-10303-21"),
        (b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC2X_FINAL'));\nENDSEC;\nDATA;\n", "IFC"),
        (b"", "ISO-10303-21"),
    ],
)
def test_what_is_no_ifc_is_refused_in_one_line(tmp_path, content, message):
    path = tmp_path / "broken.ifc"
    path.write_bytes(content)
    with pytest.raises(DataError, match=message) as caught:
        read_ifc(path)
    assert "\n" not in str(caught.value) and "broken.ifc" in str(caught.value)


def test_cut_off_file_is_refused_or_read_without_a_crash(tmp_path):
    path = tmp_path / "cut.ifc"
    box_room().write(str(path))
    path.write_bytes(path.read_bytes()[:3000])
    assert "cut off" in texts(read_ifc(path))
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(DataError, match=r"cut\.ifc"):
        read_ifc(path)


def test_what_has_no_style_takes_no_colour_of_the_engine(tmp_path):
    """IfcOpenShell shows unstyled products in colours of its own: windows wholly of glass."""
    model = box_room()
    for styled in model.by_type("IfcStyledItem"):
        model.remove(styled)
    building = read(tmp_path, model)
    (space,) = building.spaces
    _, _, width, height = OPENING
    # 1e-5: the frame's width comes from an iteration
    glass = (1 - FRAME_FRACTION) * width * height
    assert building.windows[0].area == pytest.approx(glass, rel=1e-5)
    assert of_code(building, "reflectance-assumed")
    found = {face.kind: face.reflectance("visible") for face in space.faces}
    assert found == {kind: ROOM_REFLECTANCE[kind] for kind in found}
