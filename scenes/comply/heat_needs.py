"""What rules ask of the heat of a room: degree hours, hours in an adaptive band."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np

from scenes.comply.findings import Findings
from scenes.comply.need import Need
from scenes.language.catalogue import gettext
from thermal.comfort import ADAPTIVE_BANDS, comfort_by_outdoors, degree_hours


class DegreeHours(Need):
    """Kelvin times hours in which the operative temperature is above a limit."""

    what: Literal["degree_hours"]
    above_c: float
    all_hours: bool = False  # of the day, as in dwellings; else those of use

    parts: ClassVar[frozenset[str]] = frozenset({"heat"})
    unit: ClassVar[str] = "K h"

    @property
    def words(self) -> str:
        """The quantity in words."""
        above = f"{self.above_c:g}"
        if self.all_hours:
            return gettext("degree hours above {above} °C in all hours of the year", above=above)
        return gettext("degree hours above {above} °C in the hours of use", above=above)

    def value(self, room: Findings) -> float | None:
        """Degree hours [K h]."""
        if room.heat is None:
            return None
        operative_c = room.heat.operative_c
        counted = operative_c if self.all_hours else operative_c[room.heat.occupied]
        return degree_hours(counted, self.above_c, step_h=room.step_h)


class ComfortShare(Need):
    """Share of the hours of use in which the operative temperature is in an adaptive band."""

    what: Literal["comfort"]
    band: Literal["EN 16798-1 I", "EN 16798-1 II", "EN 16798-1 III"]
    cold_from_c: float = -math.inf  # running mean outdoors from which the lower limit holds

    parts: ClassVar[frozenset[str]] = frozenset({"heat"})
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
        counted = room.heat.occupied & found.applicable
        heated = (found.excess < 0) & (found.outdoor_mean_c < self.cold_from_c)
        kept = found.comfortable | heated
        return float(np.mean(kept[counted])) if counted.any() else None
