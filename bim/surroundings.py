"""What lies behind each piece of a room's boundary: elements, other rooms, ground or open air."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.planes import Facet, area_vectors, polygons_of, triangulated
from bim.rays import RayMesh, hemisphere
from bim.rooms import Piece, RoomSolid, cut

DEEPEST_WALL = 1.5  # beyond this nothing belongs to the wall any more [m]
WIDEST_GAP = 0.6  # air between the parts of one wall or ceiling [m]
PARALLEL = 0.9  # least |cosine| to a wall's normal of what lies behind its first element: no eaves
UPRIGHT = 0.5  # most |cosine| of a wall's normal to the vertical
PLUMB = 0.05  # and of one that stands upright: 3 degrees
INSIDE = 0.02  # rays start this far inside the room: faces drawn into the wall [m]
OPPOSITE = -0.98  # cosine between faces of two rooms that share a wall: 11 degrees
OPEN_SKY = 0.1  # share of rays that escape where a wall faces the open air
FAR = 60.0  # a ray that meets nothing within this has escaped [m]
MOST_STEPS = 24  # surfaces that a ray is followed through
SAMPLES = 5  # points asked on each piece


@dataclass(frozen=True, slots=True)
class Span:
    """One element that a ray went through."""

    element: int  # index into Elements.guids
    start: float  # [m] from the room's face
    stop: float  # infinite where the ray runs along the element and does not come out
    triangle: int  # first triangle met, index into the mesh


@dataclass(frozen=True, slots=True)
class Beyond:
    """What lies behind a piece."""

    spans: tuple[Span, ...]  # from the room outwards
    adjacency: str
    neighbour: str | None = None


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Everything a room can border on."""

    elements: RayMesh
    element: NDArray[np.int64]  # [N] element of each triangle
    rooms: RayMesh
    room: NDArray[np.int64]  # [M] room of each triangle
    guids: tuple[str, ...]  # of the rooms
    ground_level: float  # [m]


def cut_by_neighbours(
    room: RoomSolid, pieces: Sequence[Piece], rooms: Sequence[RoomSolid]
) -> list[Piece]:
    """Pieces cut where the faces of other rooms lie opposite, as second-level boundaries are."""
    near = [
        other
        for other in rooms
        if other.guid != room.guid
        and np.all(other.low <= room.high + DEEPEST_WALL)
        and np.all(other.high >= room.low - DEEPEST_WALL)
    ]
    result: list[Piece] = []
    for piece in pieces:
        if piece.role == "glass":
            result.append(piece)
            continue
        rest = [piece.facet.polygon]
        for _, guid, region in _opposite(piece.facet, near):
            left: list[shapely.Polygon] = []
            for polygon in rest:
                inside, outside = cut(polygon, region)
                left += outside
                result += [
                    replace(piece, facet=replace(piece.facet, polygon=p), neighbour=guid)
                    for p in inside
                ]
            rest = left
        result += [replace(piece, facet=replace(piece.facet, polygon=p)) for p in rest]
    return result


def _opposite(
    facet: Facet, rooms: Sequence[RoomSolid]
) -> list[tuple[float, str, shapely.Geometry]]:
    """Distance, room and outline in the facet's plane of the faces opposite, nearest first."""
    found = []
    for room in rooms:
        for other in room.facets:
            if other.plane.normal @ facet.plane.normal > OPPOSITE:
                continue
            corners = other.plane.to_world(shapely.get_coordinates(other.polygon))
            distance = float(np.mean((corners - facet.plane.origin) @ facet.plane.normal))
            if not -0.05 < distance < DEEPEST_WALL:
                continue
            region = shapely.transform(
                other.polygon,
                lambda p, other=other: facet.plane.to_plane(other.plane.to_world(p))[:, :2],
            )
            region = shapely.make_valid(region).intersection(facet.polygon)
            if polygons_of(region):
                found.append((distance, room.guid, shapely.union_all(polygons_of(region))))
    return sorted(found, key=lambda item: item[0])


def sample_points(facet: Facet) -> NDArray[np.float64]:
    """Up to SAMPLES points [N, 3] well inside a facet, the middle of its biggest triangles."""
    flat = triangulated(facet.polygon)
    e1, e2 = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    areas = np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
    middles = flat[np.argsort(-areas)[: SAMPLES - 1]].mean(axis=1)
    inner = shapely.get_coordinates(shapely.point_on_surface(facet.polygon))
    return facet.plane.to_world(np.concatenate([inner, middles]))


def what_lies_beyond(piece: Piece, around: Surroundings, own: int) -> Beyond:
    """Elements behind a piece along the ray that most of its samples agree with, and what follows.

    They agree on the element met first, then on all of them: one rafter of the eaves, met by one
    sample, is no cladding.

    Args: own: index of the piece's own room in `around.guids`.
    """
    normal = piece.facet.plane.normal
    points = sample_points(piece.facet)
    if piece.role == "reveal":  # the ray runs along the wall, not through it
        points = points[:1]
    walks = [_walk(point, normal, around, own) for point in points]
    firsts = [spans[0].element if spans else -1 for spans, _, _ in walks]
    common = max(set(firsts), key=firsts.count)
    chains = [tuple(span.element for span in spans) for spans, _, _ in walks]
    agreeing = [chain for chain, first in zip(chains, firsts, strict=True) if first == common]
    chosen = chains.index(max(agreeing, key=agreeing.count))
    spans, room, stop = walks[chosen]
    if piece.role == "reveal":
        return Beyond(spans[:1], "adiabatic")
    if piece.neighbour is not None:
        return Beyond(spans, "space", piece.neighbour)
    if piece.role in ("frame", "door") and piece.attachment.neighbour is None and room < 0:
        return Beyond(spans, "outside")
    if room >= 0:
        return Beyond(spans, "space", around.guids[room])
    if not np.isfinite(stop) and normal[2] > -0.7:
        return Beyond(spans, "adiabatic")  # the end of a wall: boundary type 2b
    stop = min(stop, DEEPEST_WALL)
    point = points[chosen] + normal * (stop + 0.02)
    return Beyond(spans, _open_or_ground(point, normal, around))


def _walk(
    point: NDArray[np.float64],
    normal: NDArray[np.float64],
    around: Surroundings,
    own: int,
) -> tuple[tuple[Span, ...], int, float]:
    """Elements along the ray out of a face, the room it ends in (-1: none), the last exit."""
    limit, room = DEEPEST_WALL, -1
    start = point - INSIDE * normal
    at, t = start + (INSIDE + 0.005) * normal, INSIDE + 0.005
    for _ in range(4):  # the first surface met may be the room's own, drawn twice
        d, hit = around.rooms.first_hits(at[None], normal[None], limit)
        if hit[0] < 0:
            break
        t += d[0]
        if around.room[hit[0]] != own:
            limit, room = t, int(around.room[hit[0]])
            break
        at, t = at + (d[0] + 1e-4) * normal, t + 1e-4
    spans = _spans(_crossings(start, normal, limit, around), around, normal)
    stop = max((span.stop for span in spans), default=0.0)
    if room >= 0:
        stop = min(stop, limit)
    return spans, room, stop


def _crossings(
    start: NDArray[np.float64], normal: NDArray[np.float64], limit: float, around: Surroundings
) -> list[tuple[float, int]]:
    """Distances and triangles of the elements' faces that a ray passes, in turn.

    Up to where the next room begins, and on until the ray is out of what it is in there: a wall
    ends where that room begins, or a door's leaf within it.
    """
    found: list[tuple[float, int]] = []
    inside: set[int] = set()
    t = 0.0
    for _ in range(MOST_STEPS):
        reach = DEEPEST_WALL if inside else limit
        d, hit = around.elements.first_hits((start + t * normal)[None], normal[None], reach - t)
        if hit[0] < 0:
            break
        t += d[0]
        element = int(around.element[hit[0]])
        if t <= limit or element in inside:
            found.append((t, int(hit[0])))
            inside ^= {element}
        t += 1e-5
    return found


def _spans(
    crossings: list[tuple[float, int]], around: Surroundings, normal: NDArray[np.float64]
) -> tuple[Span, ...]:
    """Entries and exits paired by element, until a gap too wide for one wall; t from the face.

    What a wall's ray meets aslant behind the first element is the roof over the wall or its
    rafters, not a cladding, but for an upright wall that runs aslant behind another one; over a
    ceiling it is the roof that closes the attic.
    """
    open_at: dict[int, tuple[float, int]] = {}
    spans: list[Span] = []
    met = [int(around.element[triangle]) for _, triangle in crossings]
    vectors = area_vectors(around.elements.triangles[[triangle for _, triangle in crossings]])
    leaves = vectors @ normal > 0
    layered = _layered(met, leaves)
    for (t, triangle), element, leaving in zip(crossings, met, leaves, strict=True):
        if element in layered:
            first, last = layered[element]
            if (t, triangle) == crossings[first]:
                spans.append(Span(element, t - INSIDE, crossings[last][0] - INSIDE, triangle))
            continue
        starts_inside = met.count(element) % 2 == 1 and leaving
        if starts_inside and element not in {span.element for span in spans} | set(open_at):
            spans.append(Span(element, -INSIDE, t - INSIDE, triangle))
        elif element in open_at:
            start, first = open_at.pop(element)
            if t - start > 5e-4:
                spans.append(Span(element, start - INSIDE, t - INSIDE, first))
        else:
            open_at[element] = (t, triangle)
    spans += [
        Span(element, start - INSIDE, np.inf, first) for element, (start, first) in open_at.items()
    ]
    spans.sort(key=lambda span: span.start)
    kept: list[Span] = []
    reach = 0.0
    for span in spans:
        if span.start - reach > WIDEST_GAP:
            break
        if kept and abs(normal[2]) < UPRIGHT and not _may_clad(span, around, normal):
            continue
        kept.append(span)
        reach = max(reach, span.stop)
    return tuple(kept)


def _may_clad(span: Span, around: Surroundings, normal: NDArray[np.float64]) -> bool:
    """Whether the face that a ray meets first of an element is parallel to the wall, or upright."""
    (vector,) = area_vectors(around.elements.triangles[[span.triangle]])
    unit = vector / np.linalg.norm(vector)
    return bool(abs(unit @ normal) > PARALLEL or abs(unit[2]) < PLUMB)


def _layered(met: list[int], leaves: NDArray[np.bool_]) -> dict[int, tuple[int, int]]:
    """The first and last crossings of elements whose layers are bodies that touch.

    Where one body ends and the next begins a ray meets one surface, not two: from entry to exit
    their number is odd.
    """
    found = {}
    for element in set(met):
        own = [number for number, other in enumerate(met) if other == element]
        if len(own) > 1 and len(own) % 2 == 1 and leaves[own[-1]] and not leaves[own[0]]:
            found[element] = own[0], own[-1]
    return found


def _open_or_ground(
    point: NDArray[np.float64], normal: NDArray[np.float64], around: Surroundings
) -> str:
    """Beyond a point: "ground" below its level, "outside" where rays escape, else "unknown"."""
    if point[2] < around.ground_level - 0.1 or (
        normal[2] < -0.7 and point[2] < around.ground_level + DEEPEST_WALL
    ):
        return "ground"
    return "outside" if is_open(point, normal, around.elements) else "unknown"


def is_open(point: NDArray[np.float64], normal: NDArray[np.float64], building: RayMesh) -> bool:
    """Whether a point is in the open air: enough rays on the side of the normal [3] escape."""
    directions = hemisphere(normal, 32)
    # rays that go down end on the ground, which is open air too: all escapes count
    _, hit = building.first_hits(np.tile(point, (32, 1)), directions, FAR)
    return bool(np.mean(hit < 0) > OPEN_SKY)
