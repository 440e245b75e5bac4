"""Radiance's WEA weather files, read and written."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, write_bytes
from mitsuba_cfs.sky import weather_table
from mitsuba_cfs.sky.sun import direct_normal_from_global, sun_directions
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.sky.weather_table import (
    TYPICAL_LEAP_YEAR,
    TYPICAL_YEAR,
    FilePath,
    Location,
    check_length,
    checked_sun,
    location,
    number,
    read_lines,
)


def is_wea(path: str | PathLike[str]) -> bool:
    """Whether a file begins as a WEA does; `DataError` where it cannot be read."""
    try:
        with open(path, "rb") as file:
            return file.read(5).lower() == b"place"
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error


def read_wea(path: str | PathLike[str], *, whole_year: bool = True) -> Weather:
    """The weather of a Radiance WEA file: direct normal and diffuse horizontal irradiance.

    A line's time is the middle of its interval, as gendaymtx takes it.  Unit 1 is direct normal,
    unit 2 direct horizontal irradiance.  `whole_year=False` accepts any rising times.

    Raises: `DataError` that names the file, the line and the field.
    """
    site, unit, rows, first_line = wea_rows(path)
    times, step_h = wea_times(rows, path, first_line, whole_year)
    direct, diffuse = (
        weather_table.checked(path, first_line, name, rows[:, 3 + i], 0.0, 1500.0)
        for i, name in enumerate(("direct irradiance", "diffuse irradiance"))
    )
    weather = Weather(
        site=site.name,
        latitude_deg=site.latitude_deg,
        longitude_deg=site.longitude_deg,
        timezone_h=site.timezone_h,
        elevation_m=site.elevation_m,
        step_h=step_h,
        times=times,
        direct_normal=direct,
        diffuse_horizontal=diffuse,
        file=Path(path),
    )
    if unit == 1:
        return checked_sun(weather, path)
    weather = checked_sun(replace(weather, global_horizontal=direct + diffuse), path)
    sine = sun_directions(weather, model="radiance")[:, 2]
    normal = direct_normal_from_global(direct + diffuse, diffuse, sine)
    return replace(weather, direct_normal=normal)


def write_wea(weather: Weather, path: str | PathLike[str]) -> None:
    """Write a Radiance WEA file (unit 1): month, day, middle of the interval, DNI, DHI [W/m2]."""
    place = weather.site.replace(" ", "_").replace(",", "") or "unnamed"
    if "_" not in place:
        place += "_-"  # gendaymtx wants city_country
    head = (
        f"place {place}\nlatitude {weather.latitude_deg:.6f}\n"
        f"longitude {-weather.longitude_deg:.6f}\ntime_zone {-15 * weather.timezone_h:g}\n"
        f"site_elevation {weather.elevation_m:.1f}\nweather_data_file_units 1\n"
    )
    t = weather.midpoints
    hour = t.hour + t.minute / 60 + t.second / 3600
    lines = [
        f"{month} {day} {h:.4f} {direct:.6g} {diffuse:.6g}\n"
        for month, day, h, direct, diffuse in zip(
            t.month, t.day, hour, weather.direct_normal, weather.diffuse_horizontal, strict=True
        )
    ]
    write_bytes(path, (head + "".join(lines)).encode("ascii", "replace"))


WEA_HEADER = (
    "place",
    "latitude",
    "longitude",
    "time_zone",
    "site_elevation",
    "weather_data_file_units",
)


def wea_rows(path: FilePath) -> tuple[Location, int, NDArray[np.float64], int]:
    """Location, unit, rows [H, 5] of month, day, hour, direct, diffuse, and the first data line."""
    lines = read_lines(path)
    values = []
    for i, keyword in enumerate(WEA_HEADER):
        if i >= len(lines) or not lines[i].lower().startswith(keyword + " "):
            raise DataError(f"expected the header {keyword}", file=path, element=f"line {i + 1}")
        values.append(lines[i][len(keyword) :].strip())
    latitude, west, zone, elevation, unit = (
        number(text, path, i + 2, WEA_HEADER[i + 1]) for i, text in enumerate(values[1:])
    )
    if unit not in (1, 2):
        raise DataError(
            f"expected 1 (direct normal) or 2 (direct horizontal irradiance), got {unit:g}",
            file=path,
            element="line 6",
            field="weather_data_file_units",
        )
    first = len(WEA_HEADER) + 1
    rows = np.empty((len(lines) - len(WEA_HEADER), 5))
    for i, line in enumerate(lines[len(WEA_HEADER) :]):
        parts = line.split()
        if len(parts) < 5:
            raise DataError(
                f"expected month day hour direct diffuse, got {line!r}",
                file=path,
                element=f"line {first + i}",
            )
        names = ("month", "day", "hour", "direct irradiance", "diffuse irradiance")
        rows[i] = [number(parts[j], path, first + i, name) for j, name in enumerate(names)]
    site = location(path, values[0], (latitude, -west, -zone / 15, elevation))
    return site, int(unit), rows, first


def wea_times(
    rows: NDArray[np.float64], path: FilePath, first_line: int, whole_year: bool
) -> tuple[pd.DatetimeIndex, float]:
    """Interval ends [H] and the step [h] of WEA rows, whose own times are interval middles."""
    if len(rows) == 0:
        raise DataError("has no data rows", file=path)
    leap = bool(np.any((rows[:, 0] == 2) & (rows[:, 1] == 29)))
    year = TYPICAL_LEAP_YEAR if leap else TYPICAL_YEAR
    table = {"year": year, "month": rows[:, 0], "day": rows[:, 1]}
    days = pd.to_datetime(pd.DataFrame(table), errors="coerce")
    wrong = days.isna().to_numpy() | (rows[:, 2] < 0) | (rows[:, 2] > 24)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            "is not a date of month, day and hour", file=path, element=f"line {first_line + row}"
        )
    middle = pd.DatetimeIndex(days) + pd.to_timedelta(np.round(rows[:, 2] * 3600), unit="s")
    gaps = np.diff(middle) / np.timedelta64(1, "h")
    step = float(np.min(gaps)) if len(gaps) else 1.0
    wrong = (gaps <= 0) | (whole_year & (np.abs(gaps - step) > 0.01))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"hours are missing or out of order: {middle[row]} is followed by {middle[row + 1]}",
            file=path,
            element=f"line {first_line + row + 1}",
            field="time",
        )
    if whole_year:
        check_length(path, len(rows), round(1 / step), leap)
    return middle + pd.Timedelta(hours=step / 2), step
