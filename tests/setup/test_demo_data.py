"""The office and the weather that `cfs demo` runs on: valid, repeatable and of one place."""

from __future__ import annotations

import hashlib
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.geolocation
import ifcopenshell.util.shape
import ifcopenshell.validate
import numpy as np
import pytest

from scenes import demo
from tests.demo import make_office
from tests.demo.make_office import LAYERS, REFLECTANCES, u_value


@pytest.fixture(scope="module")
def shipped() -> ifcopenshell.file:
    return ifcopenshell.open(demo.OFFICE)


def _named(model: ifcopenshell.file, ifc_class: str, name: str) -> ifcopenshell.entity_instance:
    (found,) = [element for element in model.by_type(ifc_class) if element.Name == name]
    return found


def _shape(element: ifcopenshell.entity_instance):
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    return ifcopenshell.geom.create_shape(settings, element).geometry


def _body(model: ifcopenshell.file) -> list[str]:
    """The entities without the header, which names the version of the library that wrote it."""
    return [str(entity) for entity in model]


def test_the_shipped_office_is_what_the_script_writes(shipped) -> None:
    assert _body(make_office.office()) == _body(shipped)


def test_office_is_valid_ifc4(shipped) -> None:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(shipped, logger, express_rules=True)
    assert logger.statements == []
    assert shipped.schema == "IFC4"


def test_global_ids_are_unique(shipped) -> None:
    ids = [root.GlobalId for root in shipped.by_type("IfcRoot")]
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize(
    ("ifc_class", "name", "low", "high", "volume"),
    [
        ("IfcSpace", "A", (0.0, 0.0, 0.0), (4.0, 6.0, 3.0), 72.0),
        ("IfcSpace", "B", (4.125, 0.0, 0.0), (7.625, 6.0, 3.0), 63.0),
        # frame ring (3.0 x 1.5 less 2.86 x 1.36) x 0.08 and pane 2.86 x 1.36 x 0.024
        ("IfcWindow", "Window A", (0.5, -0.28, 0.9), (3.5, -0.20, 2.4), 0.1421824),
        ("IfcWindow", "Window B", (7.825, 2.0, 0.9), (7.905, 4.0, 2.4), 0.0983424),
        ("IfcDoor", "Door A-B", (4.0425, 4.5, 0.0), (4.0825, 5.4, 2.1), 0.0756),
        # 8.365 x 0.37 x 3 less the opening 3.0 x 0.37 x 1.5
        ("IfcWall", "South wall", (-0.37, -0.37, 0.0), (7.995, 0.0, 3.0), 7.62015),
        ("IfcWall", "East wall", (7.625, 0.0, 0.0), (7.995, 6.0, 3.0), 5.55),
        ("IfcWall", "Partition A-B", (4.0, 0.0, 0.0), (4.125, 6.0, 3.0), 2.01375),
        ("IfcSlab", "Floor", (-0.37, -0.37, -0.38), (7.995, 6.37, 0.0), 21.4244380),
        ("IfcFurniture", "Desk A", (1.2, 1.0, 0.0), (2.8, 1.8, 0.74), 0.06822),
    ],
)
def test_element_is_where_the_plan_says(shipped, ifc_class, name, low, high, volume) -> None:
    shape = _shape(_named(shipped, ifc_class, name))
    vertices = ifcopenshell.util.shape.get_vertices(shape)
    np.testing.assert_allclose(vertices.min(axis=0), low, atol=1e-9)
    np.testing.assert_allclose(vertices.max(axis=0), high, atol=1e-9)
    # the kernel subtracts openings to a micrometre
    assert ifcopenshell.util.shape.get_volume(shape) == pytest.approx(volume, rel=1e-5)


def test_each_window_fills_an_opening_of_its_wall(shipped) -> None:
    hosts = {
        window.Name: window.FillsVoids[0].RelatingOpeningElement.VoidsElements[0]
        for window in shipped.by_type("IfcWindow")
    }
    walls = {name: relation.RelatingBuildingElement.Name for name, relation in hosts.items()}
    assert walls == {"Window A": "South wall", "Window B": "East wall"}


def test_window_has_an_opaque_frame_and_a_clear_pane(shipped) -> None:
    for window in shipped.by_type("IfcWindow"):
        materials = _shape(window).materials
        assert sorted(material.transparency for material in materials) == [0.0, 0.8]
        psets = ifcopenshell.util.element.get_psets(window)
        width, height = window.OverallWidth, window.OverallHeight
        clear = (width - 0.14) * (height - 0.14) / (width * height)
        assert psets["Pset_WindowCommon"]["GlazingAreaFraction"] == pytest.approx(clear)
        assert 1.0 < psets["Pset_WindowCommon"]["ThermalTransmittance"] < 2.0


@pytest.mark.parametrize(
    ("ifc_class", "name", "style"),
    [
        ("IfcWall", "South wall", "White wall"),
        ("IfcWall", "Partition A-B", "Light partition"),
        ("IfcSlab", "Roof", "White ceiling"),
        ("IfcSlab", "Floor", "Grey floor"),
    ],
)
def test_surface_has_its_reflectance(shipped, ifc_class, name, style) -> None:
    (material,) = _shape(_named(shipped, ifc_class, name)).materials
    linear = [((value + 0.055) / 1.055) ** 2.4 for value in material.diffuse.components]  # sRGB
    assert linear == pytest.approx([REFLECTANCES[style]] * 3)


def test_every_layer_has_its_thermal_properties(shipped) -> None:
    sets = shipped.by_type("IfcMaterialLayerSet")
    assert {layers.LayerSetName for layers in sets} == set(LAYERS)
    for layer in (layer for layers in sets for layer in layers.MaterialLayers):
        psets = ifcopenshell.util.element.get_psets(layer.Material)
        assert psets["Pset_MaterialCommon"]["MassDensity"] > 0
        assert psets["Pset_MaterialThermal"]["ThermalConductivity"] > 0
        assert psets["Pset_MaterialThermal"]["SpecificHeatCapacity"] > 0


def test_u_value_of_the_outer_wall_is_the_sum_of_its_resistances() -> None:
    layers = 0.015 / 0.57 + 0.18 / 2.3 + 0.16 / 0.036 + 0.015 / 1.0
    assert u_value("Outer wall") == pytest.approx(1 / (0.13 + layers + 0.04))


def test_true_north_lies_ten_degrees_towards_x(shipped) -> None:
    (context,) = shipped.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[:1]
    north = np.array(context.TrueNorth.DirectionRatios)
    azimuth_of_south_wall = np.degrees(np.arctan2(*north) - np.arctan2(0.0, -1.0)) % 360.0
    # clockwise from true north to -y: north lies 10 degrees clockwise from +y
    assert -azimuth_of_south_wall % 360.0 == pytest.approx(170.0)


def test_site_is_that_of_the_weather_file(shipped) -> None:
    header = demo.WEATHER.read_text().splitlines()[0].split(",")
    site = shipped.by_type("IfcSite")[0]
    latitude = ifcopenshell.util.geolocation.dms2dd(*site.RefLatitude)
    longitude = ifcopenshell.util.geolocation.dms2dd(*site.RefLongitude)
    assert [latitude, longitude] == pytest.approx([float(header[6]), float(header[7])])
    assert site.RefElevation == float(header[9])


def test_weather_is_the_file_that_the_source_note_names() -> None:
    note = (demo.FOLDER / "SOURCE.md").read_text()
    assert hashlib.sha256(demo.WEATHER.read_bytes()).hexdigest() in note
    assert len(demo.WEATHER.read_text().splitlines()) == 8 + 8760


def test_every_shipped_file_has_its_source_noted() -> None:
    note = (demo.FOLDER / "SOURCE.md").read_text()
    data = [p.name for p in Path(demo.FOLDER).iterdir() if p.suffix in {".ifc", ".epw", ".xml"}]
    assert all(f"`{name}`" in note for name in data)
