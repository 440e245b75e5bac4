"""Guth's field of view of both eyes together, and of each eye.

Borders are polar curves: the largest angle sigma from the line of sight at the angle tau from the
vertical.

Source: Guth (1958), in the polynomials that evalglare cuts pictures with (-g, -G).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.position_index import view_angles

DEGREES = 180 / 3.1415927  # evalglare's: decides about pixels on a border of 60 degrees


def seen(geometry: GlareView, part: str) -> NDArray[np.bool_]:
    """Pixels [nx, ny] within the "total" field of view, or that of "both eyes"."""
    sigma, tau, below = view_angles(geometry.directions, geometry.view)
    s, t = sigma * DEGREES, tau * DEGREES
    if part == "total":
        upper = (7.7458218 + 0.00057407915 * t - 0.00021746318 * t**2 + 8.5572726e-6 * t**3) ** 2
        u = 180 - t
        lower = -1 / (-0.014699242 - 1.5541106e-5 * u + 4.6898068e-6 * u**2 - 5.1539687e-8 * u**3)
        inside = np.where(below, (s <= lower) | (t <= 135), s <= upper)
    elif part == "both eyes":
        u = 180 - t
        lower = (68.227109 - 2.9524084 * u + 0.046674262 * u**2) / (
            1 - 0.042317294 * u + 0.00075698419 * u**2 - 6.5364285e-7 * u**3
        )
        inside = s <= np.where(below, np.where(u > 73, 60.0, lower), 60.0)
    else:
        raise ValueError(f"field of view {part!r}: expected 'total' or 'both eyes'")
    return inside & geometry.valid
