"""Spaces that end below the glass before them, raised to what really covers them.

A space is raised where glass to the outdoors lies above its top with no slab between, and slabs,
roofs or coverings close the air above it.  It stays as it is where the file
states a suspended ceiling: a covering that covers the space, or a finished ceiling height below its
height; and where one is likely though nobody drew it: less than `PLENUM` would be won and less
than `MOSTLY` of the room's glass.  Both limits are our own judgement: voids above ceilings are 0.3
to 1 m high.

Nor does it rise into a storey whose rooms are not drawn.  What covers it lies no further above its
top than the space is high: the storey that is missing would be higher.  Glass of the room's
own storey, or that begins below its top, shows a higher room: up to twice as far as it reaches, as
a hall under a ridge is up to twice as high as its eaves, and such a void.

The column over a room's level top is cut by slabs, roofs and coverings and by other rooms; what is
left of it and open to the room belongs to the room.  Two things look alike and are none: the void
above a suspended ceiling that stops short of the facade (it is open to the room along a slit only)
and the open air over a room whose roof is not drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import manifold3d
import numpy as np
import shapely
from numpy.typing import NDArray

from bim.boxes import Boxes
from bim.ifc.cut_rooms import goes_through
from bim.ifc.glass_of_rooms import GlassOfRooms
from bim.ifc.project import psets_of
from bim.ifc.quantities import BASE_SETS
from bim.ifc.shapes import Shape, read_shapes
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import solids_of
from bim.planes import plane_through, polygons_of
from bim.rays import ray_mesh
from bim.report.issue import Issue, Phrase
from bim.rooms import OVERLAP, RoomSolid, room_solid
from bim.solids import prism, solid_of, triangles_of, union
from mitsuba_cfs.processes import ProcessEnded, Told, answer_apart
from mitsuba_cfs.surfaces import area_vectors

LEVEL = 0.99  # z of the normal of a level top
SAME_TOP = 0.01  # level tops within this of the highest are one [m]
OPEN_BELOW = 0.5  # share of the plan of the air above that is open to the room, at the least
COVERED = 0.9  # share of its upper side that lies under something, at the least
ASKED = 15  # places along each side that are asked for that
TOUCHING = 0.05  # what covers it is this near [m]
FINEST = 1e-3  # smaller details of what covers it are smoothed out [m]
Body = NDArray[np.float64]  # [N, 3, 3] triangles [m]


def raised_body(rooms: Sequence[Body], lids: Sequence[Body], tell: Told) -> Body | str:
    """The room with the air above its top, up to what covers it; else a phrase that says why not.

    Args:
        rooms: the room, then the other rooms of the building.
        lids: slabs, roofs and coverings, openings not cut.
        tell: unused; of functions that work in a process apart.
    """
    own, *others = (_solid(body) for body in rooms)
    if own is None:
        return "body-not-closed"
    room = room_solid("", "", own)
    top, outline = level_top(room)
    if outline.is_empty:
        return "top-not-level"
    over = [lid for lid in map(_solid, lids) if lid is not None and _is_over(lid, top, outline)]
    if not over:
        return "not-covered"
    plane = plane_through(np.array([0.0, 0.0, top]), np.array([0.0, 0.0, 1.0]))
    highest = max(lid.bounding_box()[5] for lid in over)
    column = prism(outline, plane, OVERLAP, highest - top)
    if column is None:
        return "top-without-area"
    beside = [other for other in others if other is not None and _is_over(other, top, outline)]
    for piece in (column - union([*over, *beside])).decompose():
        if _is_open_to(piece, top) and _is_covered(piece, lids, top):
            # the join enters both, so that the union leaves no slit
            join = manifold3d.Manifold.extrude(piece.slice(top + 1.5 * OVERLAP), 3 * OVERLAP)
            whole = union([own, join.translate((0.0, 0.0, top - OVERLAP)), piece])
            return triangles_of(whole.simplify(FINEST).as_original())[0]
    return "no-ceiling-above"


def level_top(room: RoomSolid) -> tuple[float, shapely.Geometry]:
    """Height [m] of a room's highest level faces, and their outline in world x, y (or empty)."""
    tops = [facet for facet in room.facets if facet.plane.normal[2] > LEVEL]
    if not tops:
        return float(room.high[2]), shapely.Polygon()
    corners = [f.plane.to_world(shapely.get_coordinates(f.polygon)) for f in tops]
    heights = [float(points[:, 2].max()) for points in corners]
    top = max(heights)
    parts = [
        shapely.transform(facet.polygon, lambda p, f=facet: f.plane.to_world(p)[:, :2])
        for facet, height in zip(tops, heights, strict=True)
        if height > top - SAME_TOP
    ]
    return top, shapely.union_all([p for part in parts for p in polygons_of(part)])


def _solid(body: Body) -> manifold3d.Manifold | None:
    solid = solid_of(body)
    return None if solid is None else solid.manifold


def _is_over(body: manifold3d.Manifold, top: float, outline: shapely.Geometry) -> bool:
    x0, y0, _, x1, y1, z1 = body.bounding_box()
    return z1 > top + OVERLAP and shapely.box(x0, y0, x1, y1).intersects(outline)


def _is_open_to(piece: manifold3d.Manifold, top: float) -> bool:
    """Whether most of the plan of the air above a room meets the room's top."""
    triangles, _ = triangles_of(piece)
    down = area_vectors(triangles)[:, 2]
    meets = (down < 0) & (triangles[..., 2].max(axis=1) < top + 2 * OVERLAP)
    return bool(-down[meets].sum() > OPEN_BELOW * piece.project().area())


def _is_covered(piece: manifold3d.Manifold, lids: Sequence[Body], top: float) -> bool:
    """Whether rays up from the room's top leave the air above it where they meet a lid, or nearly.

    The lids' own triangles count, so that one which is no closed solid is still in the way.
    """
    low, high = np.array(piece.bounding_box()).reshape(2, 3)
    x, y = (np.linspace(low[k], high[k], ASKED + 2)[1:-1] for k in (0, 1))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.full(len(grid), top + 1.5 * OVERLAP)])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    body, _ = triangles_of(piece)
    leaves, through = ray_mesh(body).first_hits(points, up)
    within = (through >= 0) & (area_vectors(body)[through, 2] > 0)
    meets, _ = ray_mesh(np.concatenate(lids)).first_hits(points[within], up[within])
    return bool(within.any() and np.mean(np.abs(meets - leaves[within]) < TOUCHING) >= COVERED)


LIDS = ("IfcSlab", "IfcRoof", "IfcCovering", "IfcPlate", "IfcCurtainWall")
PLENUM = 1.2  # a void above a ceiling that nobody drew is lower [m]
MOSTLY = 0.5  # share of a room's glass above its top that no such void has
LEAST_GLASS = 0.1  # above a room's top; less is the rim of a window of the storey above [m2]
LOWEST_GAIN = 0.1  # what is raised by less stays as it is [m]
LIMIT_S = 60.0  # for one room
SAME_HEIGHT = 0.05  # heights stated and drawn that agree to this are one [m]


def raised_rooms(
    source: Source, records: Sequence[SpaceRecord], glass: GlassOfRooms, covers: Sequence[Shape]
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
    source: Source, index: int, records: Sequence[SpaceRecord], lids: Sequence[Body], share_above: float, most: float
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
    """`bim.ifc.raised_rooms.raised_body` in a process of its own: roofs may be any mesh."""
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
