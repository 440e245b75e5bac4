"""Repairs of triangle meshes: weld vertices, wind faces alike, cap plane holes."""

from __future__ import annotations

from collections import defaultdict, deque

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.planes import newell_normal, plane_through, triangulated

FARTHEST = 1e5  # no building is wider: a body of such size is a fault of the file [m]
LONGEST_HOLE = 500  # edges of a hole; a longer one is a sheet, not a solid with a hole


def welded_mesh(triangles: NDArray[np.float64], distance: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices [V, 3] and faces [N, 3]: corners on one grid point merged, collapsed faces out.

    None at all of a body with a coordinate that is no number, or beyond any building.
    """
    corners = triangles.reshape(-1, 3)
    if not _is_of_a_building(corners):
        return corners[:0], np.empty((0, 3), dtype=np.int64)
    keys = np.round(corners / distance).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    faces = inverse.reshape(-1, 3)
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return corners[first], faces[whole]


def _is_of_a_building(points: NDArray[np.float64]) -> bool:
    if not np.isfinite(points).all():
        return False
    flat = points.reshape(-1, 3)
    return not len(flat) or bool(np.ptp(flat, axis=0).max() < FARTHEST)


def closed_faces(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Faces that may be handed to a library of solids; None where they cannot bound one.

    It gets finite vertices of a building's extent, faces whose corners exist and differ, none
    twice, and every edge as often as its reverse: what is less has ended whole processes.
    """
    if len(faces) < 4 or faces.min() < 0 or faces.max() >= len(vertices):
        return None
    used = vertices[faces]
    if not _is_of_a_building(used):
        return None
    if (faces == np.roll(faces, 1, axis=1)).any():
        return None
    faces = _once(faces)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    key, back = edges @ (len(vertices), 1), edges @ (1, len(vertices))
    balanced = len(faces) >= 4 and np.array_equal(np.sort(key), np.sort(back))
    return faces if balanced else None


def _once(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces without those drawn again: two of one sense are one, two back to back are none."""
    corners, inverse = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    if len(corners) == len(faces):
        return faces
    inverse = inverse.ravel()
    first = faces.argmin(axis=1)
    row = np.arange(len(faces))
    rising = faces[row, (first + 1) % 3] < faces[row, (first + 2) % 3]
    net = np.bincount(inverse, np.where(rising, 1, -1), len(corners))
    wanted = np.sign(net)[inverse] == np.where(rising, 1, -1)
    _, keep = np.unique(np.where(wanted, inverse, -1), return_index=True)
    keep = np.sort(keep[wanted[keep]])
    return faces[keep]


def wound_alike(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces turned so that neighbours agree, and each connected part encloses a positive volume."""
    faces = faces.copy()
    by_edge: dict[tuple[int, int], list[int]] = defaultdict(list)
    for i, (a, b, c) in enumerate(faces.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            by_edge[min(edge), max(edge)].append(i)
    seen = np.zeros(len(faces), dtype=bool)
    for seed in range(len(faces)):
        if seen[seed]:
            continue
        part, queue = [seed], deque([seed])
        seen[seed] = True
        while queue:
            a, b, c = (int(k) for k in faces[queue[0]])
            here = queue.popleft()
            for start, end in ((a, b), (b, c), (c, a)):
                near = by_edge[min(start, end), max(start, end)]
                if len(near) != 2:  # a rim, or several faces on one edge: no neighbour to agree with
                    continue
                other = near[0] if near[1] == here else near[1]
                if seen[other]:
                    continue
                seen[other] = True
                f = faces[other].tolist()
                if (start, end) in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0])):
                    faces[other] = faces[other, ::-1]
                part.append(other)
                queue.append(other)
        if _volume(vertices, faces[part]) < 0:
            faces[part] = faces[part, ::-1]
    return faces


def _volume(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    a, b, c = (vertices[faces] - vertices[faces].reshape(-1, 3).mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def capped(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces with every hole closed by triangles in the plane that fits its rim best."""
    caps = [faces]
    for rim in open_rims(faces):
        ring = vertices[rim]
        vector = newell_normal(ring)
        if np.linalg.norm(vector) < 1e-9:
            continue
        plane = plane_through(ring[0], -vector)
        flat = plane.to_plane(ring[::-1])[:, :2]
        polygon = shapely.Polygon(flat)
        if not polygon.is_valid:
            continue
        nearest = np.linalg.norm(triangulated(polygon)[:, :, None] - flat, axis=-1).argmin(axis=-1)
        caps.append(np.asarray(rim[::-1])[nearest])
    return np.concatenate(caps)


def open_rims(faces: NDArray[np.int64]) -> list[list[int]]:
    """Closed rings of vertices along directed edges that have no reverse."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
    have = {tuple(edge) for edge in edges}
    follow: dict[int, list[int]] = defaultdict(list)
    for a, b in have:
        if (b, a) not in have:
            follow[a].append(b)
    rims = []
    while follow:
        start = next(iter(follow))
        rim = [start]
        while len(rim) <= LONGEST_HOLE:
            ends = follow.get(rim[-1])
            if not ends:
                break
            end = ends.pop()
            if not ends:
                del follow[rim[-1]]
            if end == start:
                rims.append(rim)
                break
            rim.append(end)
        else:
            return rims
        if start in follow and not follow[start]:
            del follow[start]
    return [rim for rim in rims if len(rim) >= 3]
