"""Fenestration data attached to the windows of an IFC file, written to a new file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import ifcopenshell

from bim.fenestration import ShadingState
from bim.ifc.fenestration_write import attach_state, set_name
from bim.ifc.project import open_ifc
from bim.ifc.property_sets import Entity, new_guid, owner_of, read_again, save, take_off
from bim.ifc.targets import Targets, target_elements

REFERENCE = "BSDF"  # name of the document


def attach(
    path: str | Path,
    out: str | Path,
    state: ShadingState,
    targets: Targets,
    *,
    bsdf_reference: str | Path | None = None,
) -> int:
    """Write `out`: the model with the state attached; the number of windows and types that got it.

    A state of that name is replaced: the same state once more gives the same file.

    Args:
        bsdf_reference: name this BSDF file by an IfcDocumentReference instead of copying numbers.
    """
    model = open_ifc(path)
    elements = target_elements(model, path, targets)
    location = None
    if bsdf_reference is not None:
        location = os.path.relpath(bsdf_reference, Path(out).resolve().parent).replace(os.sep, "/")
    if _removed(model, elements, state, location):
        guids = [element.GlobalId for element in elements]
        model = read_again(model)
        elements = [model.by_guid(guid) for guid in guids]
    if state.holds_data:
        attach_state(model, elements, state)
    if location is not None:
        refer(model, elements, location)
    save(model, out)
    return len(elements)


def _removed(model: ifcopenshell.file, targets: Sequence[Entity], state: ShadingState, location: str | None) -> bool:
    """Remove the state and the reference that the targets have already; whether there was one."""
    removed = False
    if state.holds_data:
        removed = any([take_off(model, one, set_name(state.name)) for one in targets])
    for relation in model.by_type("IfcRelAssociatesDocument"):
        document = relation.RelatingDocument
        same = location is not None and getattr(document, "Location", None) == location
        if same and relation.Name == REFERENCE and set(relation.RelatedObjects) <= set(targets):
            removed = True
            model.remove(relation)
            if not model.get_total_inverses(document):
                model.remove(document)
    return removed


def refer(model: ifcopenshell.file, targets: Sequence[Entity], location: str) -> None:
    """Associate a BSDF file with windows or types by an IfcDocumentReference."""
    reference = model.create_entity("IfcDocumentReference", Location=location, Name=REFERENCE)
    model.create_entity(
        "IfcRelAssociatesDocument",
        GlobalId=new_guid(model, location, *(target.GlobalId for target in targets)),
        OwnerHistory=owner_of(model),
        Name=REFERENCE,
        RelatedObjects=list(targets),
        RelatingDocument=reference,
    )
