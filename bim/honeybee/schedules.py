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
from mitsuba_cfs.errors import DataError

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
        except DataError:
            raise
        except ValueError as error:
            raise self.objects.fault(f"is no schedule: {error}", held, field) from None

    def _rules(self, held: Mapping[str, Any]) -> Iterator[DayRule]:
        """The rules in their order, the holiday's first; the default day holds elsewhere."""
        days = {
            str(one.get("identifier")): self._day(one) for one in _objects(held, "day_schedules")
        }

        def day(named: Any) -> NDArray[np.float64]:
            if isinstance(named, dict):
                return self._day(named)
            if str(named) not in days:
                raise ValueError(f"no day schedule {named!r:.60}")
            return days[str(named)]

        if held.get("holiday_schedule"):
            yield DayRule(day(held["holiday_schedule"]), ("holiday",))
        for rule in _objects(held, "schedule_rules"):
            kinds = tuple(kind for kind in WEEK if rule.get(f"apply_{kind}", False))
            dates = (_date(rule.get("start_date"), 0), _date(rule.get("end_date"), DAYS - 1))
            yield DayRule(day(rule.get("schedule_day")), kinds, dates)
        yield DayRule(day(held.get("default_day_schedule")))

    def _day(self, one: Mapping[str, Any]) -> NDArray[np.float64]:
        times = _numbers(one.get("times") or [[0, 0]], 2)
        if times.shape[1] != 2:
            raise ValueError("expected times of hour and minute")
        starts = (times[:, 0] + times[:, 1] / 60.0).tolist()
        values = _numbers(one.get("values"), 1).tolist()
        if not one.get("interpolate"):
            return hourly_means(starts, values)
        fine = (np.arange(CLOCK * 60) + 0.5) / 60.0
        return np.interp(fine, starts, values).reshape(CLOCK, 60).mean(axis=1)


def _date(listed: Any, default: int) -> int:
    """Month and day as the number of a day; a third entry says that the year is a leap year."""
    if listed is None:
        return default
    return day_of_year(*_integers(listed)[:2])


def _objects(held: Mapping[str, Any], field: str) -> list[Mapping[str, Any]]:
    """The objects that a field lists."""
    listed = held.get(field) or []
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise ValueError(f"expected objects in {field}")
    return listed


def _numbers(values: Any, dimensions: int) -> NDArray[np.float64]:
    try:
        result = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        result = np.empty(())
    if result.ndim != dimensions:
        raise ValueError(f"expected numbers, got {values!r:.60}")
    return result


def _integers(values: Any) -> list[int]:
    """Month and day, and whether the year is a leap year."""
    numbers = _numbers(values, 1)
    if len(numbers) < 2 or not np.isfinite(numbers).all():
        raise ValueError(f"expected month and day, got {values!r:.60}")
    return [int(number) for number in numbers]


def _fixed(held: Mapping[str, Any]) -> NDArray[np.float64]:
    """Values by date [366, 8, 24] of those at fixed intervals from a day on."""
    steps = held.get("timestep") or 1
    values = _numbers(held.get("values"), 1)
    is_number = isinstance(steps, int | float)
    if not np.isfinite(values).all() or not is_number or not 1 <= steps <= 60:
        raise ValueError("expected finite values and 1 to 60 of them an hour")
    steps = int(steps)
    hours = values[: len(values) // (steps * CLOCK) * steps * CLOCK].reshape(-1, CLOCK, steps)
    hours = hours.mean(axis=2)
    start = _integers(held.get("start_date") or [1, 1])
    leap = len(start) > 2 and bool(start[2])
    order = [day for day in range(DAYS) if leap or day != LAST_OF_FEBRUARY]
    first = order.index(day_of_year(*start[:2]))
    placeholder = _numbers(held.get("placeholder_value") or 0.0, 0)
    found = np.full((DAYS, CLOCK), float(placeholder))
    for number, day in enumerate(hours[: len(order)]):
        found[order[(first + number) % len(order)]] = day
    if not leap:
        found[LAST_OF_FEBRUARY] = found[LAST_OF_FEBRUARY - 1]
    return np.repeat(found[:, None, :], len(KINDS), axis=1)
