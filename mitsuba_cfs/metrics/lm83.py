"""IES LM-83: spatial daylight autonomy, annual sunlight exposure, and its rule for blinds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from mitsuba_cfs.metrics.autonomy import area_share, daylight_autonomy, scheduled, sensor_weights
from mitsuba_cfs.metrics.noise import Noise

FloatArray = NDArray[np.float64]

SDA_THRESHOLD = 300.0  # [lx]
SDA_TIME = 0.5  # share of the scheduled time
ASE_THRESHOLD = 1000.0  # [lx] of direct sun
ASE_HOURS = 250.0  # [h] in a year
BLIND_AREA = 0.02  # share of the area that may have direct sun before blinds close


def spatial_daylight_autonomy(
    illuminance: ArrayLike,
    hours: ArrayLike,
    *,
    areas: ArrayLike | None = None,
    threshold: float = SDA_THRESHOLD,
    time: float = SDA_TIME,
) -> float:
    """sDA300/50%: share (0 to 1) of the area with 300 lx for at least half the scheduled time.

    Args:
        illuminance: [H, S] [lx], with blinds operated (`blinds_operated`).
        hours: [H] mask, `lm83_hours` for the standard's 3,650.
        areas: [S] area of each sensor; equal unless given.

    Source: ANSI/IES LM-83-12 (and -22), section 2.
    """
    return area_share(daylight_autonomy(illuminance, hours, threshold) >= time, areas)


def sunlit_hours(
    direct_illuminance: ArrayLike, hours: ArrayLike, *, step_h: float = 1.0, threshold: float = ASE_THRESHOLD
) -> FloatArray:
    """Hours [S] of the scheduled time with more than `threshold` lx straight from the sun."""
    return step_h * np.count_nonzero(scheduled(direct_illuminance, hours) > threshold, axis=0)


def annual_sunlight_exposure(
    direct_illuminance: ArrayLike,
    hours: ArrayLike,
    *,
    areas: ArrayLike | None = None,
    step_h: float = 1.0,
    threshold: float = ASE_THRESHOLD,
    most_hours: float = ASE_HOURS,
) -> float:
    """ASE1000,250h: share (0 to 1) of the area with direct sun for more than 250 hours.

    Args:
        direct_illuminance: [H, S] [lx] of the sun alone, not reflected, with blinds open.
        hours: [H] mask, `lm83_hours` for the standard's.
        step_h: length of a time step [h].

    Source: ANSI/IES LM-83-12 (and -22), section 3.
    """
    lit = sunlit_hours(direct_illuminance, hours, step_h=step_h, threshold=threshold)
    return area_share(lit > most_hours, areas)


def blinds_operated(
    direct_illuminance: Sequence[ArrayLike],
    *,
    areas: ArrayLike | None = None,
    threshold: float = ASE_THRESHOLD,
    most_area: float = BLIND_AREA,
) -> NDArray[np.bool_]:
    """Time steps [G, H] in which the blinds of each window group are closed by LM-83.

    Blinds close whenever more than 2 % of the points have direct sun, in that combination of groups
    that leaves most of it but no more than 2 %; of equals, the one that closes the last groups.
    Closed blinds transmit no direct sun: the standard's direct sun is that of open blinds.

    Args: direct_illuminance: [G][H, S] [lx] straight from the sun through each group alone, open.

    Source: IES LM-83-12, 2.2.6, as quoted by blog.lightstanza.com/daylight-terms: the groups "can
    close in any combination, until the criterion value for each hour is achieved".
    """
    direct = np.asarray(direct_illuminance, dtype=float)
    if direct.ndim != 3:
        raise ValueError(f"direct_illuminance: expected [G][H, S], got {direct.shape}")
    weights = sensor_weights(areas, direct.shape[2])
    most = most_area * (1 + 1e-9)  # the sum of equal weights has rounding errors, the limit has none
    closed = np.zeros(direct.shape[:2], dtype=bool)
    for hour in np.flatnonzero((direct.sum(axis=0) >= threshold) @ weights > most):
        through = np.flatnonzero(direct[:, hour].any(axis=1))
        states = np.array(list(product((False, True), repeat=len(through))))
        left = (~states @ direct[through, hour] >= threshold) @ weights
        closed[through, hour] = states[np.argmax(np.where(left > most, -1.0, left))]
    return closed


def spatial_daylight_autonomy_error(
    autonomy: ArrayLike, noise: Noise, *, areas: ArrayLike | None = None, time: float = SDA_TIME
) -> float:
    """Standard error of sDA (0 to 1) from the noise of DA.

        variance = sum w_i^2 p_i (1 - s_i) + (sum w_i sqrt(p_i s_i))^2
        p_i = Phi(-|DA_i - time| / error_i)

    p_i is the probability that a sensor is counted wrongly, s_i the part of the variance of its DA
    that it shares with the other sensors.

    Args: autonomy, noise: [S] DA (0 to 1) and its noise.
    """
    distance, error = np.asarray(autonomy, dtype=float) - time, noise.standard_error()
    steps = np.divide(np.abs(distance), error, out=np.full(len(error), np.inf), where=error > 0)
    wrong = ndtr(-steps)
    total = noise.own + noise.shared
    shared = np.divide(noise.shared, total, out=np.zeros_like(total), where=total > 0)
    weights = sensor_weights(areas, len(error))
    own = np.sum(weights**2 * wrong * (1 - shared))
    return float(np.sqrt(own + np.sum(weights * np.sqrt(wrong * shared)) ** 2))
