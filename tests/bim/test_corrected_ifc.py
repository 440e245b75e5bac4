"""Corrections written into a copy of the model, which is read as the model with its corrections."""

from __future__ import annotations

import ifcopenshell
import ifcopenshell.api.material
import numpy as np
import pytest
from click.testing import CliRunner

from bim.ifc.building import read_ifc
from bim.ifc.correct import correct
from bim.ifc.corrections import corrections_file, read_corrections
from mitsuba_cfs.errors import DataError
from scenes.commands.ifc import command
from tests.bim.small_ifc import box_model

CORRECTIONS = """
north = 30.0
surroundings = 0.25
outdoors = ['IfcSpace, Name="R2"']
leave_out = ['IfcWall, Name="south again"', 'IfcWall, Name="south"']

[[material]]
name = "Panel*"
conductivity = 0.03
density = 40
heat_capacity = 1400

[[reflectance]]
select = 'IfcWall, Name="north"'
visible = 0.66
solar = 0.55

[[reflectance]]
select = 'IfcWall, Name="west"'
visible = 0.2
specular = 0.1
"""


def _model(schema: str, path) -> None:
    small, walls = box_model(schema, doubled_wall=True)
    small.box("IfcSpace", "R2", (10.0, 0.0, 0.0), (3.0, 3.0, 3.0), LongName="Yard")
    for name, material in (("north", "Panel 7"), ("east", "Concrete"), ("west", "Concrete")):
        sets = ifcopenshell.api.material.add_material_set(small.model, name=name, set_type="IfcMaterialLayerSet")
        of = next((m for m in small.model.by_type("IfcMaterial") if m.Name == material), None)
        of = of or ifcopenshell.api.material.add_material(small.model, name=material)
        layer = ifcopenshell.api.material.add_layer(small.model, layer_set=sets, material=of)
        layer.LayerThickness = 0.3
        ifcopenshell.api.material.assign_material(
            small.model, products=[walls[name]], type="IfcMaterialLayerSet", material=sets
        )
    small.model.write(str(path))


def _figures(building) -> list:
    """Rooms, windows, faces with their layers and reflectances, elements outdoors, north."""
    faces = [
        (
            f.kind,
            round(f.area, 6),
            f.reflectance_visible,
            f.reflectance_solar,
            f.gloss,
            [(x.name, x.thickness, x.conductivity, x.density) for x in f.construction.layers],
        )
        for space in building.spaces
        for f in space.faces
    ]
    outside = {(e.name, e.reflectance_visible) for e in building.elements}
    glass = [(w.guid, round(w.area, 6)) for w in building.windows]
    return [faces, outside, glass, np.round(building.from_model, 9).tolist()]


@pytest.mark.parametrize("schema", ["IFC4", "IFC2X3", "IFC4X3"])
def test_the_written_model_is_read_as_the_model_with_its_corrections(tmp_path, schema):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    _model(schema, path)
    corrections_file(path).write_text(CORRECTIONS)
    with_corrections = read_ifc(path)
    done = correct(path, out)
    assert _figures(read_ifc(out)) == _figures(with_corrections)
    assert (done.north_deg, done.outdoors, done.materials, done.removed) == (30.0, 1, 1, 2)
    assert done.left == ("surroundings", "reflectance")
    left = read_corrections(corrections_file(out))
    assert left.surroundings == 0.25 and [p.select for p in left.paints] == ['IfcWall, Name="west"']
    model = ifcopenshell.open(str(out))
    # a wall that hosts a window keeps its place; the other is gone
    south = [one for one in model.by_type("IfcWall") if one.Name.startswith("south")]
    assert [(one.Name, one.Representation) for one in south] == [("south", None)]


def test_a_map_conversion_with_another_north_is_turned_too(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    model = box_model()[0].model
    crs = model.create_entity("IfcProjectedCRS", Name="EPSG:25833")
    context = model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[0]
    model.create_entity("IfcMapConversion", context, crs, 4e5, 58e5, 30.0, 0.0, 1.0, 1.0)
    model.write(str(path))
    corrections_file(path).write_text("north = 30")
    correct(path, out)
    assert not corrections_file(out).exists()
    building = read_ifc(out)
    east, north = building.from_model[:2, 1]
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(30.0)
    assert "north-contradicts-map" not in {issue.code for issue in building.issues}


def test_one_u_of_layers_of_two_thicknesses_remains_a_correction(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    _model("IFC4", path)
    model = ifcopenshell.open(str(path))
    thick = next(s for s in model.by_type("IfcMaterialLayerSet") if s.LayerSetName == "west")
    thick.MaterialLayers[0].LayerThickness = 0.4
    model.write(str(path))
    corrections_file(path).write_text(
        '[[material]]\nname = "Concrete"\nu = 0.3\n[[material]]\nname = "Panel 7"\nu = 0.2\n'
    )
    assert correct(path, out).left == ("material",)
    left = read_corrections(corrections_file(out))
    assert [one.name for one in left.materials] == ["Concrete"]
    assert _figures(read_ifc(out)) == _figures(read_ifc(path))


def test_nothing_is_overwritten_and_corrections_have_to_be_there(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    _model("IFC4", path)
    with pytest.raises(DataError, match=r"needs m\.corrections\.toml beside it"):
        correct(path, out)
    corrections_file(path).write_text("surroundings = 0.3")
    with pytest.raises(DataError, match=r"m\.ifc"):
        correct(path, path)
    corrections_file(out).write_text("")
    with pytest.raises(DataError, match="exists"):
        correct(path, out)
    assert not out.exists()


def test_the_command_says_what_was_written_and_what_remains(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    _model("IFC4", path)
    corrections_file(path).write_text(CORRECTIONS)
    result = CliRunner().invoke(command, ["correct", str(path), "-o", str(out)], catch_exceptions=False)
    assert "points 30 degrees from north" in result.output
    assert "spaces outdoors: 1, materials: 1, elements removed: 2" in result.output
    assert "surroundings, reflectance" in result.output.replace("\n", "")
