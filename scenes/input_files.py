"""The files of a command: the small ones are read and checked before its building is.

No tracer and no IFC reader is loaded for that: a mistake is reported within a second or two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

from bim.building_file import (
    STAGES,
    ReadOptions,
    building_files,
    check_building_file,
    check_room_names,
    read_building_file,
)
from bim.building_file import files_beside as building_files_beside
from bim.model import Building
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, silent, summed
from mitsuba_cfs.sky.epw import weather_of_file
from mitsuba_cfs.sky.matrix import DEFAULT_DEW_POINT_C
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS
from scenes.fenestration.systems import FenestrationSystem, WindowOverrides, read_system
from scenes.fenestration.thermal_file import PEAK_SHARES, files_beside
from scenes.fenestration.thermal_system import checked_system
from scenes.input_options import InputOptions
from scenes.room.operation import Operation, check_schedules, check_states, check_systems, read_operation


@dataclass(frozen=True, slots=True)
class InputFiles:
    """Contents of the small files: all but the building."""

    weather: Weather
    # fenestration data that go before those of the building's file
    overrides: WindowOverrides = field(default_factory=WindowOverrides)
    operation: Operation | None = None


def read_files(
    options: InputOptions,
    *,
    light_only: bool = False,
    hourly: bool = True,
    temperatures: bool = True,
    weather: Weather | None = None,
    table: str = "",
) -> InputFiles:
    """Read and check the weather, the system and the operation, the quick ones first.

    Args:
        light_only: neither U nor g is needed; hourly, temperatures: as of `read_weather`.
        weather: of the options' file, where it is read already.
        table: of a study file that names a system, for messages; by default the flags do.

    Raises: `DataError` for a file that cannot be used.
    """
    check_building(options)
    if options.weather is None:
        raise ValueError("inputs from files need a weather file")
    if weather is None:
        weather = read_weather(options.weather, hourly=hourly, temperatures=temperatures)
    operation = None if options.operation is None else read_operation(options.operation)
    system = read_override(options, heat=not light_only, by="" if table else "--cfs")
    if operation is not None:
        check_systems(operation)
        states = () if system is None else (system,)
        if states or operation.systems:
            check_states(operation, len(states or operation.systems))
        check_hours(operation, weather)
    overrides = overrides_of(options, system, operation, light_only)
    if table:
        overrides = replace(overrides, ask=table)
    return InputFiles(weather, overrides, operation)


def check_hours(operation: Operation, weather: Weather) -> None:
    """Raise `DataError` for schedules or a street of an operation that do not fit the weather."""
    check_schedules(operation.tables, weather, operation.file)
    operation.outdoors(weather)


def named_files(options: InputOptions, operation: Operation | None) -> dict[str, Path]:
    """The files that inputs are made of, by what they are; those that the building names are not.

    Args: operation: of the options' file, or the building's own.
    """
    named = {"building": options.building, "weather": options.weather, "system": options.system}
    files = {name: path for name, path in named.items() if path is not None}
    if options.building is not None:
        beside = building_files_beside(options.building)
        files |= dict(zip(("corrections",), beside, strict=False))
        files |= {f"linked_{i}": path for i, path in enumerate(options.linked)}
    if options.system is not None:
        for i, path in enumerate(files_beside(options.system)):
            files[f"system_angular_{i}" if i else "system_thermal"] = path
    if operation is not None and operation.file != options.building:
        files["operation"] = operation.file
        files |= {f"state_{i}": path for i, path in enumerate(operation.files)}
    return files | {f"surroundings_{i}": path for i, path in enumerate(options.surroundings)}


def check_building(options: InputOptions) -> None:
    """Check what can be checked of the building and the rooms' names without reading the building.

    Raises: `DataError` for a file of no format that is read, or a name that is empty or like none in it.
    """
    check_names(options.spaces)
    files = building_files(options.building_files)
    for path in files:
        check_building_file(path)
    check_room_names(files, options.spaces)


def check_names(names: Sequence[str], field: str = "--space") -> None:
    """Raise `DataError` for an empty name of a room."""
    for name in names:
        if not name.strip():
            raise DataError("expected the name or GUID of a room, got nothing", field=field)


def read_weather(path: str | PathLike[str], *, hourly: bool = True, temperatures: bool = True) -> Weather:
    """Weather of one year from an EPW file.

    Args: hourly: in steps of 1 h; temperatures: else a WEA file is read too, which has none.

    Raises: `DataError` for a file that cannot be used.
    """
    weather = weather_of_file(path)
    if weather.dry_bulb_c is None:
        if temperatures:
            message = "is a WEA file, which has no temperatures: give an EPW file"
            raise DataError(f"{message} (cfs dgp and cfs picture take it)", file=path)
        note = Note(
            "{file} states no dew point: that of Radiance's programs, {dew:.1f} °C, is used for the luminous efficacy.",
            file=Path(path).name,
            dew=DEFAULT_DEW_POINT_C,
        )
        weather = replace(weather, notes=(*weather.notes, note))
    if hourly and weather.step_h != 1.0:
        raise DataError(f"has steps of {weather.step_h:g} h; the run needs hours", file=path)
    return weather


def read_override(options: InputOptions, *, heat: bool, by: str = "--cfs") -> FenestrationSystem | None:
    """The system of `options.system` for every window.

    Args: heat: whether its U, g and BSDF must go together; by: as of `read_system`.
    """
    if options.system is None:
        return None
    values = {"u_value": options.u_value, "g_value": options.g_value}
    system = read_system(options.system, **values, by=by)
    if heat:
        checked_system(system, options.system)
    return system


def overrides_of(
    options: InputOptions,
    system: FenestrationSystem | None,
    operation: Operation | None = None,
    light_only: bool = False,
) -> WindowOverrides:
    """What replaces the windows' own data: the system, else the operation's states; U and g."""
    states = () if operation is None else operation.systems
    states = states if system is None else (system,)
    if options.glazing is not None and options.glazing not in GENERIC_GLAZINGS:
        message = f"{options.glazing!r} is none of {', '.join(GENERIC_GLAZINGS)}"
        raise DataError(message, field="--glazing")
    tau = options.visible_transmittance
    if tau is not None and not 0 < tau <= 1:
        raise DataError(f"expected more than 0, at most 1, got {tau:g}", field="--tau")
    see_through = tuple(map(peak_share, options.see_through))
    return WindowOverrides(
        states,
        options.u_value,
        options.g_value,
        light_only=light_only,
        visible=tau,
        glazing=options.glazing,
        see_through=see_through,
    )


def peak_share(text: str) -> tuple[str, float]:
    """File or system, and the share of its peak that passes straight on, of FILE=KIND.

    Args: KIND: specular, lobe, or the share, 0 to 1.

    Raises: `DataError` for another text.
    """
    name, _, kind = text.rpartition("=")
    try:
        share = PEAK_SHARES[kind] if kind in PEAK_SHARES else float(kind)
    except ValueError:
        share = -1.0
    if not name or not 0 <= share <= 1:
        message = f"expected FILE=specular, FILE=lobe or FILE=0.3, got {text!r}"
        raise DataError(message, field="--see-through")
    return Path(name).name, share


def read_building(
    path: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    join: Sequence[str] = (),
    furniture: bool = False,
    apertures: Sequence[str] = (),
    surroundings: Sequence[str | PathLike[str]] = (),
    surroundings_offset: tuple[float, float, float] | None = None,
    facade_panes: Sequence[str] = (),
    progress: Progress = silent,
) -> Building:
    """The building of an IFC file, with the corrections kept beside it, or of another format.

    Args:
        path: a file, several IFC files of one building, or a folder of them.
        join: rooms to make one, as "Hall + Living".
        furniture: whether furniture is in the light and the views of its room.
        apertures: materials of a Radiance scene's surfaces that are windows.
        surroundings: files of the surroundings, see `bim.with_surroundings`.
        surroundings_offset: added to their coordinates [m] in place of any georeference.
        facade_panes: materials of a Radiance scene's panes before dark rooms; they mirror.

    Raises: `DataError` for a file that cannot be used; faults of the model are the building's
        `problems`.
    """
    first, *linked = building_files([path] if isinstance(path, str | PathLike) else path)
    read = ReadOptions(
        tuple(join),
        furniture,
        tuple(apertures),
        tuple(map(Path, surroundings)),
        surroundings_offset,
        tuple(facade_panes),
        tuple(linked),
    )
    return read_building_file(first, read, summed(progress, "inputs", STAGES))


def building_of(options: InputOptions, progress: Progress = silent) -> Building:
    """The building of a command's options; raises as `read_building`."""
    cache = MatrixCache.of_user() if options.cache else None
    steps = summed(progress, "inputs", STAGES)
    return read_building_file(options.building, options.read, steps, cache=cache)
