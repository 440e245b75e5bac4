"""The small files of a run, read and checked before its building is."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes import input_files
from scenes.room.picture_hours import check_hours, wanted_hours
from scenes.run.options import JobOptions

NETCDF = ("xarray", "h5netcdf")  # packages that write it


def check_netcdf() -> None:
    """Raise `DataError` where the packages are missing that write netCDF."""
    missing = [name for name in NETCDF if find_spec(name) is None]
    if missing:
        message = f"needs {' and '.join(missing)} (pip install 'mitsuba-cfs[netcdf]')"
        raise DataError(message, field="--netcdf")


def read_files(options: JobOptions) -> input_files.InputFiles:
    """The weather, the system and the operation of a run, the quick ones first.

    Raises: `DataError` for a file that cannot be used, `PictureHourError` for a wrong hour.
    """
    if options.netcdf:
        check_netcdf()
    hours = options.room.outputs.picture_hours
    check_hours(hours)
    files = input_files.read_files(options)
    if options.energyplus:
        _check_energyplus(options, files)
    check_hours(hours, files.weather.midpoints)
    _check_sun(hours, files.weather)
    return files


def _check_energyplus(options: JobOptions, files: input_files.InputFiles) -> None:
    """Raise `DataError` for a run of which EnergyPlus cannot be given the rooms."""
    if not options.coupled_heat:
        raise DataError("writes rooms with heat between them: leave out --no-coupled-heat", field="--energyplus")
    if files.operation is not None and files.operation.tables.heat_island is not None:
        message = "EnergyPlus reads the EPW file itself, without a heat island"
        raise DataError(message, file=files.operation.file, field="heat_island")
    if files.weather.step_h != 1.0:
        raise DataError("EnergyPlus takes a year of hours", file=options.weather, field="--energyplus")


def _check_sun(hours: tuple[str, ...], weather: Weather) -> None:
    """Whether the sun is up in the hours asked for; where it is takes a second to load."""
    if hours:
        from mitsuba_cfs.sky.sun import is_up, sun_directions

        lit = np.flatnonzero(is_up(sun_directions(weather)))
        wanted_hours(hours, weather.midpoints, lit)
