"""Rooms drawn lower than they are: the air above a room's top up to what really covers it.

The column over a room's level top is cut by slabs, roofs and coverings and by other rooms; what is
left of it and open to the room belongs to the room.  Two things look alike and are none: the void
above a suspended ceiling that stops short of the facade (it is open to the room along a slit only)
and the open air over a room whose roof is not drawn.
"""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import shapely
from numpy.typing import NDArray

from bim.planes import area_vectors, plane_through, polygons_of
from bim.rays import ray_mesh
from bim.rooms import OVERLAP, RoomSolid, room_solid
from bim.solids import prism, solid_of, triangles_of, union
from mitsuba_cfs.processes import Told

LEVEL = 0.99  # z of the normal of a level top
SAME_HEIGHT = 0.01  # level tops within this of the highest are one [m]
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
        if height > top - SAME_HEIGHT
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
