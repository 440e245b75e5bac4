"""Needs of the light at the eye of a seat: melanopic EDI or illuminance, by daylight or by lamps."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from scenes.comply.findings import EyeLight, Findings
from scenes.comply.need import ROUNDING, Clock, Need, at_clock
from scenes.language.catalogue import decimal, gettext
from scenes.toml_file import Positive


class EyeNeed(Need):
    """A need of the light at the eye of a seat."""

    lux: Positive
    quantity: Literal["melanopic EDI", "illuminance"] = "melanopic EDI"
    light: Literal["daylight", "lamps"] = "daylight"  # by lamps alone, at full power

    parts: ClassVar[frozenset[str]] = frozenset({"eye"})
    unit: ClassVar[str] = "%"
    digits: ClassVar[int] = 1

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
