"""Results of simulations written back into an IFC model: property sets on spaces and windows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike

import ifcopenshell

from bim.ifc.project import open_ifc
from bim.ifc.property_sets import Entity, give_set, save
from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError

SET_NAME = "CFS results"
MEASURES = {bool: "IfcBoolean", int: "IfcInteger", float: "IfcReal", str: "IfcText"}
Value = bool | int | float | str


def write_results(
    path: str | PathLike[str],
    results: Mapping[str, Mapping[str, Value]],
    out: str | PathLike[str],
    *,
    set_name: str = SET_NAME,
    description: str = "Computed by mitsuba-cfs",
) -> tuple[Issue, ...]:
    """Write `out`: the model with a property set of results on each element; what had no place.

    A set of that name that an element already has is replaced.  Rooms found from geometry have no
    entity in the file: they are returned as issues.

    Args: results: GUID of a space, window or other element -> name of the result, with its unit in
        the name -> value.
    Raises: `DataError` where the model cannot be read or written or holds none of the elements;
        `ValueError` for a value that is no number, truth value or text.
    """
    model = open_ifc(path)
    issues = []
    for guid, values in results.items():
        try:
            element = model.by_guid(guid)
        except RuntimeError:
            issues.append(Issue("result-without-element", guid))
            continue
        properties = [_property(model, name, value) for name, value in values.items()]
        if properties:
            give_set(model, [element], set_name, description, properties)
    if results and len(issues) == len(results):
        raise DataError("holds none of the elements that have results", file=path)
    save(model, out)
    return tuple(issues)


def _property(model: ifcopenshell.file, name: str, value: Value) -> Entity:
    if hasattr(value, "item"):  # NumPy's numbers
        value = value.item()
    if isinstance(value, str):  # a note is a text that can be translated
        value = str(value)
    if type(value) not in MEASURES or (isinstance(value, float) and not math.isfinite(value)):
        raise ValueError(f"result {name}: expected a number, truth value or text, got {value!r}")
    nominal = model.create_entity(MEASURES[type(value)], value)
    return model.create_entity("IfcPropertySingleValue", Name=name, NominalValue=nominal)
