"""Zones of an IFC file: read with their rooms, chosen by name."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell.api.group
import ifcopenshell.api.root
import pytest

from bim.building_file import chosen_spaces, named_spaces
from bim.ifc.building import read_ifc
from bim.model import Building
from mitsuba_cfs.errors import DataError
from tests.bim.small_ifc import DEPTH, HEIGHT, WALL, WIDTH, box_model


@pytest.fixture(scope="module")
def building(tmp_path_factory) -> Building:
    """A room with a window and one behind it without, both in a zone of a zone."""
    small, _ = box_model()
    low = (0.0, DEPTH + WALL, 0.0)
    small.box("IfcWall", "back", (0.0, DEPTH + WALL + 2, 0.0), (WIDTH, WALL, HEIGHT))
    small.box("IfcSpace", "R2", low, (WIDTH, 2.0, HEIGHT), LongName="Bath")
    model = small.model
    zones = []
    for name in ("Dwelling 1", "House"):
        zones.append(ifcopenshell.api.root.create_entity(model, ifc_class="IfcZone", name=name))
    zones[0].ObjectType = "Apartment"
    spaces = model.by_type("IfcSpace")
    ifcopenshell.api.group.assign_group(model, products=spaces, group=zones[0])
    ifcopenshell.api.group.assign_group(model, products=[zones[0]], group=zones[1])
    path = tmp_path_factory.mktemp("zones") / "m.ifc"
    model.write(str(path))
    path.with_name("m.corrections.toml").write_text('indoors = ["IfcSpace"]')
    return read_ifc(path)


def test_zones_have_their_rooms_and_those_of_zones_in_them(building) -> None:
    guids = {space.guid for space in building.spaces}
    assert len(guids) == 2
    assert [(zone.name, zone.kind) for zone in building.zones] == [("Dwelling 1", "Apartment"), ("House", "")]
    assert [set(zone.rooms) for zone in building.zones] == [guids, guids]


def test_a_zone_chooses_its_rooms(building) -> None:
    both = named_spaces(building, ["dwelling 1"], Path("m.ifc"))
    assert [space.name for space in both] == ["R1", "R2"]
    # the bath has no window: of a zone it is left out, by its name it is refused
    assert [s.name for s in chosen_spaces(building, ["Dwelling 1"], Path("m.ifc"))] == ["R1"]
    with pytest.raises(DataError, match="has no window"):
        chosen_spaces(building, ["R2"], Path("m.ifc"))
    with pytest.raises(DataError, match="zones: Dwelling 1, House"):
        named_spaces(building, ["Dwelling 3"], Path("m.ifc"))
