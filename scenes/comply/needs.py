"""What rules ask of a room: each need names a quantity, says it in words, and finds its value.

Needs of heat are hours, degree hours and excess above a limit, and bands.  A limit is a line over
the running mean outdoor temperature, clipped; a constant where its slope is zero.  The counted
hours are those of use or all, of some months and clock hours.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Unpack

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from mitsuba_cfs.metrics.autonomy import area_share, daylight_autonomy
from mitsuba_cfs.metrics.en17037 import HALF_TIME, exceeded, reached_on_area
from mitsuba_cfs.metrics.lm83 import annual_sunlight_exposure
from scenes.comply.findings import EyeLight, Findings, RoomHeat
from scenes.language.catalogue import decimal, gettext, ngettext
from scenes.language.numbers import listed
from scenes.toml_file import Positive, Share, TomlTable
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
Month = Annotated[int, Field(ge=1, le=12)]
ROUNDING = 1e-9  # of shares of an area
Clock = Annotated[int, Field(ge=0, le=24)]


class Need(TomlTable):
    """A limit of a quantity of a room."""

    what: str  # each need's own name, by which a rule asks for it
    at_least: float | None = None
    at_most: float | None = None

    parts: ClassVar[frozenset[str]] = frozenset()  # of `Findings` that it needs
    unit: ClassVar[str] = ""  # "%" values are shares and shown times 100
    digits: ClassVar[int] = 0

    def __init_subclass__(
        cls, parts: str | None = None, unit: str | None = None, digits: int | None = None, **options: Unpack[ConfigDict]
    ) -> None:
        super().__init_subclass__(**options)
        given = {"parts": None if parts is None else frozenset(parts.split()), "unit": unit, "digits": digits}
        for name, value in given.items():
            if value is not None:
                setattr(cls, name, value)

    @model_validator(mode="after")
    def _has_one_limit(self) -> Need:
        if (self.at_least is None) == (self.at_most is None):
            raise ValueError("expected either at_least or at_most")
        return self

    @property
    def words(self) -> str:
        """The quantity in words."""
        raise NotImplementedError

    def value(self, room: Findings) -> float | None:
        """The quantity of a room; None where it was not computed."""
        raise NotImplementedError

    def met(self, value: float | None) -> bool | None:
        """Whether a value keeps the limit; None where there is none."""
        if value is None:
            return None
        if self.at_least is not None:
            return value >= self.at_least - ROUNDING
        return value <= (self.at_most or 0.0) + ROUNDING


def at_clock(room: Findings, hours: tuple[int, int]) -> NDArray[np.bool_]:
    """Whether each step [H] is within clock hours, which may pass midnight."""
    start, end = hours
    clock = room.calendar.times.hour.to_numpy()
    inside = (clock >= start) & (clock < end)
    return inside if start <= end else (clock >= start) | (clock < end)


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


class HeatNeed(Need, parts="heat"):
    """A need of the operative temperature over counted hours."""

    all_hours: bool = False  # of the day, as in dwellings; else those of use
    months: tuple[Month, Month] | None = None  # first and last, inclusive
    hours: tuple[Clock, Clock] | None = None  # clock hours, past midnight too

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
        text = gettext("in all hours of the year") if self.all_hours else gettext("in the hours of use")
        if self.months is not None:
            first, last = self.months
            text = gettext("{period}, months {first} to {last}", period=text, first=first, last=last)
        if self.hours is not None:
            start, end = self.hours
            text = gettext("{period}, {start} to {end} o'clock", period=text, start=start, end=end)
        return text


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


class DegreeHours(LimitedNeed, unit="K h"):
    """Kelvin times hours in which the operative temperature is above a limit."""

    what: Literal["degree_hours"]
    # days count from the first to the last with this running mean outdoors [degC]
    season_from_c: float | None = None

    @property
    def words(self) -> str:
        """The quantity in words."""
        text = gettext("degree hours above {limit}, {period}", limit=self.line.words, period=self.period)
        if self.season_from_c is None:
            return text
        return gettext(
            "{quantity}; between the first and the last day with a running mean outdoors of {from_c} °C",
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


class HoursAbove(LimitedNeed, unit="h", digits=1):
    """Counted hours in which a limit is exceeded, or their share."""

    what: Literal["hours_above"]
    by_k: float = 0.0  # kelvin above the limit from which an hour counts; 0: any excess
    rounded: bool = False  # the excess is rounded to whole kelvin first
    share: bool = False  # of the counted hours

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
            return gettext("hours per 100 h that are {by} K or more above {limit}, {period}", **values)
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


class DayWeighted(LimitedNeed, unit="K h"):
    """CIBSE TM52: excess of a day in whole kelvin times hours, of the worst day."""

    what: Literal["worst_day"]

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


class GreatestExcess(LimitedNeed, unit="K"):
    """CIBSE TM52: greatest excess over a limit in whole kelvin."""

    what: Literal["greatest_excess"]

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "greatest excess above {limit} in whole kelvin, {period}", limit=self.line.words, period=self.period
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


class ComfortShare(HeatNeed, unit="%", digits=1):
    """Share of the hours of use in which the operative temperature is in an adaptive band."""

    what: Literal["comfort"]
    band: Literal["EN 16798-1 I", "EN 16798-1 II", "EN 16798-1 III"]
    cold_from_c: float = -math.inf  # running mean outdoors from which the lower limit holds

    @property
    def words(self) -> str:
        """The quantity in words."""
        if self.cold_from_c >= ADAPTIVE_BANDS[self.band][-1]:
            return gettext(
                "share of the hours of use within the adaptive band {band}, upper limit only", band=self.band
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
        comfort = comfort_by_outdoors(heat.operative_c, heat.outdoor_c, self.band, per_day=per_day)
        counted = self.counted(room, heat) & comfort.applicable
        heated = (comfort.excess < 0) & (comfort.outdoor_mean_c < self.cold_from_c)
        kept = comfort.comfortable | heated
        return float(np.mean(kept[counted])) if counted.any() else None


class ReachedLux(Need, parts="open", unit="lx"):
    """EN 17037, method 2: illuminance that a share of the area has for a share of the time."""

    what: Literal["reached_lux"]
    area: Share
    time: Share = HALF_TIME

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "illuminance reached on {area} % of the reference plane in {time} % of the daylight hours",
            area=f"{100 * self.area:g}",
            time=f"{100 * self.time:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Illuminance [lx]."""
        light = room.light
        if light is None:
            return None
        values = light.open[room.daylight_hours]
        weights = np.full(values.shape[1], 1 / values.shape[1])
        return float(exceeded(reached_on_area(values, weights, self.area), self.time))


class ReachedFactor(Need, parts="open", unit="lx"):
    """EN 17037, method 1: daylight factor of a share of the area, times the median diffuse light.

    The standard's limits of the daylight factor are D_T = E_T/E_v,d,med.
    """

    what: Literal["reached_factor"]
    area: Share

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "daylight factor reached on {area} % of the reference plane, times the median outdoor "
            "diffuse illuminance of the site",
            area=f"{100 * self.area:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Illuminance [lx]."""
        if room.light is None or room.median_diffuse is None:
            return None
        factor = room.light.factor
        weights = np.full(len(factor), 1 / len(factor))
        reached = float(reached_on_area(factor[None], weights, self.area)[0])
        return reached * room.median_diffuse


class ViewShare(Need, parts="view", unit="%"):
    """EN 17037: share of the utilised area with a sight angle, a distance and layers at once."""

    what: Literal["view"]
    angle_deg: Positive
    distance: Positive
    layers: Annotated[int, Field(ge=1, le=3)]

    @property
    def words(self) -> str:
        """The quantity in words."""
        return ngettext(
            "share of the utilised area with a horizontal sight angle of {angle}°, an outside "
            "distance of {distance} m and {count} layer (landscape)",
            "share of the utilised area with a horizontal sight angle of {angle}°, an outside "
            "distance of {distance} m and {count} layers (landscape included)",
            self.layers,
            angle=f"{self.angle_deg:g}",
            distance=f"{self.distance:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        if room.view is None:
            return None
        return room.view.share(self.angle_deg, self.distance, self.layers)


class SunHours(Need, parts="sun", unit="h", digits=2):
    """EN 17037: hours of possible sun at the openings on the chosen day."""

    what: Literal["sun_hours"]

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext("possible sunlight hours at the reference points of the openings")

    def value(self, room: Findings) -> float | None:
        """Hours."""
        return None if room.sun is None else room.sun.hours


class DgpExceeded(Need, parts="glare", unit="%", digits=1):
    """EN 17037: share of the hours of use in which DGP is above, at the worst of the seats."""

    what: Literal["dgp_exceeded"]
    limit: Share

    @property
    def share(self) -> float:
        """Share of the hours of use, 0 to 1, that it compares with."""
        return self.at_most or self.at_least or 0.0

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "share of the hours of use with a daylight glare probability above {limit}, worst seat",
            limit=decimal(f"{self.limit:.2f}"),
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        return None if room.glare is None else room.glare.exceeded(self.limit)


class ViewFree(Need, parts="open operated", unit="%"):
    """Share of LM-83's hours in which one sees out through some window, blinds operated."""

    what: Literal["view_free"]

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext("share of the hours from 8 to 18 o'clock with an unobstructed view through at least one window")

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        if room.light is None or room.light.free is None:
            return None
        return float(np.mean(room.light.free[room.ten_hours].any(axis=1)))


class SpatialAutonomy(Need, parts="open operated", unit="%", digits=1):
    """IES LM-83: share of the area that has an illuminance for a share of the ten hours a day."""

    what: Literal["sda"]
    lux: Positive
    time: Share

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "sDA: {lux} lx in {time} % of the hours from 8 to 18 o'clock, blinds operated",
            lux=f"{self.lux:g}",
            time=f"{100 * self.time:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        if room.light is None or room.light.operated is None:
            return None
        autonomy = daylight_autonomy(room.light.operated, room.ten_hours, self.lux)
        return area_share(autonomy >= self.time)


class SunlightExposure(Need, parts="open", unit="%", digits=1):
    """IES LM-83: share of the area with direct sun for more than some hours, blinds open."""

    what: Literal["ase"]
    lux: Positive
    hours: Positive

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "ASE: {lux} lx of direct sun in more than {hours} h, blinds open",
            lux=f"{self.lux:g}",
            hours=f"{self.hours:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        if room.light is None:
            return None
        return annual_sunlight_exposure(
            room.light.direct, room.ten_hours, step_h=room.step_h, threshold=self.lux, most_hours=self.hours
        )


class Equinox(Need, parts="open", unit="%", digits=1):
    """LEED, option 2: share of the area within limits at clear hours round the equinoxes."""

    what: Literal["equinox"]
    low: Positive
    high: Positive
    clocks: tuple[int, ...]

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "share of the area with {low} to {high} lx at {clocks} o'clock of the clear days",
            low=f"{self.low:g}",
            high=f"{self.high:g}",
            clocks=listed([str(clock) for clock in self.clocks]),
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1, of the points that keep the limits at every one of the hours."""
        if room.light is None:
            return None
        kept = np.ones(room.light.open.shape[1], dtype=bool)
        for clock in self.clocks:
            mean = room.light.open[room.clear_hours(clock)].mean(axis=0)
            kept &= (mean >= self.low) & (mean <= self.high)
        return area_share(kept)


class MeanHours(Need, parts="open", unit="h"):
    """BREEAM: hours of the year in which the mean illuminance of the room is reached."""

    what: Literal["mean_hours"]
    lux: Positive

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext("hours of the year with a mean illuminance of {lux} lx in the room", lux=f"{self.lux:g}")

    def value(self, room: Findings) -> float | None:
        """Hours."""
        if room.light is None:
            return None
        enough = room.light.open.mean(axis=1, dtype=float) >= self.lux
        return float(room.step_h * np.count_nonzero(enough))


class WorstHours(Need, parts="open", unit="h"):
    """BREEAM: hours of the year in which the worst lit point has an illuminance."""

    what: Literal["worst_hours"]
    lux: Positive

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext("hours of the year with {lux} lx at the worst lit point", lux=f"{self.lux:g}")

    def value(self, room: Findings) -> float | None:
        """Hours."""
        if room.light is None:
            return None
        return float(room.light.hours_at_points(self.lux, room.step_h).min())


class PointHours(Need, parts="open", unit="%", digits=1):
    """BREEAM, sales areas: share of the area that has an illuminance for so many hours a year."""

    what: Literal["point_hours"]
    lux: Positive
    hours: Positive

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "share of the area with {lux} lx in {hours} hours of the year", lux=f"{self.lux:g}", hours=f"{self.hours:g}"
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1, of the points, each by its own hours."""
        if room.light is None:
            return None
        return area_share(room.light.hours_at_points(self.lux, room.step_h) >= self.hours)


class LightingEnergy(Need, parts="open", unit="kWh/(m² a)", digits=1):
    """Yearly energy of lamps that are dimmed to what daylight lacks, per floor area (LENI)."""

    what: Literal["leni"]
    lux: Positive  # that lamps and daylight keep together
    power_w_m2: Positive  # of the lamps where there is no daylight
    standby_kwh_m2: Annotated[float, Field(ge=0)] = 0.0  # of controls and emergency lights, a year

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "lighting energy with {power} W/m² installed, dimmed to {lux} lx, 8 to 18 o'clock",
            power=decimal(f"{self.power_w_m2:g}"),
            lux=f"{self.lux:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Energy [kWh/(m2 a)]; blinds operated where that is known.

        Source: EN 15193-1's indicator LENI = W/A; hour by hour in place of its dependency factors.
        """
        if room.light is None:
            return None
        light = room.light.open if room.light.operated is None else room.light.operated
        lacking = np.maximum(1.0 - light[room.ten_hours] / self.lux, 0.0)
        hours = room.step_h * float(lacking.mean(axis=1, dtype=float).sum())
        return self.power_w_m2 * hours / 1000 + self.standby_kwh_m2


class EyeNeed(Need, parts="eye", unit="%", digits=1):
    """A need of the light at the eye of a seat."""

    lux: Positive
    quantity: Literal["melanopic EDI", "illuminance"] = "melanopic EDI"
    light: Literal["daylight", "lamps"] = "daylight"  # by lamps alone, at full power

    @property
    def light_words(self) -> str:
        """The light in words."""
        names = {
            ("melanopic EDI", "daylight"): gettext(
                "{lux} lx of melanopic EDI at the eye by daylight", lux=f"{self.lux:g}"
            ),
            ("melanopic EDI", "lamps"): gettext("{lux} lx of melanopic EDI at the eye by lamps", lux=f"{self.lux:g}"),
            ("illuminance", "daylight"): gettext("{lux} lx at the eye by daylight", lux=f"{self.lux:g}"),
            ("illuminance", "lamps"): gettext("{lux} lx at the eye by lamps", lux=f"{self.lux:g}"),
        }
        return names[self.quantity, self.light]

    def enough(self, eye: EyeLight) -> NDArray[np.bool_] | None:
        """The hours of use [H] with enough light; None where the lamps' light is not known."""
        row = int(self.quantity == "melanopic EDI")
        if self.light == "daylight":
            return eye.occupied & (eye.daylight[row] >= self.lux)
        if eye.lamps is None:
            return None
        return eye.occupied & np.full(len(eye.occupied), eye.lamps[row] >= self.lux)


class EyeShare(EyeNeed):
    """Share of the hours of use between clock hours with enough light at the eye."""

    what: Literal["eye_share"]
    between: tuple[Clock, Clock] = (0, 24)

    @property
    def words(self) -> str:
        """The quantity in words."""
        start, end = self.between
        return gettext(
            "share of the hours of use from {start} to {end} o'clock with {light}",
            start=start,
            end=end,
            light=self.light_words,
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        enough = None if room.eye is None else self.enough(room.eye)
        if room.eye is None or enough is None:
            return None
        counted: NDArray[np.bool_] = room.eye.occupied & at_clock(room, self.between)
        return float(enough[counted].mean()) if counted.any() else None


class EyeDays(EyeNeed):
    """Share of the days of use on which enough light lasts, without a break, from before a clock hour."""

    what: Literal["eye_days"]
    hours: Positive  # on end
    begins_by: Clock = 24

    @property
    def words(self) -> str:
        """The quantity in words."""
        values = {"hours": decimal(f"{self.hours:g}"), "light": self.light_words}
        if self.begins_by == 24:
            return gettext("share of the days of use with {hours} h on end of {light}", **values)
        return gettext(
            "share of the days of use with {hours} h on end of {light}, from {clock} o'clock at the latest",
            clock=self.begins_by,
            **values,
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        enough = None if room.eye is None else self.enough(room.eye)
        if room.eye is None or enough is None:
            return None
        steps = round(24 / room.step_h)
        days = enough.reshape(-1, steps)
        used = np.flatnonzero(room.eye.occupied.reshape(-1, steps).any(axis=1))
        length = math.ceil(self.hours / room.step_h - ROUNDING)
        if not len(used):
            return None
        if length > steps:
            return 0.0
        runs = np.asarray(np.lib.stride_tricks.sliding_window_view(days, length, axis=1).all(axis=2))
        starts = np.arange(runs.shape[1]) * room.step_h <= self.begins_by
        return float((runs[used] & starts).any(axis=1).mean())


AnyNeed = Annotated[
    ReachedLux
    | ReachedFactor
    | ViewShare
    | SunHours
    | DgpExceeded
    | ViewFree
    | SpatialAutonomy
    | SunlightExposure
    | Equinox
    | MeanHours
    | WorstHours
    | PointHours
    | LightingEnergy
    | EyeShare
    | EyeDays
    | DegreeHours
    | HoursAbove
    | DayWeighted
    | GreatestExcess
    | ComfortShare,
    Field(discriminator="what"),
]
