"""Bounds of what a number in a user's file can mean: beyond them it is a slip of unit or digit.

They are wide on purpose: no building, however odd, lies outside.  Each is stated once here, with
its reason, and its message states the unit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema


@dataclass(frozen=True, slots=True)
class Limits:
    """The smallest and the largest number that a quantity may be; metadata of a pydantic field."""

    low: float
    high: float
    unit: str
    why: str
    slips: tuple[tuple[str, Callable[[float], float]], ...] = ()  # other units, and what makes ours

    def checked(self, value: float) -> float:
        """The value.

        Raises: `ValueError` that states bounds, unit and reason, and the unit it was perhaps in.
        """
        if self.low <= value <= self.high:
            return value
        text = f"expected {self.low:g} to {self.high:g} {self.unit}".rstrip()
        text += f" ({self.why}), got {value:g}"
        for unit, ours in self.slips:
            if value > self.high and self.low <= ours(value) <= self.high:
                text += f"; {value:g} {unit} would be {ours(value):.3g} {self.unit}"
                break
        raise ValueError(text)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The number as its type says, then within the bounds."""
        return core_schema.no_info_after_validator_function(self.checked, handler(source))


def _thousandth(value: float) -> float:
    return value / 1000.0


TEMPERATURE = Limits(
    -30.0,
    60.0,
    "C",
    "what rooms are kept at",
    (("F", lambda f: (f - 32.0) / 1.8 if f < 150 else 1e9), ("K", lambda k: k - 273.15)),
)
OUTDOOR = Limits(-60.0, 60.0, "C", "weather")
AIR_CHANGE = Limits(0.0, 200.0, "1/h", "a paint shop has 100")
DOOR_FLOW = Limits(0.0, 50.0, "m3/s", "a hall's gate in the wind", (("m3/h", lambda v: v / 3600),))
LENGTH = Limits(0.0, 500.0, "m", "no room is longer", (("mm", _thousandth),))
LAYER = Limits(0.0, 5.0, "m", "the thickest walls", (("mm", _thousandth),))
CONDUCTIVITY = Limits(0.001, 500.0, "W/(m K)", "a vacuum panel has 0.004, silver 430")
DENSITY = Limits(0.0, 20000.0, "kg/m3", "lead has 11300")
HEAT_CAPACITY = Limits(50.0, 10000.0, "J/(kg K)", "lead has 129, water 4186: no kJ")
GAIN = Limits(0.0, 3000.0, "W/m2", "a hall of computers")
LAMPS = Limits(0.0, 500.0, "W/m2", "a greenhouse")
SHARE = Limits(0.0, 1.0, "", "a share")
HOURS = Limits(0.0, 24.0, "h", "a day")
STATE = Limits(0.0, 100.0, "", "the number of a state")
PERSON = Limits(0.0, 1000.0, "W", "hard work; 75 at a desk")
PERSONS = Limits(0.0, 10000.0, "persons in a room", "a big hall")
POWER = Limits(0.0, 1e7, "W", "10 MW for a room")
TARGET = Limits(0.0, 1e5, "lx", "an operating table")
EYE = Limits(0.0, 2e5, "lx", "the sun in the eye")
SUN = Limits(0.0, 1500.0, "W/m2", "more than the sun gives")
SLAT = Limits(0.0, 2.0, "m", "a big louvre", (("mm", _thousandth),))
GAP = Limits(0.0, 0.2, "m", "wider ones are rooms", (("mm", _thousandth),))
RESISTANCE = Limits(0.0, 10.0, "m2 K/W", "more than any film")
PSI = Limits(-1.0, 3.0, "W/(m K)", "a balcony slab without a break has 1.0")
CHI = Limits(0.0, 10.0, "W/K", "a steel beam through the wall has 1")
U_VALUE = Limits(0.01, 10.0, "W/(m2 K)", "sheet metal has 6")
FRAME_U = Limits(0.1, 5.5, "W/(m2 K)", "films alone have 5.9")
AREA = Limits(0.0, 1e6, "m2", "the biggest halls")
PERIMETER = Limits(0.0, 1e4, "m", "the biggest halls", (("mm", _thousandth),))
DEPTH = Limits(0.0, 50.0, "m", "ten floors down", (("mm", _thousandth),))
SOIL_CAPACITY = Limits(5e5, 5e6, "J/(m3 K)", "dry sand 1.3e6, wet clay 3e6: by volume")
FLOW = Limits(0.0, 1e6, "m3/h", "a hall's fan")
VAPOUR = Limits(0.0, 1e6, "g/h", "a person gives 50, a pool 1e5")
PERCENT = Limits(0.0, 100.0, "%", "relative humidity")
WIND = Limits(0.0, 60.0, "m/s", "a hurricane")
LEAK = Limits(0.0, 1e5, "cm2", "a leaky house has 1000")
FAN = Limits(0.0, 1e4, "W/(m3/s)", "SFP 5 has 2000 to 3000", (("W/(m3/h)", lambda v: v * 3600),))
COP = Limits(0.2, 30.0, "", "heat per electricity; a boiler 0.9, a heat pump 3 to 5")
FACTOR = Limits(0.0, 10.0, "", "primary energy per final energy")
