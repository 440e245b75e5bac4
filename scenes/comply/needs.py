"""What rules ask of a room: each need names a quantity, says it in words, and finds its value."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from mitsuba_cfs.metrics.autonomy import area_share, daylight_autonomy
from mitsuba_cfs.metrics.en17037 import HALF_TIME, exceeded, reached_on_area
from mitsuba_cfs.metrics.lm83 import annual_sunlight_exposure
from scenes.comply.findings import Findings
from scenes.comply.heat_needs import (
    ComfortShare,
    DayWeighted,
    DegreeHours,
    GreatestExcess,
    HoursAbove,
)
from scenes.comply.need import Need
from scenes.language.catalogue import decimal, gettext, ngettext
from scenes.language.numbers import listed
from scenes.toml_file import Positive, Share


class ReachedLux(Need):
    """EN 17037, method 2: illuminance that a share of the area has for a share of the time."""

    what: Literal["reached_lux"]
    area: Share
    time: Share = HALF_TIME

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "lx"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "illuminance reached on {area} % of the reference plane in {time} % of the daylight "
            "hours",
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


class ReachedFactor(Need):
    """EN 17037, method 1: daylight factor of a share of the area, times the median diffuse light.

    The standard's limits of the daylight factor are D_T = E_T/E_v,d,med.
    """

    what: Literal["reached_factor"]
    area: Share

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "lx"

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


class ViewShare(Need):
    """EN 17037: share of the utilised area with a sight angle, a distance and layers at once."""

    what: Literal["view"]
    angle_deg: Positive
    distance: Positive
    layers: Annotated[int, Field(ge=1, le=3)]

    parts: ClassVar[frozenset[str]] = frozenset({"view"})
    unit: ClassVar[str] = "%"

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


class SunHours(Need):
    """EN 17037: hours of possible sun at the openings on the chosen day."""

    what: Literal["sun_hours"]

    parts: ClassVar[frozenset[str]] = frozenset({"sun"})
    unit: ClassVar[str] = "h"
    digits: ClassVar[int] = 2

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext("possible sunlight hours at the reference points of the openings")

    def value(self, room: Findings) -> float | None:
        """Hours."""
        return None if room.sun is None else room.sun.hours


class DgpExceeded(Need):
    """EN 17037: share of the hours of use in which DGP is above, at the worst of the seats."""

    what: Literal["dgp_exceeded"]
    limit: Share

    parts: ClassVar[frozenset[str]] = frozenset({"glare"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

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


class ViewFree(Need):
    """Share of LM-83's hours in which one sees out through some window, blinds operated."""

    what: Literal["view_free"]

    parts: ClassVar[frozenset[str]] = frozenset({"open", "operated"})
    unit: ClassVar[str] = "%"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "share of the hours from 8 to 18 o'clock with an unobstructed view through at least "
            "one window"
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1."""
        if room.light is None or room.light.free is None:
            return None
        return float(np.mean(room.light.free[room.ten_hours].any(axis=1)))


class SpatialAutonomy(Need):
    """IES LM-83: share of the area that has an illuminance for a share of the ten hours a day."""

    what: Literal["sda"]
    lux: Positive
    time: Share

    parts: ClassVar[frozenset[str]] = frozenset({"open", "operated"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

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


class SunlightExposure(Need):
    """IES LM-83: share of the area with direct sun for more than some hours, blinds open."""

    what: Literal["ase"]
    lux: Positive
    hours: Positive

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

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
            room.light.direct,
            room.ten_hours,
            step_h=room.step_h,
            threshold=self.lux,
            most_hours=self.hours,
        )


class Equinox(Need):
    """LEED, option 2: share of the area within limits at clear hours round the equinoxes."""

    what: Literal["equinox"]
    low: Positive
    high: Positive
    clocks: tuple[int, ...]

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

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


class MeanHours(Need):
    """BREEAM: hours of the year in which the mean illuminance of the room is reached."""

    what: Literal["mean_hours"]
    lux: Positive

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "h"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "hours of the year with a mean illuminance of {lux} lx in the room",
            lux=f"{self.lux:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Hours."""
        if room.light is None:
            return None
        enough = room.light.open.mean(axis=1, dtype=float) >= self.lux
        return float(room.step_h * np.count_nonzero(enough))


class WorstHours(Need):
    """BREEAM: hours of the year in which the worst lit point has an illuminance."""

    what: Literal["worst_hours"]
    lux: Positive

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "h"

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "hours of the year with {lux} lx at the worst lit point", lux=f"{self.lux:g}"
        )

    def value(self, room: Findings) -> float | None:
        """Hours."""
        if room.light is None:
            return None
        return float(room.light.hours_at_points(self.lux, room.step_h).min())


class PointHours(Need):
    """BREEAM, sales areas: share of the area that has an illuminance for so many hours a year."""

    what: Literal["point_hours"]
    lux: Positive
    hours: Positive

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

    @property
    def words(self) -> str:
        """The quantity in words."""
        return gettext(
            "share of the area with {lux} lx in {hours} hours of the year",
            lux=f"{self.lux:g}",
            hours=f"{self.hours:g}",
        )

    def value(self, room: Findings) -> float | None:
        """Share, 0 to 1, of the points, each by its own hours."""
        if room.light is None:
            return None
        return area_share(room.light.hours_at_points(self.lux, room.step_h) >= self.hours)


class LightingEnergy(Need):
    """Yearly energy of lamps that are dimmed to what daylight lacks, per floor area (LENI)."""

    what: Literal["leni"]
    lux: Positive  # that lamps and daylight keep together
    power_w_m2: Positive  # of the lamps where there is no daylight
    standby_kwh_m2: Annotated[float, Field(ge=0)] = 0.0  # of controls and emergency lights, a year

    parts: ClassVar[frozenset[str]] = frozenset({"open"})
    unit: ClassVar[str] = "kWh/(m² a)"
    digits: ClassVar[int] = 1

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
    | DegreeHours
    | HoursAbove
    | DayWeighted
    | GreatestExcess
    | ComfortShare,
    Field(discriminator="what"),
]
