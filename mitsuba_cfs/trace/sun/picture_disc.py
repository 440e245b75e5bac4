"""The sun's disc cut into small pieces: in a view's pixels, and for what of it is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View, pixel_rays
from mitsuba_cfs.sky.sun import SUN_RADIUS

SUBPIXEL = np.radians(0.025)  # places on the sun's disc lie so close: the disc holds 360
RAYS = 1 << 20  # tried at a time
PARTS = 512  # of the disc, for what of it is seen: an edge across it is found to 1 %
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # [rad]


def disc_parts(sun: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions [PARTS, 3] of equal parts of the disc round a unit vector [3], a sunflower's."""
    number = np.arange(PARTS) + 0.5
    cosine = 1 - number / PARTS * (1 - np.cos(SUN_RADIUS))
    sine, turn = np.sqrt(1 - cosine**2), number * GOLDEN_ANGLE
    side = np.cross(sun, [1.0, 0, 0] if abs(sun[0]) < 0.7 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    other = np.cross(sun, side)
    across = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    return cosine[:, None] * sun + sine[:, None] * across


def disc_in_view(
    directions: NDArray[np.float64], sun: NDArray[np.float64], pixel_size: float
) -> bool:
    """Whether a sun [3] stands in one of the pixels that look to directions [n, 3]."""
    return bool(np.max(directions @ sun, initial=-1.0) > np.cos(pixel_size))


def before_eye(view: View, directions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether directions [.., 3] lie before the eye: at its side the disc is cut in two."""
    return directions @ np.asarray(view.direction, dtype=float) > 0


def disc_reach(pixel_size: float) -> float:
    """Angle [rad] from the sun's middle within which a pixel's middle lies that shows the disc."""
    return float(SUN_RADIUS + pixel_size)


def disc_rays(
    view: View,
    pixels: NDArray[np.int64],
    suns: NDArray[np.float64],
    pixel_size: float,
    *,
    step: float = SUBPIXEL,
) -> tuple[NDArray[np.int64], NDArray[np.float64], float]:
    """Rays of pixels [n] that meet the disc of a sun [n, 3] each, and the share of one of them.

    Args:
        pixel_size: the largest angle [rad] across a pixel of the view.
        step: between rays [rad]; pieces are counted whole, by which the disc of 360 pieces can be
            off by 2 %, one of 9,000 by 0.2 %.

    Returns: number [m] of the pixel that a ray belongs to; its direction [m, 3]; its share.
    """
    count = int(np.clip(np.ceil(pixel_size / step), 4, 64 * SUBPIXEL / step))
    inner = (np.arange(count) + 0.5) / count
    dx, dy = (a.ravel()[None] for a in np.meshgrid(inner, inner))
    owners, ways = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    block = max(1, RAYS // count**2)  # a year of large pixels would fill the memory
    for start in range(0, len(pixels), block):
        number = pixels[start : start + block, None]
        directions, exists = pixel_rays(view, number, dx, dy)
        cosine = np.einsum("ijk,ik->ij", directions, suns[start : start + block])
        pixel, place = np.nonzero(exists & (cosine >= np.cos(SUN_RADIUS)))
        owners.append(pixel + start)
        ways.append(directions[pixel, place])
    return np.concatenate(owners), np.concatenate(ways), 1 / count**2
