"""Windows in the plane of a wall, as other programs draw them: glass as a part of a face.

A window's glass lies in its frame, else in the wall around it; where it lies in neither, a face is
made for it that is a thousandth wider.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Face, Space, Window
from bim.planes import Plane, merged_polygons, plane_through, polygons_of

SAME_PLANE = 2e-3  # glass this near the plane of a face lies in it [m]
WIDER = 1.001  # of a face that is made for a window, in size
SLIVER = 1.5e-3  # narrower polygons are left out [m]
RIM = 1e-4  # width of a face around a pane that shares its outline [m]
INSIDE = 0.01  # share of the glass' border that a face it lies in has to share


@dataclass(frozen=True, slots=True)
class HostedPolygon:
    """A plane polygon of a room's boundary with the panes that lie in it."""

    face: Face | None  # None: made for its pane
    plane: Plane
    polygon: shapely.Polygon  # with its panes
    panes: tuple[tuple[Window, shapely.Polygon], ...] = ()


def hosted_polygons(space: Space) -> list[HostedPolygon]:
    """The polygons of a room's faces, in their order, and of glass that lies in none of them.

    Slivers, which other programs refuse, are left out.  A pane that shares the outline of its face
    is smaller by a rim: honeybee takes it as outside where lines meet.
    """
    parts = [
        (face, plane, polygon)
        for face in space.faces
        for plane, polygon in _polygons(face.triangles)
        if not polygon.buffer(-SLIVER / 2).is_empty
    ]
    panes: list[list[tuple[Window, shapely.Polygon]]] = [[] for _ in parts]
    extra = []
    for window in space.windows:
        for plane, glass in _polygons(window.triangles):
            at = _host(plane, glass, parts)
            if at is None:
                extra.append(HostedPolygon(None, plane, glass, ((window, _smaller(glass)),)))
                continue
            face, host_plane, polygon = parts[at]
            pane = _moved(glass, plane, host_plane)
            parts[at] = face, host_plane, _largest(shapely.union(polygon, pane, grid_size=1e-6))
            panes[at].append((window, pane))
    polygons = [
        HostedPolygon(face, plane, polygon, tuple((w, _within(pane, polygon)) for w, pane in own))
        for (face, plane, polygon), own in zip(parts, panes, strict=True)
    ]
    return [*polygons, *extra]


def _within(pane: shapely.Polygon, polygon: shapely.Polygon) -> shapely.Polygon:
    """A pane without the part of it that is on the outline of its face."""
    inner = polygon.buffer(-RIM, join_style="mitre")
    return pane if inner.covers(pane) else _largest(pane.intersection(inner))


def _smaller(glass: shapely.Polygon) -> shapely.Polygon:
    middle = [glass.centroid.x, glass.centroid.y]
    return shapely.transform(glass, lambda p: middle + (p - middle) / WIDER)


def _polygons(triangles: NDArray[np.float64]) -> list[tuple[Plane, shapely.Polygon]]:
    """The plane polygons that a surface's triangles are, with its normal."""
    vector = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]).sum(0)
    plane = plane_through(triangles[0, 0], vector)
    return [(plane, p) for p in merged_polygons(plane.to_plane(triangles)[..., :2])]


def _moved(polygon: shapely.Polygon, source: Plane, target: Plane) -> shapely.Polygon:
    return shapely.transform(polygon, lambda p: target.to_plane(source.to_world(p))[:, :2])


def _largest(shape: shapely.Geometry) -> shapely.Polygon:
    return max(polygons_of(shape), key=lambda polygon: polygon.area)


def _host(plane: Plane, glass: shapely.Polygon, parts: Sequence[tuple[Face, Plane, shapely.Polygon]]) -> int | None:
    """The polygon of a face that the glass lies in: that which has most of its border."""
    best, most = None, INSIDE * glass.length
    for index, (_, other, polygon) in enumerate(parts):
        corners = plane.to_world(shapely.get_coordinates(glass))
        off = np.abs(other.to_plane(corners)[:, 2]).max()
        if plane.normal @ other.normal < 0.9999 or off > SAME_PLANE:
            continue
        pane = _moved(glass, plane, other)
        shared = pane.boundary.intersection(polygon.buffer(SAME_PLANE)).length
        if shared > most:
            best, most = index, shared
    return best
