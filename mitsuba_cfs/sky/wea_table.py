"""The text of WEA files as checked numbers: every fault names its line and field."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather_table import (
    TYPICAL_LEAP_YEAR,
    TYPICAL_YEAR,
    FilePath,
    Location,
    check_length,
    location,
    number,
    read_lines,
)

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
