"""Points even over the area of a room's surfaces, on both of their sides.

The first half of the points is on the side of the normals, the second half, the same points, on the
other.  A triangle's points follow each other, so that what is the triangle's own is repeated.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.sampling import pixel_positions
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints

SIDES = (1.0, -1.0)  # of a triangle, along its normal


class EvenPoints:
    """Points of triangles, `count` on either side, numbered side by side."""

    def __init__(self, surfaces: Surfaces, centre: NDArray[np.float64], off: float, count: int) -> None:
        """Of surfaces with an area, about a centre; off: how far off the surfaces they are [m]."""
        share, marks = np.cumsum(surfaces.areas), (np.arange(count) + 0.5) / count
        ends = np.searchsorted(marks * share[-1], share, side="right")
        ends[-1] = count
        corners = surfaces.triangles.swapaxes(0, 1)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        self.count, self._ends = count, ends
        self._each = np.diff(ends, prepend=0)
        self._corners, self._off = corners - centre, off * normal
        self.normals = np.stack([side * normal for side in SIDES]).astype(np.float32)  # [2, T, 3] of both sides

    def repeated(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the triangles [T] as those of the points of a side [count]."""
        return np.repeat(values, self._each)

    def along(self, axis: int) -> list[NDArray[np.float32]]:
        """A coordinate of the points [count], of either side."""
        parts = zip(self._corners[:, :, axis], _shares_of_corners(self.count), strict=True)
        first, *others = (self.repeated(corner) * part for corner, part in parts)
        for other in others:
            first += other
        off = self.repeated(self._off[:, axis])
        return [(first + off).astype(np.float32), (first - off).astype(np.float32)]

    def some(self, number: NDArray[np.integer]) -> SurfacePoints:
        """The points with some numbers, those of the second side from `count` on."""
        side, place = np.divmod(number, self.count)
        triangle = np.searchsorted(self._ends, place, side="right")
        parts = zip(self._corners, _shares_of_corners(self.count), strict=True)
        point = sum(corner[triangle] * part[place, None] for corner, part in parts)
        point = point + np.array(SIDES)[side, None] * self._off[triangle]
        return SurfacePoints(point.astype(np.float32), self.normals[side, triangle])


@cache
def _shares_of_corners(count: int) -> tuple[NDArray[np.float64], ...]:
    """What points even over a triangle have of its corners [count], in turn."""
    u, v = np.ascontiguousarray(pixel_positions(count).T)
    root = np.sqrt(u)
    return 1 - root, root * (1 - v), root * v
