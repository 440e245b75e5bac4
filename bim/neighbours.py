"""Adjacency of each piece of a room's boundary: element, other room, ground or outdoor air."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.bodies import Bodies, Span
from bim.boxes import Boxes
from bim.planes import Facet, polygons_of, triangulated
from bim.rays import RayMesh, hemisphere
from bim.rooms import Piece, RoomSolid, cut
from mitsuba_cfs.surfaces import area_vectors

T = TypeVar("T", bound=Hashable)

DEEPEST_WALL = 1.5  # beyond this nothing belongs to the wall any more [m]
DEEPEST_IN_ROOM = 0.5  # nor objects further into the room
THICKEST_SPAN = 1.0  # a ray that is longer in one element runs along it, not through [m]
WIDEST_GAP = 0.6  # air between the parts of one wall or ceiling [m]
PARALLEL = 0.9  # least |cosine| to a wall's normal of what lies behind its first element: no eaves
UPRIGHT = 0.5  # most |cosine| of a wall's normal to the vertical
PLUMB = 0.05  # and of one that stands upright: 3 degrees
INSIDE = 0.02  # rays start this far inside the room: faces drawn into the wall [m]
OPPOSITE = -0.98  # cosine between faces of two rooms that share a wall: 11 degrees
OPEN_SKY = 0.1  # share of rays that escape where a wall faces the open air
FAR = 60.0  # a ray that meets nothing within this has escaped [m]
TOUCHING = 1e-3  # what reaches less into the wall does not belong to it [m]
SAMPLES = 5  # points asked on each piece


@dataclass(frozen=True, slots=True)
class Beyond:
    """What lies behind a piece."""

    spans: tuple[Span, ...]  # from the room's face outwards
    adjacency: str
    neighbour: str | None = None


@dataclass(frozen=True, slots=True)
class Walk:
    """What a ray out of a room's face meets."""

    spans: tuple[Span, ...]  # the parts of one wall
    room: int  # that it ends in, -1: none
    stop: float  # where it is out of all of them [m], infinite where it runs along one


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Everything a room can border on."""

    bodies: Bodies
    rooms: RayMesh
    room: NDArray[np.int64]  # [M] room of each triangle
    guids: tuple[str, ...]  # of the rooms
    ground_level: float  # [m]


def cut_by_neighbours(
    room: RoomSolid, pieces: Sequence[Piece], rooms: Sequence[RoomSolid], boxes: Boxes
) -> list[Piece]:
    """Pieces cut where the faces of other rooms lie opposite, as second-level boundaries are.

    Args: boxes: of the rooms.
    """
    around = boxes.near(room.low, room.high, DEEPEST_WALL)
    near = [rooms[index] for index in around if rooms[index].guid != room.guid]
    facets = [(other.guid, facet) for other in near for facet in other.facets]
    normals = np.array([facet.plane.normal for _, facet in facets]).reshape(-1, 3)
    corners = [facet.plane.to_world(shapely.get_coordinates(facet.polygon)) for _, facet in facets]
    result: list[Piece] = []
    for piece in pieces:
        if piece.role == "glass":
            result.append(piece)
            continue
        rest = [piece.facet.polygon]
        towards = np.flatnonzero(normals @ piece.facet.plane.normal <= OPPOSITE)
        for _, guid, region in _opposite(piece.facet, [(*facets[i], corners[i]) for i in towards]):
            left: list[shapely.Polygon] = []
            for polygon in rest:
                inside, outside = cut(polygon, region)
                left += outside
                result += [replace(piece, facet=replace(piece.facet, polygon=p), neighbour=guid) for p in inside]
            rest = left
        result += [replace(piece, facet=replace(piece.facet, polygon=p)) for p in rest]
    return result


def _opposite(
    facet: Facet, towards: Sequence[tuple[str, Facet, NDArray[np.float64]]]
) -> list[tuple[float, str, shapely.Geometry]]:
    """Distance, room and outline in the facet's plane of the faces opposite, nearest first.

    Args: towards: rooms, their facets that face this one, and the facets' corners [N, 3].
    """
    left, low, right, high = facet.polygon.bounds
    faces = []
    for guid, other, corners in towards:
        distance = float(np.mean((corners - facet.plane.origin) @ facet.plane.normal))
        if not -0.05 < distance < DEEPEST_WALL:
            continue
        flat = facet.plane.to_plane(corners)[:, :2]
        (x_low, y_low), (x_high, y_high) = flat.min(axis=0), flat.max(axis=0)
        if x_low > right or x_high < left or y_low > high or y_high < low:
            continue
        region = shapely.transform(other.polygon, lambda _, flat=flat: flat)
        region = shapely.make_valid(region).intersection(facet.polygon)
        if polygons := polygons_of(region):
            faces.append((distance, guid, shapely.union_all(polygons)))
    return sorted(faces, key=lambda item: item[0])


def sample_points(facet: Facet) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Up to SAMPLES points [N, 3] well inside a facet, and the area [N] that each stands for [m2].

    The middles of its biggest triangles, and before them one point that is inside in any case.
    """
    flat = triangulated(facet.polygon)
    e1, e2 = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    areas = 0.5 * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
    biggest = np.argsort(-areas)[: SAMPLES - 1]
    inner = shapely.get_coordinates(shapely.point_on_surface(facet.polygon))
    points = facet.plane.to_world(np.concatenate([inner, flat[biggest].mean(axis=1)]))
    return points, np.concatenate([areas[biggest].min(keepdims=True), areas[biggest]])


def what_lies_beyond(piece: Piece, around: Surroundings, own: int) -> Beyond:
    """Elements behind a piece along the ray that most of its samples agree with, and what follows.

    Most of its area agrees on the element met first, a gap counts less than what two samples meet,
    and most of those samples on all of them: one rafter of the eaves, met by one, is no cladding.

    Args: own: index of the piece's own room in `around.guids`.
    """
    normal = piece.facet.plane.normal
    points, areas = sample_points(piece.facet)
    if piece.role == "reveal":  # the ray runs along the wall, not through it
        points = points[:1]
    back = DEEPEST_IN_ROOM if piece.role == "room" else INSIDE
    walks = _without_fittings(_walks(points, normal, around, own, back=back))
    chains = {i: tuple(span.element for span in walk.spans) for i, walk in enumerate(walks)}
    firsts = {i: chain[:1] for i, chain in chains.items()}
    twice = {i: what for i, what in firsts.items() if what and [*firsts.values()].count(what) > 1}
    first = _most(twice or firsts, areas)
    agreeing = {i: chain for i, chain in chains.items() if chain[:1] == first}
    most = _most(agreeing, np.ones(len(points)))
    whole = [i for i, chain in chains.items() if chain == most]
    spans = walks[whole[0]].spans
    room = _most({i: walks[i].room for i in whole}, areas)
    if piece.role == "reveal":
        return Beyond(spans[:1], "adiabatic")
    if piece.neighbour is not None:
        return Beyond(spans, "space", piece.neighbour)
    if piece.role in ("frame", "door") and piece.attachment.neighbour is None and room < 0:
        return Beyond(spans, "outside")
    if room >= 0:
        return Beyond(spans, "space", around.guids[room])
    # where another wall or a stair stands against this one the ray says nothing of the rest
    free = [i for i in whole if np.isfinite(walks[i].stop)] or whole
    met = {i: _adjacency(points[i], walks[i], normal, around) for i in free}
    return Beyond(spans, _most(met, areas))


def _most(by_index: Mapping[int, T], areas: NDArray[np.float64]) -> T:
    """What most of the area says, by number of its sample; where two are even, the first."""
    shares: dict[T, float] = {}
    for i, what in by_index.items():
        shares[what] = shares.get(what, 0.0) + round(float(areas[i]), 9)
    return max(shares, key=lambda what: shares[what])


def _adjacency(point: NDArray[np.float64], walk: Walk, normal: NDArray[np.float64], around: Surroundings) -> str:
    """What follows the wall behind a point of it where no room does."""
    stop = walk.stop
    if not np.isfinite(stop):
        if normal[2] > -0.7:
            return "adiabatic"  # the end of a wall: boundary type 2b
        ends = [span.stop for span in walk.spans if np.isfinite(span.stop)]
        stop = max(ends, default=DEEPEST_WALL)
    return _open_or_ground(point + normal * (stop + 0.02), normal, around)


def _walks(
    points: NDArray[np.float64], normal: NDArray[np.float64], around: Surroundings, own: int, *, back: float
) -> list[Walk]:
    """What rays out of points [N, 3] of a face meet, asked from so far back in the room [m]."""
    limits, rooms = [DEEPEST_WALL] * len(points), [-1] * len(points)
    at, passed = points + 0.005 * normal, [INSIDE + 0.005] * len(points)
    free = [*range(len(points))]
    for _ in range(4):  # the first surface met may be the room's own, drawn twice
        distances, hits = around.rooms.first_hits(at[free], np.tile(normal, (len(free), 1)), DEEPEST_WALL)
        own_face = []
        for i, distance, hit in zip(free, distances, hits, strict=True):
            if hit < 0:
                continue
            passed[i] += distance
            if around.room[hit] != own:
                limits[i], rooms[i] = passed[i], int(around.room[hit])
                continue
            at[i] += (distance + 1e-4) * normal
            passed[i] += 1e-4
            own_face.append(i)
        free = own_face
        if not free:
            break
    return [
        _walk(point, normal, around, limit=limit, room=room, back=back)
        for point, limit, room in zip(points, limits, rooms, strict=True)
    ]


def _walk(
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
    around: Surroundings,
    *,
    limit: float,
    room: int,
    back: float,
) -> Walk:
    """What a ray out of a face meets until it enters another room, -1: none, at `limit` [m]."""
    spans = _at_the_face(around.bodies, point, normal, limit - INSIDE, back)
    spans = _of_one_wall(spans, around, normal)
    stop = max((span.stop for span in spans), default=0.0)
    if room >= 0:
        stop = min(stop, limit)
    # what the ray runs along behind the first is the end of a wall that stands against this one
    through = [span for span in spans[1:] if np.isfinite(span.stop)]
    return Walk((*spans[:1], *through), room, stop)


def _at_the_face(
    bodies: Bodies, point: NDArray[np.float64], normal: NDArray[np.float64], limit: float, back: float
) -> list[Span]:
    """Elements that a ray passes between leaving the room and entering the next one [m].

    Rooms are drawn to the middles of walls, to the slab under the flooring or through their ceiling
    up to its top: all of that belongs to the wall.  Objects deeper in the room do not, but
    for its part beyond the face.
    """
    spans: list[Span] = []
    for span in bodies.along(point - back * normal, normal, back + 2 * DEEPEST_WALL):
        span = span.moved(back)
        if span.stop <= -TOUCHING or span.start >= limit - TOUCHING:
            continue
        if span.start <= -back:
            if span.stop <= TOUCHING:
                continue
            span = span.since(-INSIDE)
        spans.append(span if span.stop - span.start < DEEPEST_WALL else span.endless())
    return sorted(spans, key=lambda span: (span.start, span.stop))


def _without_fittings(walks: Sequence[Walk]) -> list[Walk]:
    """The walks without what ends at the face in some of them: a stair along a wall, a beam.

    What is a part of the wall, its panels or its flooring, is in all of them.
    """
    ends = [{s.element for s in walk.spans if s.stop <= TOUCHING} for walk in walks]
    loose = set().union(*ends) - set(ends[0]).intersection(*ends)
    return [
        replace(walk, spans=tuple(s for s in walk.spans if s.stop > TOUCHING or s.element not in loose))
        for walk in walks
    ]


def _of_one_wall(spans: Sequence[Span], around: Surroundings, normal: NDArray[np.float64]) -> list[Span]:
    """Those until a gap too wide for one wall.

    What a wall's ray meets aslant behind the first element is the roof over the wall or its
    rafters, not a cladding, but for an upright wall that runs aslant behind another one; over a
    ceiling it is the roof that closes the attic.
    """
    kept: list[Span] = []
    reach = 0.0
    for span in spans:
        # over a room that is drawn lower than it is the first may lie as far as any
        if span.start - reach > WIDEST_GAP and (kept or normal[2] < UPRIGHT):
            break
        if kept and abs(normal[2]) < UPRIGHT and not _may_clad(span, around, normal):
            continue
        along = kept and span.stop - span.start > THICKEST_SPAN
        kept.append(span.endless() if along else span)
        reach = max(reach, span.stop)
    return kept


def _may_clad(span: Span, around: Surroundings, normal: NDArray[np.float64]) -> bool:
    """Whether the face that a ray meets first of an element is parallel to the wall, or upright."""
    (vector,) = area_vectors(around.bodies.mesh.triangles[[span.triangle]])
    unit = vector / np.linalg.norm(vector)
    return bool(abs(unit @ normal) > PARALLEL or abs(unit[2]) < PLUMB)


def _open_or_ground(point: NDArray[np.float64], normal: NDArray[np.float64], around: Surroundings) -> str:
    """Beyond a point: "ground" below its level, "outside" where rays escape, else "unknown"."""
    if point[2] < around.ground_level - 0.1 or (normal[2] < -0.7 and point[2] < around.ground_level + DEEPEST_WALL):
        return "ground"
    return "outside" if is_open(point, normal, around.bodies.mesh) else "unknown"


def is_open(point: NDArray[np.float64], normal: NDArray[np.float64], building: RayMesh) -> bool:
    """Whether a point is in the open air: enough rays on the side of the normal [3] escape."""
    directions = hemisphere(normal, 32)
    # rays that go down end on the ground, which is open air too: all escapes count
    _, hit = building.first_hits(np.tile(point, (32, 1)), directions, FAR)
    return bool(np.mean(hit < 0) > OPEN_SKY)
