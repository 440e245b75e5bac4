"""Booleans and distances of solids, worked out in a process that may die.

The library of solids has ended whole processes by a signal on meshes that passed every check.  Here
such a mesh costs its own room, or the distance of its own pair of walls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from bim.model import Problem
from bim.rooms import Attachment, Piece, RoomSolid, room_pieces, room_solid
from bim.solids import PackedSolid, packed, unpacked
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.processes import ProcessEnded, each_apart

LIMIT_S = 180.0  # for all rooms of a building, and for all its walls


@dataclass(frozen=True, slots=True)
class RoomBoundary:
    """What `bim.rooms.room_pieces` gives for a room."""

    pieces: list[Piece]
    volume: float  # of the air with the recesses of its windows [m3]
    problems: list[Problem]


def room_boundaries(
    rooms: Sequence[tuple[RoomSolid, Sequence[Attachment]]],
) -> list[RoomBoundary | RoomError]:
    """The boundary of each room with its attachments; the error where there is none."""
    items = [(one.guid, one.name, packed(one.manifold), list(own)) for one, own in rooms]
    found = each_apart(_boundary, items, limit_s=LIMIT_S)
    return [RoomError(str(one)) if isinstance(one, ProcessEnded) else one for one in found]


def gaps_between(
    walls: Sequence[tuple[PackedSolid, Sequence[PackedSolid]]], widest: float
) -> list[list[float] | ProcessEnded]:
    """Distances [m] of each wall to its neighbours, at most `widest`."""
    return each_apart(_gaps, [(one, list(near), widest) for one, near in walls], limit_s=LIMIT_S)


def _boundary(
    item: tuple[str, str, PackedSolid, list[Attachment]],
) -> RoomBoundary | RoomError:
    guid, name, solid, attachments = item
    try:
        return RoomBoundary(*room_pieces(room_solid(guid, name, unpacked(solid)), attachments))
    except shapely.errors.ShapelyError as error:
        return RoomError(f"its windows cannot be cut out: {error}")


def _gaps(item: tuple[PackedSolid, list[PackedSolid], float]) -> list[float]:
    one, near, widest = item
    body = unpacked(one)
    return [float(body.min_gap(unpacked(other), widest)) for other in near]
