"""What rules ask of the heat of a room: hours, degree hours and excess above a limit, and bands.

A limit is a line over the running mean outdoor temperature, clipped; a constant where its slope is
zero.  The counted hours are those of use or all, of some months and clock hours.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from scenes.comply.findings import Findings, RoomHeat
from scenes.comply.need import Need
from scenes.language.catalogue import decimal, gettext
from scenes.toml_file import TomlTable
from thermal.comfort import (
    ADAPTIVE_BANDS,
    comfort_by_outdoors,
    degree_hours,
    rolling_mean,
    running_mean,
    running_mean_en16798,
)

FloatArray = NDArray[np.float64]
LONG = 60  # days after which the weights of an exponential mean are below 1e-5
HEAT = frozenset({"heat"})
Month = Annotated[int, Field(ge=1, le=12)]
Clock = Annotated[int, Field(ge=0, le=24)]


class LimitTable(TomlTable):
    """Upper limit of the operative temperature [degC]: intercept_c + slope x mean outdoors."""

    intercept_c: float
    slope: float = 0.0
    least_c: float = -math.inf
    most_c: float = math.inf
    # of EN 16798-1 by its seven weights; exponential, 0.8 of the day before; the same of seven
    # days; the last 48 hours
    mean: Literal["EN 16798-1", "exponential", "seven days", "48 h"] = "EN 16798-1"
    night: tuple[Clock, Clock] | None = None  # clock hours with a limit of their own
    night_c: float | None = None

    @model_validator(mode="after")
    def _has_its_night(self) -> LimitTable:
        if (self.night is None) != (self.night_c is None):
            raise ValueError("night and night_c belong together")
        return self

    def mean_outdoors(self, room: Findings, heat: RoomHeat) -> FloatArray:
        """Running mean outdoor temperature [H] [degC]."""
        per_day = round(24 / room.step_h)
        if self.mean == "EN 16798-1":
            return running_mean_en16798(heat.outdoor_c, per_day=per_day)
        if self.mean == "48 h":
            return rolling_mean(heat.outdoor_c, 2 * per_day)
        days = LONG if self.mean == "exponential" else 7
        return running_mean(heat.outdoor_c, alpha=0.8, days=days, per_day=per_day)

    def at(self, room: Findings, heat: RoomHeat) -> FloatArray:
        """The limit [H] [degC]."""
        limit = np.full(len(heat.operative_c), self.intercept_c)
        if self.slope:
            line = self.intercept_c + self.slope * self.mean_outdoors(room, heat)
            limit = np.clip(line, self.least_c, self.most_c)
        if self.night is not None and self.night_c is not None:
            limit = np.where(at_clock(room, self.night), self.night_c, limit)
        return limit

    @property
    def words(self) -> str:
        """The limit in words."""
        constant = decimal(f"{self.intercept_c:.3g}")
        text = gettext("{limit} °C", limit=constant)
        if self.slope:
            text = gettext(
                "{intercept} °C + {slope} x running mean outdoors",
                intercept=constant,
                slope=decimal(f"{self.slope:.3g}"),
            )
            if math.isfinite(self.least_c):
                least = decimal(f"{self.least_c:g}")
                text = gettext("{limit}, at least {least} °C", limit=text, least=least)
            if math.isfinite(self.most_c):
                most = decimal(f"{self.most_c:g}")
                text = gettext("{limit}, at most {most} °C", limit=text, most=most)
        if self.night is not None and self.night_c is not None:
            start, end = self.night
            text = gettext(
                "{limit}; from {start} to {end} o'clock {night} °C",
                limit=text,
                start=start,
                end=end,
                night=decimal(f"{self.night_c:g}"),
            )
        return text


class HeatNeed(Need):
    """A need of the operative temperature over counted hours."""

    all_hours: bool = False  # of the day, as in dwellings; else those of use
    months: tuple[Month, Month] | None = None  # first and last, inclusive
    hours: tuple[Clock, Clock] | None = None  # clock hours, past midnight too

    parts: ClassVar[frozenset[str]] = HEAT

    def counted(self, room: Findings, heat: RoomHeat) -> NDArray[np.bool_]:
        """The hours [H] that count."""
        mask = np.ones(len(heat.operative_c), bool) if self.all_hours else heat.occupied.copy()
        if self.months is not None:
            first, last = self.months
            month = room.calendar.times.month.to_numpy()
            inside = (month >= first) & (month <= last)
            mask &= inside if first <= last else (month >= first) | (month <= last)
        if self.hours is not None:
            mask &= at_clock(room, self.hours)
        return mask

    @property
    def period(self) -> str:
        """The counted hours in words."""
        text = (
            gettext("in all hours of the year")
            if self.all_hours
            else gettext("in the hours of use")
        )
        if self.months is not None:
            first, last = self.months
            text = gettext(
                "{period}, months {first} to {last}", period=text, first=first, last=last
            )
        if self.hours is not None:
            start, end = self.hours
            text = gettext("{period}, {start} to {end} o'clock", period=text, start=start, end=end)
        return text


def at_clock(room: Findings, hours: tuple[int, int]) -> NDArray[np.bool_]:
    """Whether each step [H] is within clock hours, which may pass midnight."""
    start, end = hours
    clock = room.calendar.times.hour.to_numpy()
    inside = (clock >= start) & (clock < end)
    return inside if start <= end else (clock >= start) | (clock < end)


class LimitedNeed(HeatNeed):
    """A need of the excess over a limit."""

    above_c: float | None = None  # a constant limit
    limit: LimitTable | None = None

    @model_validator(mode="after")
    def _has_one_temperature(self) -> LimitedNeed:
        if (self.above_c is None) == (self.limit is None):
            raise ValueError("expected either above_c or limit")
        return self

    @property
    def line(self) -> LimitTable:
        """The limit, a constant one too."""
        return self.limit or LimitTable(intercept_c=self.above_c or 0.0)

    def excess(self, room: Findings, heat: RoomHeat) -> FloatArray:
        """Operative temperature less the limit [H] [K]."""
        return heat.operative_c - self.line.at(room, heat)


class DegreeHours(LimitedNeed):
    """Kelvin times hours in which the operative temperature is above a limit."""

    what: Literal["degree_hours"]
    # days count from the first to the last with this running mean outdoors [degC]
    season_from_c: float | None = None

    unit: ClassVar[str] = "K h"

    @property
    def words(self) -> str:
        """The quantity in words."""
        text = gettext(
            "degree hours above {limit}, {period}", limit=self.line.words, period=self.period
        )
        if self.season_from_c is None:
            return text
        return gettext(
            "{quantity}; between the first and the last day with a running mean outdoors of "
            "{from_c} °C",
            quantity=text,
            from_c=decimal(f"{self.season_from_c:g}"),
        )

    def value(self, room: Findings) -> float | None:
        """Degree hours [K h]."""
        if room.heat is None:
            return None
        mask = self.counted(room, room.heat)
        if self.season_from_c is not None:
            warm = np.flatnonzero(self.line.mean_outdoors(room, room.heat) >= self.season_from_c)
            inside = np.zeros_like(mask)
            if len(warm):
                inside[warm[0] : warm[-1] + 1] = True
            mask &= inside
        limit = self.line.at(room, room.heat)[mask]
        return degree_hours(room.heat.operative_c[mask], limit, step_h=room.step_h)


class HoursAbove(LimitedNeed):
    """Counted hours in which a limit is exceeded, or their share."""

    what: Literal["hours_above"]
    by_k: float = 0.0  # kelvin above the limit from which an hour counts; 0: any excess
    rounded: bool = False  # the excess is rounded to whole kelvin first
    share: bool = False  # of the counted hours

    unit: ClassVar[str] = "h"
    digits: ClassVar[int] = 1

    @property
    def words(self) -> str:
        """The quantity in words."""
        values = {"limit": self.line.words, "period": self.period}
        if self.by_k == 0.0:
            if self.share:
                return gettext("hours per 100 h above {limit}, {period}", **values)
            return gettext("hours above {limit}, {period}", **values)
        values["by"] = decimal(f"{self.by_k:g}")
        if self.share:
            return gettext(
                "hours per 100 h that are {by} K or more above {limit}, {period}", **values
            )
        return gettext("hours that are {by} K or more above {limit}, {period}", **values)

    def value(self, room: Findings) -> float | None:
        """Hours of the year, or of each 100 counted ones."""
        if room.heat is None:
            return None
        mask = self.counted(room, room.heat)
        excess = self.excess(room, room.heat)[mask]
        if self.rounded:
            excess = to_whole_kelvin(excess)
        count = np.count_nonzero(excess >= self.by_k if self.by_k > 0 else excess > 0.0)
        if self.share:
            return 100.0 * count / mask.sum() if mask.any() else None
        return float(count * room.step_h)


class DayWeighted(LimitedNeed):
    """CIBSE TM52: excess of a day in whole kelvin times hours, of the worst day."""

    what: Literal["worst_day"]

    unit: ClassVar[str] = "K h"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "degree hours in whole kelvin above {limit} on the worst day, {period}",
            limit=self.line.words,
            period=self.period,
        )

    def value(self, room: Findings) -> float | None:
        """Weighted exceedance [K h]."""
        if room.heat is None:
            return None
        excess = np.maximum(to_whole_kelvin(self.excess(room, room.heat)), 0.0)
        excess[~self.counted(room, room.heat)] = 0.0
        return float(excess.reshape(-1, round(24 / room.step_h)).sum(axis=1).max() * room.step_h)


class GreatestExcess(LimitedNeed):
    """CIBSE TM52: greatest excess over a limit in whole kelvin."""

    what: Literal["greatest_excess"]

    unit: ClassVar[str] = "K"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "greatest excess above {limit} in whole kelvin, {period}",
            limit=self.line.words,
            period=self.period,
        )

    def value(self, room: Findings) -> float | None:
        """Excess [K]; 0 where the limit is kept."""
        if room.heat is None:
            return None
        excess = to_whole_kelvin(self.excess(room, room.heat))[self.counted(room, room.heat)]
        return float(max(excess.max(initial=0.0), 0.0))


def to_whole_kelvin(excess: FloatArray) -> FloatArray:
    """Excess rounded to the nearest whole kelvin, halves up."""
    return np.floor(excess + 0.5)


class ComfortShare(HeatNeed):
    """Share of the hours of use in which the operative temperature is in an adaptive band."""

    what: Literal["comfort"]
    band: Literal["EN 16798-1 I", "EN 16798-1 II", "EN 16798-1 III"]
    cold_from_c: float = -math.inf  # running mean outdoors from which the lower limit holds

    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

    @property
    def words(self) -> str:
        """The quantity in words."""
        if self.cold_from_c >= ADAPTIVE_BANDS[self.band][-1]:
            return gettext(
                "share of the hours of use within the adaptive band {band}, upper limit only",
                band=self.band,
            )
        if math.isfinite(self.cold_from_c):
            return gettext(
                "share of the hours of use within the adaptive band {band}; the lower limit "
                "applies from an outdoor running mean of {cold_from} °C",
                band=self.band,
                cold_from=f"{self.cold_from_c:g}",
            )
        return gettext("share of the hours of use within the adaptive band {band}", band=self.band)

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1, of the hours whose running mean outdoors is in the band's range.

        Below `cold_from_c` a heating is on, which the temperatures here do not have: what is too
        cold then counts as kept.
        """
        if room.heat is None:
            return None
        heat, per_day = room.heat, round(24 / room.step_h)
        found = comfort_by_outdoors(heat.operative_c, heat.outdoor_c, self.band, per_day=per_day)
        counted = self.counted(room, heat) & found.applicable
        heated = (found.excess < 0) & (found.outdoor_mean_c < self.cold_from_c)
        kept = found.comfortable | heated
        return float(np.mean(kept[counted])) if counted.any() else None
