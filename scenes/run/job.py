"""What the files of a run hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bim.model import Building, Space
from bim.to_thermal import shared_constructions
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.resolver import fill_windows, window_sources
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.thermal_file import files_beside
from scenes.room.inner_glass import opened, source_rooms
from scenes.room.operation import Operation, check_states, stated_note, used_operation
from scenes.room.operation_hours import check_schedules
from scenes.room.windows import traced_building
from scenes.run.building import building_of
from scenes.run.files import JobFiles, read_files
from scenes.run.inputs import chosen_spaces
from scenes.run.options import JobOptions


@dataclass(frozen=True, slots=True)
class JobInputs:
    """What the files of a run hold."""

    building: Building
    spaces: list[Space]
    weather: Weather
    systems: Mapping[str, States]  # by window GUID
    operation: Operation | None
    stated: tuple[str, ...] = ()  # what of the operation is the building's file's, in words
    several: tuple[str, ...] = ()  # first states of windows that have more, which are not used


def read_inputs(
    options: JobOptions, progress: Progress, files: JobFiles | None = None
) -> JobInputs:
    """The inputs, the building last."""
    files = files or read_files(options)
    progress("inputs", 0.1)
    steps = part(progress, 0.1, 1.0)
    building = building_of(options, steps)
    inputs = job_inputs(building, options.spaces, files, inner=options.inner_glass)
    progress("inputs", 1.0)
    return inputs


def job_inputs(
    building: Building, names: Sequence[str], files: JobFiles, *, inner: bool = False
) -> JobInputs:
    """A building's rooms of those names with what fills their windows.

    Args: inner: light passes glass between rooms; rooms lit by that alone are among them.

    Raises: `DataError` for a room that is not there, a window without a system.
    """
    operation, weather = files.operation, files.weather
    beyond: dict[str, list[Space]] = {}
    if inner:
        building = opened(building)
        beyond = {space.guid: source_rooms(building, space) for space in building.spaces}
    spaces = chosen_spaces(
        building, names, building.file, lambda s: bool(s.windows or beyond.get(s.guid))
    )
    traced = {s.guid: s for space in spaces for s in (space, *beyond.get(space.guid, ()))}
    windows = [window for space in traced.values() for window in space.windows]
    systems = fill_windows(windows, files.given, building.file)
    if operation is not None:
        weather = operation.outdoors(weather)
        check_states(operation, max(len(states) for states in systems.values()))
    several = ()
    if operation is None:  # the building's file says how rooms are used, not how shades move
        several = tuple(states[0].name for states in systems.values() if len(states) > 1)
        systems = {guid: states[:1] for guid, states in systems.items()}
    stated = stated_note(building, "" if operation is None else operation.file.name)
    used = used_operation(operation, building)
    if used is not None and used is not operation:
        check_schedules(used.tables, weather, used.file)
    building = traced_building(building, systems)
    return JobInputs(building, spaces, weather, systems, used, stated, several)


def input_files(options: JobOptions, inputs: JobInputs) -> dict[str, Path]:
    """The files that a run is made of, by what they are."""
    files = {"building": options.building, "weather": options.weather}
    files = {name: path for name, path in files.items() if path is not None}
    if options.system is not None:
        files["system"] = options.system
        for i, path in enumerate(files_beside(options.system)):
            files[f"system_angular_{i}" if i else "system_thermal"] = path
    if inputs.operation is not None and inputs.operation.file != options.building:
        files["operation"] = inputs.operation.file
        files |= {f"state_{i}": path for i, path in enumerate(inputs.operation.files)}
    return files | {f"surroundings_{i}": path for i, path in enumerate(options.surroundings)}


def balanced_together(inputs: JobInputs, options: JobOptions) -> bool:
    """Whether heat flows between the rooms of a run."""
    return options.coupled_heat and len(inputs.spaces) > 1


def run_spaces(inputs: JobInputs, options: JobOptions) -> list[Space]:
    """The rooms of a run; of those balanced together two sides of a wall are built alike."""
    if not balanced_together(inputs, options):
        return inputs.spaces
    return list(shared_constructions(inputs.spaces))


def used_systems(inputs: JobInputs) -> list[FenestrationSystem]:
    """Every system that the run may use, once."""
    states = used_states(inputs).values()
    return list({id(system): system for some in states for system in some}.values())


def used_sources(inputs: JobInputs) -> list[dict]:
    """Name and source of every system that the run may use, and its windows."""
    windows = [window for space in inputs.spaces for window in space.windows]
    return window_sources(windows, used_states(inputs))


def used_states(inputs: JobInputs) -> dict[str, States]:
    """The systems of each window in the states that the run may use, by its GUID."""
    several = inputs.operation is not None
    return {guid: s if several else s[:1] for guid, s in inputs.systems.items()}
