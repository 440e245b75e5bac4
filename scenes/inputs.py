"""The one road from options to the inputs of every command.

files = read_files(options)                 # `input_files`: weather, BSDF, operation
inputs = read_inputs(options, files)        # the building, its rooms, what fills each window
inputs.head.lines                           # what was left out, what was assumed
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from bim.building_file import chosen_spaces, named_spaces, read_elements
from bim.doorways import opened, source_rooms
from bim.model import Building, Space
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import with_albedo
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.resolver import fill_windows, window_sources
from scenes.fenestration.systems import FenestrationSystem, States
from scenes.fenestration.tilts import tilt_note
from scenes.head import Head, head_of
from scenes.input_files import InputFiles, building_of, named_files, read_files
from scenes.input_options import NO_OPTIONS, InputOptions
from scenes.room.control_groups import shared_groups
from scenes.room.ground import assumed_ground_note, ground_note
from scenes.room.operation import (
    Operation,
    check_schedules,
    check_states,
    stated_note,
    unstated_note,
    used_operation,
    weekday_note,
)
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.room.windows import traced_building

Systems = Mapping[str, States]  # by window GUID
ChooseStates = Callable[[Systems], Systems]
Rooms = Literal["glazed", "first", "all"]


@dataclass(frozen=True, slots=True)
class Inputs:
    """Inputs of a command: a building with what fills each window, rooms, weather, operation."""

    building: Building  # as it is traced: without drawn shades that a window's BSDF contains
    spaces: Sequence[Space]  # the chosen rooms
    weather: Weather
    systems: Systems  # the states that are used
    operation: Operation | None = None
    options: InputOptions = NO_OPTIONS
    filled: Systems = field(default_factory=dict)  # all states that the windows have
    notes: tuple[str, ...] = ()  # assumptions about the use of rooms and the shading states
    light_only: bool = False  # neither U nor g is used

    @property
    def used_systems(self) -> list[FenestrationSystem]:
        """Each system of the windows once."""
        return list({id(state): state for states in self.systems.values() for state in states}.values())

    @property
    def sources(self) -> list[dict[str, Any]]:
        """Name and source of each system, and its windows."""
        windows = [window for space in self.spaces for window in space.windows]
        return window_sources([w for w in windows if w.guid in self.systems], self.systems)

    @property
    def head(self) -> Head:
        """What was left out, what was assumed, and how much it matters."""
        return head_of(
            self.building, self.spaces, self.systems, self.weather, notes=self.notes, light_only=self.light_only
        )

    @property
    def files(self) -> dict[str, Path]:
        """The files that the inputs are made of, by what they are."""
        return named_files(self.options, self.operation)


def read_inputs(
    options: InputOptions, files: InputFiles | None = None, progress: Progress = silent, **chosen: Any
) -> Inputs:
    """The inputs of a command from its options: the building is read last.

    Args: files: of `read_files`; read now by default; chosen: as of `inputs_of`.

    Raises: as `read_files` and `inputs_of`.
    """
    files = files or read_files(options)
    progress("inputs", 0.1)
    building = building_of(options, part(progress, 0.1, 1.0))
    inputs = inputs_of(building, options, files, **chosen)
    progress("inputs", 1.0)
    return inputs


def inputs_of(
    building: Building,
    options: InputOptions,
    files: InputFiles,
    *,
    rooms: Rooms = "glazed",
    states: ChooseStates | None = None,
    inner: bool = False,
    fill: bool = True,
    heat_of: RoomOptions | None = None,
    tables: OperationTables | None = None,
) -> Inputs:
    """The inputs of a command, of a building that was read or made.

    Args:
        rooms: which rooms without names: those with a window, the first of them, or all.
        states: chooses from the states that the windows have; by default all states with an
            operation, else the first.
        inner: light passes glass between rooms; rooms lit by that alone count as glazed.
        fill: whether the command needs to know what fills the windows.
        heat_of: options of rooms whose heat the command balances; their gains and leaks hold
            without an operation.
        tables: rules of the shading; by default those of the operation. The rooms that rules of several
            rooms read are filled too.

    Raises: `DataError` for a room that is not in the building, a window that nothing fills.
    """
    operation, overrides = files.operation, files.overrides
    beyond: dict[str, list[Space]] = {}
    if inner:
        building = opened(building)
        beyond = {space.guid: source_rooms(building, space) for space in building.spaces}
    file = options.building or building.file or Path(building.name)
    if rooms == "all":
        spaces = named_spaces(building, options.rooms, file)
    else:
        spaces = chosen_spaces(building, options.rooms, file, lambda s: bool(s.windows or beyond.get(s.guid)))
    spaces = spaces[:1] if rooms == "first" else spaces
    traced = {s.guid: s for space in spaces for s in (space, *beyond.get(space.guid, ()))}
    tables = operation.tables if tables is None and operation is not None else tables
    for group in () if tables is None else shared_groups(building, tables, spaces):
        traced |= {space.guid: space for space in group.sensor_rooms}
    windows = [window for space in traced.values() for window in space.windows]
    filled = fill_windows(windows, overrides, building.file) if fill else {}
    if operation is not None:
        check_states(operation, max(len(states) for states in filled.values()))
    states = states or (first_states if operation is None else every_state)
    systems = states(filled)
    used = used_operation(operation, building)
    if used is not None and used is not operation:
        check_schedules(used.tables, files.weather, used.file)
    notes = (
        *stated_note(building, "" if operation is None else operation.file.name),
        *_unstated(operation, used, building, heat_of),
        *_ground_notes(operation, building, heat_of),
        *(() if used is None else weekday_note([used.tables], files.weather)),
        *_state_notes(options, operation, filled, systems, building),
        *(() if operation is None else tilt_note(operation.systems)),
        *unused_rules(tables, filled),
    )
    building = traced_building(building, systems)
    weather = with_albedo(files.weather, options.albedo)
    weather = weather if operation is None else operation.outdoors(weather)
    return Inputs(building, spaces, weather, systems, used, options, filled, notes, overrides.light_only)


def outdoor_inputs(
    options: InputOptions,
    files: InputFiles,
    select: Sequence[str],
    *,
    leave_out: Sequence[str] = (),
    reflectance: float | None = None,
    file: Path | None = None,
    progress: Progress = silent,
) -> tuple[Inputs, tuple[frozenset[str], ...]]:
    """The inputs of a command without rooms, and the GUIDs of the elements that selectors choose.

    Args: file: that has the selectors, for messages; select to reflectance: as of `read_elements`.

    Raises: `DataError` for a building that cannot be used, or a text that is no selector.
    """
    if options.building is None:
        raise ValueError("elements are selected in a building's file")
    building, chosen = read_elements(
        options.building,
        select,
        options=options.read,
        leave_out=leave_out,
        reflectance=reflectance,
        selected_in=file or "",
        progress=progress,
    )
    weather = with_albedo(files.weather, options.albedo)
    return Inputs(building, (), weather, {}, files.operation, options), chosen


def first_states(systems: Systems) -> Systems:
    """Each window in its first state."""
    return {guid: states[:1] for guid, states in systems.items()}


def every_state(systems: Systems) -> Systems:
    """Each window in all its states."""
    return systems


def _ground_notes(operation: Operation | None, building: Building, heat_of: RoomOptions | None) -> tuple[str, ...]:
    """Sentences on the ground below the rooms whose heat is balanced."""
    if operation is not None:
        return ground_note(operation.tables, building)
    return () if heat_of is None else assumed_ground_note(building)


def _unstated(
    operation: Operation | None, used: Operation | None, building: Building, heat_of: RoomOptions | None
) -> tuple[str, ...]:
    """A sentence on gains and leaks that neither the operation nor the building states."""
    if operation is not None:
        return unstated_note(operation.tables, building, operation.file.name)
    if heat_of is None:
        return ()
    if used is None:
        return unstated_note(heat_of, building)
    return unstated_note(OperationTables(), building, used.file.name)


def unused_rules(tables: OperationTables | None, systems: Systems) -> tuple[str, ...]:
    """A sentence where rules are stated for windows that have one state each."""
    if tables is None or not systems or any(len(states) > 1 for states in systems.values()):
        return ()
    if not any("control" in one.model_fields_set for one in (tables, *tables.rooms)):
        return ()
    return (Note("Every window has one state: the rules of [control] have no effect."),)


def _state_notes(
    options: InputOptions, operation: Operation | None, filled: Systems, systems: Systems, building: Building
) -> tuple[str, ...]:
    """A sentence where windows have more states than are used."""
    if operation is not None and operation.systems and options.system is not None:
        name = operation.file.name
        note = Note("--cfs sets the fenestration of the windows; [[system]] of {file} is not used.", file=name)
        return (note,)
    several = [
        states[0].name for guid, states in filled.items() if operation is None and len(systems[guid]) == 1 < len(states)
    ]
    if not several:
        return ()
    source = building.name if options.building is None else options.building.name
    names = ", ".join(dict.fromkeys(several))
    note = Note(
        "{file} has several shading states; without --operation the first state of each window "
        "({windows}) is used all year.",
        file=source,
        windows=names,
    )
    return (note,)
