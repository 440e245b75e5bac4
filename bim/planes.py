"""Planes and the polygons in them: the step between a triangle mesh and named plane faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import area_vectors

PLANE_TOLERANCE = 2e-5  # vertices this near a plane lie in it [m]: a fifth of what is welded
SAME_DIRECTION = 0.99999  # cosine of 0.26 degrees: facets of curved walls stay apart
GRID = 1e-6  # overlays of polygons are rounded to this: no zero-width strips [m]
SMALLEST_AREA = 1e-6  # polygons below one square millimetre are numerical dust [m2]


def principal_extents(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Extents [3] of points [N, 3] along their principal axes, the least first [m]."""
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return np.sort(np.ptp(points @ axes.T, axis=0))


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane with its own right-handed axes: u, v in the plane, w = u x v the normal."""

    origin: NDArray[np.float64]  # [3] [m]
    axes: NDArray[np.float64]  # [3, 3] rows u, v, w

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal [3]."""
        return self.axes[2]

    def to_plane(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points [..., 3] in u, v and height above the plane [..., 3]."""
        return (points - self.origin) @ self.axes.T

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points [N, 2] or [N, 3] of the plane's axes in the world [N, 3]."""
        points = np.asarray(points, dtype=float)
        return points @ self.axes[: points.shape[-1]] + self.origin


@dataclass(frozen=True, slots=True)
class Facet:
    """A polygon with holes in a plane, and the label of where it comes from."""

    plane: Plane
    polygon: shapely.Polygon  # in the plane's u, v [m]
    label: int = 0


def plane_through(origin: NDArray[np.float64], normal: NDArray[np.float64]) -> Plane:
    """Plane of that normal through a point; v points up as far as it can (north if level)."""
    w = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    up = np.array([0.0, 0.0, 1.0]) if abs(w[2]) < 0.9999 else np.array([0.0, 1.0, 0.0])
    v = up - (up @ w) * w
    v /= np.linalg.norm(v)
    return Plane(np.asarray(origin, dtype=float), np.stack([np.cross(v, w), v, w]))


def newell_normal(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area vector [3] [m2] of a closed ring [N, 3], plane or not, concave or not.

    Source: Newell's method, Tampieri 1992 (Graphics Gems III, "Newell's method for computing the
    plane equation of a polygon").
    """
    return 0.5 * np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)


def planar_facets(triangles: NDArray[np.float64], labels: NDArray[np.int64] | None = None) -> list[Facet]:
    """Plane polygons that triangles [T, 3, 3] of one label [T] merge to, biggest plane first."""
    labels = np.zeros(len(triangles), dtype=int) if labels is None else labels
    vectors = area_vectors(triangles)
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(areas, 1e-300)[:, None]
    free = areas > SMALLEST_AREA * 1e-3
    facets: list[Facet] = []
    for seed in np.argsort(-areas):
        if not free[seed]:
            continue
        plane = plane_through(triangles[seed, 0], normals[seed])
        heights = np.abs((triangles - plane.origin) @ plane.normal).max(axis=1)
        member = free & (labels == labels[seed]) & (heights < PLANE_TOLERANCE)
        member &= normals @ plane.normal > SAME_DIRECTION
        member[seed] = True
        free &= ~member
        flat = plane.to_plane(triangles[member])[..., :2]
        facets += [Facet(plane, polygon, int(labels[seed])) for polygon in merged_polygons(flat)]
    return facets


def merged_polygons(flat: NDArray[np.float64]) -> list[shapely.Polygon]:
    """Polygons with holes that flat triangles [T, 3, 2] cover together."""
    return polygons_of(shapely.union_all(shapely.make_valid(shapely.polygons(flat))))


def polygons_of(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    """The polygons in any geometry that are more than dust."""
    if isinstance(geometry, shapely.Polygon):
        return [geometry] if geometry.area > SMALLEST_AREA else []
    if not isinstance(geometry, shapely.geometry.base.BaseMultipartGeometry):
        return []
    return [polygon for part in geometry.geoms for polygon in polygons_of(part)]


def without_slits(geometry: shapely.Geometry, width: float) -> shapely.Geometry:
    """A polygon or several with the gaps and notches up to this width filled [m]."""
    wider = geometry.buffer(width / 2, join_style="mitre")
    return wider.buffer(-width / 2, join_style="mitre")


def rings_of(polygon: shapely.Polygon) -> list[NDArray[np.float64]]:
    """Open rings [N, 2]: the outer one counter-clockwise, then the holes clockwise."""
    oriented = shapely.orient_polygons(polygon)
    rings = [oriented.exterior, *oriented.interiors]
    return [np.asarray(ring.coords)[:-1] for ring in rings]


def without_holes(polygon: shapely.Polygon) -> list[shapely.Polygon]:
    """Polygons without holes that cover one with holes: cut upright through each hole."""
    if not polygon.interiors:
        return [polygon]
    (x, _), (left, low, right, high) = polygon.interiors[0].centroid.coords[0], polygon.bounds
    halves = (shapely.box(left - 1, low - 1, x, high + 1), shapely.box(x, low - 1, right + 1, high + 1))
    cut = shapely.intersection([polygon, polygon], halves, grid_size=GRID)
    return [part for half in cut for piece in polygons_of(half) for part in without_holes(piece)]


def triangulated(polygon: shapely.Polygon) -> NDArray[np.float64]:
    """Counter-clockwise triangles [T, 3, 2] that use every vertex of the polygon and no other."""
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    flat = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)
    return flat[:, :3]
