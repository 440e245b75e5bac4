"""Rooms that nobody drew: the voids that merged building elements enclose.

The elements are united, small gaps between them closed, and the boundary of the union is split
into parts that touch.  The part that a ray from outside the bounding box meets first is the
building's outer face; the other parts are rooms.  This is the dissertation's algorithm (section
2.4); the sign of each part's volume, a winding number, has to say the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from bim.leaks import may_enclose
from bim.planes import principal_extents
from bim.rays import ray_mesh
from bim.shell import enclosed_volume
from bim.solids import solid_of, triangles_of, union
from mitsuba_cfs.processes import Told
from mitsuba_cfs.surfaces import area_vectors

GAP = 0.02  # gaps between elements up to this are closed [m]
FINEST = 1e-3  # smaller details of a found room are smoothed out [m]
SMALLEST_ROOM = 2.0  # smaller voids are cavities and shafts [m3]
LOWEST_ROOM = 1.5  # lower ones are no rooms either [m]
MOST_TRIANGLES = 120  # elements with more are united as they are: widening takes a second each
MOST_WIDENED = 20_000  # triangles of all that are not convex, biggest first: a minute on one core
THICKEST_WALL = 0.6  # a body that is no thicker may be filled where its surface is open [m]
LARGEST_VOID = 5_000  # triangles; a void with more is not widened back, so that its room is smaller
LIMIT_S = 180.0  # the search for rooms is stopped then


@dataclass(frozen=True, slots=True)
class Enclosed:
    """Rooms found between elements, and what was too much work to be done in full."""

    rooms: tuple[NDArray[np.float64], ...]  # triangles [N, 3, 3] of each, biggest first
    not_widened: int = 0  # elements united as they are: gaps beside them stay open
    not_extended: int = 0  # rooms that end half a gap before their walls
    hulls: int = 0  # flat elements without a closed body: their convex hulls


def rooms_enclosed_by(elements: Sequence[NDArray[np.float64]], gap: float = GAP, tell: Told | None = None) -> Enclosed:
    """Rooms between building elements, each of triangles [N, 3, 3].

    Every element is widened by half the gap; the remaining voids are widened again, less the
    elements as they are, so that the rooms end at the elements' own faces.

    Args: tell: called with "number of the element, number of all", the last one for the union.
    """
    tell = tell or (lambda text: None)
    turn = main_wall_direction(np.concatenate(elements)) if len(elements) else np.eye(3)
    back = np.linalg.inv(turn)
    cube = manifold3d.Manifold.cube((gap, gap, gap), True)
    turned, wide, spent, not_widened, hulls = {}, {}, 0, 0, 0
    areas = [np.linalg.norm(area_vectors(element), axis=1).sum() for element in elements]
    for index in np.argsort(-np.nan_to_num(areas), kind="stable"):
        tell(f"{index} {len(elements)}")
        solid = solid_of(elements[index])
        body = _flat_hull(elements[index]) if solid is None else solid.manifold
        if body is None:
            continue
        hulls += solid is None
        own = turned[index] = _turned(body, turn)
        spent += _work_to_widen(own)
        wide[index] = _widened(own, cube) if spent <= MOST_WIDENED else own
        not_widened += spent > MOST_WIDENED
    tell(f"{len(elements)} {len(elements)}")
    if not turned:
        return Enclosed(())
    original = union([turned[index] for index in sorted(turned)])
    united = union([wide[index] for index in sorted(wide)])
    rooms, not_extended = [], 0
    for part in interior_parts(triangles_of(united)[0]):
        void = solid_of(part[:, ::-1])
        if void is None:
            continue
        room = void.manifold
        if room.num_tri() <= LARGEST_VOID:
            # one widening gives back what the elements' own widening took
            room = room.minkowski_sum(cube)
        else:
            not_extended += 1
        room = (room - original).simplify(FINEST)
        rooms += [piece for piece in room.decompose() if _is_room(piece)]
    rooms.sort(key=lambda room: -room.volume())
    found = (triangles_of(_turned(room, back).as_original())[0] for room in rooms)
    return Enclosed(tuple(found), not_widened, not_extended, hulls)


def first_rooms_enclosed(
    elements: Sequence[NDArray[np.float64]], attempts: Sequence[tuple[Sequence[NDArray[np.float64]], float]], tell: Told
) -> tuple[int, Enclosed]:
    """Number of the first attempt (elements besides, gap [m]) that finds rooms, and these; -1."""
    for number, (more, gap) in enumerate(attempts):
        if not may_enclose([*elements, *more], gap):
            continue
        enclosed = rooms_enclosed_by([*elements, *more], gap, tell)
        if enclosed.rooms:
            return number, enclosed
    return -1, Enclosed(())


def _flat_hull(triangles: NDArray[np.float64]) -> manifold3d.Manifold | None:
    """The convex hull of an open body that is as flat as a wall; None of any other one."""
    corners = np.unique(triangles.reshape(-1, 3), axis=0)
    if not np.isfinite(corners).all():
        return None
    if principal_extents(corners)[0] > THICKEST_WALL:
        return None
    hull = manifold3d.Manifold.hull_points(corners)
    return hull if hull.volume() > 0 else None


def _is_room(solid: manifold3d.Manifold) -> bool:
    box = solid.bounding_box()
    return solid.volume() > SMALLEST_ROOM and box[5] - box[2] > LOWEST_ROOM


def _work_to_widen(solid: manifold3d.Manifold) -> int:
    """Triangles whose widening takes time: none of a convex solid, nor of one left as it is."""
    if solid.num_tri() > MOST_TRIANGLES or solid.hull().volume() < 1.0001 * solid.volume():
        return 0
    return solid.num_tri()


def _widened(solid: manifold3d.Manifold, cube: manifold3d.Manifold) -> manifold3d.Manifold:
    return solid.minkowski_sum(cube) if solid.num_tri() <= MOST_TRIANGLES else solid


def _turned(solid: manifold3d.Manifold, rotation: NDArray[np.float64]) -> manifold3d.Manifold:
    return solid.transform(np.column_stack([rotation, np.zeros(3)]))


def main_wall_direction(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation [3, 3] about z that brings most upright area [N, 3, 3] to face along x or y."""
    vectors = area_vectors(triangles)
    areas = np.linalg.norm(vectors, axis=1)
    upright = (areas > 1e-9) & (np.abs(vectors[:, 2]) < 0.1 * areas)
    if not upright.any():
        return np.eye(3)
    azimuth = np.mod(np.arctan2(vectors[upright, 1], vectors[upright, 0]), np.pi / 2)
    quarter, weights = np.exp(4j * azimuth), areas[upright]
    # the direction of the biggest heap of walls, not the mean of several
    bins = np.round(np.degrees(azimuth)).astype(int) % 90
    heap = bins == np.bincount(bins, weights, 90).argmax()
    angle = np.angle(np.sum(quarter[heap] * weights[heap])) / 4
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def interior_parts(triangles: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Parts [N, 3, 3] of a closed surface that lie inside, as the outside does not see them.

    Parts touch through shared vertices.  A part is interior if the ray from outside does not meet
    it first and its enclosed volume is negative (its normals point into the void).
    """
    labels = touching_parts(triangles)
    outer = outer_part(triangles, labels)
    parts = [triangles[labels == k] for k in range(labels.max(initial=-1) + 1) if k != outer]
    return [part for part in parts if enclosed_volume(part) < 0]


def touching_parts(triangles: NDArray[np.float64], body: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
    """Number of the connected part that each triangle [N, 3, 3] belongs to.

    Args: body: of each triangle [N]; triangles of different bodies do not touch.
    """
    keys = np.round(triangles.reshape(-1, 3) / 1e-6).astype(np.int64)
    if body is not None:
        keys = np.column_stack([keys, np.repeat(body, 3)])
    faces = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1, 3)
    count = int(faces.max(initial=-1)) + 1
    rows, columns = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    return connected_components(graph, directed=False)[1][faces[:, 0]]


def outer_part(triangles: NDArray[np.float64], labels: NDArray[np.int64]) -> int:
    """Part that a ray from a corner outside the bounding box meets first on its way in; -1: none.

    The ray goes to the middle of the biggest triangle, so that it meets something.
    """
    if not len(triangles):
        return -1
    corners = triangles.reshape(-1, 3)
    start = np.add(corners.max(axis=0), [1.0, 1.3, 0.7])
    target = triangles[np.linalg.norm(area_vectors(triangles), axis=1).argmax()].mean(axis=0)
    direction = (target - start) / np.linalg.norm(target - start)
    _, hit = ray_mesh(triangles).first_hits(start[None], direction[None])
    return -1 if hit[0] < 0 else int(labels[hit[0]])
