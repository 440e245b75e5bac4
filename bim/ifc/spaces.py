"""IfcSpace as closed solids, with names, storeys and stated quantities."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import ifcopenshell

from bim.ifc.corrections import RoomName
from bim.ifc.damage import Damage, type_of
from bim.ifc.project import psets_of, storey_of
from bim.ifc.quantities import QuantityScales, checked_volume, stated_quantities
from bim.ifc.shapes import Shape
from bim.isolated_solids import spaces_of
from bim.names import label_of
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import RoomSolid, room_solid
from mitsuba_cfs.processes import ProcessEnded

SMALLEST_SPACE = 0.2  # smaller spaces are beams or ducts of the wrong class [m3]
OVERLAPPING, REMOVED = "spaces-overlap", "space-removed"  # codes of issues
OUTDOORS = "space-outdoors"
FILE_NAMES = RoomName("", None, None)


@dataclass(frozen=True, slots=True)
class SpaceRecord:
    """A space of the file with its solid."""

    solid: RoomSolid
    name: str
    long_name: str
    storey: str
    volume: float  # of the solid as drawn [m3]
    stated_area: float | None
    stated_volume: float | None
    type_name: str = ""
    raised: float = 0.0  # of the volume: above the space as drawn, up to what covers it [m3]
    cut: float = 0.0  # drawn beyond the slab, roof or ceiling that ends the room [m3]
    step_id: int = 0  # of the space; 0 for a room found from geometry

    @property
    def guid(self) -> str:
        """GUID of the space."""
        return self.solid.guid

    @property
    def label(self) -> str:
        """Number and name of the space as people use them."""
        return label_of(self.name, self.long_name, self.guid)


def read_spaces(
    model: ifcopenshell.file,
    shapes: dict[int, Shape],
    scales: QuantityScales,
    damage: Damage | None = None,
    *,
    stated: Mapping[int, bool] | None = None,
    removed: Collection[int] = (),
    names: Mapping[int, RoomName] | None = None,
) -> tuple[list[SpaceRecord], list[Issue]]:
    """Every space that is indoors by the file and has a body; the others are issues.

    Args:
        stated: whether spaces are outdoors, by STEP id, where the corrections say so.
        removed: STEP ids of what the corrections leave out.
        names: by STEP id, where the corrections state any.
    """
    stated = {} if stated is None else stated
    records: list[SpaceRecord] = []
    issues: list[Issue] = []
    seen: set[str] = set()
    spaces = model.by_type("IfcSpace")
    drawn = {space.id(): shapes[space.id()] for space in spaces if space.id() in shapes}
    bodies = spaces_of([shape.triangles for shape in drawn.values()])
    solids = dict(zip(drawn, bodies, strict=True))
    for space in spaces:
        guid = space.GlobalId
        stated_name = (names or {}).get(space.id(), FILE_NAMES)
        name = space.Name if stated_name.name is None else stated_name.name
        long_name = space.LongName if stated_name.long_name is None else stated_name.long_name
        label = label_of(name or "", long_name or "", guid)
        if guid in seen:
            guid = f"{guid}-{space.id()}"
            values = {"room": label, "guid": guid}
            issues.append(Issue("space-guid-repeated", space.GlobalId, values))
        seen.add(guid)
        if space.id() in removed:
            issues.append(Issue(REMOVED, guid, {"room": label}, Effect("room")))
            continue
        psets = psets_of(space, damage)
        if space.id() not in stated and is_outdoors(space, psets):
            issues.append(Issue("space-external", guid, {"room": label}, Effect("room")))
            continue
        if space.id() not in solids:
            issues.append(Issue("space-without-geometry", guid, {"room": label}, Effect("room")))
            continue
        solid = solids[space.id()]
        if solid is None:
            issues.append(Issue("space-encloses-nothing", guid, {"room": label}, Effect("room")))
            continue
        if isinstance(solid, ProcessEnded):
            values = {"room": label, "reason": str(solid)}
            issues.append(Issue("space-not-computed", guid, values, Effect("room")))
            continue
        if solid.volume < SMALLEST_SPACE:
            values = {"room": label, "volume": solid.volume}
            issues.append(Issue("space-too-small", guid, values, Effect("room")))
            continue
        if stated.get(space.id()):
            reason = Phrase("outdoors-by-correction")
            values = {"room": label, "volume": solid.volume, "reason": reason}
            issues.append(Issue(OUTDOORS, guid, values, Effect("room")))
            continue
        if solid.repair:
            values = {"room": label, "repair": Phrase(solid.repair)}
            issues.append(Issue("space-repaired", guid, values))
        area, volume = stated_quantities(psets, scales)
        volume, slip = checked_volume(volume, solid.volume, psets, scales.length)
        if slip is not None:
            code, values = slip
            issues.append(Issue(code, guid, {"room": label, **values}))
        records.append(
            SpaceRecord(
                room_solid(guid, label, solid.manifold),
                name or long_name or guid,
                long_name or "",
                storey_of(space),
                solid.volume,
                area,
                volume,
                _type_name(space, damage),
                step_id=space.id(),
            )
        )
    return records, issues


def _type_name(space: ifcopenshell.entity_instance, damage: Damage | None) -> str:
    """What kind of room it is: the name of its IfcSpaceType, else its ObjectType."""
    kind = type_of(space, damage)
    return (kind.Name if kind is not None else space.ObjectType) or ""


def is_outdoors(space: ifcopenshell.entity_instance, psets: dict[str, dict[str, Any]]) -> bool:
    """Whether the file says that a space is external."""
    common = psets.get("Pset_SpaceCommon", {})
    kinds = (
        getattr(space, "InteriorOrExteriorSpace", None),
        getattr(space, "PredefinedType", None),
    )
    return common.get("IsExternal") is True or "EXTERNAL" in kinds
