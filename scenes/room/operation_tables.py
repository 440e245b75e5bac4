"""The tables of a TOML file that say how rooms are operated: states, control, gains, air, loads."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from scenes import plausible
from scenes.fenestration.tables import StateTable
from scenes.toml_file import Positive, Share, TomlTable
from thermal.zone import IdealLoads

CLOCK = 24  # hours of a schedule


def _clock(hours: tuple[int, int]) -> tuple[int, int]:
    """Two clock times as `working_hours` takes them: 22 to 6 is the night."""
    start, end = hours
    if not (0 <= start < 24 and 0 <= end <= 24 and start != end):
        raise ValueError(
            f"expected two different hours, from 0 to 23 and to 0 to 24, got {list(hours)}"
        )
    return hours


Hours = Annotated[
    tuple[int, int],
    AfterValidator(_clock),
    Field(description="clock times from and to, over midnight too"),
]


class ControlTable(TomlTable):
    """Which state holds: states are numbered from 0 in the order of the file."""

    rule: Literal["always", "schedule", "irradiance", "glare", "cut-off"] = "always"
    state: Annotated[int, Field(ge=0)] = 0  # "always"; and the closed one of "irradiance"
    schedule: tuple[int, ...] = ()  # "schedule": 24 states
    close_above: Annotated[Positive, plausible.SUN] = 200.0  # "irradiance" on the windows [W/m2]
    open_below: Annotated[float, plausible.SUN] | None = None
    limit_lx: Annotated[Positive, plausible.EYE] = (
        3473.0  # "glare": vertical illuminance of the eye; sDGP 0.40
    )
    limit_dgp: Share | None = None  # "glare": DGP of every hour's picture in place of Ev
    slat_tilts_deg: tuple[float, ...] = ()  # "cut-off": of each state
    slat_width: Annotated[Positive, plausible.SLAT] = 0.08  # [m]
    slat_spacing: Annotated[Positive, plausible.SLAT] = 0.072  # [m]

    def fault(self, states: int) -> tuple[str, str] | None:
        """The key that does not fit windows of so many states, and what is wrong with it."""
        if self.rule == "schedule" and len(self.schedule) != CLOCK:
            return "schedule", f"expected {CLOCK} states, got {len(self.schedule)}"
        wanted = self.schedule if self.rule == "schedule" else (self.state,)
        if any(not 0 <= state < states for state in wanted):
            return "state", f"a state outside 0 to {states - 1}: the windows have {states}"
        if self.rule == "cut-off" and len(self.slat_tilts_deg) != states:
            return "slat_tilts_deg", f"expected one for each of {states} states"
        return None


class GainsTable(TomlTable):
    """Heat in the room during the occupied hours."""

    equipment_w_m2: Annotated[float, plausible.GAIN] = 8.0
    persons: Annotated[float, plausible.PERSONS] = 1.0
    person_w: Annotated[float, plausible.PERSON] = 75.0
    lighting_w_m2: Annotated[float, plausible.LAMPS] = 0.0
    lighting_target_lx: Annotated[Positive, plausible.TARGET] = (
        500.0  # of the mean on the work plane; daylight dims
    )
    radiant_share: Share = 0.5
    occupied: Hours = (8, 18)


class AirTable(TomlTable):
    """Outdoor air."""

    infiltration_ach: Annotated[float, plausible.AIR_CHANGE] = 0.5
    night_ach: Annotated[float, plausible.AIR_CHANGE] = 0.0  # more of it in these hours
    night: Hours = (0, 7)
    # each way through every open door between coupled rooms [m3/s]; 0: the doors are shut
    door_m3_s: Annotated[float, plausible.DOOR_FLOW] = 0.0


class LoadsTable(TomlTable):
    """Ideal heating and cooling; without set points the room floats."""

    heating_c: Annotated[float, plausible.TEMPERATURE] | None = None
    cooling_c: Annotated[float, plausible.TEMPERATURE] | None = None
    heating_limit_w: Annotated[Positive, plausible.POWER] | None = None
    cooling_limit_w: Annotated[Positive, plausible.POWER] | None = None

    @model_validator(mode="after")
    def _do_not_cross(self) -> LoadsTable:
        if self.heating_c is not None and self.cooling_c is not None:
            if self.heating_c > self.cooling_c:
                raise ValueError("the set points cross: heating_c lies above cooling_c")
        return self

    def ideal(self) -> IdealLoads:
        """Set points and limits; none stated means never, and without limit."""
        infinity = float("inf")
        return IdealLoads(
            -infinity if self.heating_c is None else self.heating_c,
            infinity if self.cooling_c is None else self.cooling_c,
            self.heating_limit_w or infinity,
            self.cooling_limit_w or infinity,
        )


class OperationTables(TomlTable):
    """How rooms are operated: a file of `cfs run` and `cfs study`, a part of `cfs thermal`'s."""

    system: tuple[StateTable, ...] = ()  # states, from open to closed; none: those of the windows
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
