"""Rules of shading control in an IFC model: windows that move together are a group with its rule.

A group is an IfcGroup of the type `KIND`, to which its windows are assigned
(IfcRelAssignsToGroup); its property set `SET_NAME` has the keys of the rule, lists and tables as
JSON.  IfcControl is abstract, and the kinds that IFC4 has of it (orders, permits, calendars, costs,
work) are no rules of operation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell

from bim.ifc.project import open_ifc
from bim.ifc.property_sets import Entity, give_set, new_guid, owner_of, save, take_off
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text

KIND = "CFS shading control"  # ObjectType of the groups
SET_NAME = "CFS shading control"
AS_JSON = ("[", "{", '"')  # starts of the values that are stored as JSON
DESCRIPTION = "Rule by which the windows of the group change their shading state"


@dataclass(frozen=True, slots=True)
class StoredGroup:
    """Windows that move together by a rule."""

    name: str
    windows: tuple[str, ...]  # GUIDs
    rule: Mapping[str, Any] = field(default_factory=dict)  # keys of an operation file's [control]
    room: str = ""  # its label, for the group's name in the model


def write_control(path: str | PathLike[str], out: str | Path, groups: Sequence[StoredGroup]) -> None:
    """Write `out`: the model with these groups, in place of those that it has.

    Raises: `DataError` where the model cannot be read or written or lacks a window.
    """
    model = open_ifc(path)
    _remove(model)
    for group in groups:
        try:
            windows = [model.by_guid(guid) for guid in group.windows]
        except RuntimeError as error:
            raise DataError(str(error), file=path, element=group.name) from None
        name = f"{group.room}: {group.name}" if group.room else group.name
        described = (KIND, name, *group.windows)
        owner = owner_of(model)
        entity = model.create_entity("IfcGroup", new_guid(model, *described), owner, name, DESCRIPTION, KIND)
        model.create_entity(
            "IfcRelAssignsToGroup",
            new_guid(model, "windows", *described),
            owner,
            RelatedObjects=windows,
            RelatingGroup=entity,
        )
        properties = [_property(model, "name", group.name)]
        properties += [_property(model, key, value) for key, value in group.rule.items()]
        give_set(model, [entity], SET_NAME, DESCRIPTION, properties)
    save(model, out)


def read_control(path: str | PathLike[str]) -> tuple[StoredGroup, ...]:
    """The groups of a model that `write_control` wrote; none without.

    Raises: `DataError` where the model cannot be read, or a rule in it.
    """
    model, groups = open_ifc(path), []
    for entity in _groups(model):
        windows = [one.GlobalId for relation in _assigned(entity) for one in relation.RelatedObjects or ()]
        rule = {
            one.Name: _value(one, path, entity)
            for relation in entity.IsDefinedBy or ()
            if getattr(relation, "RelatingPropertyDefinition", None) is not None
            and relation.RelatingPropertyDefinition.Name == SET_NAME
            for one in relation.RelatingPropertyDefinition.HasProperties
        }
        name = str(rule.pop("name", entity.Name))
        groups.append(StoredGroup(name, tuple(windows), rule))
    return tuple(groups)


def _groups(model: ifcopenshell.file) -> list[Entity]:
    return [one for one in model.by_type("IfcGroup") if one.ObjectType == KIND]


def _assigned(entity: Entity) -> Sequence[Entity]:
    return entity.IsGroupedBy or ()


def _remove(model: ifcopenshell.file) -> None:
    """Remove the groups that an earlier call wrote."""
    for entity in _groups(model):
        take_off(model, entity, SET_NAME)
        for relation in list(_assigned(entity)):
            model.remove(relation)
        model.remove(entity)


def _property(model: ifcopenshell.file, name: str, value: Any) -> Entity:
    kind, stored = "IfcText", value
    if isinstance(value, bool):
        kind = "IfcBoolean"
    elif isinstance(value, int):
        kind = "IfcInteger"
    elif isinstance(value, float):
        kind = "IfcReal"
    elif not isinstance(value, str) or value.startswith(AS_JSON):
        stored = json_text(value)
    return model.create_entity("IfcPropertySingleValue", name, None, model.create_entity(kind, stored), None)


def _value(one: Entity, path: str | PathLike[str], group: Entity) -> Any:
    """The value of a property; JSON where it is a list or a table, or begins as one."""
    where: dict[str, Any] = {"file": path, "element": group.Name, "field": one.Name}
    nominal = getattr(one, "NominalValue", None)
    if nominal is None:
        raise DataError("has no value", **where)
    value = getattr(nominal, "wrappedValue", nominal)
    if not isinstance(value, str | bool | int | float):
        raise DataError("expected a single value", **where)
    if not isinstance(value, str) or not value.startswith(AS_JSON):
        return value
    try:
        return json.loads(value)
    except (ValueError, RecursionError) as error:
        raise DataError(f"is no list or table: {error}", **where) from None
