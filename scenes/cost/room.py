"""The room of the dissertation's Table 1 with its window and its grid of sensors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface

WIDTH, DEPTH, HEIGHT = 3.65, 4.60, 3.00  # [m]
WINDOW = (0.3, 3.35, 0.9, 2.6)  # left, right, sill, head in the wall y = 0 [m]
WALLS, CEILING, FLOOR = 0.50, 0.80, 0.34  # reflectance
WORK_PLANE = 0.85  # [m]
NOTHING = Surfaces.none()


def room() -> Surfaces:
    """Floor, ceiling, three walls and the wall around the window."""
    w, d, h = WIDTH, DEPTH, HEIGHT
    x0, x1, z0, z1 = WINDOW
    faces = [
        (FLOOR, [(0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0)]),
        (CEILING, [(0, 0, h), (0, d, h), (w, d, h), (w, 0, h)]),
        (WALLS, [(0, d, 0), (w, d, 0), (w, d, h), (0, d, h)]),
        (WALLS, [(0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h)]),
        (WALLS, [(w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0)]),
        (WALLS, [(0, 0, 0), (w, 0, 0), (w, 0, z0), (0, 0, z0)]),
        (WALLS, [(0, 0, z1), (w, 0, z1), (w, 0, h), (0, 0, h)]),
        (WALLS, [(0, 0, z0), (x0, 0, z0), (x0, 0, z1), (0, 0, z1)]),
        (WALLS, [(x1, 0, z0), (w, 0, z0), (w, 0, z1), (x1, 0, z1)]),
    ]
    return Surfaces(
        np.concatenate([_quad(corners) for _, corners in faces]),
        np.repeat([reflectance for reflectance, _ in faces], 2),
        np.repeat(np.arange(len(faces)), 2),
    )


def window_groups(count: int = 1) -> list[WindowGroup]:
    """The window, or the same opening cut into `count` strips that are a group each."""
    x0, x1, z0, z1 = WINDOW
    edges = np.linspace(x0, x1, count + 1)
    groups = []
    for i, (a, b) in enumerate(pairwise(edges)):
        glass = _quad([(a, 0, z0), (b, 0, z0), (b, 0, z1), (a, 0, z1)])
        groups.append(WindowGroup(f"window{i}", (WindowSurface(f"window{i}", glass),)))
    return groups


def sensors(spacing: float = 0.5) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and normals [S, 3] of the work plane's grid, its first half a spacing from the walls.

    At 0.5 m: 7 x 9 sensors.
    """
    x = np.arange(spacing / 2, WIDTH, spacing)
    y = np.arange(spacing / 2, DEPTH, spacing)
    points = np.array([(a, b, WORK_PLANE) for b in y for a in x])
    return points, np.tile([0.0, 0.0, 1.0], (len(points), 1))


def _quad(corners: list[tuple[float, float, float]]) -> NDArray[np.float64]:
    a, b, c, d = corners
    return np.array([[a, b, c], [a, c, d]], dtype=float)
