"""Moisture of the zones' air, hour by hour, from the air flows of a balance.

The air is mixed, walls neither take nor give vapour.  In each hour a zone's humidity ratio goes
exponentially to what its inflows and sources would give; neighbours have the mean of the hour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require

FloatArray = NDArray[np.float64]
RATIO = 0.621945  # of the molar masses of water and dry air
EVAPORATION = 2.501e6  # heat of evaporation at 0 degC [J/kg]
VAPOUR_HEAT = 1860.0  # specific heat of vapour [J/(kg K)]
AIR_GAS = 287.055  # [J/(kg K)]


def saturation_pressure(temperature_c: ArrayLike) -> FloatArray:
    """Pressure of saturated vapour [...] [Pa], over ice below 0 degC.

    Source: Hyland and Wexler 1983, as in the ASHRAE Handbook of Fundamentals, Psychrometrics (5),
    (6).
    """
    c = np.asarray(temperature_c, dtype=float)
    t = c + 273.15
    ice = (
        -5.6745359e3 / t
        + 6.3925247
        - 9.677843e-3 * t
        + 6.2215701e-7 * t**2
        + 2.0747825e-9 * t**3
        - 9.484024e-13 * t**4
        + 4.1635019 * np.log(t)
    )
    water = (
        -5.8002206e3 / t
        + 1.3914993
        - 4.8640239e-2 * t
        + 4.1764768e-5 * t**2
        - 1.4452093e-8 * t**3
        + 6.5459673 * np.log(t)
    )
    return np.exp(np.where(c < 0.0, ice, water))


def humidity_ratio(relative: ArrayLike, temperature_c: ArrayLike, pressure: ArrayLike) -> FloatArray:
    """Vapour per dry air [...] [kg/kg] at a relative humidity of 0 to 1; pressure [Pa]."""
    vapour = np.asarray(relative, dtype=float) * saturation_pressure(temperature_c)
    return RATIO * vapour / (np.asarray(pressure, dtype=float) - vapour)


def relative_humidity(ratio: ArrayLike, temperature_c: ArrayLike, pressure: ArrayLike) -> FloatArray:
    """Relative humidity [...], 0 to 1, of a humidity ratio [kg/kg]."""
    w = np.asarray(ratio, dtype=float)
    vapour = np.asarray(pressure, dtype=float) * w / (RATIO + w)
    return vapour / saturation_pressure(temperature_c)


@dataclass(frozen=True, slots=True)
class MoistZone:
    """Inputs of the moisture balance of a zone's air."""

    volume: float  # [m3]
    air_c: FloatArray  # [H]
    outdoor_air: FloatArray  # [H] [m3/s]
    vapour: FloatArray  # [H] sources [kg/s]
    humidify_to: float = 0.0  # relative humidity held by a humidifier, 0 to 1
    dehumidify_to: float = 1.0  # held by a cooler; 1: by none, vapour condenses of itself

    def __post_init__(self) -> None:
        order = 0.0 <= self.humidify_to <= self.dehumidify_to <= 1.0
        require(order, "humidity", "expected 0 <= humidify_to <= dehumidify_to <= 1")


@dataclass(frozen=True, slots=True)
class Humidity:
    """Hourly means of a zone's moisture."""

    ratio: FloatArray  # [H] [kg/kg]
    relative: FloatArray  # [H] 0 to 1
    humidify: FloatArray  # [H] latent heat given to the air [W]
    dehumidify: FloatArray  # [H] latent heat that a cooler takes from it [W]


def zone_humidity(
    zones: Sequence[MoistZone],
    outdoor_ratio: FloatArray,
    outdoor_c: FloatArray,
    pressure: FloatArray,
    between: FloatArray | None = None,
    *,
    row_s: float = 3600.0,
) -> tuple[Humidity, ...]:
    """The humidity of zones [Z] over the hours H.

    Args: outdoor_ratio: [H] [kg/kg]; between: [Z, Z] or [H, Z, Z] air that a zone (row) takes from
        another (column) [m3/s]; row_s: length of the hours, where they are not [s].
    """
    hours, count = len(outdoor_ratio), len(zones)
    density = pressure / (AIR_GAS * (outdoor_c + 273.15))
    flow = density[:, None] * np.stack([z.outdoor_air for z in zones], axis=1)
    air = np.stack([z.air_c for z in zones], axis=1)
    source = np.stack([np.broadcast_to(z.vapour, hours) for z in zones], axis=1)
    links = np.zeros((count, count)) if between is None else np.asarray(between, dtype=float)
    links = np.broadcast_to(links, (hours, count, count))
    mass = density[:, None] * np.array([z.volume for z in zones])
    low, high = (
        humidity_ratio(np.array([getattr(z, key) for z in zones]), air, pressure[:, None])
        for key in ("humidify_to", "dehumidify_to")
    )
    start = np.clip(np.full(count, outdoor_ratio[0]), low[0], high[0])
    inflow = flow * outdoor_ratio[:, None] + source
    means, added = _hours(start, flow, density, links, inflow, (mass / row_s, low, high))
    latent = added * (EVAPORATION + VAPOUR_HEAT * air)
    cooled = np.array([z.dehumidify_to < 1.0 for z in zones])
    given, taken = np.maximum(latent, 0.0), np.maximum(-latent, 0.0) * cooled
    relative = relative_humidity(means, air, pressure[:, None])
    return tuple(Humidity(means[:, z], relative[:, z], given[:, z], taken[:, z]) for z in range(count))


def _hours(
    start: FloatArray,
    flow: FloatArray,
    density: FloatArray,
    links: FloatArray,
    inflow: FloatArray,
    air: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Mean ratio of each hour [H, Z], and the vapour added (or taken: negative) [kg/s].

    flow: outdoor air, inflow: vapour, both but for other zones [kg/s]; air: mass per length of the
    hour [kg/s], least and greatest ratio.
    """
    mass, low, high = air
    beside = bool(np.any(links))
    total = flow + density[:, None] * links.sum(axis=2) if beside else flow
    k = np.maximum(total / mass, 1e-9)
    passing = np.maximum(total, 1e-9 * mass)
    gone = -np.expm1(-k)  # of the difference, at the hour's end
    kept = np.where(k < 1e-4, k / 2 - k**2 / 6, 1.0 - gone / k)  # gone of it in the hour's mean
    steady = inflow / passing
    before, ends = np.empty_like(flow), np.empty_like(flow)
    w, mean = start, start
    for h in range(len(flow)):
        if beside:
            steady[h] += density[h] * (links[h] @ mean) / passing[h]
        before[h] = w
        ends[h] = w + (steady[h] - w) * gone[h]
        held = np.minimum(np.maximum(ends[h], low[h]), high[h])
        if beside:
            mean = w + (steady[h] - w) * kept[h] + (held - ends[h]) / gone[h] * kept[h]
        w = held
    given = np.minimum(np.maximum(ends, low), high) - ends  # evenly over the hour
    means = before + (steady - before) * kept + given / gone * kept
    return means, given * mass * k / gone
