"""Spaces that end below their glass: raised to the roof, but to no void above a ceiling."""

from __future__ import annotations

import ifcopenshell.api.aggregate
import ifcopenshell.api.pset
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import pytest

from bim.ifc.building import read_ifc
from bim.report.issue import issue_text
from bim.shell import open_edges
from tests.bim.small_ifc import DEPTH, GLASS_AREA, HEIGHT, OPENING, WALL, WIDTH, box_model

LOW = 1.5  # a space that ends here has 0.8 m of 1.3 m of the window's glass above it [m]
VOLUME = WIDTH * DEPTH * HEIGHT


def read(tmp_path, small):
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    return read_ifc(path)


def said(building) -> str:
    (issue,) = (i for i in building.issues if i.code in ("room-raised", "room-too-low"))
    return issue_text(issue).effect


def test_space_below_its_glass_is_raised_to_the_roof(tmp_path):
    building = read(tmp_path, box_model(space_height=LOW)[0])
    (room,) = building.spaces
    assert room.room_volume == pytest.approx(VOLUME, rel=1e-6)
    assert room.drawn_volume == pytest.approx(WIDTH * DEPTH * LOW, rel=1e-6)
    assert open_edges(room.shell) == 0
    assert building.account.glass_used == pytest.approx(GLASS_AREA, rel=1e-3)
    assert (building.account.low, building.account.raised) == ((), ("R1 Room",))
    assert said(building) == (f"it is raised by 1.50 m, which adds {WIDTH * DEPTH * 1.5:.1f} m3")
    ceiling = max(room.faces, key=lambda face: face.triangles[..., 2].mean())
    assert (ceiling.kind, ceiling.reflectance_visible) == ("roof", pytest.approx(0.8))


def test_gallery_in_the_hall_stays_a_slab(tmp_path):
    small, _ = box_model(space_height=LOW)
    depth, thick = 2.0, 0.2
    small.box("IfcSlab", "gallery", (0.0, DEPTH - depth, LOW), (WIDTH, depth, thick))
    building = read(tmp_path, small)
    (room,) = building.spaces
    assert room.room_volume == pytest.approx(VOLUME - WIDTH * depth * thick, rel=1e-3)
    assert open_edges(room.shell) == 0
    assert building.account.share_used == pytest.approx(1.0)


@pytest.mark.parametrize("short", [0.0, 0.6])
def test_void_above_a_drawn_ceiling_is_not_the_room(tmp_path, short):
    small, _ = box_model(space_height=LOW)
    small.box("IfcCovering", "ceiling", (0.0, short, LOW), (WIDTH, DEPTH - short, 0.05))
    building = read(tmp_path, small)
    assert building.spaces[0].raised == 0.0
    assert building.account.glass_used < 0.5 * GLASS_AREA


def test_ceiling_that_nobody_drew_is_assumed_where_little_would_be_won(tmp_path):
    building = read(tmp_path, box_model(space_height=2.0)[0])
    assert building.spaces[0].raised == 0.0
    assert (
        said(building)
        == "it is kept as drawn, because the 1.00 m above it may be the void of a ceiling that is not drawn"
    )
    assert building.account.low == ("R1 Room",)


@pytest.mark.parametrize("relation", [False, True])
def test_stated_ceiling_is_believed(tmp_path, relation):
    small, _ = box_model(space_height=LOW)
    (space,) = small.model.by_type("IfcSpace")
    if relation:
        covering = ifcopenshell.api.root.create_entity(small.model, ifc_class="IfcCovering")
        covering.PredefinedType = "CEILING"
        small.model.create_entity(
            "IfcRelCoversSpaces", GlobalId=ifcopenshell.guid.new(), RelatingSpace=space, RelatedCoverings=[covering]
        )
    else:
        heights = {"FinishCeilingHeight": LOW, "Height": HEIGHT}
        quantities = ifcopenshell.api.pset.add_qto(small.model, product=space, name="Qto_SpaceBaseQuantities")
        ifcopenshell.api.pset.edit_qto(small.model, qto=quantities, properties=heights)
    building = read(tmp_path, small)
    assert building.spaces[0].raised == 0.0
    assert "kept as drawn, because " in said(building) and "eiling" in said(building)


@pytest.mark.parametrize("height", [LOW, HEIGHT])
def test_room_does_not_rise_into_a_storey_whose_rooms_are_not_drawn(tmp_path, height):
    building = read(tmp_path, box_model(space_height=height, roof=False, upper=True)[0])
    assert building.spaces[0].raised == 0.0
    assert "above its top, a storey or more" in said(building)


def test_hall_whose_high_glass_is_filed_with_the_storey_above_is_raised(tmp_path):
    low, (x, _, width, _) = 1.8, OPENING
    small, _ = box_model(space_height=low, places=((x, 1.9, width, 0.8),))
    storey = ifcopenshell.api.root.create_entity(small.model, ifc_class="IfcBuildingStorey", name="upper")
    ifcopenshell.api.aggregate.assign_object(
        small.model, products=[storey], relating_object=small.model.by_type("IfcBuilding")[0]
    )
    ifcopenshell.api.spatial.assign_container(
        small.model, products=small.model.by_type("IfcWindow"), relating_structure=storey
    )
    building = read(tmp_path, small)
    assert building.spaces[0].room_volume == pytest.approx(VOLUME, rel=1e-6)


def test_slab_that_is_no_closed_solid_is_still_between(tmp_path):
    small, _ = box_model(space_height=LOW)
    create = small.model.create_entity
    slab = small.box("IfcSlab", "sheet", (0, 0, 0), (1, 1, 1))
    z = LOW + 1.3  # under the glass above the space, as the low rim of the opening is
    ring = [(0.0, 0.7, z), (WIDTH, 0.7, z), (WIDTH, DEPTH, z), (0.0, DEPTH, z)]
    loop = create("IfcPolyLoop", [create("IfcCartesianPoint", point) for point in ring])
    face = create("IfcFace", [create("IfcFaceOuterBound", loop, True)])
    sheet = create("IfcShellBasedSurfaceModel", [create("IfcOpenShell", [face])])
    slab.Representation.Representations[0].Items = [sheet]
    slab.Representation.Representations[0].RepresentationType = "SurfaceModel"
    building = read(tmp_path, small)
    assert building.spaces[0].raised == 0.0 and building.account.low


@pytest.mark.parametrize("case", ["no roof", "most of a roof", "storey above"])
def test_open_air_and_the_storey_above_are_not_the_room(tmp_path, case):
    small, _ = box_model(space_height=LOW, roof=case == "storey above")
    low, depth = (-WALL, -WALL), DEPTH + 2 * WALL
    if case == "storey above":
        small.box("IfcSlab", "between", (*low, LOW), (WIDTH + 2 * WALL, depth, 0.1))
    if case == "most of a roof":
        small.box("IfcRoof", "roof", (*low, HEIGHT), (WIDTH + 2 * WALL, 0.8 * depth, 0.2))
    building = read(tmp_path, small)
    assert building.spaces[0].raised == 0.0
    assert building.spaces[0].room_volume == pytest.approx(WIDTH * DEPTH * LOW, rel=1e-6)
