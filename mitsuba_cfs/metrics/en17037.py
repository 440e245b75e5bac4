"""EN 17037: quantities of daylight provision; the levels are data of a rule file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.metrics.autonomy import scheduled, sensor_weights

FloatArray = NDArray[np.float64]

HALF_TIME = 0.5  # share of the daylight hours
TARGET_AREA, MINIMUM_AREA = 0.5, 0.95  # shares of the reference plane, openings in walls (A.1)
HORIZONTAL_AREA = 0.95  # rooflights, where there is a target only (table A.2)
RULES = ("hourly", "sensor")


@dataclass(frozen=True, slots=True)
class DaylightProvision:
    """Quantities that determine a room's level of daylight provision."""

    target_illuminance: float  # [lx] reached on half the area (95 % under rooflights), half the time
    minimum_illuminance: float  # [lx] reached on 95 % of the area, half the time


def daylight_provision(
    illuminance: ArrayLike,
    hours: ArrayLike,
    *,
    areas: ArrayLike | None = None,
    horizontal_openings: bool = False,
    rule: str = "hourly",
) -> DaylightProvision:
    """Illuminances that a room reaches by annual illuminance (method 2 of the standard).

    Args:
        illuminance: [H, S] [lx] on the reference plane (0.85 m, 0.5 m off the walls).
        hours: [H] mask of the daylight hours (`daylight_hours`: half of the year).
        areas: [S] area of each sensor; equal unless given.
        horizontal_openings: rooflights, whose target is for 95 % of the area.
        rule: `hourly`: the area is lit at the same time, in at least half of the hours (the words
            of the standard); `sensor`: each sensor has its own half of the hours (as sDA), which
            some programs take and which is never stricter by much.

    Source: EN 17037:2018+A1:2021, annex A, tables A.1 and A.2; annex B.3, method 2.
    """
    if rule not in RULES:
        raise ValueError(f"rule: expected one of {RULES}, got {rule!r}")
    values = scheduled(illuminance, hours)
    weights = sensor_weights(areas, values.shape[1])

    def reached(area: float) -> float:
        if rule == "hourly":
            return float(exceeded(reached_on_area(values, weights, area), HALF_TIME))
        return float(reached_on_area(exceeded(values, HALF_TIME)[None, :], weights, area)[0])

    target = reached(HORIZONTAL_AREA if horizontal_openings else TARGET_AREA)
    minimum = reached(MINIMUM_AREA)
    return DaylightProvision(target, minimum)


def reached_on_area(values: ArrayLike, weights: FloatArray, area: float) -> FloatArray:
    """Greatest illuminance [H] that at least a share `area` of the sensors [H, S] reaches."""
    values = np.asarray(values)
    order = np.argsort(-values, axis=1, kind="stable")
    covered = np.cumsum(weights[order], axis=1)
    first = np.argmax(covered >= area - 1e-9, axis=1)  # rounding of the sum of the weights
    return np.take_along_axis(values, order, axis=1)[np.arange(len(values)), first]


def exceeded(values: ArrayLike, time: float) -> FloatArray:
    """Greatest illuminance [...] reached in at least a share `time` of the axis [H, ...]."""
    values = np.asarray(values)
    count = max(1, int(np.ceil(time * len(values) - 1e-9)))
    return np.partition(values, len(values) - count, axis=0)[len(values) - count]


def median_diffuse(diffuse_illuminance: ArrayLike, hours: ArrayLike) -> float:
    """Median of the outdoor diffuse horizontal illuminance [H] over the daylight hours [lx]."""
    values = np.asarray(diffuse_illuminance, dtype=float)
    return float(np.median(scheduled(values[:, None], hours)))


def greatest_cell(length: float, width: float) -> float:
    """Greatest size p [m] of a cell of the grid on a reference plane of these sides [m].

        p = 0.5 x 5^log10(d),

    with d the longer side, or the shorter one where the longer is at least twice as long; 10 m at
    the most.

    Source: EN 17037:2018, annex B.1; the rule is that of EN 12464-1.
    """
    longer, shorter = max(length, width), min(length, width)
    if not shorter > 0:
        raise ValueError(f"expected a plane of two sides, got {length} x {width} m")
    d = shorter if longer >= 2 * shorter else longer
    return float(min(0.5 * 5 ** np.log10(d), 10.0))
