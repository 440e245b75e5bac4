"""Schedules of a honeybee model: rulesets and values at fixed intervals.

Source: honeybee-schema, "ScheduleRuleset", "ScheduleDay", "ScheduleRule", "ScheduleFixedInterval".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.honeybee.library import NamedObjects
from bim.use import (
    CLOCK,
    DAYS,
    KINDS,
    DayRule,
    YearSchedule,
    day_of_year,
    hourly_means,
)

LAST_OF_FEBRUARY = day_of_year(2, 29)
WEEK = KINDS[:7]


class ScheduleLibrary:
    """The schedules of a file, read when something refers to them."""

    def __init__(self, energy: Mapping[str, Any], file: Path) -> None:
        self.objects = NamedObjects(energy, ("schedules",), "construction", file)
        self._found: dict[str, YearSchedule] = {}

    def schedule(self, named: Any) -> YearSchedule:
        """The schedule of a name, or that a load holds itself.

        Raises: `DataError` that names the schedule and its field.
        """
        if isinstance(named, dict):
            return self._read(named)
        name = str(named)
        if name not in self._found:
            held = self.objects.find("schedules", name)
            if held is None:
                raise self.objects.fault(f"no schedule {name!r:.60}", {}, "schedules")
            self._found[name] = self._read(held)
        return self._found[name]

    def _read(self, held: Mapping[str, Any]) -> YearSchedule:
        name = str(held.get("display_name") or held.get("identifier", ""))
        fixed = str(held.get("type", "")).startswith("ScheduleFixedInterval")
        field = "values" if fixed else "day_schedules"
        try:
            if fixed:
                return YearSchedule(name, _fixed(held))
            return YearSchedule.of_rules(name, self._rules(held))
        except (TypeError, ValueError, KeyError, IndexError) as error:
            if hasattr(error, "file"):  # a `DataError`, which names its field
                raise
            message = f"is no schedule: {error}" if isinstance(error, ValueError) else "is none"
            raise self.objects.fault(message, held, field) from None

    def _rules(self, held: Mapping[str, Any]) -> Iterator[DayRule]:
        """The rules in their order, the holiday's first; the default day holds elsewhere."""
        days = {one["identifier"]: self._day(one) for one in held["day_schedules"]}

        def day(named: Any) -> NDArray[np.float64]:
            return self._day(named) if isinstance(named, dict) else days[named]

        if held.get("holiday_schedule"):
            yield DayRule(day(held["holiday_schedule"]), ("holiday",))
        for rule in held.get("schedule_rules") or ():
            kinds = tuple(kind for kind in WEEK if rule.get(f"apply_{kind}", False))
            dates = (_date(rule.get("start_date"), 0), _date(rule.get("end_date"), DAYS - 1))
            yield DayRule(day(rule["schedule_day"]), kinds, dates)
        yield DayRule(day(held["default_day_schedule"]))

    def _day(self, one: Mapping[str, Any]) -> NDArray[np.float64]:
        times = one.get("times") or [[0, 0]]
        starts = [float(hour) + float(minute) / 60.0 for hour, minute in times]
        values = [float(value) for value in one["values"]]
        if not one.get("interpolate"):
            return hourly_means(starts, values)
        fine = (np.arange(CLOCK * 60) + 0.5) / 60.0
        return np.interp(fine, starts, values).reshape(CLOCK, 60).mean(axis=1)


def _date(listed: Any, default: int) -> int:
    """Month and day as the number of a day; a third entry says that the year is a leap year."""
    return default if listed is None else day_of_year(int(listed[0]), int(listed[1]))


def _fixed(held: Mapping[str, Any]) -> NDArray[np.float64]:
    """Values by date [366, 8, 24] of those at fixed intervals from a day on."""
    steps = int(held.get("timestep") or 1)
    values = np.asarray(held["values"], dtype=float)
    if values.ndim != 1 or not np.isfinite(values).all() or not 1 <= steps <= 60:
        raise ValueError("expected finite values and 1 to 60 of them an hour")
    hours = values[: len(values) // (steps * CLOCK) * steps * CLOCK].reshape(-1, CLOCK, steps)
    hours = hours.mean(axis=2)
    start = held.get("start_date") or [1, 1]
    leap = len(start) > 2 and bool(start[2])
    order = [day for day in range(DAYS) if leap or day != LAST_OF_FEBRUARY]
    first = order.index(day_of_year(int(start[0]), int(start[1])))
    found = np.full((DAYS, CLOCK), float(held.get("placeholder_value") or 0.0))
    for number, day in enumerate(hours[: len(order)]):
        found[order[(first + number) % len(order)]] = day
    if not leap:
        found[LAST_OF_FEBRUARY] = found[LAST_OF_FEBRUARY - 1]
    return np.repeat(found[:, None, :], len(KINDS), axis=1)
