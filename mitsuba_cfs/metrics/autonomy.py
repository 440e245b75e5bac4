"""Shares of time that each sensor has enough, or too much, daylight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.metrics.noise import Noise

FloatArray = NDArray[np.float64]
NoiseOfSums = Callable[[FloatArray], Noise]  # of weights [H, S]

THRESHOLD = 300.0  # [lx] daylight autonomy
ERROR_STEP = 3.0  # standard errors from the threshold: hours within are near it
NEAR_HOURS = 30  # so many hours near the threshold are looked for at least
LEAST_WIDTH, MOST_WIDTH = 1e-6, 0.25  # how far from the threshold, as a share of it
TYPICAL_HOURS = 4  # hours near the threshold whose own noise is computed
UDI_LIMITS = (100.0, 300.0, 3000.0)  # [lx] Mardaljevic et al. 2012: fell short, supplementary,
# autonomous, exceeded
UDI_LIMITS_2005 = (100.0, 300.0, 2000.0)  # [lx] upper limit of Nabil and Mardaljevic 2005


def daylight_autonomy(illuminance: ArrayLike, hours: ArrayLike, threshold: float = THRESHOLD) -> FloatArray:
    """DA [S]: share (0 to 1) of the scheduled time steps with at least `threshold` lx.

    Args:
        illuminance: [H, S] [lx].
        hours: [H] mask of the scheduled time steps.

    Source: Reinhart and Walkenhorst 2001, Energy and Buildings 33:683.
    """
    return np.mean(scheduled(illuminance, hours) >= threshold, axis=0)


def daylight_autonomy_noise(
    illuminance: ArrayLike,
    hours: ArrayLike,
    noise_of: NoiseOfSums,
    *,
    relative_error: ArrayLike,
    threshold: float = THRESHOLD,
) -> Noise:
    """Noise of DA (0 to 1) [S] by that of the illuminance.

    Hours near the threshold decide.  Of n hours within t (1 -+ a), a part 1 / 2 a t crosses it for
    each lux:

        variance = (n / 2 a H)^2 c + n / (2 a H^2) sqrt(v) / sqrt(pi)

    where c is the part of their relative variance that the hours have in common, and v the part
    that each has alone: that of a mean hour is c + v, that of their mean is c + v / n.  Two normal
    values of the variance v are 2 sqrt(v / pi) apart.

    Args:
        illuminance: [H, S] [lx].
        hours: [H] mask of the H scheduled time steps.
        noise_of: that of the sums over the hours of the illuminance times weights [H, S].
        relative_error: [S] relative standard error of the mean illuminance.
    """
    values, of_schedule = scheduled(illuminance, hours), np.asarray(hours)
    distance = np.abs(values / threshold - 1)
    last = min(NEAR_HOURS, len(distance)) - 1
    few = np.partition(distance, last, axis=0)[last]
    width = np.maximum(ERROR_STEP * np.asarray(relative_error), few)
    width = np.clip(width, LEAST_WIDTH, MOST_WIDTH)
    near = distance <= width
    count, steps = near.sum(axis=0), len(values)
    weights = np.zeros((len(of_schedule), values.shape[1]))
    weights[of_schedule] = near / (2 * width * threshold * steps)
    together = noise_of(weights)
    if not count.any():
        return together
    # of the hours' mean, relative; and of some hours each
    scale = np.divide(2 * width * steps, count, out=np.zeros(len(count)), where=count > 0)
    of_mean = (together.own + together.shared) * scale**2
    of_hour = np.zeros(len(count))
    for i in range(TYPICAL_HOURS):
        rank = np.ceil((i + 0.5) / TYPICAL_HOURS * count)
        chosen = near & (np.cumsum(near, axis=0) == np.maximum(rank, 1))
        weights[of_schedule] = chosen / threshold
        hourly = noise_of(weights)
        of_hour += (hourly.own + hourly.shared) / TYPICAL_HOURS
    alone = np.maximum(of_hour - of_mean, 0.0) * count / np.maximum(count - 1, 1)
    common = np.maximum(of_mean - alone / np.maximum(count, 1), 0.0)
    share = np.divide(common, of_mean, out=np.ones(len(count)), where=of_mean > 0)
    crossing = count / (2 * width * steps**2) * np.sqrt(alone / np.pi)
    nothing = np.zeros(len(count))
    return together.scaled(np.sqrt(share)) + Noise(crossing, nothing, nothing)


def continuous_daylight_autonomy(illuminance: ArrayLike, hours: ArrayLike, threshold: float = THRESHOLD) -> FloatArray:
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
            f"expected illuminance [H, S] and a mask [H], got {values.shape} and {hours.shape} of {hours.dtype}"
        )
    if not hours.any():
        raise ValueError("the schedule has no time step")
    values = values[hours]
    if not np.issubdtype(values.dtype, np.floating):
        values = values.astype(float)
    if not np.all((values >= 0) & (values < np.inf)):
        raise ValueError("illuminance: expected finite values, not negative")
    return values
