"""The small files and the choices of a run, read and checked before its building is.

No tracer and no IFC reader is loaded for that: a mistake is named within a second or two.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from bim.building_file import check_building_file
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import FenestrationSystem, Given, read_system
from scenes.fenestration.thermal_system import checked_system
from scenes.room.operation import Operation, check_states, check_systems, read_operation
from scenes.room.operation_hours import check_schedules
from scenes.room.picture_hours import check_hours, wanted_hours
from scenes.run.inputs import read_weather
from scenes.run.options import JobOptions

NETCDF = ("xarray", "h5netcdf")  # packages that write it


@dataclass(frozen=True, slots=True)
class JobFiles:
    """What the files of a run hold, all but the building."""

    weather: Weather
    system: FenestrationSystem | None
    operation: Operation | None
    given: Given  # what fills the windows, by flag or operation file


def check_netcdf() -> None:
    """Raise `DataError` where the packages are missing that write netCDF."""
    missing = [name for name in NETCDF if find_spec(name) is None]
    if missing:
        message = f"needs {' and '.join(missing)} (pip install 'mitsuba-cfs[netcdf]')"
        raise DataError(message, field="--netcdf")


def read_files(options: JobOptions) -> JobFiles:
    """The weather, the system and the operation of a run, the quick ones first.

    Raises: `DataError` for a file that cannot be used, `PictureHourError` for a wrong hour.
    """
    if options.netcdf:
        check_netcdf()
    check_building_file(options.building)
    check_names(options.spaces)
    hours = options.room.outputs.picture_hours
    check_hours(hours)
    weather = read_weather(options.weather)
    check_hours(hours, weather.midpoints)
    operation = None if options.operation is None else read_operation(options.operation)
    system = None
    if options.system is not None:
        chosen = {"u_value": options.u_value, "g_value": options.g_value}
        system = read_system(options.system, **chosen, by="--cfs")
        checked_system(system, options.system)
    if operation is not None:
        _check_operation(operation, system)
        check_schedules(operation.tables, weather, operation.file)
        operation.outdoors(weather)  # a street out of range is named before the building is read
    _check_sun(hours, weather)
    states = () if operation is None else operation.systems
    states = states if system is None else (system,)
    given = Given(states, options.u_value, options.g_value)
    return JobFiles(weather, system, operation, given)


def check_names(names: tuple[str, ...], field: str = "--space") -> None:
    """Raise `DataError` for the name of a room that cannot be one."""
    for name in names:
        if not name.strip():
            raise DataError("expected the name or GUID of a room, got nothing", field=field)


def _check_sun(hours: tuple[str, ...], weather: Weather) -> None:
    """Whether the sun is up in the hours asked for; where it is takes a second to load."""
    if hours:
        from mitsuba_cfs.sky.sun import is_up, sun_directions

        lit = np.flatnonzero(is_up(sun_directions(weather)))
        wanted_hours(hours, weather.midpoints, lit)


def _check_operation(operation: Operation, system: FenestrationSystem | None) -> None:
    """What does not need the windows: its systems' data, and its control's states."""
    check_systems(operation)
    if system is not None:
        check_states(operation, 1)
    elif operation.systems:
        check_states(operation, len(operation.systems))
