"""Directions in which a flat receiver takes up light: the cosine times its angular acceptance."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

ENTRIES = 4096  # of the inverse distribution


class AcceptedDirections:
    """Directions over the hemisphere with density a(theta) cos(theta) / total."""

    def __init__(self, acceptance: ArrayLike | None = None) -> None:
        """Prepare the distribution.

        Args:
            acceptance: a(theta) at even steps from 0 to 90 degrees, linear between; 1 by default.
        """
        a = np.ones(2) if acceptance is None else np.asarray(acceptance, dtype=float)
        if a.ndim != 1 or len(a) < 2 or a.min() < 0 or not a.max() > 0:
            raise ValueError("acceptance: expected two or more values, none negative, not all 0")
        # u = sin^2(theta) is even for a cosine: pi times the integral of a over u is the total
        u = np.linspace(0.0, 1.0, ENTRIES + 1)
        middle = np.arcsin(np.sqrt(0.5 * (u[1:] + u[:-1])))
        density = np.interp(middle, np.linspace(0.0, np.pi / 2, len(a)), a)
        cumulative = np.concatenate([[0.0], np.cumsum(density)]) / ENTRIES
        self.total = float(np.pi * cumulative[-1])  # projected solid angle [sr]
        inverse = np.interp(u, cumulative / cumulative[-1], u)
        self._inverse = mi.Float(inverse.astype(np.float32))

    def sample(self, u: mi.Point2f) -> mi.Vector3f:
        """A local direction, z along the receiver's normal."""
        place = u.x * ENTRIES
        index = dr.minimum(mi.UInt32(place), ENTRIES - 1)
        low = dr.gather(mi.Float, self._inverse, index)
        high = dr.gather(mi.Float, self._inverse, index + 1)
        sine2 = dr.clip(low + (high - low) * (place - mi.Float(index)), 0.0, 1.0)
        sine, phi = dr.sqrt(sine2), dr.two_pi * u.y
        return mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), dr.sqrt(1.0 - sine2))
