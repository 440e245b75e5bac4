"""Shares of time that each sensor has enough, or too much, daylight."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

THRESHOLD = 300.0  # [lx] daylight autonomy
ERROR_STEP = 3.0  # standard errors by which hours are moved to count those near the threshold
UDI_LIMITS = (100.0, 300.0, 3000.0)  # [lx] Mardaljevic et al. 2012: fell short, supplementary,
# autonomous, exceeded
UDI_LIMITS_2005 = (100.0, 300.0, 2000.0)  # [lx] upper limit of Nabil and Mardaljevic 2005


def daylight_autonomy(
    illuminance: ArrayLike, hours: ArrayLike, threshold: float = THRESHOLD
) -> FloatArray:
    """DA [S]: share (0 to 1) of the scheduled time steps with at least `threshold` lx.

    Args:
        illuminance: [H, S] [lx].
        hours: [H] mask of the scheduled time steps.

    Source: Reinhart and Walkenhorst 2001, Energy and Buildings 33:683.
    """
    return np.mean(scheduled(illuminance, hours) >= threshold, axis=0)


def daylight_autonomy_error(
    illuminance: ArrayLike,
    hours: ArrayLike,
    relative_error: ArrayLike,
    threshold: float = THRESHOLD,
) -> FloatArray:
    """Standard error of DA [S] (0 to 1) by the noise of the illuminance.

        (DA(E (1 + k e)) - DA(E (1 - k e))) / 2 k

    A sensor's noise is that of its matrices, about the same share of the illuminance in all hours.
    Few hours are close to the threshold: k = 3 counts enough of them.

    Args:
        illuminance: [H, S] [lx].
        hours: [H] mask of the scheduled time steps.
        relative_error: [S] relative standard error of the illuminance.
    """
    values, error = scheduled(illuminance, hours), ERROR_STEP * np.asarray(relative_error)
    above, below = (np.mean(values * (1 + s * error) >= threshold, axis=0) for s in (1, -1))
    return np.asarray((above - below) / (2 * ERROR_STEP))


def continuous_daylight_autonomy(
    illuminance: ArrayLike, hours: ArrayLike, threshold: float = THRESHOLD
) -> FloatArray:
    """cDA [S]: mean over the scheduled time steps of the part of `threshold` that is met.

    Source: Rogers 2006, Daylighting Metric Development.
    """
    met = scheduled(illuminance, hours) / threshold
    return np.mean(np.minimum(met, 1.0, out=met), axis=0)


def useful_daylight_illuminance(
    illuminance: ArrayLike, hours: ArrayLike, limits: tuple[float, ...] = UDI_LIMITS
) -> FloatArray:
    """UDI bins [len(limits) + 1, S]: shares of the scheduled time steps; each column sums to 1.

    With the default limits: below 100 lx, 100 to 300, 300 to 3000, above 3000.  A bin holds its
    lower limit; the last limit itself still is useful.

    Source: Nabil and Mardaljevic 2005, Lighting Research and Technology 37:41; limits of 2012.
    """
    if list(limits) != sorted(set(limits)) or not limits or limits[0] <= 0:
        raise ValueError(f"limits: expected rising positive illuminances, got {limits}")
    values = scheduled(illuminance, hours)
    above = [np.mean(values >= limit, axis=0) for limit in limits[:-1]]
    above.append(np.mean(values > limits[-1], axis=0))
    steps = np.stack([np.ones(values.shape[1]), *above, np.zeros(values.shape[1])])
    return steps[:-1] - steps[1:]


def area_share(met: ArrayLike, areas: ArrayLike | None = None) -> float:
    """Share (0 to 1) of the area whose sensors [S] meet a condition; equal areas unless given."""
    met = np.asarray(met, dtype=bool)
    weights = sensor_weights(areas, len(met))
    return float(weights[met].sum())


def sensor_weights(areas: ArrayLike | None, count: int) -> FloatArray:
    """Share of the area [S] of each of `count` sensors; sums to 1."""
    if count == 0:
        raise ValueError("expected at least one sensor")
    if areas is None:
        return np.full(count, 1.0 / count)
    areas = np.asarray(areas, dtype=float)
    if areas.shape != (count,) or not np.all(areas >= 0) or not areas.sum() > 0:
        raise ValueError(f"areas: expected {count} areas, not negative, got {areas.shape}")
    return areas / areas.sum()


def scheduled(illuminance: ArrayLike, hours: ArrayLike) -> NDArray[np.float64]:
    """Illuminance [h, S] of the scheduled time steps, checked: finite and not negative."""
    values, hours = np.asarray(illuminance), np.asarray(hours)
    if values.ndim != 2 or hours.shape != (len(values),) or hours.dtype != bool:
        raise ValueError(
            f"expected illuminance [H, S] and a mask [H], got {values.shape} and "
            f"{hours.shape} of {hours.dtype}"
        )
    if not hours.any():
        raise ValueError("the schedule has no time step")
    values = values[hours]
    if not np.issubdtype(values.dtype, np.floating):
        values = values.astype(float)
    if not np.all((values >= 0) & (values < np.inf)):
        raise ValueError("illuminance: expected finite values, not negative")
    return values
