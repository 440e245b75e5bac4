"""Which surfaces of a Radiance scene are indoors, by random walks.

A walk that starts on a surface goes on in all directions until it meets the inner side of a window
(it began in the room), its outer side, or nothing (it began outdoors).  The share of walks that end
at windows distinguishes indoors from outdoors, even if the drawing has slits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bim.model import Window
from bim.radiance.scene import RadianceObject
from bim.rays import ray_mesh
from bim.shell import welded

WALKS = 64  # from each side of a triangle
STEPS = 300  # surfaces that a walk meets at the most
ENDS = 1e-3  # of walks end at each surface, for those in closed cavities
INDOORS = 0.1  # share of walks that end at a window, from where light of the room gets to a side
CAVITY = 0.5  # half of the rays from a side are shorter than this in a cavity [m]
THICK = 1.0  # behind what is thinner the room goes on: a piece of furniture [m]
BEFORE = 1e-4  # distance from a surface at which its walks start [m]


@dataclass(frozen=True, slots=True)
class Indoors:
    """Which opaque triangles of a scene are in the room, axis T over all of its opaque objects."""

    triangles: NDArray[np.float64]  # [T, 3, 3] [m]
    owner: NDArray[np.int64]  # [T] object
    body: NDArray[np.int64]  # of each object: those that touch are one
    lit: NDArray[np.bool_]  # [2, T] light of the room gets to the front, to the back
    bounds: NDArray[np.bool_]  # [2, T] and it bounds the room's air: no cavity is before it
    furniture: NDArray[np.bool_]  # [T] of bodies in the room, or lit in a cavity

    @property
    def stands(self) -> NDArray[np.bool_]:
        """Furniture [T] of bodies that do not only line a cavity."""
        body = self.body[self.owner]
        standing = np.unique(body[self.furniture & self.bounds.any(axis=0)])
        return self.furniture & np.isin(body, standing)

    def outward(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        """The chosen triangles [T', 3, 3], counter-clockwise seen from beyond the room."""
        front = np.where(self.bounds.any(axis=0), self.bounds[0], self.lit[0])
        return np.where(front[:, None, None], self.triangles[:, ::-1], self.triangles)[chosen]


def indoors_of(objects: Sequence[RadianceObject], windows: Sequence[Window]) -> Indoors:
    """Which surfaces of a scene light of its windows gets to, and which of them bound the room."""
    triangles = np.concatenate([np.empty((0, 3, 3)), *(thing.triangles for thing in objects)])
    owner = np.repeat(np.arange(len(objects)), [len(thing.triangles) for thing in objects])
    count = len(triangles)
    glass = np.concatenate([window.triangles for window in windows])
    walls = np.concatenate([triangles, glass])
    normals = np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    mesh = ray_mesh(walls)
    rng = np.random.default_rng(0)
    share = np.zeros((2, count))
    rows, columns, free = [], [], []
    for side in (0, 1):  # front, back
        up = normals[:count] * (1 - 2 * side)
        starts = np.repeat(np.arange(count), WALKS)
        directions = _cosine(up[starts], rng)
        points = _points(triangles[starts], rng) + BEFORE * up[starts]
        distance, hit = mesh.first_hits(points, directions)
        free.append(np.median(distance.reshape(count, WALKS), axis=1))
        facing = np.einsum("ij,ij->i", directions, normals[hit]) < 0  # meets the front
        on_solid = (hit >= 0) & (hit < count)
        np.add.at(share[side], starts[(hit >= count) & ~facing], 1 / WALKS)
        rows.append(side * count + starts[on_solid])
        columns.append((hit + count * ~facing)[on_solid])
    row, column = np.concatenate(rows), np.concatenate(columns)
    weights = np.full(len(row), 1 / WALKS)
    step = csr_array((weights, (row, column)), shape=(2 * count, 2 * count))
    lit = (_reaching(share.ravel(), step) > INDOORS).reshape(2, count)
    bounds = lit & (np.stack(free) > CAVITY)
    bodies = _bodies(triangles, owner)
    return _with_furniture(Indoors(triangles, owner, bodies, lit, bounds, lit[0]), normals[:count])


def _reaching(share: NDArray[np.float64], step: csr_array) -> NDArray[np.float64]:
    """Share [N] of walks that reach a window from inside, from each side of the surfaces.

    Args: share: that reaches one at once; step: [N, N] to where the others go.
    """
    result = share.copy()
    for _ in range(STEPS):
        result = share + (1 - ENDS) * (step @ result)
    return result


def _with_furniture(indoors: Indoors, normals: NDArray[np.float64]) -> Indoors:
    """The same with the triangles marked behind which the room goes on, by majority of bodies."""
    triangles, (front, back) = indoors.triangles, indoors.lit
    outward = np.where(indoors.bounds[0][:, None], -normals, normals)
    middles = triangles.mean(axis=1) + BEFORE * outward
    hit = ray_mesh(triangles).first_hits(middles, outward, THICK)[1]
    from_front = np.einsum("ij,ij->i", outward, normals[hit]) < 0
    goes_on = (hit >= 0) & np.where(from_front, back[hit], front[hit])
    used = indoors.bounds.any(axis=0)
    behind = used & (indoors.bounds.all(axis=0) | goes_on)
    areas = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    body = indoors.body[indoors.owner]
    total, part = (np.bincount(body, areas * chosen) for chosen in (used, behind))
    stands = (part > 0.5 * total)[body]
    return replace(indoors, furniture=stands | (indoors.lit.any(axis=0) & ~used))


def _bodies(triangles: NDArray[np.float64], owner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of the body that each object belongs to: objects that share corners are one."""
    corners = triangles.reshape(-1, 3)
    vertices = welded(corners)
    index = cKDTree(vertices).query(corners)[1]
    count = int(owner.max()) + 1
    size = count + len(vertices)
    links = csr_array(
        (np.ones(len(index)), (np.repeat(owner, 3), count + index)), shape=(size, size)
    )
    return connected_components(links, directed=False)[1][:count]


def _points(triangles: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A point [N, 3] anywhere on each triangle [N, 3, 3]."""
    a, b = rng.random((2, len(triangles), 1))
    root = np.sqrt(a)
    first, second, third = triangles.transpose(1, 0, 2)
    return (1 - root) * first + root * (1 - b) * second + root * b * third


def _cosine(normals: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A direction [N, 3] by the cosine round each normal: a point of the unit sphere set on it."""
    ball = rng.normal(size=normals.shape)
    directions = normals + ball / np.linalg.norm(ball, axis=1)[:, None]
    return directions / np.linalg.norm(directions, axis=1)[:, None]
