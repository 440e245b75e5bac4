"""Results written into a model: found again, replaced, valid by ifcopenshell's validator."""

from __future__ import annotations

import ifcopenshell
import ifcopenshell.util.element
import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.ifc.results_write import SET_NAME, write_results
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from tests.bim.small_ifc import box_room
from tests.bim.test_fenestration_ifc import faults

NOBODY = "0000000000000000000000"


@pytest.fixture(params=["IFC2X3", "IFC4", "IFC4X3"])
def path(request, tmp_path):
    path = tmp_path / "in.ifc"
    box_room(request.param).write(str(path))
    return path


def results_of(path, guid: str) -> dict:
    model = ifcopenshell.open(str(path))  # elements do not keep their file alive
    found = dict(ifcopenshell.util.element.get_psets(model.by_guid(guid)).get(SET_NAME, {}))
    found.pop("id", None)
    return found


def test_results_are_found_again_and_replaced(path, tmp_path):
    out = tmp_path / "out.ifc"
    building = read_ifc(path)
    space, window = building.spaces[0].guid, building.windows[0].guid
    values = {"DA 300 lx [%]": np.float64(0.1 + 0.2), "hours": np.int64(7), "met": True}
    values["method"] = Note("{count}-phase", count=3)  # a text that can be translated
    assert write_results(path, {space: values, window: {"gain [kWh]": 1 / 3}}, out) == ()
    assert results_of(out, space) == {**values, "DA 300 lx [%]": 0.1 + 0.2}
    assert results_of(out, window) == {"gain [kWh]": 1 / 3}
    assert faults(out) == faults(path)  # nothing but what the small model lacked before
    write_results(out, {space: {"DA 300 lx [%]": 50.0}}, out)
    assert results_of(out, space) == {"DA 300 lx [%]": 50.0}
    assert results_of(out, window) == {"gain [kWh]": 1 / 3}
    sets = [s for s in ifcopenshell.open(str(out)).by_type("IfcPropertySet") if s.Name == SET_NAME]
    assert len(sets) == 2 and faults(out) == faults(path)
    assert read_ifc(out).spaces[0].volume == building.spaces[0].volume


def test_rooms_without_an_entity_and_wrong_values(path, tmp_path):
    out = tmp_path / "out.ifc"
    space = read_ifc(path).spaces[0].guid
    (issue,) = write_results(path, {space: {"DA": 1.0}, NOBODY: {"DA": 2.0}}, out)
    assert issue.where == NOBODY
    out.unlink()
    with pytest.raises(DataError, match="none of the elements"):
        write_results(path, {NOBODY: {"DA": 2.0}}, out)
    for value in (float("nan"), None, [1.0]):
        with pytest.raises(ValueError, match="result DA"):
            write_results(path, {space: {"DA": value}}, out)
    assert not out.exists()
