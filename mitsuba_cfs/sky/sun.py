"""Sun position in the middle of each interval; world frame x east, y north, z up."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.options import LEAST_ALTITUDE_DEG, SUN_MODELS
from mitsuba_cfs.sky.weather import Weather, standard_pressure

SUN_ANGLE_DEG = 0.533  # full angle of the disc that Radiance uses
SUN_RADIUS = np.radians(SUN_ANGLE_DEG / 2)  # [rad]
SUN_SOLID_ANGLE = 2 * np.pi * (1 - np.cos(SUN_RADIUS))  # [sr]
SOLAR_CONSTANT = 1361.0  # [W/m2]


def sun_directions(weather: Weather, *, model: str = "spa") -> NDArray[np.float64]:
    """Unit vectors [H, 3] towards the sun in the middle of each interval.

    `spa` (the default): NREL's Solar Position Algorithm, uncertainty 0.0003 deg, with
    atmospheric refraction.  `radiance`: the formula of gensky and gendaymtx, 0.45 deg off on
    average and 1.5 deg at worst, for agreement with them.  `energyplus`: its fit by the number of
    the day, 1.5 days late (the declination is off by 0.59 deg at the equinoxes), no refraction.

    Source: Reda and Andreas 2004, Solar Energy 76:577 (pvlib's implementation); Radiance `sun.c`;
    EnergyPlus, Engineering Reference, "Climate Calculations".
    """
    if model not in SUN_MODELS:
        raise ValueError(f"sun model: expected one of {SUN_MODELS}, got {model!r}")
    if model == "spa":
        directions = _spa_directions(weather, weather.midpoints)
    else:
        directions = _by_declination(
            weather, *(_energyplus_day if model == "energyplus" else declination_and_time)(weather)
        )
    return rotated(directions, weather.turned_deg) if weather.turned_deg else directions


def day_of_sun(weather: Weather, day: pd.Timestamp) -> NDArray[np.float64]:
    """Unit vectors [1441, 3] towards the sun at each minute of a day, from midnight to midnight.

    Local standard time at the weather's place; by the Solar Position Algorithm, as above.
    """
    return sun_at(weather, pd.date_range(day, periods=24 * 60 + 1, freq="min"))


def sun_at(weather: Weather, times: pd.DatetimeIndex) -> NDArray[np.float64]:
    """Unit vectors [N, 3] towards the sun at moments in local standard time, by the Solar Position Algorithm."""
    directions = _spa_directions(weather, times)
    return rotated(directions, weather.turned_deg) if weather.turned_deg else directions


def _spa_directions(weather: Weather, times: pd.DatetimeIndex) -> NDArray[np.float64]:
    from pvlib import solarposition

    utc = times - pd.Timedelta(hours=weather.timezone_h)
    pressure, temperature = weather.pressure_pa, weather.dry_bulb_c
    standard = standard_pressure(weather.elevation_m)
    table = solarposition.spa_python(
        utc.tz_localize("UTC"),
        weather.latitude_deg,
        weather.longitude_deg,
        altitude=weather.elevation_m,
        pressure=standard if pressure is None else float(np.mean(pressure)),
        temperature=12.0 if temperature is None else float(np.mean(temperature)),
    )
    angles = np.radians(table[["apparent_elevation", "azimuth"]].to_numpy())
    return direction(angles[:, 0], angles[:, 1])


def declination_and_time(weather: Weather) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Declination [rad] and solar time [h], 12 at noon, of each interval's middle [H].

    Source: Radiance `sun.c`.
    """
    t = weather.midpoints
    day = t.day_of_year.to_numpy().astype(float)
    hour = (t.hour + t.minute / 60 + t.second / 3600).to_numpy()
    declination = 0.4093 * np.sin(2 * np.pi / 365 * (day - 81))
    equation_of_time = 0.170 * np.sin(4 * np.pi / 373 * (day - 80)) - 0.129 * np.sin(2 * np.pi / 355 * (day - 8))
    return declination, hour + equation_of_time + weather.longitude_deg / 15 - weather.timezone_h


# of sin(declination), and of the equation of time [h], by the day's angle: mean, then sine and cosine
ENERGYPLUS_DECLINATION = (
    (5.618e-3, 0.0),
    (0.0657911, -0.392779),
    (6.444e-4, -6.18495e-3),
    (-1.0101e-4, -7.951e-5),
    (-1.1691e-4, 2.096e-5),
)
ENERGYPLUS_TIME = (
    (2.1971e-4, 0.0),
    (-0.122649, 7.62856e-3),
    (-0.156308, -0.0530028),
    (-3.88702e-3, -1.23978e-3),
    (-2.70502e-3, -1.67992e-3),
)


def _energyplus_day(weather: Weather) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """As `declination_and_time`, one value of each for a whole day."""
    t = weather.midpoints
    day = 2 * np.pi / 366 * t.day_of_year.to_numpy()

    def fit(terms: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
        waves = [a * np.sin(k * day) + b * np.cos(k * day) for k, (a, b) in enumerate(terms[1:], 1)]
        return terms[0][0] + np.sum(waves, axis=0)

    hour = (t.hour + t.minute / 60 + t.second / 3600).to_numpy()
    time = hour + fit(ENERGYPLUS_TIME) + weather.longitude_deg / 15 - weather.timezone_h
    return np.arcsin(fit(ENERGYPLUS_DECLINATION)), time


def _by_declination(
    weather: Weather, declination: NDArray[np.float64], solar_time: NDArray[np.float64]
) -> NDArray[np.float64]:
    angle = solar_time * np.pi / 12  # 0 at midnight
    latitude = np.radians(weather.latitude_deg)
    sin_l, cos_l = np.sin(latitude), np.cos(latitude)
    sin_d, cos_d = np.sin(declination), np.cos(declination)
    east = cos_d * np.sin(angle)
    north = cos_l * sin_d + sin_l * cos_d * np.cos(angle)
    up = sin_l * sin_d - cos_l * cos_d * np.cos(angle)
    return np.stack([east, north, up], axis=-1)


def rotated(directions: ArrayLike, angle_deg: float) -> NDArray[np.float64]:
    """Directions [..., 3] turned counter-clockwise seen from above, as `gendaymtx -r` does."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.asarray(directions, dtype=float) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])


def direction(altitude: ArrayLike, azimuth: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors [..., 3] from altitude and azimuth (clockwise from north) [rad]."""
    altitude, azimuth = np.asarray(altitude, dtype=float), np.asarray(azimuth, dtype=float)
    level = np.cos(altitude)
    return np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(altitude)], axis=-1)


def altitude(directions: ArrayLike) -> NDArray[np.float64]:
    """Altitude [...] [rad] of unit vectors [..., 3]."""
    return np.arcsin(np.clip(np.asarray(directions, dtype=float)[..., 2], -1.0, 1.0))


def azimuth(directions: ArrayLike) -> NDArray[np.float64]:
    """Azimuth [...] [rad, 0..2 pi), clockwise from north, of vectors [..., 3]."""
    d = np.asarray(directions, dtype=float)
    return np.mod(np.arctan2(d[..., 0], d[..., 1]), 2 * np.pi)


def is_up(directions: ArrayLike) -> NDArray[np.bool_]:
    """Whether any of the sun's disc is above the horizon [...], as gendaymtx decides it."""
    return altitude(directions) > -SUN_RADIUS


def direct_normal_from_global(
    global_horizontal: ArrayLike,
    diffuse_horizontal: ArrayLike,
    sine_of_altitude: ArrayLike,
    *,
    least_altitude_deg: float = LEAST_ALTITUDE_DEG,
) -> NDArray[np.float64]:
    """Direct normal irradiance [H] [W/m2]: (global - diffuse)/sin(altitude), 0 at low sun.

    Below `least_altitude_deg` the quotient of two small measured numbers is noise, so the beam is
    taken as 0; a diffuse reading above the global one gives 0 too.  Limited to the radiation
    outside the atmosphere.
    """
    beam = np.asarray(global_horizontal, dtype=float) - np.asarray(diffuse_horizontal, dtype=float)
    sine = np.asarray(sine_of_altitude, dtype=float)
    usable = sine > np.sin(np.radians(least_altitude_deg))
    normal = np.where(usable, beam / np.where(usable, sine, 1.0), 0.0)
    return np.clip(normal, 0.0, SOLAR_CONSTANT * 1.035)  # at perihelion
