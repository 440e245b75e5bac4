"""How a building's file says that its rooms are used: schedules, gains, air, set points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
from numpy.typing import NDArray

CLOCK, DAYS = 24, 366  # hours of a day; days of a leap year, so that every date is there
KINDS = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday", "holiday")
LEAP = 2024
VAPORISING = 2.43e6  # heat of vaporisation at skin temperature [J/kg]


@dataclass(frozen=True, slots=True)
class DayRule:
    """A day's values and the days on which they hold."""

    values: NDArray[np.float64]  # [24] by clock hour
    kinds: tuple[str, ...] = KINDS
    dates: tuple[int, int] = (0, DAYS - 1)  # first and last day of the year, over its end too


@dataclass(frozen=True, slots=True, eq=False)
class YearSchedule:
    """A value for every hour of a year, whatever weekday it begins on."""

    name: str
    values: NDArray[np.float64]  # [366, 8, 24] by date, kind of day (KINDS), clock hour

    @classmethod
    def of_rules(cls, name: str, rules: Iterable[DayRule]) -> YearSchedule:
        """The schedule of rules of which the first that holds gives a day's values, else 0."""
        values = np.zeros((DAYS, len(KINDS), CLOCK))
        free = np.ones((DAYS, len(KINDS)), dtype=bool)
        day = np.arange(DAYS)
        for rule in rules:
            start, end = rule.dates
            after, before = day >= start, day <= end
            dated = after & before if start <= end else after | before
            chosen = free & dated[:, None] & np.isin(KINDS, rule.kinds)
            values[chosen] = rule.values
            free &= ~chosen
        return cls(name, values)

    @classmethod
    def constant(cls, name: str, value: float) -> YearSchedule:
        """The same value in all hours."""
        return cls(name, np.full((DAYS, len(KINDS), CLOCK), float(value)))

    def times(self, factor: float) -> YearSchedule:
        """The schedule times a number."""
        return YearSchedule(self.name, factor * self.values)

    def plus(self, other: YearSchedule) -> YearSchedule:
        """The sum of two schedules."""
        return YearSchedule(f"{self.name} + {other.name}", self.values + other.values)


ALWAYS = YearSchedule.constant("always", 1.0)


def day_of_year(month: int, day: int) -> int:
    """Number of a date in a leap year, from 0; `ValueError` for a date that there is not."""
    return (date(LEAP, month, day) - date(LEAP, 1, 1)).days


def hourly_means(starts: Sequence[float], values: Sequence[float]) -> NDArray[np.float64]:
    """Means [24] of values that hold from their start [h] to the next; `ValueError` for no day."""
    at = np.asarray(starts, dtype=float)
    if len(at) == 0 or at[0] != 0 or np.any(np.diff(at) <= 0) or at[-1] >= CLOCK:
        raise ValueError("expected rising times of a day from 0:00")
    if len(at) != len(values) or not np.isfinite(np.asarray(values, dtype=float)).all():
        raise ValueError("expected a finite value for each time")
    ends = np.append(at[1:], CLOCK)
    hours = np.arange(CLOCK)[:, None]
    within = np.clip(np.minimum(ends, hours + 1) - np.maximum(at, hours), 0.0, 1.0)
    return within @ np.asarray(values, dtype=float)


def vapour_g_h(latent_w: float) -> float:
    """The vapour [g/h] that carries a person's latent heat [W]."""
    return latent_w / VAPORISING * 3.6e6


@dataclass(frozen=True, slots=True)
class ScheduledValue:
    """A quantity at most, and its share by hour."""

    peak: float
    share: YearSchedule | None = None  # None: its hours are not stated


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedUse:
    """What a file states of a room's use; None is not stated."""

    persons: ScheduledValue | None = None
    person_w: float | None = None  # dry heat of a person
    person_vapour_g_h: float | None = None
    equipment_w: ScheduledValue | None = None
    lighting_w: ScheduledValue | None = None
    lighting_target_lx: float | None = None  # to which lamps are dimmed; None: they are not
    radiant_share: float | None = None  # of the heat of all gains
    infiltration_m3_s: ScheduledValue | None = None
    infiltration_factors: tuple[float, float, float, float] | None = None  # a + b dT + c v + d v2
    ventilation_m3_s: ScheduledValue | None = None  # outdoor air of a fan
    heat_recovery: float | None = None  # share of the fan's air
    heating_c: YearSchedule | None = None
    cooling_c: YearSchedule | None = None
    heating_limit_w: float | None = None
    cooling_limit_w: float | None = None
    humidify_to: float | None = None  # relative humidity [%]
    dehumidify_to: float | None = None
