"""A rough layer as a tensor tree: a Gaussian lobe about the specular direction, and diffuse light.

    f(i, o) = share(theta_i) exp(-|o - s|^2 / width^2) / (pi width^2 sqrt(cos_i cos_o)) c(theta_i)
              + diffuse(theta_i) / pi

s is the direction straight on, or that of the mirror; c keeps the lobe's flux at its share.

Source: `normal.c` of Radiance, which samples and sums the specular lobe of `trans` so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.tensor_merge import DARK, merged_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, square_to_disk

RESOLVED = 3.0  # of the smallest leaves in the half width of a lobe at 1/e, where they may be
LEVELS = (6, 7)  # of the smallest leaves
NARROWEST = 1.6 * np.sqrt(np.pi) / (1 << LEVELS[1])  # half width of a lobe [rad]
PLACES = 3  # in a cell along each axis, for its mean
WITHIN = 0.05  # of its mean that the values of a leaf may differ

ByAngle = Callable[[NDArray[np.float64]], NDArray[np.float64]]  # share by angle of incidence [rad]


def lobe_tree(width: float, share: ByAngle, diffuse: ByAngle) -> TensorTree:
    """The tree of rank 3 of a lobe about the specular direction, and of diffuse light.

    Args: width: half width at 1/e [rad], at least `NARROWEST`.

    Raises: `ValueError` for a narrower lobe.
    """
    if width < NARROWEST:
        raise ValueError(f"a lobe of {width:g} rad: expected at least {NARROWEST:.3f}")
    level = int(np.ceil(np.log2(RESOLVED * np.sqrt(np.pi) / width)))
    cells = 1 << int(np.clip(level, *LEVELS))
    fine = (np.arange(cells * PLACES) + 0.5) / (cells * PLACES)
    disk = square_to_disk(np.stack(np.meshgrid(fine, fine, indexing="ij"), -1))
    x, cosine = disk[..., 0], np.sqrt(np.maximum(1.0 - (disk**2).sum(axis=-1), 0.0))
    grid = np.zeros((cells,) * 3, dtype=np.float32)
    for i in range(cells // 2):
        for sine in 1.0 - 2.0 * fine[PLACES * i : PLACES * (i + 1)]:
            straight = np.sqrt(1.0 - sine**2)
            off = 2.0 - 2.0 * (sine * x + straight * cosine)
            lobe = np.exp(-off / width**2) / np.sqrt(np.maximum(cosine, 1e-3))
            lobe = lobe.reshape(cells, PLACES, cells, PLACES).mean(axis=(1, 3))
            theta = np.array([np.arcsin(sine)])
            flux = np.pi * lobe.mean()
            grid[i] += (share(theta)[0] / flux * lobe + diffuse(theta)[0] / np.pi) / PLACES
    return merged_tree(grid, relative=WITHIN, absolute=DARK)
