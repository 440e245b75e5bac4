"""Shade of overhangs and fins on a facade: the lit share of a rectangle, beam and diffuse.

Facade coordinates as in `sunlit_room`: x to the right seen from outside, y up, z outward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Overhang:
    """A horizontal plate that stands out from the facade."""

    y: float
    x: tuple[float, float]
    depth: float


@dataclass(frozen=True, slots=True)
class Fin:
    """A vertical plate that stands out from the facade."""

    x: float
    y: tuple[float, float]
    depth: float


Device = Overhang | Fin


def lit_share(
    rectangle: tuple[tuple[float, float], tuple[float, float]],
    devices: tuple[Device, ...],
    directions: FloatArray,
    *,
    grid: tuple[int, int] = (24, 24),
) -> FloatArray:
    """Share [T] of a rectangle (x range, y range) that sees along each direction [T, 3]."""
    if not devices:
        return np.ones(len(directions))
    (x0, x1), (y0, y1) = rectangle
    nx, ny = grid
    px, py = (
        a.ravel()
        for a in np.meshgrid(x0 + (np.arange(nx) + 0.5) / nx * (x1 - x0), y0 + (np.arange(ny) + 0.5) / ny * (y1 - y0))
    )
    share = np.empty(len(directions))
    for start in range(0, len(directions), 5000):
        d = directions[start : start + 5000]
        blocked = np.zeros((len(d), len(px)), dtype=bool)
        for device in devices:
            blocked |= _blocked(device, d, px, py)
        share[start : start + len(d)] = 1.0 - blocked.mean(axis=1)
    return share


def _blocked(device: Device, d: FloatArray, px: FloatArray, py: FloatArray) -> NDArray[np.bool_]:
    across = 1 if isinstance(device, Overhang) else 0
    plane = device.y if isinstance(device, Overhang) else device.x
    low, high = device.x if isinstance(device, Overhang) else device.y
    here, along = (py, px) if isinstance(device, Overhang) else (px, py)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (plane - here)[None, :] / d[:, across, None]
        out = t * d[:, 2, None]
        other = along[None, :] + t * d[:, 1 - across, None]
        return (t > 0) & (out > 0) & (out <= device.depth) & (other >= low) & (other <= high)


def diffuse_lit_share(
    rectangle: tuple[tuple[float, float], tuple[float, float]],
    devices: tuple[Device, ...],
    *,
    rings: int = 40,
    sectors: int = 80,
) -> tuple[float, float]:
    """Shares of the uniform light from above and from below the horizon that arrive."""
    sine2 = (np.arange(rings) + 0.5) / rings
    phi = 2 * np.pi * (np.arange(sectors) + 0.5) / sectors
    s, p = (a.ravel() for a in np.meshgrid(np.sqrt(sine2), phi))
    directions = np.stack([s * np.cos(p), s * np.sin(p), np.sqrt(1 - s**2)], axis=1)
    share = lit_share(rectangle, devices, directions, grid=(10, 10))
    above = directions[:, 1] > 0
    return float(share[above].mean()), float(share[~above].mean())
