"""Daylight factor: illuminance inside over illuminance outside under the CIE overcast sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def daylight_factor(illuminance: ArrayLike, outdoor_horizontal: float) -> NDArray[np.float64]:
    """Daylight factor [S] (0 to 1) of sensors [S] [lx] under the CIE overcast sky.

    Args: `outdoor_horizontal` [lx]: unobstructed, of the same sky (`mitsuba_cfs.sky.cie`).

    Source: CIE 16-1970; ISO 15469:2004 for the sky.
    """
    values = np.asarray(illuminance, dtype=float)
    if not outdoor_horizontal > 0:
        raise ValueError(f"outdoor_horizontal: expected more than 0, got {outdoor_horizontal}")
    if not np.all((values >= 0) & (values < np.inf)):
        raise ValueError("illuminance: expected finite values, not negative")
    return values / outdoor_horizontal
