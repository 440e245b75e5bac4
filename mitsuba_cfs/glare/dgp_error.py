"""The standard error of DGP over a year, from some of its hours.

Two pictures of one hour, each of half of the paths, differ in DGP by twice the standard error of
the DGP of their mean: one estimate with one degree of freedom.  Hours of about the same DGP have
about the same error, so that a few hours in the order of DGP tell that of all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FEWEST, MOST, SHARE = 4, 24, 8  # hours that are rated by halves: one in eight
TOGETHER = 5  # neighbours in the order of DGP whose mean square is taken


def hours_by_halves(dgp: NDArray[np.float64]) -> NDArray[np.int64]:
    """Hours [n] evenly spread over the order of DGP [H], to be evaluated in halves; ascending."""
    count = min(len(dgp), int(np.clip(len(dgp) // SHARE, FEWEST, MOST)))
    order = np.argsort(dgp, kind="stable")
    return order[np.round(np.linspace(0, len(dgp) - 1, count)).astype(np.int64)]


def dgp_errors(
    dgp: NDArray[np.float64], hours: NDArray[np.int64], errors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Standard error of the DGP of every hour [H] from those of some.

    Args: hours: [n] as of `hours_by_halves`; errors: [n] half the difference of the DGP of two
    halves.
    """
    if not len(hours):
        return np.full(len(dgp), np.nan)
    rank = np.empty(len(dgp))
    rank[np.argsort(dgp, kind="stable")] = np.arange(len(dgp))
    weights = np.ones(min(TOGETHER, len(hours)))
    count = np.convolve(np.ones(len(hours)), weights, mode="same")
    mean = np.convolve(errors**2, weights, mode="same") / count
    return np.sqrt(np.interp(rank, rank[hours], mean))
