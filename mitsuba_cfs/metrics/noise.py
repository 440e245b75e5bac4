"""Variances of quantities of the sensors, and the standard errors that follow from them.

A few batches estimate a variance badly: errors are multiplied by Student's factor, so that twice
the stated one covers 95 % of results, whatever the number of batches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

Array = NDArray[np.float64]
MANY = 1e9  # degrees of freedom
COVERED = 2.0  # standard errors that are to cover what they cover of a normal distribution, 95 %


@dataclass(frozen=True, slots=True)
class Noise:
    """Variance of a quantity of the sensors [S]: by paths of their own, and by what they share."""

    own: Array  # the straight view
    shared: Array  # V and D, the sun, what windows reflect
    by_freedom: Array  # sum of v^2 / degrees of freedom over the independent parts v of both

    @classmethod
    def none(cls, count: int) -> Noise:
        """Of a number of sensors without noise."""
        return cls(np.zeros(count), np.zeros(count), np.zeros(count))

    @classmethod
    def of(cls, variance: Array, by_freedom: Array, *, shared: bool = False) -> Noise:
        """From a variance [S], and the sum of squares of its parts over their freedom [S]."""
        nothing = np.zeros_like(variance)
        return cls(*((nothing, variance) if shared else (variance, nothing)), by_freedom)

    def __add__(self, other: Noise) -> Noise:
        """The noise of a sum of independent illuminances."""
        return Noise(self.own + other.own, self.shared + other.shared, self.by_freedom + other.by_freedom)

    def scaled(self, factor: Array) -> Noise:
        """The noise of the illuminance times a factor [S]."""
        return Noise(self.own * factor**2, self.shared * factor**2, self.by_freedom * factor**4)

    def part(self, sensors: slice) -> Noise:
        """That of some sensors."""
        return Noise(self.own[sensors], self.shared[sensors], self.by_freedom[sensors])

    def student(self) -> Array:
        """Student's factor [S] of the standard error, 1 for many degrees of freedom.

        Source: degrees of freedom of a sum of variances, Welch 1947 and Satterthwaite 1946,
        doi:10.2307/3002019.
        """
        total = self.own + self.shared
        freedom = np.divide(total**2, self.by_freedom, out=np.full_like(total, MANY), where=self.by_freedom > 0)
        factor: Array = stdtrit(np.clip(freedom, 1.0, MANY), ndtr(COVERED)) / COVERED
        return factor

    def standard_error(self) -> Array:
        """Standard error [S] with Student's factor."""
        error: Array = np.sqrt(self.own + self.shared) * self.student()
        return error
