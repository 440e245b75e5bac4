"""Sensors spread over polygons: walls for irradiance, facades, photovoltaic panels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Face, Window
from bim.planes import Plane, merged_polygons, newell_normal, plane_through
from bim.sensors import winding_number

OFF_THE_SURFACE = 0.01  # sensors stand this far before what they belong to [m]


def polygon_sensors(
    ring: NDArray[np.float64],
    spacing: Sequence[float],
    holes: Sequence[NDArray[np.float64]] = (),
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [S, 3] on a polygon [N, 3] and its unit normal [3].

    The spacing along X, Y and Z of the world is taken to the polygon's own axes u and v:
    d_u = sqrt((u_x d_X)^2 + (u_y d_Y)^2 + (u_z d_Z)^2), d_v likewise; the first point lies half a
    spacing from the corner of the polygon's box in those axes.  A point counts where the winding
    number of ring and holes is not zero, so holes and self-intersections are allowed.

    Source: the dissertation, section 2.5, with d_Y and d_Z in their places (printed: d_X three
    times); winding number: Sunday 2001.
    """
    spacing = np.asarray(spacing, dtype=float)
    if spacing.shape != (3,) or spacing.min() <= 0:
        raise ValueError("spacing: expected three positive lengths, along X, Y and Z")
    vector = newell_normal(ring)
    if not np.linalg.norm(vector) > 0:
        raise ValueError("the polygon has no area")
    plane = plane_through(ring[0], vector)
    holes = [hole if newell_normal(hole) @ vector < 0 else hole[::-1] for hole in holes]
    flat = [plane.to_plane(one)[:, :2] for one in (ring, *holes)]
    edges = np.concatenate([np.stack([one, np.roll(one, -1, axis=0)], axis=1) for one in flat])
    low, high = flat[0].min(axis=0), flat[0].max(axis=0)
    du, dv = (np.linalg.norm(axis * spacing) for axis in plane.axes[:2])
    u = np.arange(low[0] + du / 2, high[0], du)
    v = np.arange(low[1] + dv / 2, high[1], dv)
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = [abs(winding_number(point, edges)) > 0.5 for point in grid]
    return plane.to_world(grid[np.array(inside, dtype=bool)]), plane.normal


def surface_sensors(
    surface: Face | Window, spacing: Sequence[float], *, outdoors: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [S, 3] just before a face or window and their directions [S, 3].

    They look into the room, or outdoors: then they stand before the outer side of the wall.
    """
    depth = 0.0
    if outdoors and isinstance(surface, Face):
        depth = surface.construction.thickness
    plane: Plane = plane_through(surface.triangles[0, 0], surface.normal)
    found = []
    for polygon in merged_polygons(plane.to_plane(surface.triangles)[..., :2]):
        oriented = shapely.orient_polygons(polygon)
        rings = [
            plane.to_world(np.asarray(ring.coords)[:-1])
            for ring in (oriented.exterior, *oriented.interiors)
        ]
        found.append(polygon_sensors(rings[0], spacing, rings[1:])[0])
    points = np.concatenate(found)
    direction = surface.normal if outdoors else -surface.normal
    points = points + (OFF_THE_SURFACE + depth) * direction
    return points, np.tile(direction, (len(points), 1))
