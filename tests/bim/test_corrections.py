"""The TOML file of corrections beside a model."""

from __future__ import annotations

import ifcopenshell.api.material
import ifcopenshell.api.pset
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.type
import pytest

from bim.ifc.building import read_ifc
from bim.ifc.corrections import Corrections, read_corrections
from mitsuba_cfs.errors import DataError
from tests.bim.small_ifc import box_room


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "model.ifc"
    box_room(doubled_wall=True).write(str(path))
    return path


def names(building) -> set[str]:
    return {element.name for element in building.elements}


def test_file_beside_the_model_is_used(path):
    path.with_name("model.corrections.toml").write_text(
        """
leave_out = ['IfcWall, Name="south again"']
surroundings = 0.25
[[reflectance]]
select = 'IfcSlab'
visible = 0.11
solar = 0.22
[[reflectance]]
select = 'IfcWall, Name="north"'
visible = 0.66
"""
    )
    building = read_ifc(path)
    assert "south again" not in names(building) and "south" in names(building)
    assert {e.reflectance_visible for e in building.elements} == {0.25}
    faces = building.spaces[0].faces
    floor = next(face for face in faces if face.kind == "floor")
    assert (floor.reflectance_visible, floor.reflectance_solar) == (0.11, 0.22)
    values = {round(face.reflectance_visible, 2) for face in faces if face.kind == "wall"}
    assert values == {0.66, 0.5}
    assert any("corrections are used" in problem.what for problem in building.problems)
    assert "south again" in names(read_ifc(path, corrections=Corrections()))


def test_only_keeps_nothing_else(path):
    corrections = Corrections(only=("IfcSpace", "IfcWindow", "IfcSlab", 'IfcWall, Name="south"'))
    building = read_ifc(path, corrections=corrections)
    assert names(building) == {"south", "W1", "floor", "roof"}
    assert len(building.windows) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("leave_out = 3", "leave_out"),
        ("leaves = []", "leaves"),
        ("surroundings = 1.2", "surroundings"),
        ("[[reflectance]]\nvisible = 0.5", "select"),
        ("[[reflectance]]\nselect = 'IfcWall'", "visible"),
        ("leave_out = [", "TOML"),
    ],
)
def test_wrong_entries_are_named(tmp_path, text, message):
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=message):
        read_corrections(path)


def test_selector_that_cannot_be_parsed_is_named(path):
    with pytest.raises(DataError, match="IfcWall,,,"):
        read_ifc(path, corrections=Corrections(leave_out=("IfcWall,,,=",)))


@pytest.mark.parametrize(
    "select",
    [
        "{guid}",
        'IfcWall, Name="east"',
        'IfcWall, type="Type E"',
        'IfcWall, material="Brick"',
        'IfcWall, location="Attic"',
        'layer="A-EAST"',
        "IfcWall, layer=A-EAST",
        'layer="A-EAST" + layer="none"',
        'IfcWall, Pset_WallCommon.Reference="E1"',
    ],
)
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_every_kind_of_selector_leaves_out_the_one_wall(tmp_path, schema, select):
    model = box_room(schema)
    wall = next(one for one in model.by_type("IfcWall") if one.Name == "east")
    kind = ifcopenshell.api.root.create_entity(model, ifc_class="IfcWallType", name="Type E")
    ifcopenshell.api.type.assign_type(model, related_objects=[wall], relating_type=kind)
    brick = ifcopenshell.api.material.add_material(model, name="Brick")
    ifcopenshell.api.material.assign_material(model, products=[wall], material=brick)
    attic = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingStorey", name="Attic")
    ifcopenshell.api.spatial.assign_container(model, products=[wall], relating_structure=attic)
    model.create_entity(
        "IfcPresentationLayerAssignment", Name="A-EAST",
        AssignedItems=[wall.Representation.Representations[0]],
    )  # fmt: skip
    pset = ifcopenshell.api.pset.add_pset(model, product=wall, name="Pset_WallCommon")
    ifcopenshell.api.pset.edit_pset(model, pset=pset, properties={"Reference": "E1"})
    removed = Corrections(leave_out=(select.format(guid=wall.GlobalId),)).removed(model)
    assert removed == {wall.id()}
