"""Pixels of a view that the edge of a shadow crosses, and the places in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View
from mitsuba_cfs.trace.sampling import spread_rays

EDGE_PLACES = 8  # in a pixel at an edge: what is lit of it is known to a tenth


def edge_pixels(
    lit: NDArray[np.bool_], pixels: NDArray[np.int64], view: View
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Hours [k] and numbers [k] of the pixels that are lit [h, m] unlike one of their neighbours.

    Args: pixels: [m] row * width + column; others count as their neighbours do.
    """
    row, column = np.divmod(pixels, view.width)
    place = np.full((view.height + 2, view.width + 2), -1)
    place[row + 1, column + 1] = np.arange(len(pixels))
    crossed = np.zeros_like(lit)
    for down, across in ((0, 1), (1, 0)):
        other = place[row + 1 + down, column + 1 + across]
        first = np.flatnonzero(other >= 0)
        second = other[first]
        unlike = lit[:, first] != lit[:, second]
        crossed[:, first] |= unlike
        crossed[:, second] |= unlike
    hour, number = np.nonzero(crossed)
    return hour, number


def places_in_pixels(view: View, pixels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Directions [k * EDGE_PLACES, 3] of places spread over each of some pixels [k]."""
    return spread_rays(view, pixels, EDGE_PLACES)[0]
