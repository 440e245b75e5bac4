"""Pictures by the view matrix of every pixel, the long way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.images.view import View
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.matrices.pixel_view import picture_part_blocks


def luminance_pictures(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    view: View,
    window_luminance: ArrayLike,
    *,
    samples: int = 32,
    **options: Any,
) -> NDArray[np.float32]:
    """Pictures [H, ny, nx]: luminance of each pixel for every hour's window luminance.

        L[pixel, h] = sum over g, k of V[pixel, g, k] L_window[g, k, h]

    Args:
        window_luminance: [G, K, H] of the windows towards the room, T D s [cd/m2].
        samples, options: see `picture_part_blocks`.
    """
    window_luminance = np.asarray(window_luminance, dtype=np.float32)
    G, K, H = window_luminance.shape
    flat = window_luminance.reshape(G * K, H)
    pictures = np.zeros((H, view.height * view.width), dtype=np.float32)
    blocks = picture_matrix_blocks(surfaces, groups, view, samples=samples, **options)
    for pixels, matrix in blocks:
        pictures[:, pixels] = (matrix.reshape(len(pixels), G * K) @ flat).T
    return pictures.reshape(H, view.height, view.width)


def picture_matrix_blocks(
    surfaces: Surfaces, groups: Sequence[WindowGroup], view: View, **options: Any
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Blocks of the view matrix of a picture: pixel numbers [n] and their rows [n, G, K].

    The rows of a pixel hold its radiance per unit radiance of each window patch: 1 shared among the
    patches that it sees directly, and what the surfaces it sees reflect.

    Args: options: of `picture_part_blocks`.
    """
    for block in picture_part_blocks(surfaces, groups, view, **options):
        reflected = block.lit + block.later
        whole = block.seen.toarray() + reflected
        yield block.pixels, whole.reshape(len(whole), len(groups), -1)
