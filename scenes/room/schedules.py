"""Schedules of an operation file: weekdays, weekends, holidays and seasons as values by hour."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, GetCoreSchemaHandler, PrivateAttr, model_validator
from pydantic_core import CoreSchema, core_schema

from bim.use import KINDS, YearSchedule, day_of_year
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.sky.weather import Weather
from scenes.plausible import Limits
from scenes.toml_file import TomlTable

FloatArray = NDArray[np.float64]
CLOCK = 24  # hours of a day
WEEK = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
SATURDAY, SUNDAY = 5, 6


def _clock(hours: tuple[int, int]) -> tuple[int, int]:
    """Two clock times for `working_hours`; 22 to 6 is the night."""
    start, end = hours
    if not (0 <= start < CLOCK and 0 <= end <= CLOCK and start != end):
        raise ValueError(f"expected two different hours, from 0 to 23 and to 0 to 24, got {list(hours)}")
    return hours


Hours = Annotated[tuple[int, int], AfterValidator(_clock)]


def _date(text: str) -> str:
    """A day of the year, MM-DD."""
    try:
        return datetime.strptime(f"2024-{text}", "%Y-%m-%d").strftime("%m-%d")  # a leap year
    except ValueError:
        raise ValueError(f"expected a day as MM-DD, got {text!r}") from None


Date = Annotated[str, AfterValidator(_date)]


class RangeTable(TomlTable):
    """A value between two clock times of a day; 22 to 6 is its first and its last hours."""

    hours: Hours
    value: float


def _profile(value: Any) -> Any:
    """A number, 24 numbers, or ranges: all as ranges."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return ({"hours": (0, CLOCK), "value": value},)
    if not isinstance(value, list | tuple) or any(not isinstance(v, dict | RangeTable | int | float) for v in value):
        raise ValueError(f"expected a number, 24 of them, or ranges of hours, got {value!r}")
    if any(isinstance(v, dict | RangeTable) for v in value):
        return value
    if len(value) != CLOCK:
        raise ValueError(f"expected {CLOCK} values, one an hour, got {len(value)}")
    return tuple({"hours": (hour, hour + 1), "value": v} for hour, v in enumerate(value))


Profile = Annotated[tuple[RangeTable, ...], BeforeValidator(_profile)]


class DaysTable(TomlTable):
    """Profiles of the days of a week; the default of a day is `weekend`, then `weekday`."""

    weekday: Profile | None = None
    weekend: Profile | None = None
    saturday: Profile | None = None
    sunday: Profile | None = None
    holiday: Profile | None = None  # without: as Sunday

    def day(self, kind: str) -> tuple[RangeTable, ...]:
        """The profile of a "weekday", "saturday", "sunday" or "holiday"."""
        names = {"holiday": ("holiday", "sunday", "weekend", "weekday")}.get(
            kind, (kind, "weekend", "weekday") if kind != "weekday" else (kind,)
        )
        return next(p for name in names if (p := getattr(self, name)) is not None)


class SeasonTable(DaysTable):
    """Profiles between two dates, both included; from 10-01 to 03-31 is the winter."""

    dates: tuple[Date, Date]


class ScheduleTable(DaysTable):
    """A value for every hour of the year: by days and seasons, or a column of a file."""

    otherwise: float = 0.0  # in hours that no range names: the set-back
    peak: float = 1.0  # multiplies all values
    holidays: tuple[Date, ...] | None = None  # in place of the calendar's
    season: tuple[SeasonTable, ...] = ()  # the first that applies replaces the days above
    csv: Path | None = None  # one row per hour, with a header
    column: str = ""
    _year: YearSchedule | None = PrivateAttr(None)  # of a building's file, in place of the profiles

    @model_validator(mode="after")
    def _has_its_days(self) -> ScheduleTable:
        if (self.csv is None) == (self.weekday is None):
            raise ValueError("give either `weekday` or `csv` with its `column`")
        if any(season.weekday is None for season in self.season):
            raise ValueError("season: a season needs its own `weekday`")
        return self

    @classmethod
    def from_file(cls, year: YearSchedule, peak: float = 1.0) -> ScheduleTable:
        """The table of a schedule in a building's file."""
        table = cls(weekday=0.0, peak=peak)
        table._year = year
        return table

    @property
    def stated(self) -> tuple[float, ...]:
        """Every value in the table itself."""
        if self._year is not None:
            return tuple(float(value) for value in np.unique(self.peak * self._year.values))
        days = (self, *self.season)
        profiles = (getattr(day, key) for day in days for key in DaysTable.model_fields)
        values = [one.value for profile in profiles if profile is not None for one in profile]
        return tuple(self.peak * value for value in (self.otherwise, *values))

    @property
    def by_weekday(self) -> bool:
        """Whether values depend on the day of the week."""
        if self._year is not None:
            return bool(np.ptp(self._year.values[:, : len(WEEK)], axis=1).any())
        parts = (self, *self.season)
        return any(day is not None for part in parts for day in (part.weekend, part.saturday, part.sunday))

    def hourly(self, weather: Weather, holidays: tuple[str, ...]) -> FloatArray:
        """The values [H]; `holidays`: MM-DD, for a schedule without its own."""
        if self.csv is not None:
            return self.peak * _column(self.csv, self.column, len(weather.times))
        days = weather.midpoints
        date = 100 * days.month.to_numpy() + days.day.to_numpy()
        named = holidays if self.holidays is None else self.holidays
        free = np.isin(date, [_number(day) for day in named])
        kinds = np.where(weather.weekday == SATURDAY, "saturday", "weekday")
        kinds = np.where(weather.weekday == SUNDAY, "sunday", kinds)
        kinds = np.where(free, "holiday", kinds)
        if self._year is not None:
            return self.peak * self._of_year(days, weather.weekday, free)
        values, open_ = np.full(len(date), self.otherwise), np.ones(len(date), dtype=bool)
        for part in (*self.season, self):
            inside = open_.copy()
            if isinstance(part, SeasonTable):
                start, end = map(_number, part.dates)
                after, before = date >= start, date <= end
                inside &= after & before if start <= end else after | before
            open_ &= ~inside
            for kind in np.unique(kinds[inside]):
                for one in part.day(kind):
                    values[inside & (kinds == kind) & working_hours(weather, *one.hours)] = one.value
        return self.peak * values

    def _of_year(self, days: pd.DatetimeIndex, weekday: NDArray[np.int64], free: NDArray[np.bool_]) -> FloatArray:
        """Values [H] of the building file's schedule on the days of a weather."""
        date = 100 * days.month.to_numpy() + days.day.to_numpy()
        numbers = [day_of_year(int(one) // 100, int(one) % 100) for one in np.unique(date)]
        day = np.asarray(numbers)[np.unique(date, return_inverse=True)[1]]
        kind = np.where(free, KINDS.index("holiday"), weekday)
        return self._year.values[day, kind, days.hour.to_numpy()]


class CalendarTable(TomlTable):
    """Holidays, and the weekday of the first day of the year."""

    holidays: tuple[Date, ...] = ()
    starts_on: Literal[WEEK] | None = None  # else the weather file's own first day


def clock_or_name(value: Any) -> Any:
    """Two clock times."""
    if not isinstance(value, list | tuple) or len(value) != 2 or set(map(type, value)) != {int}:
        raise ValueError(f"expected two hours or the name of a schedule, got {value!r}")
    return _clock((value[0], value[1]))


def states_or_name(value: Any) -> Any:
    """Shading states by hour."""
    if not isinstance(value, list | tuple) or set(map(type, value)) - {int}:
        raise ValueError(f"expected {CLOCK} states or the name of a schedule, got {value!r}")
    return tuple(value)


@dataclass(frozen=True, slots=True)
class OrSchedule:
    """Metadata of a field whose value is a constant or the name of a schedule.

    `plain` checks the constant; without it, the constant is a number within the limits.
    """

    limits: Limits
    plain: Callable[[Any], Any] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """None, a text, or a number within the limits."""
        return core_schema.no_info_plain_validator_function(self._checked)

    def _checked(self, value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        if self.plain is not None:
            return self.plain(value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"expected a number or the name of a schedule, got {value!r}")
        return self.limits.checked(float(value))


def scheduled_fields(table: TomlTable) -> dict[str, tuple[str, Limits]]:
    """The schedules that a table names, by key, and the limits of their values."""
    named = {}
    for key, field in type(table).model_fields.items():
        value = getattr(table, key)
        for metadata in field.metadata:
            if isinstance(metadata, OrSchedule) and isinstance(value, str):
                named[key] = value, metadata.limits
    return named


def tables_within(table: TomlTable, place: str) -> Iterator[tuple[str, TomlTable]]:
    """A table and all tables within it, with their paths."""
    yield place, table
    for key in type(table).model_fields:
        value = getattr(table, key)
        if isinstance(value, TomlTable):
            yield from tables_within(value, f"{place}.{key}")
        elif isinstance(value, tuple):
            for number, one in enumerate(value):
                if isinstance(one, TomlTable):
                    yield from tables_within(one, f"{place}.{key}.{number}")


def unknown_name(name: str, known: Mapping[str, object]) -> str:
    """The message on an unknown schedule."""
    near = get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known) or 'none'}"
    return f"no schedule {name!r}; {hint}"


def _number(date: str) -> int:
    """A day MM-DD as 100 times its month, and its day."""
    return int(date[:2]) * 100 + int(date[3:])


def _column(path: Path, column: str, hours: int) -> FloatArray:
    """A column of numbers [H] of a CSV file."""
    try:
        stamp = path.stat()
        names, rows = _csv_rows(path, stamp.st_mtime_ns, stamp.st_size)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    if column not in names:
        raise DataError(f"no column {column!r}; there are {', '.join(names)}", file=path)
    if len(rows) != hours:
        raise DataError(f"expected {hours} rows as the weather has, got {len(rows)}", file=path)
    values = np.empty(hours)
    for number, row in enumerate(rows):
        try:
            values[number] = float(row[column])
        except (TypeError, ValueError):
            message = f"expected a number, got {row[column]!r}"
            element = f"line {number + 2}"
            raise DataError(message, file=path, element=element, field=column) from None
    if not np.isfinite(values).all():
        raise DataError("expected finite numbers", file=path, field=column)
    return values


@lru_cache(maxsize=4)  # schedules of a study are columns of few files
def _csv_rows(path: Path, changed: int, size: int) -> tuple[list[str], list[dict[str, Any]]]:
    """Column names and rows of a file that has not changed since: `changed`, `size`."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    return [name for name in (rows[0] if rows else {}) if name], rows
