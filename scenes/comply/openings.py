"""The openings of a room as EN 17037 measures them: width, sill, head, inner plane of the wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space, Window

FloatArray = NDArray[np.float64]

DEEPEST = 1.5  # of a recess [m]
BESIDE = 0.25  # a reveal lies no further from the glass than a frame is wide [m]
UPRIGHT = 0.98  # of the normal's z, above which an opening is horizontal


@dataclass(frozen=True, slots=True)
class Opening:
    """A window's glass as a rectangle in its plane, and how far the inner wall lies before it."""

    window: Window
    centre: FloatArray  # [3] middle of the rectangle [m]
    along: FloatArray  # [3] unit vector, horizontal, to the right seen from the room
    up: FloatArray  # [3] unit vector in the plane, upwards
    width: float  # [m]
    height: float  # along `up` [m]
    recess: float  # from the inner surface of the wall to the glass [m]

    @property
    def normal(self) -> FloatArray:
        """Unit normal [3], outdoors."""
        return self.window.normal

    @property
    def is_horizontal(self) -> bool:
        """Whether it has no sill and no head: a rooflight."""
        return bool(abs(self.normal[2]) > UPRIGHT)

    @property
    def sill(self) -> float:
        """Height of the lower edge of the glass in the world [m]."""
        return float(self.centre[2] - 0.5 * self.height * self.up[2])

    @property
    def head(self) -> float:
        """Height of the upper edge of the glass in the world [m]."""
        return float(self.centre[2] + 0.5 * self.height * self.up[2])

    def at(self, x: FloatArray, z: FloatArray) -> FloatArray:
        """Points [N, 3] in the glass, so far along from its middle, at a height of the world."""
        upwards = (np.asarray(z, dtype=float) - self.centre[2]) / self.up[2]
        return self.centre + np.multiply.outer(x, self.along) + np.multiply.outer(upwards, self.up)


def openings_of(space: Space) -> list[Opening]:
    """The openings of a room, in the order of its windows."""
    reveals = [face.triangles.reshape(-1, 3) for face in space.faces if face.kind == "reveal"]
    corners = np.concatenate(reveals) if reveals else np.empty((0, 3))
    return [_opening(window, corners) for window in space.windows]


def _opening(window: Window, reveals: FloatArray) -> Opening:
    normal = window.normal
    along = np.cross(normal, [0.0, 0.0, 1.0])
    length = np.linalg.norm(along)
    along = np.array([1.0, 0.0, 0.0]) if length < 1e-6 else along / length
    up = np.cross(along, normal)
    if up[2] < 0:
        along, up = -along, -up
    points = window.triangles.reshape(-1, 3)
    x, y = points @ along, points @ up
    width, height = float(np.ptp(x)), float(np.ptp(y))
    depth = float((points @ normal).mean())
    middle = [(v.min() + v.max()) / 2 for v in (x, y)]
    centre = middle[0] * along + middle[1] * up + depth * normal
    recess = _recess(reveals @ along - middle[0], reveals @ up - middle[1], depth - reveals @ normal, width, height)
    return Opening(window, centre, along, up, width, height, recess)


def _recess(x: FloatArray, y: FloatArray, depth: FloatArray, width: float, height: float) -> float:
    """How deep the reveals round a glass reach into the room [m]; 0 without any."""
    near = (np.abs(x) < width / 2 + BESIDE) & (np.abs(y) < height / 2 + BESIDE)
    depth = depth[near & (depth > 0) & (depth < DEEPEST)]
    return float(depth.max()) if len(depth) else 0.0
