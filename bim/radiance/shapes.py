"""Shapes of Radiance's objects as triangles.

Circles become polygons of the same area.  Source of the arguments: "The RADIANCE 5.1 Synthetic
Imaging System", 3.1.
"""

from __future__ import annotations

import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray

from bim.planes import newell_normal, plane_through, triangulated
from bim.radiance.primitives import Primitive

SIDES = 32  # of a circle
FARTHEST = 1e10  # of a coordinate, in units of the file
SUBDIVISIONS = 2  # of an icosahedron: 320 triangles

INWARD = {"bubble": "sphere", "tube": "cylinder", "cup": "cone"}
ARGUMENTS = {"sphere": 4, "cylinder": 7, "cone": 8, "ring": 8}
KINDS = ("polygon", *ARGUMENTS, *INWARD)


def triangles_of(primitive: Primitive) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of an object, counter-clockwise seen from its front; [0, 3, 3] if flat.

    Raises: `DataError` naming file and line for wrong arguments.
    """
    kind = INWARD.get(primitive.kind, primitive.kind)
    numbers = np.asarray(primitive.numbers)
    if not np.abs(numbers).max(initial=0.0) <= FARTHEST:
        raise primitive.fault(f"a coordinate or size is above {FARTHEST:g}")
    if kind == "polygon":
        if len(numbers) < 9 or len(numbers) % 3:
            raise primitive.fault(
                f"expected three numbers of each corner, got {len(numbers)} numbers"
            )
        return polygon_triangles(numbers.reshape(-1, 3))
    if len(numbers) != ARGUMENTS[kind]:
        raise primitive.fault(f"expected {ARGUMENTS[kind]} numbers, got {len(numbers)}")
    if (numbers[6:] < 0).any() or (kind == "sphere" and numbers[3] <= 0):
        raise primitive.fault("a radius is negative")
    triangles = sphere(numbers[:3], numbers[3]) if kind == "sphere" else strip(kind, numbers)
    return triangles[:, ::-1] if primitive.kind in INWARD else triangles


def polygon_triangles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """A plane polygon [n, 3] as triangles, concave or with holes on seams."""
    area = newell_normal(corners)
    if not np.linalg.norm(area) > 0:
        return np.empty((0, 3, 3))
    plane = plane_through(corners[0], area)
    whole = shapely.make_valid(shapely.Polygon(plane.to_plane(corners)[:, :2]))
    parts = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon"]
    flat = np.concatenate([np.empty((0, 3, 2)), *map(triangulated, parts)])
    return plane.to_world(flat.reshape(-1, 2)).reshape(-1, 3, 3)


def sphere(centre: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """A sphere's triangles, of its area."""
    mesh = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    return mesh.triangles * (radius * np.sqrt(4 * np.pi / mesh.area)) + centre


def strip(kind: str, numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """The strip between two circles; the front is outside, of a ring where its normal points."""
    if kind == "ring":
        start = end = numbers[:3]
        axis, radii = numbers[3:6], numbers[6:8][::-1]
    else:
        start, end = numbers[:3], numbers[3:6]
        axis, radii = end - start, (numbers[6], numbers[7] if kind == "cone" else numbers[6])
    if not np.linalg.norm(axis) > 0:
        return np.empty((0, 3, 3))
    u, v, _ = plane_through(start, axis).axes
    angles = np.linspace(0.0, 2 * np.pi, SIDES + 1)
    size = np.sqrt((2 * np.pi / SIDES) / np.sin(2 * np.pi / SIDES))
    round_ = size * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    low, high = start + radii[0] * round_, end + radii[1] * round_
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    both = np.concatenate([first, second])
    areas = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
    return both[areas > 0]
