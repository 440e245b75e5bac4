"""Cells of Shirley and Chiu's square on Mitsuba's types, with the methods of `TracedBasis`."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from mitsuba_cfs.bsdf.traced_klems import cell
from mitsuba_cfs.bsdf.traced_tree import disk_to_square, square_to_disk


class TracedSquares:
    """The square in 2^levels x 2^levels cells, numbered row by row."""

    def __init__(self, levels: int) -> None:
        self.width = 1 << levels

    def patch(self, x, y, z):
        """Cell of the direction with cosines (x, y); z does not matter."""
        u, v = (cell(p * self.width, self.width - 1) for p in disk_to_square(x, y))
        return u * self.width + v

    def direction(self, patch, u, v):
        """(x, y, |z|) of the point (u, v) of a cell."""
        row = patch // self.width
        column = patch - row * self.width
        x, y = square_to_disk((mi.Float(row) + u) / self.width, (mi.Float(column) + v) / self.width)
        return x, y, dr.safe_sqrt(1.0 - x * x - y * y)


class TracedRings:
    """Incident cells of rank 3: (1 - sin(theta)) / 2 below 0.5, in 2^(levels - 1) steps."""

    def __init__(self, levels: int) -> None:
        self.width = 1 << (levels - 1)

    def direction(self, patch, u, v):
        """(x, y, |z|) of the point `u` of a step, at azimuth 2 pi `v`; even in u."""
        sine = 1.0 - (mi.Float(patch) + u) / self.width
        s, c = dr.sincos(2 * dr.pi * v)
        return sine * c, sine * s, dr.safe_sqrt(1.0 - sine * sine)
