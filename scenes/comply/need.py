"""What every need of a rule has: a quantity in words, its value of a room, and a limit."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from scenes.comply.findings import Findings
from scenes.toml_file import TomlTable

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
