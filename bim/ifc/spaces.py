"""IfcSpace as closed solids, with names, storeys and stated quantities."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import ifcopenshell

from bim.ifc.corrections import RoomName
from bim.ifc.damage import Damage, entities, instances, type_of
from bim.ifc.project import psets_of, storey_of, storeys_in
from bim.ifc.quantities import QuantityScales, checked_volume, stated_quantities
from bim.ifc.shapes import Shape
from bim.isolated_solids import spaces_of
from bim.model import SpaceGroup
from bim.names import UnknownName, has_words, item_named, label_of, unknown_room
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import RoomSolid, room_solid
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.processes import ProcessEnded

DEEPEST = 20  # zones of zones
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
    guids: list[str] = []
    for relation in getattr(group, "IsGroupedBy", None) or ():
        for one in entities(relation.RelatedObjects):
            if one.is_a("IfcSpace"):
                guids.append(one.GlobalId)
            elif one.is_a("IfcGroup") and depth:
                guids += _spaces(one, depth - 1)
    return guids


@dataclass(frozen=True, slots=True)
class _Drawn:
    """A space of the file by its names."""

    guid: str
    name: str
    long_name: str

    @property
    def label(self) -> str:
        """Number and name of the space as people use them."""
        return label_of(self.name, self.long_name, self.guid)


def check_rooms(
    models: Sequence[ifcopenshell.file],
    rooms: Sequence[str],
    file: str | PathLike[str],
    corrected: Iterable[RoomName] = (),
) -> None:
    """Refuse names that no room of a building can have.

    A name with the words of a space, zone or storey of the models may be that of rooms that are
    joined, cut or left out; one that is only a part of such a name is that of none.

    Args: corrected: names that the corrections state.

    Raises: `DataError`.
    """
    spaces = [space for model in models for space in instances(model, "IfcSpace")]
    drawn = [_Drawn(s.GlobalId or "", s.Name or s.LongName or "", s.LongName or "") for s in spaces]
    if not rooms or not drawn:
        return
    zones = [zone.name for model in models for zone in read_zones(model)]
    storeys = [one.Name or "" for model in models for one in storeys_in(model)]
    names = {*zones, *storeys, *(text for one in drawn for text in (one.guid, one.name, one.long_name))}
    names |= {text or "" for one in corrected for text in (one.name, one.long_name)}
    for room in rooms:
        if any(has_words(room, name) for name in names if name.strip()):
            continue
        try:
            item_named(drawn, room, "space")
        except UnknownName as error:
            raise DataError(unknown_room(error, room, zones), file=file, field="space") from error


def _type_name(space: ifcopenshell.entity_instance, damage: Damage | None) -> str:
    """What kind of room it is: the name of its IfcSpaceType, else its ObjectType."""
    kind = type_of(space, damage)
    return (kind.Name if kind is not None else space.ObjectType) or ""


def is_outdoors(space: ifcopenshell.entity_instance, psets: dict[str, dict[str, Any]]) -> bool:
    """Whether the file says that a space is external."""
    common = psets.get("Pset_SpaceCommon", {})
    kinds = (getattr(space, "InteriorOrExteriorSpace", None), getattr(space, "PredefinedType", None))
    return common.get("IsExternal") is True or "EXTERNAL" in kinds
