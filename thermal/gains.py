"""Internal heat gains: people, equipment, and lighting that daylight dims."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range
from thermal.zone import Gains


def dimmed_share(
    illuminance: ArrayLike, target_lx: float, *, least: float = 0.0
) -> NDArray[np.float64]:
    """Share [H] of the lamps' power that daylight leaves to be given: 1 - E/target, dimmed.

    illuminance: [H] daylight at the control point [lx]; least: share at full dimming.
    """
    require(target_lx > 0, "lighting", f"target illuminance must be positive, got {target_lx} lx")
    require_range(least, 0.0, 1.0, "lighting: least share")
    missing = np.clip(1.0 - np.asarray(illuminance, dtype=float) / target_lx, 0.0, 1.0)
    return np.maximum(missing, least)


def split_gains(power: ArrayLike, radiant_share: float, *others: tuple[ArrayLike, float]) -> Gains:
    """Gains of one or several sources of power [H] [W], each with its radiant share."""
    convective: NDArray[np.float64] | float = 0.0
    radiant: NDArray[np.float64] | float = 0.0
    for watts, share in ((power, radiant_share), *others):
        require_range(share, 0.0, 1.0, "radiant share")
        array = np.asarray(watts, dtype=float)
        convective, radiant = convective + (1.0 - share) * array, radiant + share * array
    return Gains(convective, radiant)
