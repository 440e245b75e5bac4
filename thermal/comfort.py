"""Thermal comfort: radiant and operative temperature, adaptive bands, PMV and SET."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import ThermalInputError, require

KELVIN = 273.15

# (slope, intercept, below, above, lowest and highest valid outdoor mean), all [degC] or [K]
ADAPTIVE_BANDS = {
    "ASHRAE 55 90 %": (0.31, 17.8, 2.5, 2.5, 10.0, 33.5),
    "ASHRAE 55 80 %": (0.31, 17.8, 3.5, 3.5, 10.0, 33.5),
    "EN 16798-1 I": (0.33, 18.8, 3.0, 2.0, 10.0, 30.0),
    "EN 16798-1 II": (0.33, 18.8, 4.0, 3.0, 10.0, 30.0),
    "EN 16798-1 III": (0.33, 18.8, 5.0, 4.0, 10.0, 30.0),
}


def mean_radiant_temperature(surface_c: ArrayLike, view_factors: ArrayLike) -> NDArray[np.float64]:
    """MRT [H] [degC] of a point: (sum_j F_j T_j^4)^(1/4).

    Args: surface_c: [H, N]; view_factors: [N] from the person to the surfaces, sum 1.

    Source: ISO 7726, annex B.
    """
    f = np.asarray(view_factors, dtype=float)
    fits = abs(f.sum() - 1.0) < 1e-3
    require(fits, "view factors of the person", f"sum to {f.sum():.4f} instead of 1")
    kelvin = np.asarray(surface_c, dtype=float) + KELVIN
    return (kelvin**4 @ f) ** 0.25 - KELVIN


def room_centre_mrt(surface_c: ArrayLike, floor_c: ArrayLike, area: ArrayLike | None = None) -> NDArray[np.float64]:
    """MRT [H] [degC] at the room's centre: mean of all surfaces' mean and of the floor.

    Args: surface_c: [H, N]; floor_c: [H]; area: [N] weights, plain mean (dissertation) without.
    """
    surfaces = np.asarray(surface_c, dtype=float)
    weight = np.ones(surfaces.shape[-1]) if area is None else np.asarray(area, dtype=float)
    return 0.5 * (surfaces @ (weight / weight.sum()) + np.asarray(floor_c, dtype=float))


def operative_temperature(air_c: ArrayLike, mrt_c: ArrayLike, air_speed: float = 0.1) -> NDArray[np.float64]:
    """Operative temperature [...] [degC]: the mean below 0.2 m/s, else ISO 7726's weights."""
    air, mrt = np.asarray(air_c, dtype=float), np.asarray(mrt_c, dtype=float)
    require(air_speed >= 0, "air speed", f"is negative: {air_speed} m/s")
    weight = 1.0 if air_speed < 0.2 else np.sqrt(10.0 * air_speed)
    return (mrt + weight * air) / (1.0 + weight)


def running_mean(outdoor_c: ArrayLike, *, alpha: float = 0.7, days: int = 7, per_day: int = 24) -> NDArray[np.float64]:
    """Running mean outdoor temperature [H] [degC] of the days before, the year taken as cyclic.

    (1 - a) sum_k a^(k-1) t_(d-k) / (1 - a^n): the division, missing in the dissertation, makes the
    weights sum to 1.  EN 16798-1: alpha 0.8.
    """
    daily = _daily_means(outdoor_c, per_day)
    require(0.0 < alpha < 1.0, "running mean", f"alpha must lie between 0 and 1, got {alpha}")
    weights = alpha ** np.arange(days)
    return _days_before(daily, weights / weights.sum(), per_day)


def running_mean_en16798(outdoor_c: ArrayLike, *, per_day: int = 24) -> NDArray[np.float64]:
    """Running mean [H] [degC] of seven days with the weights of EN 16798-1, eq. (B.2)."""
    weights = np.array([1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2])
    return _days_before(_daily_means(outdoor_c, per_day), weights / 3.8, per_day)


def rolling_mean(outdoor_c: ArrayLike, steps: int) -> NDArray[np.float64]:
    """Mean [H] [degC] of the last so many steps, the present one included; the year is cyclic."""
    outdoor = np.asarray(outdoor_c, dtype=float)
    total = np.cumsum(np.concatenate([outdoor[-steps:], outdoor]))
    return (total[steps:] - total[:-steps]) / steps


def _daily_means(outdoor_c: ArrayLike, per_day: int) -> NDArray[np.float64]:
    outdoor = np.asarray(outdoor_c, dtype=float)
    whole = f"expected whole days of {per_day} values"
    require(len(outdoor) % per_day == 0, "outdoor temperature", whole)
    return outdoor.reshape(-1, per_day).mean(axis=1)


def _days_before(daily: NDArray[np.float64], weights: NDArray[np.float64], per_day: int) -> NDArray[np.float64]:
    mean = sum(w * np.roll(daily, k + 1) for k, w in enumerate(weights))
    return np.repeat(mean, per_day)


@dataclass(frozen=True, slots=True)
class AdaptiveComfort:
    """Hours against one adaptive band."""

    band: str
    outdoor_mean_c: NDArray[np.float64]  # [H] that the limits follow
    low_c: NDArray[np.float64]  # [H] operative temperature limits
    high_c: NDArray[np.float64]  # [H]
    applicable: NDArray[np.bool_]  # [H] the outdoor mean lies in the standard's range
    comfortable: NDArray[np.bool_]  # [H] applicable and within the limits
    excess: NDArray[np.float64]  # [H] kelvin above the upper limit (positive) or below (negative)


def adaptive_comfort(
    operative_c: ArrayLike, outdoor_mean_c: ArrayLike, band: str = "ASHRAE 55 80 %"
) -> AdaptiveComfort:
    """Operative temperatures [H] against an adaptive band of `ADAPTIVE_BANDS`.

    Source: ASHRAE 55-2020, 5.4; EN 16798-1:2019, B.2.2.
    """
    require(band in ADAPTIVE_BANDS, "comfort band", f"{band!r} is not of {list(ADAPTIVE_BANDS)}")
    slope, intercept, below, above, lowest, highest = ADAPTIVE_BANDS[band]
    operative = np.asarray(operative_c, dtype=float)
    mean = np.asarray(outdoor_mean_c, dtype=float)
    require(operative.shape == mean.shape, "comfort", "one outdoor mean for every hour is needed")
    comfort = intercept + slope * mean
    low, high = comfort - below, comfort + above
    applicable = (mean >= lowest) & (mean <= highest)
    excess = np.maximum(operative - high, 0.0) + np.minimum(operative - low, 0.0)
    within = applicable & (excess == 0.0)
    return AdaptiveComfort(band, mean, low, high, applicable, within, excess)


def comfort_by_outdoors(operative_c: ArrayLike, outdoor_c: ArrayLike, band: str, *, per_day: int) -> AdaptiveComfort:
    """Operative temperatures [H] against the adaptive comfort band of a standard.

    Args: outdoor_c: [H] of whole days with so many values each.
    """
    mean = running_mean_en16798 if band.startswith("EN 16798-1") else running_mean
    return adaptive_comfort(operative_c, mean(outdoor_c, per_day=per_day), band)


def degree_hours(operative_c: ArrayLike, above_c: ArrayLike, *, step_h: float) -> float:
    """Kelvin above a limit (one, or one each [H]) times hours, of operative temperatures [H]."""
    return float(np.maximum(np.asarray(operative_c) - above_c, 0.0).sum() * step_h)


@dataclass(frozen=True, slots=True)
class ComfortSummary:
    """Comfort of one room over the chosen hours."""

    band: str
    hours: int  # chosen hours
    comfortable: int
    too_warm: int
    too_cold: int
    not_applicable: int  # outdoor mean outside the standard's range
    degree_hours_warm: float  # [K h] above the upper limit
    degree_hours_cold: float  # [K h] below the lower limit
    discomfort_by_month: NDArray[np.int64]  # [12] hours outside the band or not applicable


def summarise(comfort: AdaptiveComfort, chosen: ArrayLike, months: ArrayLike | None = None) -> ComfortSummary:
    """Counts of the chosen hours [H] (a mask); months: [H] 1 to 12, a common year without."""
    mask = np.asarray(chosen, dtype=bool)
    valid = mask & comfort.applicable
    warm, cold = valid & (comfort.excess > 0), valid & (comfort.excess < 0)
    month = _months(len(mask)) if months is None else np.asarray(months)
    outside = mask & ~comfort.comfortable
    return ComfortSummary(
        band=comfort.band,
        hours=int(mask.sum()),
        comfortable=int((mask & comfort.comfortable).sum()),
        too_warm=int(warm.sum()),
        too_cold=int(cold.sum()),
        not_applicable=int((mask & ~comfort.applicable).sum()),
        degree_hours_warm=float(comfort.excess[warm].sum()),
        degree_hours_cold=float(np.abs(comfort.excess[cold]).sum()),
        discomfort_by_month=np.bincount(month[outside] - 1, minlength=12)[:12],
    )


def _months(hours: int) -> NDArray[np.int64]:
    days = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31]
    if hours == 8784:
        days[1] = 29
    require(hours == 24 * sum(days), "months", f"needed for {hours} hours, not a whole year")
    return np.repeat(np.arange(1, 13), 24 * np.array(days))


def pmv_ppd(
    air_c: ArrayLike,
    mrt_c: ArrayLike,
    *,
    air_speed: ArrayLike = 0.1,
    humidity: ArrayLike = 50.0,
    metabolic_rate: float = 1.2,
    clothing: float = 0.5,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Predicted mean vote [H] and percentage dissatisfied [H] (ISO 7730, pythermalcomfort).

    humidity: relative [%]; metabolic_rate in met, clothing in clo.  Hours outside the standard's
    limits are computed all the same.
    """
    pmv_ppd_iso = _model("pmv_ppd_iso")
    air, mrt, speed, moist = _surroundings(air_c, mrt_c, air_speed, humidity)
    result = pmv_ppd_iso(tdb=air, tr=mrt, vr=speed, rh=moist, met=metabolic_rate, clo=clothing, **_PLAIN)
    return np.asarray(result.pmv, dtype=float), np.asarray(result.ppd, dtype=float)


def standard_effective_temperature(
    air_c: ArrayLike,
    mrt_c: ArrayLike,
    *,
    air_speed: ArrayLike = 0.1,
    humidity: ArrayLike = 50.0,
    metabolic_rate: float = 1.2,
    clothing: float = 0.5,
) -> NDArray[np.float64]:
    """SET [H] [degC] (Gagge two-node model, pythermalcomfort); arguments as for `pmv_ppd`."""
    surroundings = _surroundings(air_c, mrt_c, air_speed, humidity)
    return np.asarray(_set_of_hours()(*surroundings, metabolic_rate, clothing))


@cache
def _set_of_hours() -> Callable[..., NDArray[np.float64]]:
    """SET of air, radiant temperature, speed, humidity [...], metabolic rate and clothing."""
    try:
        with _models_alone():
            return import_module("thermal.two_nodes").set_of_hours
    except ImportError:  # a version of the package with other names inside
        return _set_tmp


def _set_tmp(
    air: NDArray[np.float64],
    mrt: NDArray[np.float64],
    speed: NDArray[np.float64],
    moist: NDArray[np.float64],
    *person: float,
) -> NDArray[np.float64]:
    """SET by the package's function, which calls its compiled model for each value from Python."""
    metabolic_rate, clothing = person
    of = {"tdb": air, "tr": mrt, "v": speed, "rh": moist, "met": metabolic_rate, "clo": clothing}
    return np.asarray(_model("set_tmp")(**of, **_PLAIN).set, dtype=float)


_PACKAGE = "pythermalcomfort.models"


@cache
def _model(name: str) -> Callable[..., Any]:
    """One model of pythermalcomfort."""
    with _models_alone():
        model: Callable[..., Any] = getattr(import_module(f"{_PACKAGE}.{name}"), name)
    return model


@contextmanager
def _models_alone() -> Iterator[None]:
    """Import models of pythermalcomfort one by one: importing all compiles what is not used here, for a second."""
    import pythermalcomfort

    stand_in = _PACKAGE not in sys.modules  # for the package; a later import of it runs the package itself
    if stand_in:
        package = sys.modules[_PACKAGE] = ModuleType(_PACKAGE)
        package.__path__ = [f"{folder}/models" for folder in pythermalcomfort.__path__]
    try:
        yield
    finally:
        if stand_in:
            del sys.modules[_PACKAGE]


_PLAIN = {"limit_inputs": False, "round_output": False}


def _surroundings(
    air_c: ArrayLike, mrt_c: ArrayLike, air_speed: ArrayLike, humidity: ArrayLike
) -> tuple[NDArray[np.float64], ...]:
    """Air, mean radiant temperature, air speed and humidity as arrays of one shape, checked."""
    values = [np.asarray(v, dtype=float) for v in (air_c, mrt_c, air_speed, humidity)]
    try:
        air, mrt, speed, moist = (np.array(v) for v in np.broadcast_arrays(*values))
    except ValueError as error:
        shapes = ", ".join(str(v.shape) for v in values)
        raise ThermalInputError("comfort", f"air, radiant, speed, humidity: {shapes}") from error
    require(bool(np.all(np.isfinite(air + mrt))), "comfort", "a temperature is missing")
    require(bool(np.all(speed >= 0)), "air speed", "is negative")
    require(bool(np.all((moist >= 0) & (moist <= 100))), "humidity", "lies outside 0 to 100 %")
    return air, mrt, speed, moist
