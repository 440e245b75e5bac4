"""Plane faces that close a room without a gap: neighbours share vertices and whole edges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bim.planes import Facet, polygons_of, rings_of, triangulated

WELD = 1e-4  # vertices nearer than this become one: a tenth of a millimetre [m]


def conforming_triangles(facets: list[Facet]) -> list[NDArray[np.float64]]:
    """Triangles [T, 3, 3] of each facet such that neighbouring facets share whole edges.

    Vertices of one facet that lie on an edge of another are inserted there, then every polygon is
    triangulated with all its vertices (constrained Delaunay).  Facets that collapse give [0, 3, 3].
    """
    rings = [[facet.plane.to_world(ring) for ring in rings_of(facet.polygon)] for facet in facets]
    points = np.concatenate([ring for many in rings for ring in many])
    vertices = welded(points)
    tree = cKDTree(vertices)
    corners = np.split(tree.query(points)[1], np.cumsum([len(ring) for many in rings for ring in many])[:-1])
    whole = iter(_with_touching(corners, vertices, tree))
    return [_triangles(facet, [next(whole) for _ in many], vertices) for facet, many in zip(facets, rings, strict=True)]


def welded(points: NDArray[np.float64], distance: float = WELD) -> NDArray[np.float64]:
    """One representative [M, 3] for each cluster of points [N, 3] within `distance`."""
    tree = cKDTree(points)
    keep = np.ones(len(points), dtype=bool)
    for i, near in enumerate(tree.query_ball_point(points, distance)):
        if keep[i]:
            keep[[j for j in near if j > i]] = False
    return points[keep]


def _with_touching(
    rings: Sequence[NDArray[np.int64]], vertices: NDArray[np.float64], tree: cKDTree
) -> Iterator[list[int]]:
    """Indices of the welded vertices along each ring, those of other facets included."""
    edges = [
        [(a, b) for a, b in zip(ring, np.roll(ring, -1), strict=True) if a != b] for ring in map(np.asarray, rings)
    ]
    between = iter(_between(np.array([edge for ring in edges for edge in ring]).reshape(-1, 2), vertices, tree))
    for ring in edges:
        yield [i for start, _ in ring for i in (int(start), *next(between).tolist())]


def _between(edges: NDArray[np.int64], vertices: NDArray[np.float64], tree: cKDTree) -> list[NDArray[np.int64]]:
    """Indices of the vertices on each edge [E, 2], from its start to its end, without these."""
    start, edge = vertices[edges[:, 0]], vertices[edges[:, 1]] - vertices[edges[:, 0]]
    length = np.linalg.norm(edge, axis=1)
    near = tree.query_ball_point(start + edge / 2, length / 2 + WELD)
    of = np.repeat(np.arange(len(edges)), [len(some) for some in near])
    vertex = np.array([i for some in near for i in some], dtype=np.int64)
    offset = vertices[vertex] - start[of]
    along = np.einsum("ij,ij->i", offset, edge[of]) / length[of]
    off = np.linalg.norm(offset - (along / length[of])[:, None] * edge[of], axis=1)
    between = (off < 2 * WELD) & (along > WELD) & (along < length[of] - WELD)
    order = np.flatnonzero(between)[np.lexsort((along[between], of[between]))]
    return np.split(vertex[order], np.searchsorted(of[order], np.arange(1, len(edges))))


def _triangles(facet: Facet, rings: list[list[int]], vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of one facet on the welded vertices."""
    rings = [ring for ring in rings if len(ring) >= 3]
    if not rings:
        return np.empty((0, 3, 3))
    flat = [facet.plane.to_plane(vertices[ring])[:, :2] for ring in rings]
    polygon = shapely.Polygon(flat[0], flat[1:])
    if not polygon.is_valid:  # welding made holes touch the outline or each other
        outline, *holes = (shapely.make_valid(shapely.Polygon(ring)) for ring in flat)
        polygon = shapely.difference(outline, shapely.union_all(holes))
    corners = np.concatenate(flat)
    index = np.concatenate([np.asarray(ring) for ring in rings])
    parts = [triangulated(p) for p in polygons_of(polygon)]
    if not parts:
        return np.empty((0, 3, 3))
    nearest = index[cKDTree(corners).query(np.concatenate(parts))[1]]
    whole = (nearest != np.roll(nearest, 1, axis=1)).all(axis=1)
    return vertices[nearest[whole]]


def open_edges(triangles: NDArray[np.float64]) -> int:
    """Number of directed edges without their reverse: 0 for a closed, evenly wound surface.

    An edge may be closed by several shorter ones, where corners of a neighbour lie on it.
    """
    corners = triangles.reshape(-1, 3)
    vertices = welded(corners)
    index = cKDTree(vertices).query(corners)[1].reshape(-1, 3)
    edges = _unmatched(np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]]))
    if not len(edges):
        return 0
    tree = cKDTree(vertices)
    chains = [
        [a, *some.tolist(), b] for (a, b), some in zip(edges.tolist(), _between(edges, vertices, tree), strict=True)
    ]
    return len(_unmatched(np.array([pair for chain in chains for pair in pairwise(chain)])))


def _unmatched(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """The directed edges [E, 2] that remain when each has taken away a reverse one."""
    edges = edges[edges[:, 0] != edges[:, 1]]
    ordered, sign = np.sort(edges, axis=1), np.where(edges[:, 0] < edges[:, 1], 1, -1)
    pairs, which = np.unique(ordered, axis=0, return_inverse=True)
    net = np.bincount(which.reshape(-1), weights=sign, minlength=len(pairs)).astype(np.int64)
    turned = np.where((net < 0)[:, None], pairs[:, ::-1], pairs)
    return np.repeat(turned, np.abs(net), axis=0)


def enclosed_volume(triangles: NDArray[np.float64]) -> float:
    """Signed volume [m3] in a closed surface [N, 3, 3]; positive when normals point outwards."""
    a, b, c = (triangles - triangles.reshape(-1, 3).mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
