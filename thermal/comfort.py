"""Thermal comfort: radiant and operative temperature, adaptive bands, PMV and SET."""

from __future__ import annotations

from dataclasses import dataclass

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


def room_centre_mrt(
    surface_c: ArrayLike, floor_c: ArrayLike, area: ArrayLike | None = None
) -> NDArray[np.float64]:
    """MRT [H] [degC] at the room's centre: mean of all surfaces' mean and of the floor.

    Args: surface_c: [H, N]; floor_c: [H]; area: [N] weights, plain mean (dissertation) without.
    """
    surfaces = np.asarray(surface_c, dtype=float)
    weight = np.ones(surfaces.shape[-1]) if area is None else np.asarray(area, dtype=float)
    return 0.5 * (surfaces @ (weight / weight.sum()) + np.asarray(floor_c, dtype=float))


def operative_temperature(
    air_c: ArrayLike, mrt_c: ArrayLike, air_speed: float = 0.1
) -> NDArray[np.float64]:
    """Operative temperature [...] [degC]: the mean below 0.2 m/s, else ISO 7726's weights."""
    air, mrt = np.asarray(air_c, dtype=float), np.asarray(mrt_c, dtype=float)
    require(air_speed >= 0, "air speed", f"is negative: {air_speed} m/s")
    weight = 1.0 if air_speed < 0.2 else np.sqrt(10.0 * air_speed)
    return (mrt + weight * air) / (1.0 + weight)


def running_mean(
    outdoor_c: ArrayLike, *, alpha: float = 0.7, days: int = 7, per_day: int = 24
) -> NDArray[np.float64]:
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


def _days_before(
    daily: NDArray[np.float64], weights: NDArray[np.float64], per_day: int
) -> NDArray[np.float64]:
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


def comfort_by_outdoors(
    operative_c: ArrayLike, outdoor_c: ArrayLike, band: str, *, per_day: int
) -> AdaptiveComfort:
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


def summarise(
    comfort: AdaptiveComfort, chosen: ArrayLike, months: ArrayLike | None = None
) -> ComfortSummary:
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


MET, GAGGE_MET = 58.15, 58.2  # [W/m2] of a seated person, in each source
SKIN, CORE, BLOOD = 33.7, 36.8, 6.3  # neutral temperatures [degC], blood to the skin [L/(h m2)]
BODY_AREA, BODY_MASS = 1.8258, 70.0  # [m2], [kg]
CLOTH_TOLERANCE, MOST_ROUNDS = 1e-4, 150  # of the clothing's temperature [K]


def pmv_ppd(
    air_c: ArrayLike,
    mrt_c: ArrayLike,
    *,
    air_speed: ArrayLike = 0.1,
    humidity: ArrayLike = 50.0,
    metabolic_rate: float = 1.2,
    clothing: float = 0.5,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Predicted mean vote [H] and percentage dissatisfied [H].

    humidity: relative [%]; metabolic_rate in met, clothing in clo.  Hours outside the standard's
    limits are computed all the same.

    Source: ISO 7730:2005, 4.1, 5 and annex D.
    """
    air, mrt, speed, moist = _surroundings(air_c, mrt_c, air_speed, humidity)
    heat, insulation = metabolic_rate * MET, 0.155 * clothing  # [W/m2], [m2 K/W]
    wider = 1.0 + 1.29 * insulation if insulation <= 0.078 else 1.05 + 0.645 * insulation
    vapour = 10.0 * moist * np.exp(16.6536 - 4030.183 / (air + 235.0))  # [Pa]
    radiant = 3.96e-8 * wider * (mrt + 273.0) ** 4
    cloth = air + (35.5 - air) / (3.5 * (6.45 * insulation + 0.1))
    for _ in range(MOST_ROUNDS):
        before = cloth
        film = np.maximum(2.38 * np.abs(cloth - air) ** 0.25, 12.1 * np.sqrt(speed))
        # half of the step to the balance of the clothing, its radiation held
        lost = 3.96e-8 * wider * (cloth + 273.0) ** 4 - radiant
        aim = 35.7 - 0.028 * heat - insulation * lost
        aim = (aim + insulation * wider * film * air) / (1.0 + insulation * wider * film)
        cloth = 0.5 * (cloth + aim)
        if np.abs(cloth - before).max(initial=0.0) < CLOTH_TOLERANCE:
            break
    skin = 3.05e-3 * (5733.0 - 6.99 * heat - vapour) + 0.42 * max(heat - MET, 0.0)
    breath = 1.7e-5 * heat * (5867.0 - vapour) + 0.0014 * heat * (34.0 - air)
    dry = 3.96e-8 * wider * (cloth + 273.0) ** 4 - radiant + wider * film * (cloth - air)
    pmv = (0.303 * np.exp(-0.036 * heat) + 0.028) * (heat - skin - breath - dry)
    return pmv, 100.0 - 95.0 * np.exp(-0.03353 * pmv**4 - 0.2179 * pmv**2)


def standard_effective_temperature(
    air_c: ArrayLike,
    mrt_c: ArrayLike,
    *,
    air_speed: ArrayLike = 0.1,
    humidity: ArrayLike = 50.0,
    metabolic_rate: float = 1.2,
    clothing: float = 0.5,
) -> NDArray[np.float64]:
    """SET [H] [degC] of a standing person after an hour; arguments as for `pmv_ppd`.

    Source: Gagge, Fobelets and Berglund 1986, ASHRAE Transactions 92 (2B); ANSI/ASHRAE 55-2020,
    normative appendix D, with the sweat at the greatest wettedness of the paper.
    """
    air, mrt, speed, moist = _surroundings(air_c, mrt_c, air_speed, humidity)
    speed = np.maximum(speed, 0.1)
    heat, insulation, wider = metabolic_rate * GAGGE_MET, 0.155 * clothing, 1.0 + 0.15 * clothing
    clothed = clothing > 0.0
    vapour = 0.01 * moist * _saturation(air)
    wettest = 0.59 * speed**-0.08 if clothed else 0.38 * speed**-0.29
    walking = 5.66 * max(metabolic_rate - 0.85, 0.0) ** 0.39
    film = np.maximum(np.maximum(3.0, 8.600001 * speed**0.53), walking)
    breath = 0.0023 * heat * (44.0 - vapour) + 0.0014 * heat * (34.0 - air)
    skin, core = np.full_like(air, SKIN), np.full_like(air, CORE)
    blood, share = np.full_like(air, BLOOD), np.full_like(air, 0.1)
    produced, evaporated = np.full_like(air, heat), np.full_like(air, 0.1 * metabolic_rate)
    radiant = np.full_like(air, 4.7)
    for _ in range(59):  # minutes
        around, cloth = 1.0 / (wider * (radiant + film)), None
        for _ in range(MOST_ROUNDS):
            felt = (radiant * mrt + film * air) / (radiant + film)
            now = (around * skin + insulation * felt) / (around + insulation)
            if cloth is not None and np.abs(now - cloth).max(initial=0.0) <= CLOTH_TOLERANCE:
                break
            cloth = now
            radiant = 4.0 * 0.95 * 0.73 * 5.6697e-8 * (0.5 * (cloth + mrt) + 273.15) ** 3
            around = 1.0 / (wider * (radiant + film))
        dry = (skin - felt) / (around + insulation)
        inner = (core - skin) * (5.28 + 1.163 * blood)
        rate = BODY_AREA / (0.97 * BODY_MASS * 60.0)
        step = (inner - dry - evaporated) * rate / share, (produced - inner - breath) * rate
        skin, core = skin + step[0], core + step[1] / (1.0 - share)
        cold = np.maximum(SKIN - skin, 0.0)
        blood = (BLOOD + 120.0 * np.maximum(core - CORE, 0.0)) / (1.0 + 0.5 * cold)
        blood = np.clip(blood, 0.5, 90.0)
        warm = share * (skin - SKIN) + (1.0 - share) * core + share * SKIN - 0.1 * SKIN - 0.9 * CORE
        sweat = 170.0 * np.maximum(warm, 0.0) * np.exp(np.maximum(skin - SKIN, 0.0) / 10.7)
        sweat = 0.68 * np.minimum(sweat, 500.0)
        through = 1.0 / (2.2 * wider * film) + insulation / (2.2 * (0.45 if clothed else 1.0))
        most = (_saturation(skin) - vapour) / through
        most = np.where(most == 0.0, 0.001, most)
        wet = 0.06 + 0.94 * sweat / most
        soaked, part = wet > wettest, (wettest - 0.06) / 0.94
        diffused = np.where(soaked, 0.06 * (1.0 - part) * most, wet * most - sweat)
        evaporated = np.where(most < 0.0, 0.0, np.where(soaked, part * most, sweat) + diffused)
        wet = np.where(soaked | (most < 0.0), wettest, wet)
        produced = heat + 19.4 * cold * np.maximum(CORE - core, 0.0)
        share = 0.0417737 + 0.7451833 / (blood + 0.585417)
    return _standard_temperature(skin, dry + evaporated, wet, radiant, metabolic_rate)


def _standard_temperature(
    skin: NDArray[np.float64],
    lost: NDArray[np.float64],
    wet: NDArray[np.float64],
    radiant: NDArray[np.float64],
    metabolic_rate: float,
) -> NDArray[np.float64]:
    """Air of the standard surroundings [degC] to which skin [degC] of a wettedness loses as much.

    Args: lost: heat of the skin [W/m2]; radiant: its radiative coefficient [W/(m2 K)].
    """
    film = max(3.0, 5.66 * max(metabolic_rate - 0.85, 0.0) ** 0.39)
    clothing = 1.52 / (metabolic_rate + 0.6944) - 0.1835
    wider, whole = 1.0 + 0.25 * clothing, film + radiant
    passed = 1.0 / (1.0 + 0.155 * wider * whole * clothing)
    vapour = 0.45 * film / whole * (1.0 - passed) / (film / whole - 0.45 * passed)
    dry = 1.0 / (1.0 / (wider * whole) + 0.155 * clothing)
    moist = wet / (1.0 / (2.2 * wider * film) + 0.155 * clothing / (2.2 * vapour))
    air = skin - lost / dry
    for _ in range(MOST_ROUNDS):
        pressure = _saturation(air)
        excess = lost - dry * (skin - air) - moist * (_saturation(skin) - 0.5 * pressure)
        slope = dry + 0.5 * moist * pressure * 4030.183 / (air + 235.0) ** 2
        change = excess / slope
        air = air - change
        if np.abs(change).max(initial=0.0) < 1e-6:
            break
    return air


def _saturation(temperature_c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vapour pressure at saturation [torr] (Antoine)."""
    pressure: NDArray[np.float64] = np.exp(18.6686 - 4030.183 / (temperature_c + 235.0))
    return pressure


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
