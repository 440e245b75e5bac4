"""Klems patches on Mitsuba's types: which patch holds a direction, and points of a patch."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.bsdf.klems import KlemsBasis


def table(values: ArrayLike):
    """A table of floats for `gather`, in the active variant."""
    values = np.ascontiguousarray(np.ravel(values), dtype=np.float32)
    return values if mi.variant().startswith("scalar") else mi.Float(values)


def gather(values, index, active=True):
    """Entry of a `table`; zero where not active."""
    if isinstance(values, np.ndarray):
        return float(values[index]) if active else 0.0
    return dr.gather(mi.Float, values, index, active)


def cell(place, last: int):
    """The whole number at or below a place in a table, 0 to `last`.

    Also where the place is no number, as of a ray that met nothing: clipped before it is a whole
    number it stays NaN, and the gather would read outside the table: a signal on AVX2.
    """
    return mi.UInt32(dr.clip(mi.Int32(place), 0, last))


class TracedBasis:
    """A Klems basis whose methods take and give Mitsuba's types."""

    def __init__(self, basis: KlemsBasis) -> None:
        self.cosines = [float(np.cos(bound)) for bound in basis.theta_bounds[1:-1]]
        self.counts = table(basis.phi_counts)
        self.starts = table(basis.ring_starts)
        self.rings = table(basis.rings)
        self.sine2 = table(np.sin(basis.theta_bounds) ** 2)

    def patch(self, x, y, z):
        """Patch of a direction whose azimuth is that of (x, y) and whose |z| is cos(theta)."""
        cosine = dr.abs(z)
        ring = mi.UInt32(0)
        for bound in self.cosines:
            ring += dr.select(cosine <= bound, mi.UInt32(1), mi.UInt32(0))
        count = gather(self.counts, ring)
        turns = dr.atan2(y, x) * dr.inv_two_pi
        within = dr.floor((turns - dr.floor(turns)) * count + 0.5)
        within = dr.select(within < count, within, 0.0)  # 0 where it is no number too
        return mi.UInt32(gather(self.starts, ring) + within)

    def direction(self, patch, u, v):
        """(x, y, |z|) of the point (u, v) of a patch, uniform in cos(theta) d_omega."""
        ring = mi.UInt32(gather(self.rings, patch))
        low = gather(self.sine2, ring)
        sine2 = dr.fma(u, gather(self.sine2, ring + 1) - low, low)
        within = mi.Float(patch) - gather(self.starts, ring)
        s, c = dr.sincos((within + v - 0.5) * (2 * dr.pi / gather(self.counts, ring)))
        sine = dr.safe_sqrt(sine2)
        return sine * c, sine * s, dr.safe_sqrt(1.0 - sine2)
