"""The text of weather files as checked numbers: every fault names its line and field.

`checked_sun` compares the radiation with the stated location and clock.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
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
    _, index, count = np.unique(weather.midpoints.normalize().asi8, return_index=True, return_counts=True)
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


def noon_offset(latitude_deg: float, radiation: FloatArray, declination: FloatArray, hour: FloatArray) -> float:
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


FilePath = str | PathLike[str]

# Years that stand for a file whose months come from different years: 1 January is a Sunday, as
# nearly every EPW header says.
TYPICAL_YEAR, TYPICAL_LEAP_YEAR = 2017, 2012
WEEK = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
STEPS_PER_DAY = 24
LONGEST_GAP_H = 6  # of missing values that are interpolated

# EPW field: column, value that means "missing" (at or above it), least and greatest valid value.
# Source: EnergyPlus Auxiliary Programs, EPW data dictionary.  The irradiance bound is ours: more
# than the sun gives outside the atmosphere (1,413 W/m2) plus broken-cloud enhancement.
EPW_FIELDS: dict[str, tuple[int, float, float, float]] = {
    "dry bulb temperature": (6, 99.9, -90.0, 70.0),
    "dew point temperature": (7, 99.9, -90.0, 70.0),
    "relative humidity": (8, 999.0, 0.0, 110.0),
    "pressure": (9, 999999.0, 31000.0, 120000.0),
    "horizontal infrared irradiance": (12, 9999.0, 0.0, 1000.0),
    "global horizontal irradiance": (13, 9999.0, 0.0, 1800.0),
    "direct normal irradiance": (14, 9999.0, 0.0, 1500.0),
    "diffuse horizontal irradiance": (15, 9999.0, 0.0, 1500.0),
    "global horizontal illuminance": (16, 999900.0, 0.0, 250000.0),
    "direct normal illuminance": (17, 999900.0, 0.0, 250000.0),
    "diffuse horizontal illuminance": (18, 999900.0, 0.0, 250000.0),
    "wind direction": (20, 999.0, 0.0, 360.0),
    "wind speed": (21, 999.0, 0.0, 80.0),
    "total sky cover": (22, 99.0, 0.0, 10.0),
    "opaque sky cover": (23, 99.0, 0.0, 10.0),
    "snow depth": (30, 999.0, 0.0, 998.0),
    "albedo": (32, 999.0, 0.01, 1.0),
    "liquid precipitation depth": (33, 999.0, 0.0, 400.0),
}
EPW_HEADER = (
    "LOCATION",
    "DESIGN CONDITIONS",
    "TYPICAL/EXTREME PERIODS",
    "GROUND TEMPERATURES",
    "HOLIDAYS/DAYLIGHT SAVING",  # SAVINGS in most files, not in those of PVGIS
    "COMMENTS 1",
    "COMMENTS 2",
    "DATA PERIODS",
)


@dataclass(frozen=True, slots=True)
class Location:
    """Where a weather file is for."""

    name: str
    latitude_deg: float
    longitude_deg: float
    timezone_h: float
    elevation_m: float

    @property
    def values(self) -> tuple[str, float, float, float, float]:
        """The first fields of `Weather`."""
        return self.name, self.latitude_deg, self.longitude_deg, self.timezone_h, self.elevation_m


def read_lines(path: FilePath) -> list[str]:
    """The file's lines; `DataError` where it cannot be read or is empty."""
    try:
        text = Path(path).read_text(encoding="latin-1")  # city names in any encoding pass
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    lines = text.removeprefix("ï»¿").rstrip().splitlines()  # the prefix: a UTF-8 byte order mark
    if not lines:
        raise DataError("the file is empty", file=path)
    return lines


def number(text: str, path: FilePath, line: int, field: str) -> float:
    """One finite number; `DataError` where the text is none."""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise DataError(f"expected a number, got {text!r}", file=path, element=f"line {line}", field=field)
    return value


def checked(
    path: FilePath, first_line: int, field: str, values: NDArray[np.float64], low: float, high: float
) -> NDArray[np.float64]:
    """`values` if each is NaN or within its bounds; else `DataError` with the first that is not."""
    wrong = (values < low) | (values > high)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"expected {low:g} to {high:g}, got {values[row]:g}",
            file=path,
            element=f"line {first_line + row}",
            field=field,
        )
    return values


def location(path: FilePath, name: str, numbers: tuple[float, float, float, float]) -> Location:
    """A checked location from latitude, longitude, time zone [h] and elevation [m]."""
    bounds = (("latitude", 90.0), ("longitude", 180.0), ("time zone", 14.0), ("elevation", 9000.0))
    for (field, bound), value in zip(bounds, numbers, strict=True):
        if abs(value) > bound:
            raise DataError(f"expected -{bound:g} to {bound:g}, got {value:g}", file=path, field=field)
    return Location(name, *numbers)


def epw_lines(path: FilePath) -> tuple[list[str], list[str]]:
    """The eight header lines and the data lines of an EPW file."""
    lines = read_lines(path)
    if not lines[0].upper().startswith("LOCATION,"):
        raise DataError("is not an EPW file: expected a first line LOCATION,...", file=path)
    for i, keyword in enumerate(EPW_HEADER):
        if i >= len(lines) or not lines[i].upper().startswith(keyword):
            raise DataError(f"expected the header {keyword}", file=path, element=f"line {i + 1}")
    return lines[: len(EPW_HEADER)], lines[len(EPW_HEADER) :]


def epw_location(head: list[str], path: FilePath) -> Location:
    """The site of the LOCATION line."""
    parts = [part.strip() for part in head[0].split(",")]
    if len(parts) < 10:
        raise DataError(f"expected 10 fields, got {len(parts)}", file=path, element="line 1", field="LOCATION")
    names = ("latitude", "longitude", "time zone", "elevation")
    latitude, longitude, zone, elevation = (number(parts[6 + i], path, 1, name) for i, name in enumerate(names))
    name = ", ".join(part for part in (parts[1], parts[3]) if part not in ("", "-"))
    return location(path, name, (latitude, longitude, zone, elevation))


def epw_source(head: list[str]) -> str:
    """Where the values come from: the LOCATION line's source and the comments."""
    parts = [part.strip() for part in head[0].split(",")]
    return "; ".join(text for text in (parts[4], *(line.partition(",")[2].strip() for line in head[5:7])) if text)


def epw_first_weekday(head: list[str]) -> int | None:
    """Weekday of the first data row, Monday 0; None if the header does not state it."""
    parts = [part.strip().casefold() for part in head[7].split(",")]
    return WEEK.index(parts[4]) if len(parts) > 4 and parts[4] in WEEK else None


def epw_ground(head: list[str], path: FilePath) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Depths [G] [m] and monthly temperatures [G, 12] [deg C] of the ground; None if not given."""
    parts = [part.strip() for part in head[3].split(",")][1:]
    count = int(number(parts[0], path, 4, "GROUND TEMPERATURES")) if parts and parts[0] else 0
    if count <= 0:
        return None, None
    if len(parts) < 1 + 16 * count:
        raise DataError(
            f"expected {16 * count} fields for {count} depths, got {len(parts) - 1}",
            file=path,
            element="line 4",
            field="GROUND TEMPERATURES",
        )
    depths, months = [], []
    for i in range(count):
        block = parts[1 + 16 * i : 17 + 16 * i]
        depths.append(number(block[0], path, 4, "ground depth"))
        months.append([number(text, path, 4, "ground temperature") for text in block[4:]])
    return np.array(depths), np.array(months)


def interpolated(values: NDArray[np.float64], longest: int) -> NDArray[np.float64]:
    """Values [H] whose gaps (NaN) of at most `longest` are interpolated; others, and ends, stay."""
    missing = np.isnan(values)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], missing, [0]])))
    for start, end in edges.reshape(-1, 2):
        if end - start <= longest and start > 0 and end < len(values):
            missing[start:end] = False
    rows, known = np.arange(len(values)), ~np.isnan(values)
    if not known.any():
        return values
    return np.where(missing, np.nan, np.interp(rows, rows[known], values[known]))


class EpwColumns:
    """The data lines of an EPW file, read column by column."""

    def __init__(self, path: FilePath, header_lines: int, lines: list[str]) -> None:
        self.path, self.first_line = path, header_lines + 1
        self.gaps: dict[str, NDArray[np.int64]] = {}  # rows of fields that were interpolated
        self.rows = [line.split(",") for line in lines]
        for i, row in enumerate(self.rows):
            if len(row) < 24:
                raise DataError(
                    f"expected at least 24 fields, got {len(row)}", file=path, element=f"line {self.first_line + i}"
                )

    def error(self, field: str, row: int, message: str) -> DataError:
        """Error for one field of one row, with its date."""
        month, day, hour = (part.strip() for part in self.rows[row][1:4])
        return DataError(
            f"{message} (month {month}, day {day}, hour {hour})",
            file=self.path,
            element=f"line {self.first_line + row}",
            field=field,
        )

    def _numbers(self, column: int, field: str, rows: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        rows = np.arange(len(self.rows)) if rows is None else rows
        texts = [self.rows[row][column] for row in rows]
        try:
            values = np.array(texts, dtype=float)
        except ValueError:
            values = np.array([_number_or_nan(text) for text in texts])
        if not np.isfinite(values).all():
            first = int(np.argmin(np.isfinite(values)))
            raise self.error(field, rows[first], f"expected a number, got {texts[first]!r}")
        return values

    def _values(self, field: str) -> NDArray[np.float64]:
        column, missing, _, _ = EPW_FIELDS[field]
        blank = np.array([not row[column].strip() for row in self.rows], dtype=bool)
        values = np.full(len(self.rows), np.nan)
        values[~blank] = self._numbers(column, field, np.flatnonzero(~blank))
        return np.where(values >= missing, np.nan, values)

    def optional(self, field: str) -> NDArray[np.float64]:
        """The field's values [H], NaN where the file marks them missing."""
        _, _, low, high = EPW_FIELDS[field]
        return checked(self.path, self.first_line, field, self._values(field), low, high)

    def plausible(self, field: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """The field's values [H], NaN where missing or out of bounds, and where they are so."""
        _, _, low, high = EPW_FIELDS[field]
        values = self._values(field)
        wrong = (values < low) | (values > high)
        return np.where(wrong, np.nan, values), wrong

    def unchecked(self, field: str) -> NDArray[np.float64] | None:
        """The field's values [H], NaN where missing or impossible; None where the file has none."""
        column, missing, low, high = EPW_FIELDS[field]
        texts = [row[column] if column < len(row) else "" for row in self.rows]
        values = np.array([_number_or_nan(text) for text in texts])
        wrong = ~(values >= low) | (values > high) | (values >= missing)
        return None if wrong.all() else np.where(wrong, np.nan, values)

    def required(self, field: str) -> NDArray[np.float64]:
        """The field's values [H], gaps of a few hours filled; `DataError` for a longer one."""
        return self.filled(field, self.optional(field))

    def filled(self, field: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """The values [H] with gaps (NaN) of a few hours interpolated linearly, which `gaps` names.

        Raises: `DataError` for a gap of more than `LONGEST_GAP_H`, and at both ends of the file.
        """
        missing = np.isnan(values)
        if not missing.any():
            return values
        steps = max(1, len(values) // (STEPS_PER_DAY * 365))  # in an hour
        result = interpolated(values, LONGEST_GAP_H * steps)
        if np.isnan(result).any():
            start = int(np.argmax(np.isnan(result)))
            length = int(np.argmin(np.append(missing[start:], False)))
            text = self.rows[start][EPW_FIELDS[field][0]]
            most = f"between others up to {LONGEST_GAP_H} hours are filled"
            message = f"missing (the file has {text}; {length / steps:g} hours; {most})"
            raise self.error(field, start, message)
        self.gaps[field] = np.flatnonzero(missing)
        return result

    def whole(self, field: str) -> NDArray[np.float64] | None:
        """The field's values [H], or None where any is missing."""
        values = self.optional(field)
        return None if np.isnan(values).any() else values

    def times(self) -> tuple[pd.DatetimeIndex, float]:
        """Interval ends [H] and the step [h]; `DataError` where an hour is missing or misplaced."""
        count = len(self.rows)
        dates = np.stack([self._numbers(i, name) for i, name in enumerate(("year", "month", "day", "hour"))])
        years = np.unique(dates[0]).astype(int)
        leap = bool(np.any((dates[1] == 2) & (dates[2] == 29)))
        year = year_of(years, leap)
        steps, rest = divmod(count, STEPS_PER_DAY * (366 if leap else 365))
        if rest or not steps or 60 % steps:
            steps = max(1, steps)  # the first row out of order then says where rows are missing
        ends = pd.date_range(f"{year}-01-01", periods=count + 1, freq=f"{3600 // steps}s")[1:]
        expected = ends - pd.Timedelta(seconds=1)  # hour 24 ends on the next day
        wanted = np.stack([expected.month, expected.day, expected.hour + 1])
        wrong = np.any(dates[1:] != wanted, axis=0)
        if wrong.any():
            row = int(np.argmax(wrong))
            month, day, hour = wanted[:, row]
            raise self.error(
                "time", row, f"hours missing or out of order: expected month {month}, day {day}, hour {hour}"
            )
        check_length(self.path, count, steps, leap)
        return ends, 1.0 / steps


def _number_or_nan(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def year_of(years: NDArray[np.int64], leap: bool) -> int:
    """The file's own year if it has one that fits its days, else a typical year."""
    if len(years) == 1 and 1900 <= years[0] <= 2100:
        year = int(years[0])
        if leap == bool(pd.Timestamp(year, 1, 1).is_leap_year):
            return year
    return TYPICAL_LEAP_YEAR if leap else TYPICAL_YEAR


def check_length(path: FilePath, count: int, steps_per_hour: int, leap: bool) -> None:
    """`DataError` where the rows are not a whole year of equal steps."""
    days = 366 if leap else 365
    if count != STEPS_PER_DAY * steps_per_hour * days:
        raise DataError(
            f"expected 8760 or 8784 hours, or a whole number of steps in each, got {count} rows",
            file=path,
            field="length",
        )
