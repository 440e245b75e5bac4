"""The tables of a TOML file that say how outdoor air comes into a room."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from scenes import plausible
from scenes.room.schedules import Hours, OrSchedule
from scenes.toml_file import Positive, Share, TomlTable
from thermal.ventilation import BLAST, DOE2, DOOR_DISCHARGE, Leakage, aim2, sherman_grimsrud

NAMED = {"constant": (1.0, 0.0, 0.0, 0.0), "doe-2": DOE2, "blast": BLAST}


def _factors(value: Any) -> Any:
    if isinstance(value, str) and value not in NAMED:
        raise ValueError(f"expected four numbers or one of {', '.join(NAMED)}, got {value!r}")
    return NAMED.get(value, value) if isinstance(value, str) else value


Factor = Annotated[float, Field(ge=0)]


class LeakageTable(TomlTable):
    """Leaks found by a pressure test: an area at 4 Pa, or a coefficient with its exponent."""

    area_cm2: Annotated[Positive, plausible.LEAK] | None = None
    coefficient: Positive | None = None  # [m3/(s Pa^n)]
    exponent: Annotated[float, Field(ge=0.5, le=1.0)] = 0.67
    stack: Annotated[float, Field(ge=0, le=1)]
    wind: Annotated[float, Field(ge=0, le=1)]
    shelter: Annotated[float, Field(ge=0, le=1)] = 1.0  # of the wind, with `coefficient`

    @model_validator(mode="after")
    def _one_of_both(self) -> LeakageTable:
        if (self.area_cm2 is None) == (self.coefficient is None):
            raise ValueError("give either `area_cm2` or `coefficient`")
        return self

    def leakage(self) -> Leakage:
        """The leaks as the balance takes them."""
        if self.area_cm2 is not None:
            return sherman_grimsrud(self.area_cm2, stack=self.stack, wind=self.wind)
        return aim2(
            self.coefficient, self.exponent,
            stack=self.stack, wind=self.wind, shelter=self.shelter,
        )  # fmt: skip


class OpenedTable(TomlTable):
    """Windows that are opened, EN 16798-7."""

    # share of the glass that opens, while allowed; a schedule says its own hours
    share: Annotated[float | str, OrSchedule(plausible.SHARE)] = 0.1
    flow: Literal["single-sided", "cross"] = "single-sided"
    when: Literal["always", "occupied"] = "occupied"  # a share that is a number
    open_above_c: Annotated[float, plausible.TEMPERATURE] = 24.0
    close_below_c: Annotated[float, plausible.TEMPERATURE] = 22.0
    least_difference: Annotated[float, Field(ge=-20, le=20)] = 0.0  # above outdoors [K]
    greatest_wind: Annotated[Positive, plausible.WIND] = 60.0  # [m/s]
    least_outdoor_c: Annotated[float, plausible.OUTDOOR] = -30.0

    @model_validator(mode="after")
    def _do_not_cross(self) -> OpenedTable:
        if self.close_below_c > self.open_above_c:
            raise ValueError("close_below_c: lies above open_above_c")
        return self


class NeighbourAirTable(TomlTable):
    """Air exchanged with a neighbour of known temperature, as much each way."""

    temperature_c: Annotated[float | str, OrSchedule(plausible.TEMPERATURE)]
    # of an opening through which warm air leaves above and cool air comes below: an open door
    width: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    height: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    discharge: Annotated[Positive, Field(le=1)] = DOOR_DISCHARGE
    open: Annotated[float | str, OrSchedule(plausible.SHARE)] = 1.0  # share of its width
    m3_h: Annotated[float | str, OrSchedule(plausible.FLOW)] = 0.0  # whatever the temperatures

    @model_validator(mode="after")
    def _has_a_size_or_a_flow(self) -> NeighbourAirTable:
        if (self.width is None) != (self.height is None):
            raise ValueError("width and height belong together")
        if self.width is None and self.m3_h == 0.0:
            raise ValueError("give `width` and `height` of an opening, or `m3_h`")
        return self


class AirTable(TomlTable):
    """Outdoor air."""

    infiltration_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.5
    # a, b, c, d: infiltration (a + b dT + c v + d v^2); "constant", "doe-2" or "blast"
    infiltration_factors: Annotated[
        tuple[Factor, Factor, Factor, Factor], BeforeValidator(_factors)
    ] = NAMED["constant"]
    leakage: LeakageTable | None = None  # besides the infiltration
    windows: OpenedTable | None = None
    night_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.0  # by night
    night: Hours = (0, 7)
    # of a fan, while occupied; the name of a schedule says its own hours
    ventilation_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.0
    heat_recovery: Share = 0.0  # of the fan's air
    bypass_above_c: Annotated[float, plausible.TEMPERATURE] | None = None  # no recovery above
    least_supply_c: Annotated[float, plausible.TEMPERATURE] | None = None  # heated to that
    supply_c: Annotated[float | str | None, OrSchedule(plausible.TEMPERATURE)] = None
    fan_w_m3_s: Annotated[float, plausible.FAN] = 0.0  # electricity of the fan
    neighbour: tuple[NeighbourAirTable, ...] = ()  # rooms that are not simulated
    # each way through every open door between coupled rooms [m3/s]; 0: the doors are shut
    door_m3_s: Annotated[float, plausible.DOOR_FLOW] = 0.0

    @model_validator(mode="after")
    def _one_temperature(self) -> AirTable:
        if self.supply_c is not None and (self.heat_recovery or self.least_supply_c is not None):
            raise ValueError("supply_c: leaves nothing to recover or to heat")
        return self
