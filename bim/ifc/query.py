"""What a selector of the corrections chooses in an IFC file, without its geometry."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike

import ifcopenshell

from bim.ifc.corrections import chosen
from bim.ifc.damage import type_of
from bim.ifc.elements import cad_layers_of, material_name
from bim.ifc.project import open_ifc, storey_of


@dataclass(frozen=True, slots=True)
class ChosenElement:
    """An element of a file as its author would look for it."""

    ifc_class: str
    name: str
    type_name: str
    storey: str
    material: str  # the first of several
    layer: str  # CAD layer, the first of several
    guid: str


def query(path: str | PathLike[str], selector: str) -> list[ChosenElement]:
    """The elements that a selector chooses, by class, storey and name.

    Raises: `DataError` where the file cannot be read or the selector is none.
    """
    model = open_ifc(path)
    elements = [_described(model.by_id(step_id)) for step_id in chosen(model, selector)]
    return sorted(elements, key=lambda one: (one.ifc_class, one.storey, one.name, one.guid))


def _described(element: ifcopenshell.entity_instance) -> ChosenElement:
    kind = type_of(element)
    return ChosenElement(
        element.is_a(),
        element.Name or "",
        (kind.Name or "") if kind is not None else "",
        storey_of(element),
        material_name(element),
        next(iter(cad_layers_of(element)), ""),
        element.GlobalId,
    )
