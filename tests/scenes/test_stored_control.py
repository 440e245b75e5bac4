"""Rules of shading control in an IFC file: written by the command, read by an operation file."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import pytest

import scenes as cfs
from bim.ifc.building import read_ifc
from bim.ifc.control import KIND, StoredGroup, read_control, write_control
from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.demo import OFFICE
from scenes.room.control_groups import control_groups, shared_groups
from scenes.room.operation import read_operation
from scenes.room.shading_rules import stated_keys

RULES = """
[control]
rule = "any"
hold_h = 2
[[control.parts]]
rule = "irradiance"
close_above = 180.0
open_below = 90.0
[[control.parts]]
rule = "glare"
seat = [2.0, 2.0, 1.2]
looks_deg = 90.0
"""
PLANS = """
[control]
rule = "predictive"
limit_dgp = 0.35
[control.predictive]
horizon_h = 12
forecast = "error"
"""


@pytest.fixture
def written(tmp_path):
    def of(rules: str, building: Path = OFFICE) -> Path:
        file, out = tmp_path / "rules.toml", tmp_path / f"of {building.stem}.ifc"
        file.write_text(rules)
        assert run(["ifc", "control", str(building), str(file), "-o", str(out)]) == 0
        return out

    return of


def taken(model: Path, folder: Path):
    """The operation that has its rules from a model."""
    file = folder / "office.toml"
    file.write_text(f'control_of = "{model.name}"\n[loads]\nheating_c = 20\n')
    return read_operation(file)


# keys beside a scenario that replace its own by the defaults of rules
SCENARIO = """
[control]
scenario = "EN ISO 13790"
close_above = 200.0
[[control.group]]
facades = ["S"]
rule = "any"
[[control.group.parts]]
scenario = "EnergyPlus OnIfHighZoneCooling"
close_above_w = 0.0
[[control.group]]
facades = ["N"]
scenario = "EnergyPlus OnNightIfLowOutdoorTempAndOffDay"
setpoint = 12
"""


@pytest.mark.parametrize("rules", [RULES.replace("seat = [2.0, 2.0, 1.2]\n", ""), PLANS, SCENARIO])
def test_rules_come_back_from_the_model_as_they_were(written, tmp_path, rules) -> None:
    out = written(rules)
    operation = taken(out, tmp_path)
    assert out in operation.files and operation.tables.loads.heating_c == 20
    stated = read_operation(tmp_path / "rules.toml").tables
    building = cfs.read_building(str(out))
    assert building.spaces and any(space.windows for space in building.spaces)
    for space in building.spaces:
        expected = control_groups(space, stated.of_room(building, space).control)
        found = control_groups(space, operation.tables.of_room(building, space).control)
        assert found.names == expected.names and found.rules == expected.rules
        assert found.number.tolist() == expected.number.tolist()
    assert operation.tables.control.predictive == stated.control.predictive


ACROSS = """
[control]
rule = "irradiance"
close_above = 180.0
hold_h = 2
across = "building"
groups = "room"
sensor_rooms = ["{room}"]
"""


def test_a_group_of_several_rooms_is_one_group_of_the_model(written, tmp_path) -> None:
    building = read_ifc(OFFICE)
    spaces = [space for space in building.spaces if space.windows]
    assert len(spaces) > 1
    out = written(ACROSS.format(room=spaces[0].guid))
    stored = read_control(out)
    expected = shared_groups(building, read_operation(tmp_path / "rules.toml").tables)
    assert {one.name: set(one.windows) for one in stored} == {
        one.name: {w.guid for windows in one.windows.values() for w in windows} for one in expected
    }
    assert max(len(one.windows) for one in expected) > 1
    back = shared_groups(building, taken(out, tmp_path).tables)
    assert [one.name for one in back] == [one.name for one in expected]
    for one, other in zip(back, expected, strict=True):
        assert one.windows == other.windows and one.sensor_rooms == other.sensor_rooms
        assert stated_keys(one.rule) == stated_keys(other.rule)


def test_the_groups_are_those_of_ifc_and_are_replaced(written, tmp_path) -> None:
    first = written("[control]\nrule = 'irradiance'\n")
    model = ifcopenshell.open(str(first))
    groups = [one for one in model.by_type("IfcGroup") if one.ObjectType == KIND]
    assert groups and len({one.Name for one in groups}) == len(groups)
    for group in groups:
        (relation,) = group.IsGroupedBy
        assert all(w.is_a("IfcWindow") or w.is_a("IfcDoor") for w in relation.RelatedObjects)
        (defined,) = group.IsDefinedBy
        values = {p.Name: p.NominalValue.wrappedValue for p in defined.RelatingPropertyDefinition.HasProperties}
        assert values["rule"] == "irradiance"
    again = written("[control]\nrule = 'always'\nstate = 1\n", first)
    stored = read_control(again)
    assert len(stored) == len(groups)
    assert all(one.rule == {"rule": "always", "state": 1} for one in stored)


def test_a_model_of_ifc2x3_holds_them_too(tmp_path) -> None:
    model = ifcopenshell.file(schema="IFC2X3")
    person = model.create_entity("IfcPerson", FamilyName="x")
    organisation = model.create_entity("IfcOrganization", Name="x")
    both = model.create_entity("IfcPersonAndOrganization", person, organisation)
    program = model.create_entity("IfcApplication", organisation, "1", "x", "x")
    owner = model.create_entity("IfcOwnerHistory", both, program, None, "ADDED", None, None, None, 0)
    guid = ifcopenshell.guid.new()
    model.create_entity("IfcWindow", guid, owner, "W1")
    path, out = tmp_path / "in.ifc", tmp_path / "out.ifc"
    path.write_text(model.to_string())
    rule = {"rule": "cut-off", "slat_tilts_deg": [0.0, 45.0], "slat_width": 0.06, "state": 1}
    write_control(path, out, [StoredGroup("S", (guid,), rule, "Office")])
    (stored,) = read_control(out)
    assert stored == StoredGroup("S", (guid,), rule)
    with pytest.raises(DataError, match="S"):
        write_control(path, out, [StoredGroup("S", (ifcopenshell.guid.new(),), rule)])


def test_what_a_model_cannot_hold_or_lacks_is_refused(tmp_path, capsys) -> None:
    file = tmp_path / "rules.toml"
    file.write_text(
        "[control]\nrule = 'schedule'\nschedule = 'use'\n[schedules.use]\nweekday = [{ hours = [8, 18], value = 0 }]\n"
    )
    out = tmp_path / "out.ifc"
    assert run(["ifc", "control", str(OFFICE), str(file), "-o", str(out)]) == 1
    assert "control.schedule: 'use': an IFC file holds 24 states" in capsys.readouterr().err
    (tmp_path / "bare.ifc").write_bytes(OFFICE.read_bytes())
    with pytest.raises(DataError, match=r"bare\.ifc: holds no rules of shading control"):
        taken(tmp_path / "bare.ifc", tmp_path)
    with pytest.raises(DataError, match=r"control_of: no such file"):
        taken(tmp_path / "none.ifc", tmp_path)
    (tmp_path / "both.toml").write_text('control_of = "a.ifc"\n[control]\nrule = "always"\n')
    with pytest.raises(DataError, match=r"control_of: the file has"):
        read_operation(tmp_path / "both.toml")


def test_a_name_may_begin_as_a_list_does(written, tmp_path) -> None:
    model = written("[control]\nrule = 'always'\n")
    window = ifcopenshell.open(str(model)).by_type("IfcWindow")[0].GlobalId
    group = StoredGroup("[A] south", (window,), {"rule": "always"})
    write_control(model, tmp_path / "named.ifc", [group])
    assert read_control(tmp_path / "named.ifc") == (group,)


def test_a_key_that_no_rule_has_is_refused(written, tmp_path) -> None:
    model = written("[control]\nrule = 'always'\n")
    window = ifcopenshell.open(str(model)).by_type("IfcWindow")[0].GlobalId
    out = tmp_path / "other.ifc"
    write_control(model, out, [StoredGroup("S", (window,), {"rule": "always", "close_over": 3})])
    with pytest.raises(DataError, match=r"other\.ifc: .*close_over"):
        taken(out, tmp_path)


def test_a_property_without_a_value_is_named(written, tmp_path) -> None:
    model = written("[control]\nrule = 'always'\n")
    window = ifcopenshell.open(str(model)).by_type("IfcWindow")[0].GlobalId
    out = tmp_path / "other.ifc"
    write_control(model, out, [StoredGroup("S", (window,), {"rule": "always"})])
    file = ifcopenshell.open(str(out))
    (rule,) = [p for p in file.by_type("IfcPropertySingleValue") if p.Name == "rule"]
    rule.NominalValue = None
    file.write(str(out))
    with pytest.raises(DataError, match=r"other\.ifc: S: rule: has no value"):
        taken(out, tmp_path)


def test_plans_of_a_room_without_a_seat_do_not_take_that_of_another(tmp_path, written) -> None:
    model = written("[control]\nrule = 'always'\n")
    first, second = (w.GlobalId for w in ifcopenshell.open(str(model)).by_type("IfcWindow")[:2])
    plan = {"rule": "predictive", "predictive": {}}
    groups = [StoredGroup("A", (first,), plan | {"seat": [1.0, 1.0, 1.2]}), StoredGroup("B", (second,), plan)]
    write_control(model, tmp_path / "plans.ifc", groups)
    control = taken(tmp_path / "plans.ifc", tmp_path).tables.control
    assert [control.rule_of(one).seat for one in control.group] == [(1.0, 1.0, 1.2), None]
