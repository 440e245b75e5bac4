"""Things outdoors at known places, for rooms of `bim.shoebox`."""

from __future__ import annotations

import numpy as np

from bim.model import Element


def wall(*corners: tuple[float, float, float], guid: str = "wall", kind: str = "IfcWall"):
    """A plane element through four corners in order."""
    a, b, c, d = np.array(corners, dtype=float)
    return Element(guid, guid, kind, np.array([[a, b, c], [a, c, d]]), 0.3, 0.3)


def facing_wall(distance: float, height: float, *, half_width: float = 500.0) -> Element:
    """A wall parallel to a facade at y = 0 that looks south, so far before it."""
    x, y = half_width, -distance
    return wall((-x, y, -50), (x, y, -50), (x, y, height), (-x, y, height))
