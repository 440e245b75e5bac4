"""Pixels of a view that the edge of a shadow crosses, and the places in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View
from mitsuba_cfs.trace.kernels.sampling import spread_rays

EDGE_PLACES = 32  # in a pixel at an edge: of a strip of sun across it 8 may show a quarter for 2 %


def edge_pixels(
    lit: NDArray[np.bool_], pixels: NDArray[np.int64], view: View
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Hours [k] and numbers [k] of the pixels that are lit [h, m] unlike one of their neighbours.

    Args: pixels: [m] row * width + column; others count as their neighbours do.
    """
    row, column = np.divmod(pixels, view.width)
    across = view.width + 2  # of a table with a border, so that every pixel has four neighbours
    number_at = np.full((view.height + 2) * across, -1)
    at = (row + 1) * across + column + 1
    number_at[at] = np.arange(len(pixels))
    found, crossed = [], np.zeros(len(pixels), dtype=bool)
    for shown in lit:
        number = np.flatnonzero(shown)  # of two that are unlike, one is lit: few are
        for step in (1, -1, across, -across):
            other = number_at[at[number] + step]
            unlike = (other >= 0) & ~shown[other]
            crossed[number[unlike]] = crossed[other[unlike]] = True
        found.append(np.flatnonzero(crossed))
        crossed[found[-1]] = False
    hour = np.repeat(np.arange(len(lit)), [len(numbers) for numbers in found])
    return hour, np.concatenate([np.empty(0, dtype=np.int64), *found])


def places_in_pixels(view: View, pixels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Directions [k * EDGE_PLACES, 3] of places spread over each of some pixels [k]."""
    return spread_rays(view, pixels, EDGE_PLACES)[0]
