"""Spaces that end below the glass before them, raised to what really covers them.

A space is raised where glass to the outdoors lies above its top with no slab between, and slabs,
roofs or coverings close the air above it (`bim.room_tops`).  It stays as it is where the file
states a suspended ceiling: a covering that covers the space, or a finished ceiling height below its
height; and where one is likely though nobody drew it: less than `PLENUM` would be won and less
than `MOSTLY` of the room's glass.  Both limits are our own judgement: voids above ceilings are 0.3
to 1 m high.

Nor does it rise into a storey whose rooms are not drawn.  What covers it lies no further above its
top than the space is high: the storey that is missing would be higher.  Glass of the room's
own storey, or that begins below its top, shows a higher room: up to twice as far as it reaches, as
a hall under a ridge is up to twice as high as its eaves, and such a void.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bim.boxes import Boxes
from bim.ifc.cut_rooms import goes_through
from bim.ifc.glass_of_rooms import GlassOfRooms
from bim.ifc.project import psets_of
from bim.ifc.quantities import BASE_SETS
from bim.ifc.shapes import Shape, read_shapes
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import solids_of
from bim.report.issue import Issue, Phrase
from bim.room_tops import Body, raised_body
from bim.rooms import room_solid
from bim.solids import triangles_of
from mitsuba_cfs.processes import ProcessEnded, answer_apart

LIDS = ("IfcSlab", "IfcRoof", "IfcCovering", "IfcPlate", "IfcCurtainWall")
PLENUM = 1.2  # a void above a ceiling that nobody drew is lower [m]
MOSTLY = 0.5  # share of a room's glass above its top that no such void has
LEAST_GLASS = 0.1  # above a room's top; less is the rim of a window of the storey above [m2]
LOWEST_GAIN = 0.1  # what is raised by less stays as it is [m]
LIMIT_S = 60.0  # for one room
SAME_HEIGHT = 0.05  # heights stated and drawn that agree to this are one [m]


def raised_rooms(
    source: Source,
    records: Sequence[SpaceRecord],
    glass: GlassOfRooms,
    covers: Sequence[Shape],
) -> tuple[list[SpaceRecord], list[Issue]]:
    """The rooms, those raised that end below their glass, and what was done with each of these.

    Args: covers: of `bim.ifc.cut_rooms.room_lids`; above one that a room goes through, glass is
        another room's.
    """
    low = {one.low.guid for one in glass.glass if one.low is not None}
    if not low:
        return list(records), []
    lids, fixed = _lids(source), source.corrections.heights_as_drawn(source.model)
    boxes = Boxes.of_triangles([cover.triangles for cover in covers])
    result, issues = list(records), []
    for index, record in enumerate(records):
        if record.guid not in low or record.step_id in fixed:
            continue
        area, reach = _glass_above(record, glass)
        if area < LEAST_GLASS:
            continue
        most = max(float(np.ptp([record.solid.low[2], record.solid.high[2]])), 2 * reach + PLENUM)
        share = _share_above(record, area, glass)
        if goes_through(record, covers, boxes):
            raised, why = record, Phrase("ceiling-drawn")
        else:
            raised, why = _raised(source, index, result, lids, share, most)
        top = float(record.solid.high[2])
        values = {"room": record.label, "top": top, "area": area}
        if why is None:
            gain = float(raised.solid.high[2]) - top
            values |= {"gain": gain, "volume": raised.raised}
            issues.append(Issue("room-raised", record.guid, values))
        else:
            issues.append(Issue("room-too-low", record.guid, values | {"reason": why}))
        result[index] = raised
    return result, issues


def _glass_above(record: SpaceRecord, glass: GlassOfRooms) -> tuple[float, float]:
    """Glass above a room's top [m2], and how far what is surely its own reaches above that [m]."""
    top = float(record.solid.high[2])
    area, reach = 0.0, 0.0
    for one in glass.glass:
        if one.low is None or one.low.guid != record.guid:
            continue
        area += one.out - one.used
        low, high = one.heights
        if one.storey == record.storey or low < top - SAME_HEIGHT:
            reach = max(reach, high - top)
    return area, reach


def _share_above(record: SpaceRecord, above: float, glass: GlassOfRooms) -> float:
    """Share of a room's glass that lies above its top."""
    own = [a for a in glass.attachments if a.room == record.guid and a.neighbour is None]
    return above / max(above + sum(a.glass.area for a in own), 1e-9)


def _raised(
    source: Source,
    index: int,
    records: Sequence[SpaceRecord],
    lids: Sequence[Body],
    share_above: float,
    most: float,
) -> tuple[SpaceRecord, Phrase | None]:
    """The room with the air above it, up to so much higher [m]; or as it is, and why."""
    record = records[index]
    stated = _stated_ceiling(source, record)
    if stated is not None:
        return record, stated
    others = [r for i, r in enumerate(records) if i != index]
    bodies = [triangles_of(r.solid.manifold)[0] for r in (record, *others)]
    try:
        body = raised_body_apart(bodies, lids)
    except ProcessEnded as error:
        return record, Phrase("text", {"text": str(error)})
    if isinstance(body, str):
        return record, Phrase(body)
    (solid,) = solids_of([body])
    if isinstance(solid, ProcessEnded):
        return record, Phrase("text", {"text": str(solid)})
    gain = float(body[..., 2].max() - record.solid.high[2])
    if solid is None or gain < LOWEST_GAIN:
        return record, Phrase("ceiling-drawn")
    if gain > most:
        return record, Phrase("next-storey", {"gap": gain})
    if gain < PLENUM and share_above < MOSTLY:
        return record, Phrase("ceiling-void", {"gap": gain})
    whole = room_solid(record.guid, record.solid.name, solid.manifold)
    more = solid.volume - record.volume
    return replace(record, solid=whole, volume=solid.volume, raised=more), None


def raised_body_apart(rooms: Sequence[Body], lids: Sequence[Body]) -> Body | str:
    """`bim.room_tops.raised_body` in a process of its own: roofs may be any mesh."""
    return answer_apart(raised_body, rooms, lids, limit_s=LIMIT_S)


def _stated_ceiling(source: Source, record: SpaceRecord) -> Phrase | None:
    """How the file states a suspended ceiling at the top of a space; None if it does not."""
    guid = record.guid.partition("-")[0]
    space = source.model.by_guid(guid) if len(guid) == 22 else None
    if space is None or not space.is_a("IfcSpace"):
        return None
    for relation in getattr(space, "HasCoverings", None) or ():
        if any(c.PredefinedType == "CEILING" for c in relation.RelatedCoverings):
            return Phrase("ceiling-covers")
    psets = psets_of(space)
    scale = source.quantity_scales().length
    drawn = float(np.ptp([record.solid.low[2], record.solid.high[2]]))
    for name in BASE_SETS:
        finish, height = (psets.get(name, {}).get(key) for key in ("FinishCeilingHeight", "Height"))
        if finish is None or height is None or height - finish < SAME_HEIGHT / scale:
            continue
        if abs(finish * scale - drawn) < SAME_HEIGHT:
            values = {"height": finish * scale, "of": height * scale}
            return Phrase("finish-ceiling-height", values)
    return None


def _lids(source: Source) -> list[Body]:
    """Slabs, roofs and coverings in the world, openings not cut."""
    wanted = {key for key, shape in source.shapes.items() if shape.ifc_class.startswith(LIDS)}
    everything = {one.id() for one in source.model.by_type("IfcProduct")}
    shapes, _ = read_shapes(source.model, without=everything - wanted, cut_openings=False)
    return [source.placed.to_world(shape.triangles) for shape in shapes.values()]
