"""Geometry of a view for glare evaluation, computed once for all pictures of the view."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.position_index import position_index, view_angles
from mitsuba_cfs.images.view import View, pixel_directions, pixel_solid_angles


def in_scan_order(picture: NDArray[Any]) -> NDArray[Any]:
    """A picture's array [ny, nx, ...], row 0 at the top, as [nx, ny, ...] with y = 0 the bottom."""
    return np.ascontiguousarray(np.swapaxes(picture[::-1], 0, 1))


def in_picture_order(scan: NDArray[Any]) -> NDArray[Any]:
    """The inverse of `in_scan_order`."""
    return np.swapaxes(scan, 0, 1)[::-1]


class GlareView:
    """Directions, solid angles and position indices of a view's pixels, in scan order [nx, ny].

    Attributes:
        view: the view.
        directions: [nx, ny, 3] unit.
        solid_angle: [nx, ny] [sr].
        cosine: [nx, ny] of the angle to the line of sight.
        valid: [nx, ny] pixels that count: with a solid angle and, in an angular fisheye, before
            the eye.
    """

    def __init__(self, view: View) -> None:
        if view.kind == "parallel":
            raise ValueError("a parallel view has no solid angles: glare needs a fisheye")
        directions, counts = pixel_directions(view)
        self.view = view
        self.directions = in_scan_order(directions)
        self.solid_angle = in_scan_order(pixel_solid_angles(view))
        self.cosine = self.directions @ np.asarray(view.direction)
        self.valid = in_scan_order(counts) & (self.solid_angle > 0)

    @cached_property
    def weight(self) -> NDArray[np.float64]:
        """Solid angle [nx, ny] [sr], 0 where the pixel does not count."""
        return np.where(self.valid, self.solid_angle, 0.0)

    @cached_property
    def projected(self) -> NDArray[np.float64]:
        """Projected solid angle [nx, ny] [sr]: E_v is its sum with the luminance."""
        return self.weight * self.cosine

    @cached_property
    def total_solid_angle(self) -> float:
        """Solid angle [sr] of the pixels that count."""
        return float(self.weight.sum())

    @cached_property
    def guth(self) -> NDArray[np.float64]:
        """Position index [nx, ny] (Guth, Iwata)."""
        return position_index(self.directions, self.view)

    @property
    def forward(self) -> NDArray[np.float64]:
        """Unit vector [3] of the line of sight."""
        return np.asarray(self.view.direction, dtype=float)

    def pixel_at(self, direction: NDArray[np.float64]) -> tuple[int, int]:
        """The pixel in scan order, among those that count, nearest to a direction [3]."""
        nearest = np.argmax(np.where(self.valid, self.directions @ direction, -1.0))
        x, y = np.unravel_index(nearest, self.valid.shape)
        return int(x), int(y)

    def angle_between(self, x: int, y: int, other_x: int, other_y: int) -> float:
        """Angle [rad] between two pixels in scan order."""
        dot = self.directions[x, y] @ self.directions[other_x, other_y]
        return float(np.arccos(np.clip(dot, -1.0, 1.0)))

    def pixels_in(self, radius: float) -> float:
        """Search radius `radius` [rad] in pixels, as evalglare estimates it at the centre."""
        x, y = self.view.width // 2, self.view.height // 2
        other_x, other_y = min(x + 10, self.view.width - 1), min(y + 10, self.view.height - 1)
        distance = self.angle_between(x, y, other_x, other_y)
        return radius / (2 * distance / 10) if distance > 0 else 0.0

    def reach(self, radius: float) -> int:
        """Pixels in either direction beyond which nothing is within `radius` [rad] of a pixel.

        An angular fisheye stretches by theta/sin theta across the radius, a hemispherical one not
        at all; other projections are not bounded here.
        """
        view = self.view
        longest = max(view.width, view.height)
        if view.kind == "hemispherical":
            per_radian = max(
                view.width / (2 * np.sin(np.radians(view.horizontal_deg) / 2)),
                view.height / (2 * np.sin(np.radians(view.vertical_deg) / 2)),
            )
            stretch = 1.0
        elif view.kind == "angular" and radius < 1.0:
            widest = np.pi / 2 + radius
            per_radian = max(view.width / np.radians(view.horizontal_deg), view.height / np.radians(view.vertical_deg))
            stretch = widest / np.sin(widest)
        else:
            return longest
        return min(int(np.ceil(radius * stretch * per_radian)) + 2, longest)


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
