"""Fenestration data attached to the windows of an IFC file, written to a new file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import ifcopenshell
import ifcopenshell.guid

from bim.fenestration import ShadingState
from bim.ifc.fenestration_write import attach_state
from bim.ifc.project import open_ifc
from bim.ifc.property_sets import owner_of, save
from mitsuba_cfs.errors import DataError

GLAZED = ("IfcWindow", "IfcDoor", "IfcPlate", "IfcCurtainWall")


def attach(
    path: str | Path,
    out: str | Path,
    state: ShadingState,
    *,
    windows: Sequence[str] = (),
    types: Sequence[str] = (),
    every_window: bool = False,
    bsdf_reference: str | Path | None = None,
) -> int:
    """Write `out`: the model with the state attached; the number of windows and types that got it.

    Args:
        windows: GUIDs of windows, doors or glazed panels.
        types: names of window types (IfcWindowType, IfcWindowStyle) or of windows' ObjectType.
        every_window: all IfcWindow.
        bsdf_reference: name this BSDF file by an IfcDocumentReference instead of copying numbers.
    """
    model = open_ifc(path)
    targets = chosen(model, path, windows, types, every_window)
    if state.bands or state.g_value is not None or state.u_value is not None:
        attach_state(model, targets, state)
    if bsdf_reference is not None:
        refer(model, targets, os.path.relpath(bsdf_reference, Path(out).resolve().parent))
    save(model, out)
    return len(targets)


def chosen(
    model: ifcopenshell.file,
    path: str | Path,
    windows: Sequence[str],
    types: Sequence[str],
    every_window: bool,
) -> list[ifcopenshell.entity_instance]:
    """Windows and window types that are meant; `DataError` where one is not there."""
    targets: dict[int, ifcopenshell.entity_instance] = {}
    if every_window:
        targets |= {one.id(): one for one in model.by_type("IfcWindow")}
        if not targets:
            raise DataError("holds no IfcWindow", file=path)
    for guid in windows:
        try:
            one = model.by_guid(guid)
        except RuntimeError:
            raise DataError(f"no element {guid!r}", file=path) from None
        if not one.is_a().startswith(GLAZED):
            raise DataError(f"is {one.is_a()}, no window", file=path, element=guid)
        targets[one.id()] = one
    for name in types:
        found = [one for one in model.by_type("IfcTypeProduct") if one.Name == name]
        found = [one for one in found if one.is_a().startswith(GLAZED)]
        found = found or [one for one in model.by_type("IfcWindow") if one.ObjectType == name]
        if not found:
            raise DataError(f"no window type {name!r}", file=path)
        targets |= {one.id(): one for one in found}
    if not targets:
        raise DataError("no window chosen: give a GUID, a type or all", file=path)
    return list(targets.values())


def refer(
    model: ifcopenshell.file, targets: Sequence[ifcopenshell.entity_instance], location: str
) -> None:
    """Associate a BSDF file with windows or types by an IfcDocumentReference."""
    reference = model.create_entity(
        "IfcDocumentReference", Location=location.replace(os.sep, "/"), Name="BSDF"
    )
    model.create_entity(
        "IfcRelAssociatesDocument",
        GlobalId=ifcopenshell.guid.new(),
        OwnerHistory=owner_of(model),
        Name="BSDF",
        RelatedObjects=list(targets),
        RelatingDocument=reference,
    )
