"""How a room is operated: shading states and their control, gains, outdoor air, set points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from bim.model import Space
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.heat.study_file import (
    AirTable,
    ControlTable,
    GainsTable,
    LoadsTable,
    Share,
    SystemTable,
)
from scenes.job.inputs import System, read_system
from scenes.toml_file import read_table, validated
from thermal.control import always, by_cut_off, by_glare, by_irradiance, by_schedule
from thermal.gains import dimmed_share, split_gains
from thermal.zone import Zone, work_hours

FloatArray = NDArray[np.float64]
CLOCK = 24  # hours of a schedule


class RunControl(ControlTable):
    """The control of `cfs thermal`, and glare by pictures."""

    limit_dgp: Share | None = None  # "glare": DGP of every hour's picture in place of Ev


class OperationFile(BaseModel):
    """The tables of a study of `cfs thermal` that say how rooms are operated."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    system: tuple[SystemTable, ...] = ()  # states, from open to closed; none: those of the windows
    control: RunControl = RunControl()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation file with its systems read."""

    file: Path
    tables: OperationFile
    systems: tuple[System, ...]  # states of every window; empty: the windows' own

    @property
    def files(self) -> tuple[Path, ...]:
        """The BSDF files that it names."""
        return tuple(self.file.parent / table.bsdf for table in self.tables.system)

    def table_of(self, system: System) -> SystemTable | None:
        """The table that a system was read from."""
        pairs = zip(self.systems, self.tables.system, strict=True)
        return next((table for known, table in pairs if known is system), None)


def read_operation(path: Path) -> Operation:
    """The operation of a TOML file; the paths in it start at its folder.

    Raises: `DataError` that names file and field.
    """
    tables = validated(OperationFile, read_table(path), path)
    warm, cool = tables.loads.heating_c, tables.loads.cooling_c
    if warm is not None and cool is not None and warm > cool:
        raise DataError("the set point heating_c lies above cooling_c", file=path, field="loads")
    systems = []
    for number, one in enumerate(tables.system):
        place = path.parent / one.bsdf
        if not place.is_file():
            raise DataError(f"no such file: {one.bsdf}", file=path, field=f"system.{number}.bsdf")
        by = f"[[system]] of {path.name},"
        system = read_system(place, u_value=one.u_value, g_value=one.g_value, by=by)
        if any(system.name == other.name for other in systems):
            system = replace(system, name=place.stem)
        systems.append(system)
    return Operation(path, tables, tuple(systems))


def check_states(operation: Operation, states: int) -> None:
    """Raise `DataError` where the control names states that the windows do not have."""
    control = operation.tables.control

    def fault(field: str, message: str) -> DataError:
        return DataError(message, file=operation.file, field=f"control.{field}")

    if control.rule == "schedule" and len(control.schedule) != CLOCK:
        raise fault("schedule", f"expected {CLOCK} states, got {len(control.schedule)}")
    wanted = control.schedule if control.rule == "schedule" else (control.state,)
    if any(not 0 <= state < states for state in wanted):
        raise fault("state", f"a state outside 0 to {states - 1}: the windows have {states}")
    if control.rule == "cut-off" and len(control.slat_tilts_deg) != states:
        raise fault("slat_tilts_deg", f"expected one for each of {states} states")


def shading_states(
    control: RunControl,
    space: Space,
    weather: Weather,
    states: int,
    *,
    irradiance: FloatArray,
    eye: FloatArray,
    dgp: Callable[[], FloatArray],
) -> NDArray[np.int64]:
    """The state of every hour [H], the same in all windows of the room.

    Args:
        irradiance: [H, G] of the window groups [W/m2]: the brightest counts.
        eye: [J, H] vertical illuminance at the eye in each state [lx].
        dgp: gives [J, H], worked out only where the control asks for it.
    """
    hours = len(weather.times)
    if control.rule == "schedule":
        return by_schedule(control.schedule, hours)
    if control.rule == "irradiance":
        closed = control.state or states - 1
        brightest = irradiance.max(axis=1)
        return by_irradiance(brightest, control.close_above, control.open_below, closed=closed)
    if control.rule == "glare":
        if control.limit_dgp is not None:
            return by_glare(dgp(), control.limit_dgp)
        return by_glare(eye, control.limit_lx)
    if control.rule == "cut-off":
        local = sun_directions(weather) @ window_frame(space.windows[0].normal).T
        beam = weather.direct_normal * np.maximum(local[:, 2], 0.0)
        tilts = np.radians(control.slat_tilts_deg)
        return by_cut_off(local, beam, tilts, control.slat_width, control.slat_spacing)
    return always(control.state, hours)


def operated(
    zone: Zone, tables: OperationFile, floor_area: float, daylight: FloatArray
) -> tuple[Zone, FloatArray]:
    """The zone with the gains, air and set points of the tables, and the lamps' power [H] [W].

    Args: daylight: [H] mean illuminance of the work plane, which dims the lamps [lx].
    """
    gains, air, loads = tables.gains, tables.air, tables.loads
    hours = len(daylight)
    present = work_hours(*gains.occupied, hours=hours)
    power = gains.equipment_w_m2 * floor_area + gains.persons * gains.person_w
    lamps = gains.lighting_w_m2 * floor_area * present
    lamps = lamps * dimmed_share(daylight, gains.lighting_target_lx)
    found = Zone(
        zone.name,
        zone.volume,
        zone.surfaces,
        zone.windows,
        infiltration_ach=air.infiltration_ach + air.night_ach * work_hours(*air.night, hours=hours),
        gains=split_gains(power * present, gains.radiant_share, (lamps, gains.radiant_share)),
        loads=loads.ideal(),
        view_factors=zone.view_factors,
    )
    return found, lamps
