"""The standard error of DGP, from the noise of pictures and from some hours of a year.

Two pictures, each of half of the paths, differ in each pixel by twice one estimate of the noise of
their mean.  Their DGP would be one estimate of its standard error, which may be far too small by
chance: twice it covers 70 % of the errors.  Random signs of large parts of the view give more
estimates (a wild block bootstrap).  Noise goes together over more than a radian: parts of 0.25 rad
state 0.45 of the spread over seeds, parts of 1.5 rad 0.90.  So few parts are independent that
Student's factor for four degrees of freedom belongs to the error:

    error^2 = t^2 mean over draws of ((DGP(L + s n) - DGP(L - s n)) / 2)^2

DGP is limited to 1; the error is that of DGP without this limit, so that a value at the limit has
the error of what is beyond it.  Hours of about the same DGP have about the same error, so that a
few hours in the order of DGP tell that of all.

Source: Wu 1986, "Jackknife, bootstrap and other resampling methods in regression analysis".
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View, pixel_solid_angles

BLOCK = 1.5  # [rad] across the parts of one sign
DRAWS = 8  # of signs
STUDENT = 2.776 / 1.960  # 97.5 % of Student's t with four degrees of freedom over the normal's
FEWEST, MOST, SHARE = 4, 24, 8  # hours that are rated by halves: one in eight
TOGETHER = 5  # neighbours in the order of DGP whose mean square is taken


def random_signs(view: View, pixels: NDArray[np.int64]) -> NDArray[np.float32]:
    """Signs [DRAWS, n] of pixels, the same within square parts of the view of `BLOCK`."""
    size = float(np.sqrt(pixel_solid_angles(view).max()))
    across = max(round(BLOCK / size), 1)
    row, column = np.divmod(pixels, view.width)
    random, signs = np.random.default_rng(0), []
    for _ in range(DRAWS):
        down, right = random.integers(0, across, 2)
        y, x = (row + down) // across, (column + right) // across
        of_block = random.choice(np.array([-1, 1], dtype=np.float32), size=(y.max(initial=0) + 1, x.max(initial=0) + 1))
        signs.append(of_block[y, x])
    return np.stack(signs)


def dgp_error(
    dgp: Callable[[NDArray[np.float32]], float],
    values: NDArray[np.float32],
    noise: NDArray[np.float32],
    signs: NDArray[np.float32],
) -> float:
    """Standard error of the DGP of a picture.

    Args:
        dgp: unlimited, of the luminance of pixels [n].
        values, noise: [n] luminance, and half the difference of two halves of the paths [cd/m2].
        signs: [DRAWS, n] as of `random_signs`.
    """
    off = [dgp(np.maximum(values + s * noise, 0)) - dgp(np.maximum(values - s * noise, 0)) for s in signs]
    return float(STUDENT * np.sqrt(np.mean(np.square(off))) / 2)


def hours_by_halves(dgp: NDArray[np.float64]) -> NDArray[np.int64]:
    """Hours [n] evenly spread over the order of DGP [H], to be evaluated in halves; ascending."""
    count = min(len(dgp), int(np.clip(len(dgp) // SHARE, FEWEST, MOST)))
    order = np.argsort(dgp, kind="stable")
    return order[np.round(np.linspace(0, len(dgp) - 1, count)).astype(np.int64)]


def dgp_errors(dgp: NDArray[np.float64], hours: NDArray[np.int64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard error of the DGP of every hour [H] from those of some.

    Args: hours: [n] as of `hours_by_halves`; errors: [n] as of `dgp_error`.
    """
    if not len(hours):
        return np.full(len(dgp), np.nan)
    rank = np.empty(len(dgp))
    rank[np.argsort(dgp, kind="stable")] = np.arange(len(dgp))
    weights = np.ones(min(TOGETHER, len(hours)))
    count = np.convolve(np.ones(len(hours)), weights, mode="same")
    mean = np.convolve(errors**2, weights, mode="same") / count
    return np.sqrt(np.interp(rank, rank[hours], mean))
