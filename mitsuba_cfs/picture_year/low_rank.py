"""Low-rank form of values that vary slowly from hour to hour: patterns, and amounts by hour.

    x[h, i] = scale[h] typical[i] sum over r of amount[h, r] pattern[r, i]

Hours are scaled to one mean and places to one root mean square first, so that a dim hour and a
dark corner are kept as well as bright ones.  Patterns are the leading right singular vectors of a
sample of hours.

Source: the truncated singular value decomposition (Eckart and Young 1936, Psychometrika 1:211-218).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FINEST = 5e-4  # of the typical value: step of the patterns' whole numbers
MOST = 32767  # of a whole number of 16 bits


@dataclass(frozen=True, slots=True)
class Patterns:
    """The patterns of one view's hours."""

    typical: NDArray[np.float32]  # [n]
    weight: NDArray[np.float64]  # [n] of a place, in the sums over places
    pattern: NDArray[np.int16]  # [r, n] in steps
    step: float
    axes: NDArray[np.float64]  # [r, n] orthonormal, of weighted values over typical ones
    spread: NDArray[np.float64]  # [r] root mean square of each axis in the sample

    @property
    def rank(self) -> int:
        """Number of patterns."""
        return len(self.pattern)

    def amounts(self, values: NDArray[np.floating]) -> tuple[NDArray, NDArray]:
        """Scale [h] and amounts [h, r] of hours of values [h, n]."""
        scale = mean_of(values, self.weight)
        relative = values / scale[:, None] / self.typical * np.sqrt(self.weight)
        return scale, (relative @ self.axes.T) / self.spread

    def values(self, scale: NDArray, amounts: NDArray) -> NDArray[np.float32]:
        """Values of hours [h, n], reconstructed and non-negative."""
        relative = amounts.astype(np.float32) @ (self.pattern.astype(np.float32) * self.step)
        return np.maximum(relative, 0.0) * self.typical * scale[:, None].astype(np.float32)


def patterns_of(sample: NDArray[np.floating], weight: NDArray[np.floating], rank: int) -> Patterns:
    """The leading patterns of a sample of hours [s, n].

    Args: weight: [n] of each place; rank: of the patterns at most, fewer where the sample is small.
    """
    weight = np.asarray(weight, dtype=float)
    relative = sample / mean_of(sample, weight)[:, None]
    typical = np.sqrt(np.mean(relative.astype(float) ** 2, axis=0))
    typical = np.maximum(typical, 1e-6 * typical.max(initial=1e-6)).astype(np.float32)
    relative = (relative / typical * np.sqrt(weight)).astype(float)
    square, vectors = np.linalg.eigh(relative @ relative.T)
    kept = np.flatnonzero(square[::-1] > 1e-12 * square.max(initial=1e-30))[:rank]
    length = np.sqrt(square[::-1][kept])
    axes = (vectors[:, ::-1][:, kept].T @ relative) / length[:, None]
    spread = length / np.sqrt(len(sample))
    whole = axes * spread[:, None] / np.sqrt(weight)
    step = max(FINEST, float(np.abs(whole).max(initial=0.0)) / MOST)
    return Patterns(typical, weight, np.round(whole / step).astype(np.int16), step, axes, spread)


def mean_of(values: NDArray[np.floating], weight: NDArray[np.floating]) -> NDArray[np.float64]:
    """Mean [h] of values [h, n] by weight, above 0."""
    return np.maximum(values @ weight / max(float(np.sum(weight)), 1e-30), 1e-6)
