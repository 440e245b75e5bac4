"""What a material is by its name: a table of names with their sources, and values in names."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path

import ifcopenshell.api.material
import ifcopenshell.guid
import pytest

from bim.ifc.building import read_ifc
from bim.material_names import material_named
from mitsuba_cfs.errors import DataError
from tests.bim.small_ifc import WALLS, add_material, box_model
from tests.issues import of_code

with (Path(__file__).parent / "material_names.csv").open(encoding="utf-8") as stream:
    NAMES = [(row["name"], row["material"]) for row in csv.DictReader(stream)]


def test_every_name_of_the_table_is_known():
    found = {name: material_named(name).layer.name for name, _ in NAMES}
    assert len(NAMES) > 300
    assert {n: found[n] for n, m in NAMES if found[n] != m} == {}


@pytest.mark.parametrize(
    ("name", "conductivity", "density"),
    [
        ("Mineralwolle WLG 035", 0.035, 50.0),
        ("EPS 032", 0.032, 20.0),
        ("PUR 0,028 W/mK", 0.028, 32.0),
        ("Concrete 2400 kg/m3", 2.3, 2400.0),
        ("Wood fibre 9 lb/ft3", 0.042, 9 * 16.0185),
        ("Ziegel 1,2 kg/dm3", 0.8, 1200.0),
    ],
)
def test_values_in_names_are_taken(name, conductivity, density):
    layer = material_named(name).layer
    assert layer.conductivity == pytest.approx(conductivity)
    assert layer.density == pytest.approx(density)


def test_air_layers_have_the_resistance_of_their_thickness():
    """EN ISO 6946:2017, table 8, horizontal heat flow."""
    air = material_named("Air")
    resistances = {d: round(air.of_thickness(d).resistance, 2) for d in (0.005, 0.015, 0.05, 0.3)}
    assert resistances == {0.005: 0.11, 0.015: 0.17, 0.05: 0.18, 0.3: 0.18}


def _walled(tmp_path, *names: str, corrections: str = "", classified: str = ""):
    """A box with a south wall of layers of 0.15 m, read."""
    small, walls = box_model()
    model = small.model
    layers = ifcopenshell.api.material.add_material_set(model, name="W", set_type="IfcMaterialLayerSet")
    for name in names:
        material = ifcopenshell.api.material.add_material(model, name=name)
        layer = ifcopenshell.api.material.add_layer(model, layer_set=layers, material=material)
        layer.LayerThickness = 0.15
        if classified:
            entry = model.create_entity("IfcClassificationReference", Name=classified)
            model.create_entity(
                "IfcExternalReferenceRelationship", RelatingReference=entry, RelatedResourceObjects=[material]
            )
    ifcopenshell.api.material.assign_material(model, products=[walls["south"]], material=layers)
    path = tmp_path / "m.ifc"
    model.write(str(path))
    if corrections:
        path.with_name("m.corrections.toml").write_text(corrections)
    return read_ifc(path)


def _south(building):
    faces = building.spaces[0].faces
    return next(f.construction for f in faces if f.kind == "wall" and f.normal[1] < -0.9)


def test_guessed_layers_of_outer_walls_are_reported_with_their_u(tmp_path):
    building = _walled(tmp_path, "Fiberglass Batt", "Concrete with insulation")
    (issue,) = [i for i in of_code(building, "outer-wall-guessed") if len(i.values["layers"]) == 2]
    assert issue.values["u"] == pytest.approx(1 / (0.15 / 0.04 + 0.15 / 0.8 + 0.17))
    assert [i.where for i in of_code(building, "material-unknown")] == ["Concrete with insulation"]


def test_classification_comes_before_the_name(tmp_path):
    building = _walled(tmp_path, "Layer A", "Glass 7", classified="Mineral wool slabs")
    assert _south(building).resistance == pytest.approx(2 * 0.15 / 0.04)


def test_corrections_state_conductivity_or_u_by_name(tmp_path):
    text = '[[material]]\nname = "wall*"\nconductivity = 0.5\n[[material]]\nname = "Panel"\nu = 0.2\n'
    building = _walled(tmp_path, "Wallboard X", "Panel", corrections=text)
    assert _south(building).resistance == pytest.approx(0.15 / 0.5 + 1 / 0.2 - 0.17)


def test_a_correction_of_no_material_is_refused(tmp_path):
    with pytest.raises(DataError, match="no material is named 'Brik'"):
        _walled(tmp_path, "Brick", corrections='[[material]]\nname = "Brik"\nu = 1.0\n')


def test_one_material_of_a_wall_is_read(tmp_path):
    small, walls = box_model()
    add_material(small.model, walls["south"], "Porenbeton")
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    assert _south(read_ifc(path)).layers[0].conductivity == 0.13


def test_a_stated_u_is_that_of_the_whole_body(tmp_path):
    """Of a wall that is one body of one material; the U held for a body of 1 m."""
    small, walls = box_model()
    add_material(small.model, walls["south"], "Panel X")
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    path.with_name("m.corrections.toml").write_text('[[material]]\nname = "Panel X"\nu = 0.2\n')
    assert _south(read_ifc(path)).resistance == pytest.approx(1 / 0.2 - 0.17)


@pytest.mark.parametrize("thickness", [0.01, 0.06])
def test_a_body_that_is_an_air_layer_has_its_resistance(tmp_path, thickness):
    """Files that draw a body for each layer; air had 0.28 W/(m K) at any thickness."""
    small, walls = box_model("IFC4")
    (x, y, z), (width, depth, height) = WALLS["north"]
    ends = {"Brick": 0.1, "Air Space": 0.1 + thickness, "Concrete": depth}
    at = pairwise([0.0, *ends.values()])
    small.show(
        walls["north"],
        [
            ((x, y + depth - b, z), (width, b - a, height), small.style(name, 0.5))
            for name, (a, b) in zip(ends, at, strict=True)
        ],
    )
    create = small.model.create_entity
    materials = create("IfcMaterialList", [create("IfcMaterial", name) for name in ends])
    create(
        "IfcRelAssociatesMaterial",
        ifcopenshell.guid.new(),
        walls["north"].OwnerHistory,
        RelatedObjects=[walls["north"]],
        RelatingMaterial=materials,
    )
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    faces = read_ifc(path).spaces[0].faces
    north = next(f.construction for f in faces if f.kind == "wall" and f.normal[1] > 0.9)
    assert [layer.name for layer in north.layers] == [*ends]
    assert north.layers[1].thickness == pytest.approx(thickness, abs=1e-6)
    assert north.layers[1].resistance == pytest.approx({0.01: 0.15, 0.06: 0.18}[thickness])
