"""Boolean operations and distances of solids, run in a subprocess because the kernel may crash.

The geometry kernel has ended whole processes by a signal on meshes that passed every check.  In a
subprocess, such a mesh affects its own room, wall or pair only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.apertures import shadow
from bim.planes import Plane, plane_through
from bim.report.issue import Issue
from bim.rooms import Attachment, Piece, RoomSolid, room_pieces, room_solid
from bim.solids import PackedSolid, Solid, packed, prism, solid_of, triangles_of, union, unpacked
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.processes import ProcessEnded, each_apart

LIMIT_S = 180.0  # for all rooms of a building, and for all its walls
FLATTEST = 0.1  # a space that is lower has no outline to extrude [m]
SLIT = 0.01  # air shut in between rooms that are made one: smaller ones are filled [m3]
Body = NDArray[np.float64]  # [N, 3, 3] triangles [m]
Packed = tuple[PackedSolid, str]  # and what had to be done to get it
Outline = tuple[shapely.Geometry, Plane, float, float]  # of a prism: see `bim.solids.prism`


@dataclass(frozen=True, slots=True)
class RoomBoundary:
    """The pieces that close a room, from `bim.rooms.room_pieces`."""

    pieces: list[Piece]
    volume: float  # of the air with the recesses of its windows [m3]
    issues: list[Issue]


def room_boundaries(rooms: Sequence[tuple[RoomSolid, Sequence[Attachment]]]) -> list[RoomBoundary | RoomError]:
    """The boundary of each room with its attachments; the error where there is none."""
    items = [(one.guid, one.name, packed(one.manifold), list(own)) for one, own in rooms]
    boundaries = each_apart(_boundary, items, limit_s=LIMIT_S)
    return [RoomError(str(one)) if isinstance(one, ProcessEnded) else one for one in boundaries]


def gaps_between(
    walls: Sequence[tuple[PackedSolid, Sequence[PackedSolid]]], widest: float
) -> list[list[float] | ProcessEnded]:
    """Distances [m] of each wall to its neighbours, at most `widest`."""
    return each_apart(_gaps, [(one, list(near), widest) for one, near in walls], limit_s=LIMIT_S)


def solids_of(bodies: Sequence[Body]) -> list[Solid | ProcessEnded | None]:
    """`bim.solids.solid_of` of each body."""
    return [_solid_here(one) for one in each_apart(_solid, list(bodies), limit_s=LIMIT_S)]


def spaces_of(bodies: Sequence[Body]) -> list[Solid | ProcessEnded | None]:
    """The solid of each space as drawn; its outline extruded as a last resort."""
    return [_solid_here(one) for one in each_apart(_space, list(bodies), limit_s=LIMIT_S)]


def shared_volumes(solids: Sequence[tuple[PackedSolid, Sequence[PackedSolid]]]) -> list[list[float] | ProcessEnded]:
    """Volumes [m3] that each solid shares with its neighbours."""
    return each_apart(_shared, [(one, list(near)) for one, near in solids], limit_s=LIMIT_S)


def parted(items: Sequence[tuple[PackedSolid, Sequence[Body]]]) -> list[list[PackedSolid] | ProcessEnded]:
    """The parts of each solid that bodies cut through, the largest first; none if it stays one."""
    return each_apart(_parted, [(one, list(by)) for one, by in items], limit_s=LIMIT_S)


def united(solids: Sequence[PackedSolid], outlines: Sequence[Outline]) -> PackedSolid | None:
    """Solids and the prisms between them as one; None where they stay apart.

    Raises: `RoomError` where their union ends its process.
    """
    (solid,) = each_apart(_united, [(list(solids), list(outlines))], limit_s=LIMIT_S)
    if isinstance(solid, ProcessEnded):
        raise RoomError(str(solid))
    return solid


def opened(bodies: Sequence[tuple[Body, Sequence[Outline]]]) -> list[Body | ProcessEnded | None]:
    """Bodies with prisms cut out; None for what is no closed solid, or nothing any more."""
    return each_apart(_opened, [(one, list(holes)) for one, holes in bodies], limit_s=LIMIT_S)


def _solid_here(packed: Packed | ProcessEnded | None) -> Solid | ProcessEnded | None:
    return Solid(unpacked(packed[0]), packed[1]) if isinstance(packed, tuple) else packed


def _solid(body: Body) -> Packed | None:
    solid = solid_of(body)
    return None if solid is None else (packed(solid.manifold), solid.repair)


def _space(body: Body) -> Packed | None:
    solid = _solid(body)
    low, high = float(body[..., 2].min()), float(body[..., 2].max())
    if solid is not None or high - low < FLATTEST:
        return solid
    plane = plane_through(np.array([*body[0, 0, :2], low]), np.array([0.0, 0.0, 1.0]))
    outline = prism(shadow(body, plane), plane, 0.0, high - low)
    return None if outline is None else (packed(outline), "outline-extruded")


def _parted(item: tuple[PackedSolid, list[Body]]) -> list[PackedSolid]:
    one, bodies = item
    solids = [found.manifold for body in bodies if (found := solid_of(body)) is not None]
    if not solids:
        return []
    whole = unpacked(one)
    parts = [p for p in (whole - union(solids)).decompose() if p.volume() > SLIT]
    if len(parts) < 2:
        return []
    parts.sort(key=lambda part: -part.volume())
    return [packed(part.as_original()) for part in parts]


def _shared(item: tuple[PackedSolid, list[PackedSolid]]) -> list[float]:
    one, near = item
    body = unpacked(one)
    return [float((body ^ unpacked(other)).volume()) for other in near]


def _united(item: tuple[list[PackedSolid], list[Outline]]) -> PackedSolid | None:
    solids, outlines = item
    prisms = [prism(*outline) for outline in outlines]
    body = union([*map(unpacked, solids), *(way for way in prisms if way is not None)])
    parts = body.decompose()  # what is hollow inside is a part of negative volume
    bodies = [part for part in parts if part.volume() > 0]
    if len(bodies) != 1:
        return None
    hollow = sum(part.volume() for part in parts) < bodies[0].volume() - SLIT
    return packed((body if hollow else bodies[0]).as_original())


def _opened(item: tuple[Body, list[Outline]]) -> Body | None:
    body, holes = item
    solid = solid_of(body)
    if solid is None:
        return None
    rest = solid.manifold
    for hole in holes:
        cutter = prism(*hole)
        if cutter is not None:
            rest = rest - cutter
    triangles, _ = triangles_of(rest)
    return triangles if len(triangles) else None


def _boundary(item: tuple[str, str, PackedSolid, list[Attachment]]) -> RoomBoundary | RoomError:
    guid, name, solid, attachments = item
    try:
        return RoomBoundary(*room_pieces(room_solid(guid, name, unpacked(solid)), attachments))
    except shapely.errors.ShapelyError as error:
        return RoomError(f"its windows cannot be cut out: {error}")


def _gaps(item: tuple[PackedSolid, list[PackedSolid], float]) -> list[float]:
    one, near, widest = item
    body = unpacked(one)
    return [float(body.min_gap(unpacked(other), widest)) for other in near]
