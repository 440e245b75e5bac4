"""Derivatives by reflectance from the paths of a matrix: how often each has met a group of surfaces.

A path that has met the surfaces of group g n times has the factor rho_g^n, so that

    d(contribution) / d(ln rho_g) = n contribution

whatever the probability was that Russian roulette let it live: that probability divides both.  One
launch adds up the matrix and, behind it, a layer for each group.
"""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_cfs.surfaces import MOST_GROUPS, SurfaceGroups
from mitsuba_cfs.trace.kernels.sampling import column, opaque
from mitsuba_cfs.trace.kernels.scene import TracedScene

BITS = 32 // MOST_GROUPS  # of the word that counts the bounces on one group
MOST_BOUNCES = (1 << BITS) - 1


class BounceCounts:
    """Counts the bounces of paths on groups of surfaces, and adds their products to layers."""

    def __init__(self, groups: Sequence[SurfaceGroups], surfaces: Sequence[int], stride: int) -> None:
        """Of the rooms of a scene.

        Args:
            groups: of each room, as many in each; surfaces: how many each room has (`surface_counts`).
            stride: entries of a layer of the matrix.
        """
        self.groups = len(groups[0].names)
        shift = np.full(sum(surfaces), 32, dtype=np.uint32)
        for of, first in zip(groups, np.cumsum([0, *surfaces]), strict=False):
            some = np.flatnonzero(of.number >= 0)
            shift[first + some] = BITS * of.number[some]
        self._shift = column(shift, mi.UInt32)
        self._stride = opaque(stride, mi.UInt32)

    def met(self, tracer: TracedScene, triangle: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """What a diffuse bounce on a triangle adds to the word of a path's counts."""
        shift = dr.gather(mi.UInt32, self._shift, dr.gather(mi.UInt32, tracer.surface, triangle, active), active)
        return dr.select(active & (shift < 32), mi.UInt32(1) << (shift & 31), 0)

    def add(self, matrix: mi.Float64, value: mi.Float, counts: mi.UInt32, slot: mi.UInt32, active: mi.Bool) -> None:
        """Add a path's contribution, times its counts, to the layers behind a matrix."""
        for number in range(self.groups):
            bounces = (counts >> (BITS * number)) & MOST_BOUNCES
            layer = slot + self._stride * mi.UInt32(number + 1)
            dr.scatter_add(matrix, mi.Float64(value * mi.Float(bounces)), layer, active & (bounces > 0))
