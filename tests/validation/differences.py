"""How far values are from those of a judge."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def rmse_and_bias(ours: ArrayLike, theirs: ArrayLike) -> tuple[float, float]:
    """Root mean square and mean of the difference, ours less theirs."""
    gap = np.asarray(ours, dtype=float) - np.asarray(theirs, dtype=float)
    return float(np.sqrt(np.mean(gap**2))), float(gap.mean())


def mean_absolute(ours: ArrayLike, theirs: ArrayLike) -> float:
    """Mean absolute difference."""
    return float(np.mean(np.abs(np.asarray(ours, dtype=float) - np.asarray(theirs, dtype=float))))
