"""The tables of a TOML file that say what heats and cools a room, and what that takes."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from scenes import plausible
from scenes.room.schedules import OrSchedule
from scenes.toml_file import Positive, Share, TomlTable

SetPoint = Annotated[float | str | None, OrSchedule(plausible.TEMPERATURE)]
Cop = Annotated[Positive, plausible.COP]


class SlabTable(TomlTable):
    """Pipes or wires in a construction of the room, in proportion to what its air lacks."""

    faces: tuple[str, ...] = ("floor",)  # side of the box, or kind of faces; the biggest such one
    depth: Annotated[Positive, plausible.LAYER] = 0.05  # below the inside face [m]
    heating_c: SetPoint = None
    cooling_c: SetPoint = None
    heating_w_m2: Annotated[float, plausible.GAIN] = 60.0  # at full power
    cooling_w_m2: Annotated[float, plausible.GAIN] = 40.0
    band: Annotated[Positive, Field(le=20)] = 2.0  # from none to full power [K]


class LoadsTable(TomlTable):
    """Ideal heating and cooling; without set points the room floats."""

    heating_c: SetPoint = None
    cooling_c: SetPoint = None
    heating_limit_w: Annotated[Positive, plausible.POWER] | None = None
    cooling_limit_w: Annotated[Positive, plausible.POWER] | None = None
    heating_radiant: Share = 0.0  # radiators 0.3, ceilings 0.6
    cooling_radiant: Share = 0.0
    slab: SlabTable | None = None
    humidify_to: Annotated[float, plausible.PERCENT] | None = None  # relative humidity [%]
    dehumidify_to: Annotated[float, plausible.PERCENT] | None = None

    @model_validator(mode="after")
    def _do_not_cross(self) -> LoadsTable:
        if isinstance(self.heating_c, float) and isinstance(self.cooling_c, float):
            if self.heating_c > self.cooling_c:
                raise ValueError("the set points cross: heating_c lies above cooling_c")
        low, high = self.humidify_to, self.dehumidify_to
        if low is not None and high is not None and low > high:
            raise ValueError("humidify_to: lies above dehumidify_to")
        return self


class PlantTable(TomlTable):
    """What heat and cold cost: an ideal plant by its COP, and primary energy."""

    # heat per final energy: a number, or pairs of outdoor temperature and COP between which it
    # is linear
    heating_cop: Cop | tuple[tuple[Annotated[float, plausible.OUTDOOR], Cop], ...] = 1.0
    cooling_cop: Cop | tuple[tuple[Annotated[float, plausible.OUTDOOR], Cop], ...] = 3.0
    heating_factor: Annotated[float, plausible.FACTOR] = 1.1  # primary per final energy
    electricity_factor: Annotated[float, plausible.FACTOR] = 2.5  # of cooling, fans, lamps, plugs

    @model_validator(mode="after")
    def _rises(self) -> PlantTable:
        for key in ("heating_cop", "cooling_cop"):
            pairs = getattr(self, key)
            if isinstance(pairs, tuple):
                at = [temperature for temperature, _ in pairs]
                if not at or any(b <= a for a, b in pairwise(at)):
                    raise ValueError(f"{key}: expected pairs by rising outdoor temperature")
        return self
