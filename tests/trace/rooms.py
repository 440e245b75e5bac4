"""Small rooms and outdoor scenes for the tests of the tracer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface


def quad(a, b, c, d) -> NDArray[np.float64]:
    """Two triangles [2, 3, 3] of a quadrilateral, counter-clockwise."""
    return np.array([[a, b, c], [a, c, d]], dtype=float)


def surfaces(quads: list[tuple[NDArray[np.float64], float]]) -> Surfaces:
    """Surfaces of (triangles, reflectance), one surface each."""
    counts = [len(t) for t, _ in quads]
    if not quads:
        return Surfaces.none()
    return Surfaces(
        np.concatenate([t for t, _ in quads]),
        np.repeat([r for _, r in quads], counts),
        np.repeat(np.arange(len(quads)), counts),
    )


NOTHING = surfaces([])
WIDTH, DEPTH, HEIGHT = 3.65, 4.60, 3.00  # the dissertation's room (its Table 1)
X0, X1, Z0, Z1 = 0.3, 3.35, 0.9, 2.6  # its window, in the wall y = 0


def test_room(scale: float = 1.0) -> tuple[Surfaces, list[WindowGroup]]:
    """The room of the dissertation's Table 1, window to the south, reflectances times `scale`."""
    w, d, h = WIDTH, DEPTH, HEIGHT
    front = [
        ((0, 0, 0), (w, 0, 0), (w, 0, Z0), (0, 0, Z0)),
        ((0, 0, Z1), (w, 0, Z1), (w, 0, h), (0, 0, h)),
        ((0, 0, Z0), (X0, 0, Z0), (X0, 0, Z1), (0, 0, Z1)),
        ((X1, 0, Z0), (w, 0, Z0), (w, 0, Z1), (X1, 0, Z1)),
    ]
    room = surfaces(
        [
            (quad((0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0)), 0.34 * scale),
            (quad((0, 0, h), (0, d, h), (w, d, h), (w, 0, h)), 0.80 * scale),
            (quad((0, d, 0), (w, d, 0), (w, d, h), (0, d, h)), 0.50 * scale),
            (quad((0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h)), 0.50 * scale),
            (quad((w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0)), 0.50 * scale),
            *((quad(*corners), 0.50 * scale) for corners in front),
        ]
    )
    glass = quad((X0, 0, Z0), (X1, 0, Z0), (X1, 0, Z1), (X0, 0, Z1))
    return room, [WindowGroup("south", (WindowSurface("window", glass),))]


def obstruction() -> Surfaces:
    """A wall to the south-east and an overhang above the window of the test room."""
    return surfaces(
        [
            (quad((2, -6, 0), (10, -6, 0), (10, -6, 6), (2, -6, 6)), 0.4),
            (quad((0, -1, 2.8), (0, 0, 2.8), (WIDTH, 0, 2.8), (WIDTH, -1, 2.8)), 0.6),
        ]
    )


def l_shaped_room() -> tuple[Surfaces, list[WindowGroup], Surfaces]:
    """An L-shaped room with windows to the south and the west, and a wall that shades the west."""
    corners = [(0, 0), (4, 0), (4, 3), (7, 3), (7, 6), (0, 6)]
    h = 2.8
    parts = []
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        origin = np.array([*start, 0.0])
        along = np.array([*end, 0.0]) - origin
        length = np.linalg.norm(along)
        strips = [(0, length, 0, h)]
        if start in ((0, 0), (0, 6)):  # the south wall and the west wall hold a window
            s0, s1, z0, z1 = 1.0, length - 1.0, 0.8, 2.4
            strips = [(0, length, 0, z0), (0, length, z1, h), (0, s0, z0, z1), (s1, length, z0, z1)]
        for a, b, c, d in strips:
            places = [(a, c), (b, c), (b, d), (a, d)]
            parts.append((quad(*(origin + along * (s / length) + [0, 0, z] for s, z in places)), 0.5))
    for z, r in ((0.0, 0.2), (h, 0.7)):
        parts.append((quad((0, 0, z), (4, 0, z), (4, 6, z), (0, 6, z)), r))
        parts.append((quad((4, 3, z), (7, 3, z), (7, 6, z), (4, 6, z)), r))
    south = quad((1, 0, 0.8), (3, 0, 0.8), (3, 0, 2.4), (1, 0, 2.4))
    west = quad((0, 5, 0.8), (0, 1, 0.8), (0, 1, 2.4), (0, 5, 2.4))
    groups = [
        WindowGroup("south", (WindowSurface("south", south),)),
        WindowGroup("west", (WindowSurface("west", west),)),
    ]
    shade = surfaces([(quad((-3, -1, 0), (-3, 7, 0), (-3, 7, 4), (-3, -1, 4)), 0.35)])
    return surfaces(parts), groups, shade


def skylight_room() -> tuple[Surfaces, list[WindowGroup]]:
    """A 4 x 4 m room under a roof that slopes up to the north, its middle a skylight."""
    low, high = 2.2, 4.2  # height of the roof at y = 0 and y = 4

    def roof(x: float, y: float) -> tuple[float, float, float]:
        return (x, y, low + (high - low) * y / 4)

    def patch(x0, y0, x1, y1):
        return quad(roof(x0, y0), roof(x1, y0), roof(x1, y1), roof(x0, y1))

    strips = [(0, 0, 4, 1), (0, 3, 4, 4), (0, 1, 1, 3), (3, 1, 4, 3)]
    walls = [
        np.array([[(0, 0, 0), (0, 4, 0), (0, 4, high)], [(0, 0, 0), (0, 4, high), (0, 0, low)]]),
        np.array([[(4, 0, 0), (4, 0, low), (4, 4, high)], [(4, 0, 0), (4, 4, high), (4, 4, 0)]]),
        quad((0, 0, 0), (0, 0, low), (4, 0, low), (4, 0, 0)),
        quad((0, 4, 0), (4, 4, 0), (4, 4, high), (0, 4, high)),
        quad((0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)),
    ]
    opaque = [(np.asarray(w, dtype=float), 0.5) for w in walls]
    opaque += [(patch(*strip), 0.7) for strip in strips]
    return surfaces(opaque), [WindowGroup("roof", (WindowSurface("skylight", patch(1, 1, 3, 3)),))]


test_room.__test__ = False
