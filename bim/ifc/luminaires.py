"""Luminaires of an IFC file: where they are, their power, and the file of their photometry.

Position and turn are those of the placement.  Photometry is the file that a light source of the
fixture names (IfcLightSourceGoniometric), or a property whose value ends in .ies or .ldt (Revit's
"Photometric Web File"); power is Pset_LightFixtureTypeCommon's TotalWattage, or Revit's "Wattage".
Of a fixture with power alone the light is not known.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bim.ifc.damage import entities, placement_of
from bim.ifc.project import length_scale, psets_of
from bim.ifc.source import Source
from bim.model import ModelLuminaire

Entity = Any  # of ifcopenshell, which has no types
WATTS = ("TotalWattage", "Wattage")  # names of properties, the first that is there
FILES = (".ies", ".ldt")


def read_luminaires(source: Source) -> tuple[ModelLuminaire, ...]:
    """The light fixtures that have a placement, of IFC4 on, or IFC2X3's terminals of such a type."""
    unit, result = length_scale(source.model), []
    gone = source.corrections.removed(source.model)
    for one in source.model.by_type("IfcDistributionFlowElement"):
        place = placement_of(one, source.damage) if _is_fixture(one) and one.id() not in gone else None
        if place is None:
            continue
        place[:3, 3] *= unit
        psets = [psets_of(part, source.damage) for part in (one, _type(one)) if part is not None]
        values = {key: value for sets in reversed(psets) for of in sets.values() for key, value in of.items()}
        axis = source.placed.rotation @ place[:3, 0]
        result.append(
            ModelLuminaire(
                str(one.Name or one.GlobalId),
                tuple(source.placed.to_world(place[:3, 3]).tolist()),
                math.degrees(math.atan2(axis[1], axis[0])),
                _watts(values),
                _photometry(one, values),
            )
        )
    return tuple(result)


def _is_fixture(one: Entity) -> bool:
    if one.is_a("IfcLightFixture"):
        return True
    kind = _type(one)
    return kind is not None and bool(kind.is_a("IfcLightFixtureType"))


def _type(one: Entity) -> Entity | None:
    """The type of an element, IFC2X3 or later."""
    for name in ("IsTypedBy", "IsDefinedBy"):
        for relation in getattr(one, name, None) or ():
            if relation.is_a("IfcRelDefinesByType"):
                return relation.RelatingType
    return None


def _watts(values: dict[str, Any]) -> float | None:
    for name in WATTS:
        value = values.get(name)
        if isinstance(value, int | float) and np.isfinite(value) and value > 0:
            return float(value)
    return None


def _photometry(one: Entity, values: dict[str, Any]) -> str:
    """The name of the file; empty without one."""
    for items in (_items(part) for part in (one, _type(one)) if part is not None):
        for item in items:
            if item.is_a("IfcLightSourceGoniometric"):
                location = getattr(item.LightDistributionDataSource, "Location", None)
                if location:  # of an external file; else a table of intensities, which is not read
                    return str(location)
    named = (v for v in values.values() if isinstance(v, str) and v.strip().lower().endswith(FILES))
    return next(named, "").strip()


def _items(one: Entity) -> list[Entity]:
    """The items of all representations of an element or a type."""
    shape = getattr(one, "Representation", None)
    maps = [r.MappedRepresentation for r in getattr(one, "RepresentationMaps", None) or ()]
    whole = [*maps, *(shape.Representations if shape is not None else ())]
    return [item for representation in whole for item in entities(representation.Items)]
