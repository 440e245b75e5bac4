"""Final and primary energy of an ideal plant by its coefficient of performance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require


def performance(table: float | Sequence[tuple[float, float]], outdoor_c: ArrayLike) -> NDArray[np.float64]:
    """Coefficient of performance [H]: one, or linear between pairs of outdoor temperature and COP.

    Beyond the first and the last pair theirs holds.
    """
    outdoor = np.asarray(outdoor_c, dtype=float)
    if isinstance(table, int | float):
        table = ((0.0, float(table)),)
    temperature, cop = np.array(table, dtype=float).T
    require(bool(np.all(np.diff(temperature) > 0)), "COP", "expected rising temperatures")
    require(bool(np.all(cop > 0)), "COP", "expected positive values")
    return np.interp(outdoor, temperature, cop)
