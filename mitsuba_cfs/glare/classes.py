"""Glare classes by DGP, and the annual rule of EN 17037.

Source: Wienold (2009) for the classes; EN 17037:2018, 5.4 and annex E for the rule.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

LIMITS = (0.35, 0.40, 0.45)
CLASSES = ("imperceptible", "perceptible", "disturbing", "intolerable")
LEVELS = ("high", "medium", "minimum", "none")
EXCEEDED_SHARE = 0.05  # of the hours of use, at most


def glare_class(dgp: float) -> str:
    """Class of a DGP: imperceptible up to 0.35, perceptible to 0.40, disturbing to 0.45."""
    return CLASSES[int(np.searchsorted(LIMITS, dgp, side="left"))]


def exceeded_share(dgp: ArrayLike, limit: float) -> float:
    """Share of the hours dgp [H] above a limit, unweighted."""
    dgp = np.asarray(dgp, dtype=float)
    if dgp.ndim != 1 or dgp.size == 0 or not np.all(np.isfinite(dgp)):
        raise ValueError("expected DGP [H] of the hours of use, all finite")
    return float(np.mean(dgp > limit))


def hour_not_exceeded(dgp: ArrayLike, share: float = EXCEEDED_SHARE) -> float:
    """DGP that is exceeded in at most `share` of the hours dgp [H]: the (1 - share) quantile."""
    dgp = np.sort(np.asarray(dgp, dtype=float))
    if dgp.ndim != 1 or dgp.size == 0 or not np.all(np.isfinite(dgp)):
        raise ValueError("expected DGP [H] of the hours of use, all finite")
    allowed = int(np.floor(share * dgp.size + 1e-9))
    return float(dgp[dgp.size - 1 - allowed])


def mean_error(errors: ArrayLike) -> float | None:
    """Root mean square of the hours' standard errors of DGP; None where none is known (NaN)."""
    known = np.asarray(errors, dtype=float)
    known = known[~np.isnan(known)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def protection_level(dgp: ArrayLike) -> str:
    """EN 17037's protection from glare: the strictest limit exceeded in at most 5 % of the hours.

    Args:
        dgp: [H] of every hour in which the room is used.

    Returns:
        "high" (0.35), "medium" (0.40), "minimum" (0.45) or "none".
    """
    return level_of(hour_not_exceeded(dgp))


def level_of(not_exceeded: float) -> str:
    """Level of `protection_level` by the DGP that is exceeded in at most 5 % of the hours of use."""
    return LEVELS[int(np.searchsorted(LIMITS, not_exceeded, side="left"))]


def class_hours(dgp: ArrayLike) -> NDArray[np.int64]:
    """Number of hours [4] of dgp [H] in each class."""
    places = np.searchsorted(LIMITS, np.asarray(dgp, dtype=float), side="left")
    return np.bincount(places, minlength=len(CLASSES))
