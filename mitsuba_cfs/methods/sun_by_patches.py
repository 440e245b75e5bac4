"""The error of the three-phase method in hours with sun, whose patches blur its direction.

Some of these hours are computed again by the five-phase method, from the same V and D.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.light import ByPhases, SeasonalLight
from mitsuba_cfs.methods.optics import hourly_states
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    illuminance_of_all,
    phase_light,
    shining_hours,
    with_sensor_light,
)
from mitsuba_cfs.methods.phase_matrices import as_five_phase

HOURS = 64  # of those with sun on a window, evenly spread
Array = NDArray[np.float64]


def sunny_hour_error(light: ByPhases, state: NDArray[np.int64] | None, illuminance: Array) -> Array:
    """Root mean square error of a sunny hour, over the mean illuminance of these hours [S].

    0 of sensors without light in them, and with the five-phase method.

    Args:
        state: [G, L] of each window group in each hour, or [L] of all; the first by default.
        illuminance: that of the sensors in this state [S, L] [lx].
    """
    rows = hourly_states(state, light.systems, light.sky)
    seasons = light.seasons() if isinstance(light, SeasonalLight) else [(light, slice(None))]
    square, total, count = np.zeros(len(illuminance)), np.zeros(len(illuminance)), 0
    for one, hours in seasons:
        if isinstance(one, PhaseLight) and not one.matrices.five_phase:
            off, lit, n = _of_season(one, rows[:, hours], illuminance[:, hours])
            square, total, count = square + n * off, total + n * lit, count + n
    mean, off = total / max(count, 1), np.sqrt(square / max(count, 1))
    return np.divide(off, mean, out=np.zeros_like(mean), where=mean > 0)


def _of_season(
    light: PhaseLight, rows: NDArray[np.int64], illuminance: Array
) -> tuple[Array, Array, int]:
    """Mean square error and mean illuminance of sunny hours [S], and how many hours have sun."""
    sunny = shining_hours(light)
    if not len(sunny):
        nothing = np.zeros(len(illuminance))
        return nothing, nothing, 0
    count = min(HOURS, len(sunny))
    some = sunny[np.round(np.linspace(0, len(sunny) - 1, count)).astype(np.int64)]
    matrices = as_five_phase(light.matrices)
    sharp = with_sensor_light(phase_light(matrices, light.systems, light.sky.part(some), needs=()))
    by_patches = illuminance[:, some]
    at_sun = illuminance_of_all(sharp, rows[:, some])[: len(illuminance)]
    return np.mean((by_patches - at_sun) ** 2, axis=1), by_patches.mean(axis=1), len(sunny)
