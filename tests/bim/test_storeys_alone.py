"""A storey of an IFC model that is read without the rest."""

from __future__ import annotations

import ifcopenshell
import ifcopenshell.util.element
import pytest

from bim.building_file import ReadOptions, named_spaces, read_building_file
from bim.ifc.building import read_ifc
from bim.ifc.damage import Damage
from bim.ifc.project import storey_of
from bim.ifc.source import keep_storeys
from mitsuba_cfs.errors import DataError
from tests.benchmarks.tower import tower

STOREYS = 5


@pytest.fixture(scope="module")
def model_text() -> str:
    """A tower of five storeys, each of ten rooms."""
    return tower(10 * STOREYS).to_string()


def test_the_next_storeys_are_kept_with_their_openings(model_text):
    model = ifcopenshell.file.from_string(model_text)
    walls = len(model.by_type("IfcWall"))
    (issue,) = keep_storeys(model, ["storey  3"], "tower.ifc", Damage())
    assert {storey_of(space) for space in model.by_type("IfcSpace")} == {"Storey 2", "Storey 3", "Storey 4"}
    assert len(model.by_type("IfcSpace")) == 30
    assert len(model.by_type("IfcWall")) == walls * 3 // STOREYS
    assert all(relation.RelatedOpeningElement for wall in model.by_type("IfcWall") for relation in wall.HasOpenings)
    assert all(window.FillsVoids for window in model.by_type("IfcWindow"))
    assert issue.values["spaces"] == 20
    assert issue.values["storeys"] == ("Storey 3",)
    assert issue.values["near"] == ("Storey 2", "Storey 4")


def test_a_wall_of_the_ground_storey_that_reaches_up_is_kept_with_its_window(model_text):
    model = ifcopenshell.file.from_string(model_text)
    wall = next(one for one in model.by_type("IfcWall") if storey_of(one) == "Storey 0" or one.Name == "South wall")
    body = next(r for r in wall.Representation.Representations if r.RepresentationIdentifier == "Body")
    solid = body.Items[0]
    while not solid.is_a("IfcExtrudedAreaSolid"):
        solid = solid.FirstOperand
    solid.Depth = 5 * solid.Depth
    guid, openings = wall.GlobalId, len(wall.HasOpenings)
    keep_storeys(model, ["Storey 4"], "tower.ifc", Damage())
    kept = [relation.RelatedOpeningElement for relation in model.by_guid(guid).HasOpenings]
    assert len(kept) == openings > 0
    assert all(opening is not None and opening.HasFillings for opening in kept)
    assert len([one for one in model.by_type("IfcWall") if one.Name == "South wall"]) == 3


def test_windows_of_a_whole_without_a_body_are_decided_by_their_opening(model_text):
    """As in a roof that is an aggregate of slabs, whose openings void the whole."""
    model = ifcopenshell.file.from_string(model_text)
    for wall in model.by_type("IfcWall"):
        wall.Representation = None
    windows = len(model.by_type("IfcWindow"))
    keep_storeys(model, ["Storey 3"], "tower.ifc", Damage())
    assert {storey_of(one) for one in model.by_type("IfcWindow")} == {"Storey 2", "Storey 3", "Storey 4"}
    assert len(model.by_type("IfcWindow")) == windows * 3 // STOREYS
    assert all(window.FillsVoids for window in model.by_type("IfcWindow"))


def test_a_storey_that_is_not_there_is_refused(tmp_path, model_text):
    path = tmp_path / "tower.ifc"
    path.write_text(model_text)
    with pytest.raises(DataError, match=r"no storey 'Storey 9'; there are: Storey"):
        read_building_file(path, ReadOptions(storeys=("Storey 9",)))
    with pytest.raises(DataError, match="not for gbXML files"):
        read_building_file("house.gbxml", ReadOptions(storeys=("Storey 9",)))


@pytest.mark.slow
def test_rooms_of_a_storey_are_those_of_the_whole(tmp_path, model_text):
    path = tmp_path / "tower.ifc"
    path.write_text(model_text)
    whole, part = read_ifc(path), read_ifc(path, storeys=["Storey 2"])
    rooms = named_spaces(part, ["Storey 2"], path)
    assert len(rooms) == 10
    for room in rooms:
        same = whole.space(room.guid)
        assert room.volume == pytest.approx(same.volume, rel=1e-9)
        assert [(f.kind, f.adjacency, f.neighbour, f.construction) for f in room.faces] == [
            (f.kind, f.adjacency, f.neighbour, f.construction) for f in same.faces
        ]
        assert [w.area for w in room.windows] == pytest.approx([w.area for w in same.windows])
