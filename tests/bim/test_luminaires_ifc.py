"""Light fixtures of an IFC file: placement, power, photometry."""

from __future__ import annotations

import ifcopenshell.guid
import pytest

from bim.ifc.building import read_ifc
from tests.bim.small_ifc import box_model


@pytest.fixture(scope="module")
def luminaires(tmp_path_factory):
    """Four fixtures: with Revit's properties, with a light source, with power of its type, with nothing."""
    small, _ = box_model()
    model = small.model
    context = model.by_type("IfcGeometricRepresentationContext")[0]

    def fixture(name, at, along=(1.0, 0.0, 0.0)):
        origin, axis = (
            model.create_entity("IfcCartesianPoint", at),
            model.create_entity("IfcDirection", (0.0, 0.0, 1.0)),
        )
        frame = model.create_entity("IfcAxis2Placement3D", origin, axis, model.create_entity("IfcDirection", along))
        place = model.create_entity("IfcLocalPlacement", None, frame)
        return model.create_entity(
            "IfcLightFixture", GlobalId=ifcopenshell.guid.new(), Name=name, ObjectPlacement=place
        )

    def properties(element, name, **values):
        kinds = {float: "IfcReal", str: "IfcLabel"}
        held = [
            model.create_entity("IfcPropertySingleValue", Name=key, NominalValue=model.create_entity(kinds[type(v)], v))
            for key, v in values.items()
        ]
        of = model.create_entity("IfcPropertySet", GlobalId=ifcopenshell.guid.new(), Name=name, HasProperties=held)
        if element.is_a("IfcTypeObject"):
            element.HasPropertySets = [of]
        else:
            model.create_entity(
                "IfcRelDefinesByProperties",
                GlobalId=ifcopenshell.guid.new(),
                RelatedObjects=[element],
                RelatingPropertyDefinition=of,
            )

    web = fixture("web", (1.0, 1.5, 2.5), (0.0, 1.0, 0.0))
    properties(web, "Photometrics", **{"Photometric Web File": "lamps\\A.IES", "Wattage": 30.0})
    source = fixture("source", (2.0, 1.5, 2.5))
    frame = model.by_type("IfcAxis2Placement3D")[-1]
    light = model.create_entity(
        "IfcLightSourceGoniometric",
        LightColour=model.create_entity("IfcColourRgb", None, 1.0, 1.0, 1.0),
        Position=frame,
        ColourTemperature=4000.0,
        LuminousFlux=3000.0,
        LightEmissionSource="LIGHTEMITTINGDIODE",
        LightDistributionDataSource=model.create_entity("IfcDocumentReference", Location="b.ldt"),
    )
    shape = model.create_entity("IfcShapeRepresentation", context, "Lighting", "LightSource", [light])
    source.Representation = model.create_entity("IfcProductDefinitionShape", Representations=[shape])
    typed = fixture("typed", (3.0, 1.5, 2.5))
    kind = model.create_entity(
        "IfcLightFixtureType", GlobalId=ifcopenshell.guid.new(), Name="T", PredefinedType="POINTSOURCE"
    )
    properties(kind, "Pset_LightFixtureTypeCommon", TotalWattage=18.0)
    model.create_entity(
        "IfcRelDefinesByType", GlobalId=ifcopenshell.guid.new(), RelatedObjects=[typed], RelatingType=kind
    )
    fixture("bare", (3.0, 2.5, 2.5))
    path = tmp_path_factory.mktemp("ifc") / "lamps.ifc"
    model.write(str(path))
    return {one.name: one for one in read_ifc(path).luminaires}


def test_fixtures_are_read_with_what_they_state(luminaires) -> None:
    assert {name: (one.watts, one.photometry) for name, one in luminaires.items()} == {
        "web": (30.0, "lamps\\A.IES"),
        "source": (None, "b.ldt"),
        "typed": (18.0, ""),
        "bare": (None, ""),
    }


def test_their_placement_is_in_the_coordinates_of_the_rooms(luminaires) -> None:
    """A metre apart along x, in metres; the first turned by 90 degrees."""
    x = [luminaires[name].position[0] for name in ("web", "source", "typed")]
    assert [x[1] - x[0], x[2] - x[1]] == pytest.approx([1.0, 1.0])
    assert luminaires["web"].turned_deg - luminaires["typed"].turned_deg == pytest.approx(90.0)
