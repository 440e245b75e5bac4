"""Rooms that a file draws several times, and materials in other scripts, accents and units."""

from __future__ import annotations

import ifcopenshell.api.group
import ifcopenshell.api.root
import pytest

from bim.defaults import BRICK, CONCRETE, INSULATION, TIMBER, UNKNOWN_MATERIAL
from bim.ifc.building import read_ifc
from bim.material_names import material_named
from tests.bim.small_ifc import DEPTH, GLASS_AREA, HEIGHT, WIDTH, add_material, box_model
from tests.bim.test_account import read
from tests.issues import of_code

GROSS = ((-0.1, -0.1, 0.0), (WIDTH + 0.2, DEPTH + 0.2, HEIGHT))
NET = ((0.0, 0.0, 0.0), (WIDTH, DEPTH, HEIGHT))


def drawn(*spaces, **attributes):
    """The box room with these spaces (name, low, size, scheme) and no other."""
    small, _ = box_model(space=False)
    for name, (low, size), scheme in spaces:
        space = small.box("IfcSpace", name, low, size)
        for key in attributes:
            setattr(space, key, scheme)
        if not attributes and scheme:
            group = ifcopenshell.api.group.add_group(small.model, name=scheme)
            ifcopenshell.api.group.assign_group(small.model, products=[space], group=group)
    return small


@pytest.mark.parametrize("attributes", [{"ObjectType": ""}, {"PredefinedType": ""}, {}])
@pytest.mark.parametrize("order", [1, -1])
def test_gross_and_net_of_one_room_are_one_and_the_scheme_is_named(tmp_path, attributes, order):
    schemes = ("GFA", "INTERNAL") if "PredefinedType" in attributes else ("Gross", "Net")
    spaces = [("gross", GROSS, schemes[0]), ("net", NET, schemes[1])][::order]
    building = read(tmp_path, drawn(*spaces, **attributes))
    (room,) = building.spaces
    assert room.name == "net"
    assert [window.area for window in room.windows] == [pytest.approx(GLASS_AREA, rel=1e-4)]
    (said,) = of_code(building, "rooms-of-several-schemes")
    assert said.values["chosen"] == schemes[1]
    account = building.account
    assert (account.rooms, account.spaces, account.overlapping, account.missing) == (1, 1, (), ())


def test_without_a_scheme_the_rooms_that_fill_another_stay(tmp_path):
    half = (WIDTH, DEPTH / 2 - 0.05, HEIGHT)
    north = (0.0, DEPTH / 2 + 0.05, 0.0)
    spaces = [("all", NET, ""), ("A", (NET[0], half), ""), ("B", (north, half), "")]
    building = read(tmp_path, drawn(*spaces))
    assert sorted(space.name for space in building.spaces) == ["A", "B"]
    again = read(tmp_path, drawn(("A", NET, ""), ("A again", NET, "")))
    assert [space.name for space in again.spaces] == ["A"]


def test_cupboard_drawn_inside_a_room_is_kept_and_named(tmp_path):
    cupboard = ((0.5, 3.0, 0.0), (1.0, 1.0, HEIGHT))
    building = read(tmp_path, drawn(("room", NET, ""), ("cupboard", cupboard, "")))
    assert len(building.spaces) == 2
    assert building.account.overlapping == ("room + cupboard (3.00 m3)",)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Béton armé", CONCRETE),
        ("BÉTON", CONCRETE),
        ("Be\u0301ton", CONCRETE),
        ("コンクリート", CONCRETE),
        ("ｺﾝｸﾘｰﾄ", CONCRETE),
        ("Бетон", CONCRETE),
        ("断熱材", INSULATION),
        ("Wärmedämmung", INSULATION),
        ("Contreplaqué", TIMBER),
        ("кирпич", BRICK),
        ("Feste Schraffur", UNKNOWN_MATERIAL),
    ],
)
def test_materials_are_known_with_accents_and_in_other_scripts(name, expected):
    assert material_named(name).layer == expected


@pytest.mark.parametrize("name", ["ガラス", "Verre trempé", "szkło", "стекло"])
def test_glass_is_known_in_other_scripts(name):
    assert material_named(name).layer.name == "soda lime glass"


def test_heat_capacity_in_kilojoules_is_taken_as_such_and_named(tmp_path):
    small, walls = box_model()
    add_material(small.model, walls["south"], "Strange stuff")
    model = small.model
    values = {"SpecificHeatCapacity": 0.92, "MassDensity": 1500.0, "ThermalConductivity": 0.7}
    singles = [
        model.create_entity("IfcPropertySingleValue", name, None, model.create_entity("IfcReal", value))
        for name, value in values.items()
    ]
    (material,) = model.by_type("IfcMaterial")
    model.create_entity("IfcMaterialProperties", "Pset", None, singles, material)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    building = read_ifc(path)
    layers = [layer for face in building.spaces[0].faces for layer in face.construction.layers]
    (found,) = {layer.heat_capacity for layer in layers if layer.name == "Strange stuff"}
    assert found == pytest.approx(920.0)
    assert of_code(building, "heat-capacity-in-kilojoules")
