"""Consistency of a weather file's radiation with its stated location and clock."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.sun import SOLAR_CONSTANT, declination_and_time
from mitsuba_cfs.sky.weather import Weather

FloatArray = NDArray[np.float64]

Days = tuple[FloatArray, FloatArray, FloatArray]  # radiation, declination, solar hour
CLEAR_SHARE = 0.3  # of the days, the clearest: their radiation lies evenly about noon
NOTED_H = 0.4  # offset of its centre from noon; 27 sound files have 0.13 at most
REFUSED_H = 1.5
FEW_DAYS, MANY_DAYS = 5, 30  # with light: too few for any judgement, enough for a note
FAR_ZONE_H = 3.5  # of a zone from its longitude: more than in any country (west China: 3.1)
SAME_H = 0.17  # that the offset of a zone or a longitude may differ by and still explain it
LEAST_SLOPE, MOST_SLOPE = 0.6, 1.6  # of the days' length; 27 sound files have 0.89 to 1.19
JUDGED_LATITUDE_DEG = 15.0  # nearer the equator days differ too little
LEAST_CLEARNESS, MOST_CLEARNESS = 0.02, 1.3  # of the 1 % clearest hours; sound: 0.70 to 0.91


def checked_sun(weather: Weather, file: str | PathLike[str]) -> Weather:
    """Weather with a note for each statement that its own radiation contradicts.

    A wrong time zone, a wrong sign of the longitude or the latitude, another unit of the radiation
    leave the numbers valid but move the sun.  They show in the radiation itself: by the hour about
    which days are centred, by the seasonal variation of the day length, and by the share of the
    extraterrestrial radiation.

    Raises: `DataError` where the sun would be more than 1.5 h off, the seasons are the other
        hemisphere's, or the radiation is at most 1/50 of that of clear hours.
    """
    days = whole_days(weather)
    if days is None:
        return weather
    notes = [*_clock(weather, days, file), *_seasons(weather, days, file)]
    notes += _amount(weather, days, file)
    return replace(weather, notes=(*weather.notes, *notes))


def whole_days(weather: Weather) -> Days | None:
    """Radiation, declination and solar hour [days, steps] of complete days; None if too few.

    Complete days cover midnight to midnight and have light.
    The radiation is the global horizontal, or where there is none the direct normal and diffuse
    together: the sun position must not enter it.
    """
    steps = weather.per_day
    _, index, count = np.unique(
        weather.midpoints.normalize().asi8, return_index=True, return_counts=True
    )
    rows = index[count == steps][:, None] + np.arange(steps)
    radiation = weather.global_horizontal
    if radiation is None:
        radiation = weather.direct_normal + weather.diffuse_horizontal
    declination, time = declination_and_time(weather)
    rows = rows[radiation[rows].sum(axis=1) > 0] if len(rows) else rows
    if len(rows) < FEW_DAYS:
        return None
    return radiation[rows], declination[rows], time[rows] - 12.0


def _clock(weather: Weather, days: Days, file: str | PathLike[str]) -> list[str]:
    """Error of zone or longitude from the hour about which clear days are symmetric."""
    late = noon_offset(weather.latitude_deg, *days)
    if abs(late) < NOTED_H or (abs(late) < REFUSED_H and len(days[0]) < MANY_DAYS):
        return _far_zone(weather)
    when = "before" if late < 0 else "after"
    what = (
        f"on clear days the radiation is centred {abs(late):.1f} h {when} the solar noon of "
        f"longitude {weather.longitude_deg:g} and time zone {weather.timezone_h:g}"
    )
    fits = [f"{name} {value:g}" for name, value in _fitting(weather, late).items()]
    if abs(late) >= REFUSED_H:
        text = f": {' or '.join(fits)} would fit" if fits else ""
        field = fits[0].rpartition(" ")[0] if len(fits) == 1 else "time zone"
        raise DataError(what + text, file=file, field=field)
    values = {
        "site": weather.site,
        "hours": abs(late),
        "longitude": weather.longitude_deg,
        "zone": weather.timezone_h,
        "fits": ", ".join(fits) or "-",
    }
    note = (
        Note(
            "Weather {site}: on clear days the radiation is centred {hours:.1f} h before the solar "
            "noon of longitude {longitude:g} and time zone {zone:g}; values that fit: {fits}; or "
            "the hours are labelled differently.",
            **values,
        )
        if late < 0
        else Note(
            "Weather {site}: on clear days the radiation is centred {hours:.1f} h after the solar "
            "noon of longitude {longitude:g} and time zone {zone:g}; values that fit: {fits}; or "
            "the hours are labelled differently.",
            **values,
        )
    )
    return [note]


def _fitting(weather: Weather, late: float) -> dict[str, float]:
    """Time zone, and longitude with the other sign, that agree with the noon of the radiation."""
    fitting = {}
    zone = round(2 * late) / 2
    if abs(late - zone) < SAME_H:
        fitting["time zone"] = _wrapped(weather.timezone_h + zone)
    if abs(_wrapped(late - 2 * weather.longitude_deg / 15)) < SAME_H:
        fitting["longitude"] = -weather.longitude_deg
    return fitting


def noon_offset(
    latitude_deg: float, radiation: FloatArray, declination: FloatArray, hour: FloatArray
) -> float:
    """Median solar hour [h] about which the radiation of the clearest days is centred, 0 at noon.

    Args: radiation, declination [rad], hour: solar, 0 at noon [h]; [days, steps] each.
    """
    above = np.maximum(height_of_sun(latitude_deg, declination, hour), 0.0).sum(axis=1)
    total = radiation.sum(axis=1)
    lit = total > 0.05 * total.max()
    clearness = total / np.maximum(above, 1e-3 * above.max())
    clear = lit & (clearness >= np.quantile(clearness[lit], 1 - CLEAR_SHARE))
    centre = np.angle((radiation * np.exp(1j * np.pi / 12 * hour)).sum(axis=1)) * 12 / np.pi
    middle = np.angle(np.exp(1j * np.pi / 12 * centre[clear]).mean())  # a median across midnight
    apart = np.array([_wrapped(value) for value in centre[clear] - middle * 12 / np.pi])
    return _wrapped(middle * 12 / np.pi + float(np.median(apart)))


def height_of_sun(latitude_deg: float, declination: FloatArray, hour: FloatArray) -> FloatArray:
    """Sine of the sun's altitude."""
    latitude = np.radians(latitude_deg)
    across = np.cos(latitude) * np.cos(declination) * np.cos(np.pi / 12 * hour)
    return np.sin(latitude) * np.sin(declination) + across


def _far_zone(weather: Weather) -> list[str]:
    """Note on a time zone far from its longitude although the radiation agrees with both."""
    apart = _wrapped(weather.timezone_h - weather.longitude_deg / 15)
    if abs(apart) <= FAR_ZONE_H:
        return []
    note = Note(
        "Weather {site}: time zone {zone:g} differs by {hours:.1f} h from longitude {longitude:g}, "
        "although the radiation agrees with both.",
        site=weather.site,
        zone=weather.timezone_h,
        hours=abs(apart),
        longitude=weather.longitude_deg,
    )
    return [note]


def _seasons(weather: Weather, days: Days, file: str | PathLike[str]) -> list[str]:
    """Error of the latitude from the seasonal variation of the day length."""
    radiation, declination, _ = days
    if len(radiation) < 300 or abs(weather.latitude_deg) < JUDGED_LATITUDE_DEG:
        return []
    lit = (radiation > 0.002 * radiation.max()).sum(axis=1) * weather.step_h
    tangent = np.tan(np.radians(np.clip(weather.latitude_deg, -89.0, 89.0)))
    cosine = np.clip(-tangent * np.tan(declination.mean(axis=1)), -1, 1)
    expected = 24 / np.pi * np.arccos(cosine)
    slope = float(np.cov(lit, expected)[0, 1] / expected.var())
    if slope < -LEAST_SLOPE:
        what = f"the longest days are in the other hemisphere's summer: {-weather.latitude_deg:g} "
        raise DataError(what + "would fit (its sign?)", file=file, field="latitude")
    if LEAST_SLOPE <= slope <= MOST_SLOPE:
        return []
    note = Note(
        "Weather {site}: from winter to summer the length of the days changes {slope:.1f} times as "
        "much as at latitude {latitude:g}.",
        site=weather.site,
        slope=slope,
        latitude=weather.latitude_deg,
    )
    return [note]


def _amount(weather: Weather, days: Days, file: str | PathLike[str]) -> list[str]:
    """Error of the unit of the radiation from its share of the extraterrestrial radiation."""
    if weather.global_horizontal is None or len(days[0]) < MANY_DAYS:
        return []
    radiation, declination, hour = days
    height = height_of_sun(weather.latitude_deg, declination, hour)
    high = height > 0.3
    if not high.any():
        return []
    clearness = float(np.quantile(radiation[high] / (SOLAR_CONSTANT * height[high]), 0.99))
    what = (
        f"in the clearest hours {100 * clearness:.2g} % of what the sun gives outside the "
        f"atmosphere arrives; the unit is W/m2"
    )
    if clearness < LEAST_CLEARNESS:
        raise DataError(what, file=file, field="global horizontal irradiance")
    note = Note(
        "Weather {site}: in the clearest hours {percent:.2g} % of the extraterrestrial radiation "
        "arrives; the unit must be W/m2.",
        site=weather.site,
        percent=100 * clearness,
    )
    return [note] if clearness > MOST_CLEARNESS else []


def _wrapped(hours: float) -> float:
    """The same hour of a day within -12 to 12."""
    return float((hours + 12) % 24 - 12)
