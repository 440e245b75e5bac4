"""Where light that enters a box room through a window in its facade lands first.

Facade coordinates: x to the right seen from outside, y up, z outward.  The room lies at z < 0.
Surfaces in order: facade, left, right, back, floor, ceiling (left: x = 0 seen from outside).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BoxRoom:
    """Inside dimensions [m] of a room and of the window in its facade."""

    width: float
    depth: float
    height: float
    window_x: tuple[float, float]
    window_y: tuple[float, float]

    @property
    def window_area(self) -> float:
        """Area of the window [m2]."""
        return float(np.ptp(self.window_x) * np.ptp(self.window_y))

    @property
    def areas(self) -> FloatArray:
        """Areas of the surfaces [6] [m2], the facade without its window."""
        side, slab = self.depth * self.height, self.width * self.depth
        back = self.width * self.height
        return np.array([back - self.window_area, side, side, back, slab, slab])


def first_hits(room: BoxRoom, directions: FloatArray, *, grid: tuple[int, int] = (24, 12)):
    """Shares [T, 6] of the light going along `directions` [T, 3] (into the room) per surface."""
    nx, ny = grid
    x = np.interp((np.arange(nx) + 0.5) / nx, [0, 1], room.window_x)
    y = np.interp((np.arange(ny) + 0.5) / ny, [0, 1], room.window_y)
    share = np.zeros((len(directions), 6))
    for start in range(0, len(directions), 20_000):
        d = directions[start : start + 20_000]
        share[start : start + len(d)] = _shares(room, d, x, y)
    return share


def _shares(room: BoxRoom, d: FloatArray, px: FloatArray, py: FloatArray) -> FloatArray:
    """Shares [T, 6] from the grid of all x with all y; of planes at one distance the lower goes."""
    with np.errstate(divide="ignore", invalid="ignore"):
        to_x = _reach(d[:, :1], px, room.width)[:, :, None]
        to_y = _reach(d[:, 1:2], py, room.height)[:, None, :]
        to_z = np.where(d[:, 2] < 0, -room.depth / d[:, 2], np.inf)[:, None, None]
    side = (to_x <= to_z) & (to_x <= to_y) & np.isfinite(to_x)
    back = (to_z < to_x) & (to_z <= to_y)
    slab = (to_y < to_x) & (to_y < to_z)
    share = np.zeros((len(d), 6))
    for hit, component, ends in ((side, 0, (1, 2)), (back, 2, (3, 3)), (slab, 1, (4, 5))):
        place = np.where(d[:, component] < 0, *ends)
        share[np.arange(len(d)), place] = hit.mean(axis=(1, 2))
    share[:, 0] = 1.0 - (side | back | slab).mean(axis=(1, 2))
    return share


def _reach(component: FloatArray, start: FloatArray, width: float) -> FloatArray:
    """How far [T, n] it is along directions with a component [T, 1] to the wall at 0 or `width`."""
    reach = np.where(component < 0, -start, width - start) / component
    return np.where(component == 0, np.inf, reach)


def diffuse_hits(room: BoxRoom, *, rings: int = 30, sectors: int = 60) -> FloatArray:
    """Shares [6] of Lambertian light from the window: its view factors to the surfaces."""
    sine2 = (np.arange(rings) + 0.5) / rings
    phi = 2 * np.pi * (np.arange(sectors) + 0.5) / sectors
    s, p = (a.ravel() for a in np.meshgrid(np.sqrt(sine2), phi))
    directions = np.stack([s * np.cos(p), s * np.sin(p), -np.sqrt(1 - s**2)], axis=1)
    return first_hits(room, directions).mean(axis=0)


class BeamTable:
    """First hits of the sun's beam, tabled over the sphere's half in front of the facade."""

    def __init__(self, room: BoxRoom, *, cells: int = 40) -> None:
        self._cells = cells
        axis = np.linspace(-1.0, 1.0, 2 * cells + 1)
        u, v = (a.ravel() for a in np.meshgrid(axis, axis, indexing="ij"))
        inside = np.minimum(1.0, 0.9999 / np.maximum(np.hypot(u, v), 1e-9))
        u, v = u * inside, v * inside
        towards = np.stack([u, v, np.sqrt(1.0 - u**2 - v**2)], axis=1)
        self._table = first_hits(room, -towards).reshape(2 * cells + 1, 2 * cells + 1, 6)

    def __call__(self, local: FloatArray) -> FloatArray:
        """Shares [T, 6] for directions [T, 3] to the sun in the window frame, z positive."""
        cells = self._cells
        at = np.clip((local[:, :2] + 1.0) * cells, 0, 2 * cells - 1e-9)
        i = at.astype(int)
        f = at - i
        t = self._table
        a = t[i[:, 0], i[:, 1]] * (1 - f[:, :1]) + t[i[:, 0] + 1, i[:, 1]] * f[:, :1]
        b = t[i[:, 0], i[:, 1] + 1] * (1 - f[:, :1]) + t[i[:, 0] + 1, i[:, 1] + 1] * f[:, :1]
        return a * (1 - f[:, 1:]) + b * f[:, 1:]
