"""The error of the three-phase method in hours with sun, whose patches blur its direction.

Some of these hours are computed again by the five-phase method, from the same V and D.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import ByPhases, Light, seasons_of
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
RATED = 16  # of these hours, for glare
Array = NDArray[np.float64]


def sunny_hour_error(light: ByPhases, state: NDArray[np.int64] | None, illuminance: Array) -> Array:
    """Root mean square error of a sunny hour, over the mean illuminance of these hours [S].

    0 of sensors without light in them, and with the five-phase method.

    Args:
        state: [G, L] of each window group in each hour, or [L] of all; the first by default.
        illuminance: that of the sensors in this state [S, L] [lx].
    """
    rows = hourly_states(state, light.systems, light.sky)
    square, total, count = np.zeros(len(illuminance)), np.zeros(len(illuminance)), 0
    for one, hours in seasons_of(light):
        if isinstance(one, PhaseLight) and not one.matrices.five_phase:
            off, lit, n = _of_season(one, rows[:, hours], illuminance[:, hours])
            square, total, count = square + n * off, total + n * lit, count + n
    mean, off = total / max(count, 1), np.sqrt(square / max(count, 1))
    return np.divide(off, mean, out=np.zeros_like(mean), where=mean > 0)


def _of_season(light: PhaseLight, rows: NDArray[np.int64], illuminance: Array) -> tuple[Array, Array, int]:
    """Mean square error and mean illuminance of sunny hours [S], and how many hours have sun."""
    sunny = shining_hours(light)
    if not len(sunny):
        nothing = np.zeros(len(illuminance))
        return nothing, nothing, 0
    some = _sample(sunny, HOURS)
    sharp = with_sensor_light(_by_five_phases(light, some))
    by_patches = illuminance[:, some]
    at_sun = illuminance_of_all(sharp, rows[:, some])[: len(illuminance)]
    return np.mean((by_patches - at_sun) ** 2, axis=1), by_patches.mean(axis=1), len(sunny)


def sunny_hour_dgp_error(
    light: Light,
    rated: ArrayLike,
    metric: str = "DGP",
    state: ArrayLike | None = None,
    *,
    hours: NDArray[np.int64] | None = None,
    options: GlareOptions | None = None,
) -> float:
    """Root mean square error of the DGP of an hour with sun on a window.

    0 without such an hour, and with methods that take the sun at its position.

    Args:
        rated: [n] DGP of some hours by `hourly_glare`, whose other arguments are the rest.
    """
    rows = hourly_states(state, light.systems, light.sky)
    every = np.full(rows.shape[1], np.nan)
    every[slice(None) if hours is None else hours] = rated
    square, count = 0.0, 0
    for one, of_season in seasons_of(light):
        if not isinstance(one, PhaseLight) or one.matrices.five_phase:
            continue
        by_patches, sunny = every[of_season], shining_hours(one)
        sunny = sunny[~np.isnan(by_patches[sunny])]
        if not len(sunny):
            continue
        some = _sample(sunny, RATED)
        sharp = _by_five_phases(one, some)
        at_sun = hourly_glare(sharp, metric, rows[:, of_season][:, some], options=options)
        square += len(sunny) * float(np.mean((by_patches[some] - at_sun.dgp) ** 2))
        count += len(sunny)
    return float(np.sqrt(square / max(count, 1)))


def _sample(hours: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Some of the hours, evenly spread, the first and the last among them."""
    count = min(most, len(hours))
    return hours[np.round(np.linspace(0, len(hours) - 1, count)).astype(np.int64)]


def _by_five_phases(light: PhaseLight, hours: NDArray[np.int64]) -> PhaseLight:
    """The light of some hours with the sun at its position, from the same V and D."""
    matrices = as_five_phase(light.matrices)
    return phase_light(matrices, light.systems, light.sky.part(hours), needs=())
