"""Where the mirrors of each orientation are, so that rays that pass by all of them are not traced.

The windows of a building are mirrors in a few layers, one for each of its facades, and cover a small
part of the box round all of them.  A map of each layer has the squares that mirrors may be met in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.sampling import column, vectors

GAP = 0.01  # between the heights of two layers [m]
SQUARES = 256  # of a map along its longer side
REACH = 0.05  # that mirrors are wider by on the map: what rays meet them beside their middle [m]


class MirrorMaps:
    """Maps of the mirrors of some orientations, the planes, by layer."""

    def __init__(self, corners: Sequence[NDArray[np.float64]], normals: NDArray[np.float64]) -> None:
        """From the corners of the triangles of each plane [J][3 T, 3], in the scene's coordinates, and normals [J, 3].

        Planes without triangles have no map.
        """
        plans = [_Plan.of(one.reshape(-1, 3, 3), normal) for one, normal in zip(corners, normals, strict=True)]
        layers = np.cumsum([0, *(len(plan.middle) for plan in plans)])
        squares = np.cumsum([0, *(plan.there.size for plan in plans)])
        self._axes = [vectors([plan.axes[i] for plan in plans]) for i in range(3)]
        self._origin = [column([plan.origin[i] for plan in plans]) for i in range(2)]
        self._size = [column([plan.there.shape[1 + i] for plan in plans], mi.UInt32) for i in range(2)]
        self._edge = column([plan.edge for plan in plans])
        self._first, self._end = column(layers[:-1], mi.UInt32), column(layers[1:], mi.UInt32)
        self._squares = column(squares[:-1], mi.UInt32)
        self._middle = column(np.concatenate([plan.middle for plan in plans]))
        self._half = column(np.concatenate([plan.half for plan in plans]))
        self._there = column(np.concatenate([plan.there.ravel() for plan in plans]), mi.Bool)

    @dr.syntax
    def may_meet(
        self, start: mi.Point3f, way: mi.Vector3f, plane: mi.UInt32, active: mi.Bool, slack: mi.Float
    ) -> mi.Bool:
        """Which active rays may meet mirrors of a plane each: all that do, and others close to one.

        Args: slack: by which places are uncertain [m].
        """
        axes = [dr.gather(mi.Vector3f, axis, plane, active) for axis in self._axes]
        height, x, y = (dr.dot(axis, mi.Vector3f(start)) for axis in axes)
        climb, u, v = (dr.dot(axis, way) for axis in axes)
        steep = dr.maximum(dr.abs(climb), 1e-9)
        first, end, squares = (
            dr.gather(mi.UInt32, of, plane, active) for of in (self._first, self._end, self._squares)
        )
        layer, found = mi.UInt32(first), mi.Bool(False)
        while active & (layer < end) & ~found:
            half = dr.gather(mi.Float, self._half, layer) + slack
            above = dr.gather(mi.Float, self._middle, layer) - height
            above = dr.select(climb < 0, -above, above)
            along = above / steep
            square, inside = self._square(layer - first, x + u * along, y + v * along, plane)
            inside &= above > -half
            # a ray along the layer may meet a mirror far from where it crosses the middle
            found |= dr.gather(mi.Bool, self._there, squares + square, inside) | (half > REACH * steep)
            layer += 1
        return active & found

    def _square(self, layer: mi.UInt32, x: mi.Float, y: mi.Float, plane: mi.UInt32) -> tuple[mi.UInt32, mi.Bool]:
        """Number of the square of a place in a layer of a plane, and whether it is on the map."""
        square, inside, edge = layer, mi.Bool(True), dr.gather(mi.Float, self._edge, plane)
        for place, origin, size in zip((x, y), self._origin, self._size, strict=True):
            at, count = (place - dr.gather(mi.Float, origin, plane)) / edge, dr.gather(mi.UInt32, size, plane)
            inside &= (at >= 0) & (at < mi.Float(count))
            square = square * count + mi.UInt32(at)
        return square, inside


@dataclass(frozen=True, slots=True)
class _Plan:
    """The map of one plane."""

    axes: NDArray[np.float64]  # [3, 3] the normal, and two directions along the mirrors
    origin: NDArray[np.float64]  # [2] of the squares [m]
    edge: float  # of the squares [m]
    middle: NDArray[np.float64]  # [K] height of each layer
    half: NDArray[np.float64]  # [K] by which a layer's mirrors are higher or lower than its middle
    there: NDArray[np.bool_]  # [K, i, j] whether a mirror may be met in a square

    @classmethod
    def of(cls, triangles: NDArray[np.float64], normal: NDArray[np.float64]) -> _Plan:
        """From triangles [T, 3, 3]."""
        across = np.linalg.svd(normal[None])[2][1:]
        axes = np.stack([normal, *across])
        if not len(triangles):
            return cls(axes, np.zeros(2), 1.0, np.empty(0), np.empty(0), np.empty((0, 1, 1), dtype=bool))
        middle, half, layer = _layers(triangles @ normal)
        place = triangles @ across.T
        low, high = place.min(axis=1) - REACH, place.max(axis=1) + REACH
        origin = low.min(axis=0)
        edge = float((high.max(axis=0) - origin).max()) / SQUARES
        first = ((low - origin) / edge).astype(np.int64)
        last = ((high - origin) / edge).astype(np.int64)
        there = np.zeros((len(middle), *(last.max(axis=0) + 1)), dtype=bool)
        for k, (i, j), (m, n) in zip(layer, first, last, strict=True):
            there[k, i : m + 1, j : n + 1] = True
        return cls(axes, origin, edge, middle, half, there)


def _layers(heights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Layers of triangles by the heights of their corners [T, 3]: middle and half of each [K], the layer [T]."""
    low, high = heights.min(axis=1), heights.max(axis=1)
    order = np.argsort(low)
    climbed = np.maximum.accumulate(high[order])
    begins = np.append(True, low[order][1:] > climbed[:-1] + GAP)
    layer = np.empty(len(low), dtype=np.int64)
    layer[order] = np.cumsum(begins) - 1
    bottom = low[order][begins]
    top = climbed[np.append(np.flatnonzero(begins)[1:], len(low)) - 1]
    return 0.5 * (bottom + top), 0.5 * (top - bottom), layer
