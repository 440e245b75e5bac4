"""The air of a street in a city by that of a weather station in the country around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather, relative_humidity, standard_pressure

SKY_VIEW, VEGETATION = (0.2, 0.9), (0.0, 0.4)  # that the equation was tried on
NORTH_DEG, EAST_DEG = (45.0, 61.0), (-11.0, 16.0)  # about where its cities lie
CALM = 0.5  # [m/s] one knot: below it a station reports no wind, and the equation has no bound
FIRST_HOUR = 8  # o'clock, of the day that a maximum is of
GAS, HEAT = 287.058, 1007.0  # of dry air: gas constant, specific heat capacity [J/(kg K)]
SOURCE = "Theeuwes et al. 2017"


def maximum_heat_island(
    sky_view: float,
    vegetation: float,
    heating: ArrayLike,
    temperature_range: ArrayLike,
    wind: ArrayLike,
) -> NDArray[np.float64]:
    """Greatest excess of the air in a street over that in the country within a day [..] [K].

        (2 - SVF - f_veg) (S DTR^3 / U)^(1/4)

    Args:
        sky_view: sky view factor of the street.
        vegetation: share of green in the plan, within 500 m.
        heating: S, global irradiance, mean of 24 hours, over density and heat capacity of air
            [K m/s].
        temperature_range: DTR, greatest less least temperature in the country [K].
        wind: U, mean speed at 10 m in the country [m/s].

    Raises: `ValueError` out of the range that the equation was tried on, and without wind.
    Source: Theeuwes, Steeneveld, Ronda, Holtslag 2017, "A diagnostic equation for the daily maximum
    urban heat island effect for cities in northwestern Europe", Int. J. Climatology 37,
    doi 10.1002/joc.4717; the range from memory, as the paper was not available.
    """
    for name, value, (low, high) in (
        ("sky_view", sky_view, SKY_VIEW),
        ("vegetation", vegetation, VEGETATION),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name}: expected {low:g} to {high:g} ({SOURCE}), got {value:g}")
    wind = np.asarray(wind, dtype=float)
    if not (wind > 0).all():
        raise ValueError(f"wind: a day without any has no heat island by {SOURCE}")
    range_ = np.asarray(temperature_range, dtype=float)
    return (2 - sky_view - vegetation) * (np.asarray(heating) * range_**3 / wind) ** 0.25


def in_city(
    weather: Weather, sky_view: float, vegetation: float, hourly_shares: Sequence[float]
) -> Weather:
    """The same weather with the air of a street: warmer, the water in it as before.

    The excess of an hour is the maximum of its day, from 8 o'clock to 8 o'clock, times a share.
    Days of less wind than `CALM` count with it.

    Args:
        weather: hourly, of whole days.
        sky_view, vegetation: as of `maximum_heat_island`.
        hourly_shares: [24] share of the maximum in each hour of the clock, from midnight on; the
            equation has none.

    Raises: `ValueError` as `maximum_heat_island`, and for weather without global irradiance.
    """
    hours, sun = len(weather.times), weather.global_horizontal
    dry, dew, wind = weather.dry_bulb_c, weather.dew_point_c, weather.wind_speed
    shares = np.asarray(hourly_shares, dtype=float)
    if weather.step_h != 1.0 or hours % 24 or weather.times[0].hour != 1:
        raise ValueError("weather: expected whole days of hours")
    if sun is None or dry is None or dew is None or wind is None:
        raise ValueError("weather: expected global irradiance, temperature, dew point and wind")
    if shares.shape != (24,):
        raise ValueError(f"hourly_shares: expected 24, got {shares.size}")

    def days(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.roll(values, -FIRST_HOUR).reshape(-1, 24)

    pressure = np.full(hours, standard_pressure(weather.elevation_m))
    if weather.pressure_pa is not None:
        pressure = weather.pressure_pa
    density = pressure / (GAS * (dry + 273.15))
    maximum = maximum_heat_island(
        sky_view,
        vegetation,
        (sun / (density * HEAT)).reshape(-1, 24).mean(axis=1),
        np.ptp(days(dry), axis=1),
        np.maximum(days(wind).mean(axis=1), CALM),
    )
    excess = np.roll(np.repeat(maximum, 24), FIRST_HOUR) * np.tile(shares, hours // 24)
    warm = dry + excess
    return replace(
        weather,
        dry_bulb_c=warm,
        relative_humidity=relative_humidity(warm, dew),
        notes=(*weather.notes, *_notes(weather, maximum, excess)),
    )


def _notes(
    weather: Weather, maximum: NDArray[np.float64], excess: NDArray[np.float64]
) -> list[str]:
    notes: list[str] = [
        Note(
            "Weather {site}: air of an urban street, on average {mean:.1f} K and at most "
            "{most:.1f} K warmer than in the file (urban heat island by {source}, median of the "
            "daily maxima {median:.1f} K); sky, wind, ground and absolute humidity are those of "
            "the file.",
            site=weather.site,
            mean=float(excess.mean()),
            most=float(excess.max()),
            source=SOURCE,
            median=float(np.median(maximum)),
        )
    ]
    for value, (low, high) in (
        (weather.latitude_deg, NORTH_DEG),
        (weather.longitude_deg, EAST_DEG),
    ):
        if not low <= value <= high:
            notes.append(
                Note(
                    "Weather {site}: the heat island equation is for cities in north-western "
                    "Europe; this site is elsewhere.",
                    site=weather.site,
                )
            )
            break
    return notes
