"""Floor areas that a file states: between the walls, or to their middle."""

from __future__ import annotations

import ifcopenshell
import ifcopenshell.api.pset
import pytest

from bim.ifc.building import read_ifc
from tests.bim.small_ifc import DEPTH, WALL, WIDTH, box_room
from tests.bim.test_joining import THICK, two_rooms


def state(path, areas: dict[str, float]) -> None:
    """Give the spaces of those names a floor area."""
    model = ifcopenshell.open(str(path))
    for space in model.by_type("IfcSpace"):
        pset = ifcopenshell.api.pset.add_pset(model, product=space, name="Dimensions")
        ifcopenshell.api.pset.edit_pset(model, pset=pset, properties={"Area": areas[space.Name]})
    model.write(str(path))


def texts(building) -> str:
    return "\n".join(problem.what for problem in building.problems)


@pytest.mark.parametrize("cut", [True, False])
def test_area_to_the_middle_of_the_walls_is_recognised(tmp_path, cut):
    path = two_rooms(tmp_path, cut=cut)  # a passage in the partition does not take it away
    half = (DEPTH - THICK) / 2
    middles = (WIDTH + WALL) * (half + WALL / 2 + THICK / 2)
    state(path, {"South": WIDTH * half, "North": middles})
    building = read_ifc(path)
    south, north = building.space("South"), building.space("North")
    assert south.area_to_middles is None and south.area_as_stated == south.floor_area
    # 1e-6: overlays of polygons are rounded to a micrometre
    assert north.area_to_middles == pytest.approx(middles, rel=1e-5)
    assert north.floor_area == pytest.approx(WIDTH * half, rel=1e-6)
    assert "North: states" in texts(building) and "South: states" not in texts(building)


def test_area_of_no_definition_is_reported(tmp_path):
    path = tmp_path / "model.ifc"
    box_room().write(str(path))
    state(path, {"R1": 30.0})
    building = read_ifc(path)
    assert building.spaces[0].area_to_middles is None
    assert "states 30.00 m2 floor area, drawn 24.00 m2" in texts(building)
