"""The sun in the pixels of a view: samples of its disc, and pixels that a shadow's edge crosses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View, pixel_rays
from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.kernels.sampling import spread_rays

SUBPIXEL = np.radians(0.025)  # between rays to the sun's disc, which so gets 360
RAYS = 1 << 20  # tried at a time
PARTS = 512  # of the disc, for its visible share: an edge across it is found to 1 %
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # [rad]
EDGE_SAMPLES = 32  # rays of a pixel at an edge: 8 may show a quarter for a strip of sun of 2 %


def disc_parts(sun: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions [PARTS, 3] of equal parts of the disc about a unit vector [3] (Vogel's spiral)."""
    number = np.arange(PARTS) + 0.5
    cosine = 1 - number / PARTS * (1 - np.cos(SUN_RADIUS))
    sine, turn = np.sqrt(1 - cosine**2), number * GOLDEN_ANGLE
    side = np.cross(sun, [1.0, 0, 0] if abs(sun[0]) < 0.7 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    other = np.cross(sun, side)
    across = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
    return cosine[:, None] * sun + sine[:, None] * across


def disc_in_view(directions: NDArray[np.float64], sun: NDArray[np.float64], pixel_size: float) -> bool:
    """Whether a sun [3] is in one of the pixels with directions [n, 3]."""
    return bool(np.max(directions @ sun, initial=-1.0) > np.cos(pixel_size))


def before_eye(view: View, directions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether directions [.., 3] are in front of the eye."""
    return directions @ np.asarray(view.direction, dtype=float) > 0


def disc_reach(pixel_size: float) -> float:
    """Largest angle [rad] between the sun's centre and that of a pixel that shows the disc."""
    return float(SUN_RADIUS + pixel_size)


def disc_rays(
    view: View, pixels: NDArray[np.int64], suns: NDArray[np.float64], pixel_size: float, *, step: float = SUBPIXEL
) -> tuple[NDArray[np.int64], NDArray[np.float64], float]:
    """Rays of pixels [n] that meet the disc of one sun [n, 3] each, and the share of one ray.

    Args:
        pixel_size: the largest angle [rad] across a pixel of the view.
        step: between rays [rad]; rays are counted whole, so that a disc of 360 rays can be off by
            2 %, one of 9,000 by 0.2 %.

    Returns: number [m] of each ray's pixel; its direction [m, 3]; the share of one ray.
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


def edge_pixels(
    lit: NDArray[np.bool_], pixels: NDArray[np.int64], view: View
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Hours [k] and numbers [k] of pixels that differ from a neighbour in being lit [h, m] or not.

    Args: pixels: [m] row * width + column; pixels not among them do not count.
    """
    row, column = np.divmod(pixels, view.width)
    across = view.width + 2  # of a table with a border, so that every pixel has four neighbours
    number_at = np.full((view.height + 2) * across, -1)
    at = (row + 1) * across + column + 1
    number_at[at] = np.arange(len(pixels))
    edges, crossed = [], np.zeros(len(pixels), dtype=bool)
    for shown in lit:
        number = np.flatnonzero(shown)  # of two that are unlike, one is lit: few are
        for step in (1, -1, across, -across):
            other = number_at[at[number] + step]
            unlike = (other >= 0) & ~shown[other]
            crossed[number[unlike]] = crossed[other[unlike]] = True
        edges.append(np.flatnonzero(crossed))
        crossed[edges[-1]] = False
    hour = np.repeat(np.arange(len(lit)), [len(numbers) for numbers in edges])
    return hour, np.concatenate([np.empty(0, dtype=np.int64), *edges])


def pixel_samples(view: View, pixels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Directions [k * EDGE_SAMPLES, 3] evenly spread over each of some pixels [k]."""
    return spread_rays(view, pixels, EDGE_SAMPLES)[0]
