"""Fenestration data attached to the windows of an IFC file, written to a new file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import ifcopenshell

from bim.fenestration import ShadingState
from bim.ifc.fenestration_write import attach_state
from bim.ifc.project import open_ifc
from bim.ifc.property_sets import new_guid, owner_of, save
from bim.ifc.targets import Targets, target_elements


def attach(
    path: str | Path,
    out: str | Path,
    state: ShadingState,
    targets: Targets,
    *,
    bsdf_reference: str | Path | None = None,
) -> int:
    """Write `out`: the model with the state attached; the number of windows and types that got it.

    Args:
        bsdf_reference: name this BSDF file by an IfcDocumentReference instead of copying numbers.
    """
    model = open_ifc(path)
    elements = target_elements(model, path, targets)
    if state.holds_data:
        attach_state(model, elements, state)
    if bsdf_reference is not None:
        refer(model, elements, os.path.relpath(bsdf_reference, Path(out).resolve().parent))
    save(model, out)
    return len(elements)


def refer(
    model: ifcopenshell.file, targets: Sequence[ifcopenshell.entity_instance], location: str
) -> None:
    """Associate a BSDF file with windows or types by an IfcDocumentReference."""
    reference = model.create_entity(
        "IfcDocumentReference", Location=location.replace(os.sep, "/"), Name="BSDF"
    )
    model.create_entity(
        "IfcRelAssociatesDocument",
        GlobalId=new_guid(model, location, *(target.GlobalId for target in targets)),
        OwnerHistory=owner_of(model),
        Name="BSDF",
        RelatedObjects=list(targets),
        RelatingDocument=reference,
    )
