"""Hits of rays in triangle meshes, for asking what lies behind a wall.

A bounding-volume tree over the triangles, walked by compiled code: no tracer, no variant, doubles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled

LEAF = 4  # triangles in a leaf of the tree at the most
DEEPEST = 64  # stack of the walk: the tree halves at every level


@dataclass(frozen=True, slots=True)
class RayMesh:
    """Triangles with a full binary tree of boxes over them: children of node i at 2 i + 1, + 2."""

    triangles: NDArray[np.float64]  # [N, 3, 3]
    leaves: NDArray[np.int64]  # [L, k] triangles of each leaf; some twice, so that all hold k
    boxes: NDArray[np.float64]  # [2 L - 1, 6] low corner, high corner

    def first_hits(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64], reach: float = np.inf
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Distance [R] [m] (inf: none) and triangle [R] (-1: none) that each ray hits first.

        Both sides of a triangle count.  Source of the test: Moeller and Trumbore 1997,
        doi:10.1080/10867651.1997.10487468.
        """
        origins = np.ascontiguousarray(origins, dtype=float)
        directions = np.ascontiguousarray(directions, dtype=float)
        if not len(self.triangles) or not len(origins):
            return np.full(len(origins), np.inf), np.full(len(origins), -1, dtype=np.int64)
        return _first_hits(origins, directions, float(reach), self.triangles, self.leaves, self.boxes)

    def all_hits(
        self, origin: NDArray[np.float64], direction: NDArray[np.float64], reach: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Distances [H] [m] and triangles [H] that one ray hits up to `reach`, in turn.

        What lies in one place is all there: where two bodies touch, faces of both; on an edge, the
        triangles on both sides of it.
        """
        if not len(self.triangles):
            return np.empty(0), np.empty(0, dtype=np.int64)
        origin, direction = np.asarray(origin, dtype=float), np.asarray(direction, dtype=float)
        distance, hit = _all_hits(origin, direction, float(reach), self.triangles, self.leaves, self.boxes)
        hit, first = np.unique(hit, return_index=True)  # some triangles are in two leaves
        order = np.argsort(distance[first], kind="stable")
        return distance[first][order], hit[order]


def ray_mesh(triangles: NDArray[np.float64]) -> RayMesh:
    """Tree over triangles [N, 3, 3]: each level halved by the middle along its longest side."""
    triangles = np.ascontiguousarray(triangles, dtype=float).reshape(-1, 3, 3)
    count = len(triangles)
    if not count:
        return RayMesh(triangles, np.empty((0, LEAF), dtype=np.int64), np.empty((0, 6)))
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    middle = 0.5 * (low + high)
    levels = max(int(np.ceil(np.log2(count / LEAF))), 0)
    size = -(-count // 2**levels)
    parts = np.resize(np.arange(count), (1, size * 2**levels))  # the first ones again at the end
    for _ in range(levels):
        points = middle[parts]
        axis = np.ptp(points, axis=1).argmax(axis=1)
        keys = np.take_along_axis(points, axis[:, None, None], axis=2)[..., 0]
        half = parts.shape[1] // 2
        halves = np.take_along_axis(parts, np.argpartition(keys, half, axis=1), axis=1)
        parts = halves.reshape(-1, half)
    boxes = [np.concatenate([low[parts].min(axis=1), high[parts].max(axis=1)], axis=1)]
    while len(boxes[0]) > 1:
        pairs = boxes[0].reshape(-1, 2, 6)
        joined = [pairs[..., :3].min(axis=1), pairs[..., 3:].max(axis=1)]
        boxes.insert(0, np.concatenate(joined, axis=1))
    return RayMesh(triangles, parts, np.concatenate(boxes))


@compiled()
def _first_hits(origins, directions, reach, triangles, leaves, boxes):
    """The first hit of each ray."""
    count = len(origins)
    distance = np.full(count, np.inf)
    hit = np.full(count, -1, dtype=np.int64)
    stack = np.empty(DEEPEST, dtype=np.int64)
    for r in range(count):
        _hits(
            origins[r], directions[r], reach, True, distance[r : r + 1], hit[r : r + 1], stack, triangles, leaves, boxes
        )
    return distance, hit


@compiled()
def _all_hits(o, d, reach, triangles, leaves, boxes):
    """All hits of one ray, in no order."""
    stack, room, found = np.empty(DEEPEST, dtype=np.int64), 16, 17
    while found > room:
        room *= 2
        distance, hit = np.empty(room), np.empty(room, dtype=np.int64)
        found = _hits(o, d, reach, False, distance, hit, stack, triangles, leaves, boxes)
    return distance[:found], hit[:found]


@compiled()
def _hits(o, d, reach, first, distance, hit, stack, triangles, leaves, boxes):
    """Walk the tree for one ray; how many hits there are, as many of them stored as find room."""
    found = top = 0
    inner = len(boxes) - len(leaves)
    stack[0] = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if not _meets(o, d, boxes[node], reach):
            continue
        if node < inner:
            stack[top + 1] = 2 * node + 2
            stack[top + 2] = 2 * node + 1
            top += 2
            continue
        for k in leaves[node - inner]:
            t = _distance(o, d, triangles[k])
            if t == np.inf or (t >= reach if first else t > reach):
                continue
            if first:
                reach, found = t, 0
            if found < len(hit):
                distance[found], hit[found] = t, k
            found += 1
    return found


@compiled()
def _meets(o, d, box, reach):
    """Whether the ray meets the box before `reach`."""
    near, far = 0.0, reach
    for k in range(3):
        if abs(d[k]) < 1e-15:
            if o[k] < box[k] - 1e-9 or o[k] > box[k + 3] + 1e-9:
                return False
            continue
        a = (box[k] - 1e-9 - o[k]) / d[k]
        b = (box[k + 3] + 1e-9 - o[k]) / d[k]
        if a > b:
            a, b = b, a
        near, far = max(near, a), min(far, b)
        if near > far:
            return False
    return True


@compiled()
def _distance(o, d, triangle):
    """Distance along the ray to the triangle, inf where it misses; without arrays, they are slow.

    Source: Moeller and Trumbore 1997, with p = d x e2, s = o - a, q = s x e1.
    """
    ax, ay, az = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    e1x, e1y, e1z = triangle[1, 0] - ax, triangle[1, 1] - ay, triangle[1, 2] - az
    e2x, e2y, e2z = triangle[2, 0] - ax, triangle[2, 1] - ay, triangle[2, 2] - az
    px = d[1] * e2z - d[2] * e2y
    py = d[2] * e2x - d[0] * e2z
    pz = d[0] * e2y - d[1] * e2x
    det = px * e1x + py * e1y + pz * e1z
    if abs(det) < 1e-14:
        return np.inf
    sx, sy, sz = o[0] - ax, o[1] - ay, o[2] - az
    u = (sx * px + sy * py + sz * pz) / det
    if u < -1e-9 or u > 1 + 1e-9:
        return np.inf
    qx = sy * e1z - sz * e1y
    qy = sz * e1x - sx * e1z
    qz = sx * e1y - sy * e1x
    v = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if v < -1e-9 or u + v > 1 + 1e-9:
        return np.inf
    t = (e2x * qx + e2y * qy + e2z * qz) / det
    return t if t > 1e-6 else np.inf


def hemisphere(normal: NDArray[np.float64], count: int = 48) -> NDArray[np.float64]:
    """Unit directions [count, 3] spread evenly over the half space of the normal (a spiral)."""
    k = np.arange(count) + 0.5
    z = 1 - k / count
    azimuth = np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z * z)
    local = np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), z])
    w = normal / np.linalg.norm(normal)
    u = np.cross(w, [1.0, 0, 0] if abs(w[0]) < 0.9 else [0, 1.0, 0])
    u /= np.linalg.norm(u)
    return local @ np.stack([u, np.cross(w, u), w])
