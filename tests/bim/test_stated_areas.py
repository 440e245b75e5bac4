"""Floor areas that a file states: between the walls, or to their middle."""

from __future__ import annotations

import ifcopenshell
import ifcopenshell.api.pset
import pytest

from bim.ifc.building import read_ifc
from tests.bim.small_ifc import DEPTH, HEIGHT, WALL, WIDTH, box_room
from tests.bim.test_joining import THICK, two_rooms
from tests.issues import of_code, texts


def state(path, areas: dict[str, float]) -> None:
    """Give the spaces of those names a floor area."""
    model = ifcopenshell.open(str(path))
    for space in model.by_type("IfcSpace"):
        pset = ifcopenshell.api.pset.add_pset(model, product=space, name="Dimensions")
        ifcopenshell.api.pset.edit_pset(model, pset=pset, properties={"Area": areas[space.Name]})
    model.write(str(path))


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
    (issue,) = of_code(building, "area-to-wall-middles")
    assert issue.values["room"] == "North" and not of_code(building, "floor-area-differs")


def test_area_of_no_definition_is_reported(tmp_path):
    path = tmp_path / "model.ifc"
    box_room().write(str(path))
    state(path, {"R1": 30.0})
    building = read_ifc(path)
    assert building.spaces[0].area_to_middles is None
    assert "stated as 30.00 m2 and drawn as 24.00 m2" in texts(building)


@pytest.mark.parametrize(
    ("unit", "height", "stated", "said"),
    [
        ("MILLIMETRE", HEIGHT, HEIGHT, "1000 times the drawn volume"),
        ("MILLIMETRE", HEIGHT + 0.5, None, "times its height of 3500 in another unit (3.50 m)"),
        ("METRE", HEIGHT + 0.5, HEIGHT + 0.5, "drawn as 72.00 m3"),  # a volume, and a wrong one
    ],
)
def test_volume_of_area_times_height_in_mixed_units(tmp_path, unit, height, stated, said):
    """Revit's GrossVolume: m2 times the file's unit of length, and the level's height at that."""
    path = tmp_path / "model.ifc"
    model = box_room(unit=unit)
    space = model.by_type("IfcSpace")[0]
    floor, high = WIDTH * DEPTH, height * (1000.0 if unit == "MILLIMETRE" else 1.0)
    quantities = {"NetFloorArea": floor, "Height": high, "GrossVolume": floor * high}
    pset = ifcopenshell.api.pset.add_qto(model, product=space, name="BaseQuantities")
    ifcopenshell.api.pset.edit_qto(model, qto=pset, properties=quantities)
    model.write(str(path))
    building = read_ifc(path)
    expected = None if stated is None else pytest.approx(floor * stated, rel=1e-6)
    assert building.spaces[0].stated_volume == expected
    assert said in texts(building)
