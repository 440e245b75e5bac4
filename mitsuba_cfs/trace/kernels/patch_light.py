"""Luminance of the window patches in some hours, which paths accumulate instead of patches."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.sampling import column, opaque

PARTS = ("lit", "later")


class PatchLight:
    """Luminances that view paths add to the hours of their row where they meet a patch.

        sum over patches of V[row, patch] L[patch, h], path by path

    A matrix of patches is the case of as many hours as patches, each of which has one patch alone
    at 1; few hours are fewer columns to hold and to smooth.
    """

    def __init__(self, lit: NDArray[np.float32], later: NDArray[np.float32]) -> None:
        """From luminances [G * K, h] for light after one reflection, and after more [cd/m2]."""
        if lit.shape != later.shape or lit.ndim != 2:
            raise ValueError(f"luminances {lit.shape} and {later.shape}: expected [G * K, h] twice")
        self.lit, self.later = lit, later
        self.hours = lit.shape[1]
        self._table = column(np.concatenate([lit, later]).ravel())
        self._count = opaque(self.hours, mi.UInt32)

    @staticmethod
    def joined(parts: Sequence[PatchLight]) -> PatchLight:
        """All hours of several, concatenated."""
        return PatchLight(*(np.hstack([getattr(p, name) for p in parts]) for name in PARTS))

    @dr.syntax
    def add(
        self,
        sums: mi.Float64,
        entry: mi.UInt32,
        patch: mi.UInt32,
        value: mi.Float,
        other: mi.UInt32,
        other_value: mi.Float,
    ) -> None:
        """Add value * L[patch, h] of two patches to the sums [h] of a row.

        Args: entry: where the row begins; patch, other: numbers, by that of all patches more after
            the first reflection.
        """
        one, two, hour = value > 0, other_value > 0, mi.UInt32(0)
        while (one | two) & (hour < self._count):
            light = value * dr.gather(mi.Float, self._table, patch * self._count + hour, one)
            light += other_value * dr.gather(mi.Float, self._table, other * self._count + hour, two)
            dr.scatter_add(sums, mi.Float64(light), entry + hour)
            hour += 1
