"""A mistake of the program's own ends the reading of a file; damage of the file is an issue."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable
from pathlib import Path

import ifcopenshell.api.material
import ifcopenshell.api.pset
import ifcopenshell.util.element
import numpy as np
import pytest

import bim
from bim.fenestration import ShadingState
from bim.ifc.attach import attach
from bim.ifc.damage import Damage
from bim.ifc.fenestration_read import read_states
from bim.ifc.project import open_ifc
from bim.ifc.targets import Targets
from bim.shoebox import shoebox
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBsdf
from tests.bim.honeybee_models import write
from tests.bim.small_ifc import HEIGHT, WIDTH, box_model, box_room
from tests.bim.test_space_boundaries import boundary
from tests.bim.test_stated_use import used_gbxml, used_model
from tests.issues import of_code

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
KINDS = (TypeError, NameError, ZeroDivisionError, AttributeError, KeyError)
HOUSE = shoebox(4, 5, 3)


def ifc(folder: Path) -> object:
    small, _ = box_model()
    (space,) = small.model.by_type("IfcSpace")
    wall = next(one for one in small.model.by_type("IfcWall") if one.Name == "north")
    boundary(small.model, space, wall, WIDTH, HEIGHT, hole=False, beyond="EXTERNAL")
    small.model.write(str(folder / "model.ifc"))
    return bim.read_ifc(folder / "model.ifc")


def states(folder: Path) -> object:
    box_room().write(str(folder / "model.ifc"))
    blocks = np.full((4, KLEMS_QUARTER.size, KLEMS_QUARTER.size), 0.05)
    state = ShadingState("", {"Visible": KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, *blocks)})
    attach(folder / "model.ifc", folder / "out.ifc", state, Targets(every_window=True))
    return read_states(open_ifc(folder / "out.ifc"), folder)


def hbjson(folder: Path) -> object:
    return bim.read_honeybee(write(used_model(), folder))


def gbxml(folder: Path) -> object:
    path = folder / "used.xml"
    path.write_text(used_gbxml())
    return bim.read_gbxml(path)


def radiance(_: Path) -> object:
    return bim.read_radiance(TUTORIALS / "office.rad")


def around(folder: Path) -> object:
    footprint = {
        "type": "FeatureCollection",
        "crs": {"properties": {"name": "urn:ogc:def:crs:EPSG::25832"}},
        "features": [
            {
                "type": "Feature",
                "properties": {"height": 9},
                "geometry": {"type": "Polygon", "coordinates": [[[30, 0], [40, 0], [40, 10], [30, 10], [30, 0]]]},
            }
        ],
    }
    (folder / "a.geojson").write_text(json.dumps(footprint))
    files = [TUTORIALS / "quarter.city.json", TUTORIALS / "horizon.csv", folder / "a.geojson"]
    return bim.with_surroundings(HOUSE, files, offset=(0, 0, 0))


PLACES: list[tuple[Callable[[Path], object], str]] = [
    (ifc, "ifcopenshell.util.element:get_type"),
    (ifc, "ifcopenshell.util.element:get_material"),
    (ifc, "ifcopenshell.util.unit:calculate_unit_scale"),
    (ifc, "ifcopenshell.util.placement:get_local_placement"),
    (ifc, "bim.ifc.materials:_material_of"),
    (ifc, "bim.ifc.materials:MaterialReader.material"),
    (ifc, "bim.ifc.materials:own_materials"),
    (ifc, "bim.ifc.project:definitions_of"),
    (ifc, "bim.ifc.project:_unit_scale"),
    (ifc, "bim.ifc.fillings:_frame_width"),
    (ifc, "bim.ifc.fillings:_panel"),
    (ifc, "bim.ifc.elements:cad_layers_of"),
    (ifc, "bim.ifc.surface_styles:_reflected"),
    (ifc, "bim.ifc.space_boundaries:_area"),
    (ifc, "bim.ifc.spaces:label_of"),
    (states, "bim.ifc.fenestration_read:KlemsBasis"),
    (states, "bim.ifc.fenestration_read:_numbers"),
    (hbjson, "bim.honeybee.use:hourly_means"),
    (hbjson, "bim.honeybee.use:ScheduleLibrary._rules"),
    (hbjson, "bim.honeybee.building:triangles_of_rings"),
    (hbjson, "bim.polygon_rooms:flat_polygon"),
    (gbxml, "bim.gbxml.building:hourly_means"),
    (gbxml, "bim.gbxml.building:resistance_layer"),
    (radiance, "bim.radiance.scene:material_of"),
    (radiance, "bim.radiance.scene:triangles_of"),
    (around, "bim.surroundings.city_models:triangles_of_surfaces"),
    (around, "bim.surroundings.city_models:_surfaces"),
    (around, "bim.surroundings.city_models:crs_name"),
    (around, "bim.surroundings.placement:horizon_wall"),
]


@pytest.mark.parametrize(
    ("read", "place", "kind"),
    [(read, place, KINDS[i % len(KINDS)]) for i, (read, place) in enumerate(PLACES)],
    ids=[f"{place}-{KINDS[i % len(KINDS)].__name__}" for i, (_, place) in enumerate(PLACES)],
)
def test_a_mistake_of_the_program_ends_the_reading(tmp_path, monkeypatch, read, place, kind):
    class Planted(kind):
        """An error that only the planted function raises."""

    def fail(*_: object, **__: object) -> None:
        raise Planted("planted")

    module, _, name = place.partition(":")
    owner: object = importlib.import_module(module)
    *above, last = name.split(".")
    for part in above:
        owner = getattr(owner, part)
    monkeypatch.setattr(owner, last, fail)
    with pytest.raises(Planted):
        read(tmp_path)


def test_a_wrong_argument_for_ifcopenshell_is_a_mistake_of_the_program():
    (wall, *_) = box_room().by_type("IfcWall")
    with pytest.raises(TypeError, match="should_skip"):
        Damage().read(
            ifcopenshell.util.element.get_material, wall, should_skip=True, of=wall, data="material", default=None
        )


@pytest.mark.parametrize(
    ("pattern", "damaged", "data"),
    [
        (r"IFCSIUNIT\(\*,\.LENGTHUNIT\.,\$,", "IFCSIUNIT(*,.LENGTHUNIT.,5.,", "units"),
        (r"(IFCRELASSOCIATESMATERIAL\(.*,)#\d+\)", r"\1#999999)", "material"),
        (r"(IFCBUILDINGSTOREY\('[^']*',#\d+,'[^']*',\$,\$,)#\d+", r"\1#7", "placement"),
        (r"(IFCPROPERTYSINGLEVALUE\('Stated',\$,)[^,]*", r"\1'x'", "properties"),
    ],
    ids=["units", "material", "placement", "properties"],
)
def test_damage_of_the_file_is_an_issue_and_the_rest_is_read(tmp_path, pattern, damaged, data):
    model = box_room()
    (window,) = model.by_type("IfcWindow")
    pset = ifcopenshell.api.pset.add_pset(model, product=window, name="Pset_Own")
    ifcopenshell.api.pset.edit_pset(model, pset=pset, properties={"Stated": 1.5})
    wall = next(one for one in model.by_type("IfcWall") if one.Name == "east")
    stone = ifcopenshell.api.material.add_material(model, name="stone")
    ifcopenshell.api.material.assign_material(model, products=[wall], material=stone)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    text, count = re.subn(pattern, damaged, path.read_text())
    assert count
    path.write_text(text)
    building = bim.read_ifc(path)
    (issue, *_) = of_code(building, "damaged-data")
    assert issue.values["data"].key == f"data-{data}" and issue.values["reason"]
    assert len(building.spaces) == 1 and building.spaces[0].windows
