"""Zones of an IFC file: which rooms belong together, such as a dwelling's."""

from __future__ import annotations

import ifcopenshell

from bim.ifc.damage import Damage, entities, instances
from bim.ifc.project import psets_of
from bim.model import SpaceGroup

DEEPEST = 20  # zones of zones


def read_zones(model: ifcopenshell.file, damage: Damage | None = None) -> tuple[SpaceGroup, ...]:
    """The IfcZone with spaces, each with those of its parts; its kind is what its texts say.

    Kind: ObjectType, LongName, Description and Pset_ZoneCommon's Category and Reference.
    """
    zones = []
    for zone in instances(model, "IfcZone"):
        rooms = tuple(dict.fromkeys(_spaces(zone, DEEPEST)))
        common = psets_of(zone, damage).get("Pset_ZoneCommon", {})
        texts = [getattr(zone, key, None) for key in ("ObjectType", "LongName", "Description")]
        texts += [common.get("Category"), common.get("Reference")]
        if rooms:
            kind = ", ".join(str(text) for text in texts if text)
            zones.append(SpaceGroup(zone.Name or kind or zone.GlobalId, kind, rooms))
    return tuple(zones)


def _spaces(group: ifcopenshell.entity_instance, depth: int) -> list[str]:
    """GUIDs of the spaces of a zone and of the zones in it."""
    found: list[str] = []
    for relation in getattr(group, "IsGroupedBy", None) or ():
        for one in entities(relation.RelatedObjects):
            if one.is_a("IfcSpace"):
                found.append(one.GlobalId)
            elif one.is_a("IfcGroup") and depth:
                found += _spaces(one, depth - 1)
    return found
