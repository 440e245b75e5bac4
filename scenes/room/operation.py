"""An operation file with its systems, and the use of rooms that a building's file states."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from bim.model import Building, Space
from bim.use import ScheduledValue, StatedUse, YearSchedule
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.pane_system import system_of_panes
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.tables import StateTable
from scenes.fenestration.thermal_system import checked_system
from scenes.room.operation_tables import PARTS, OperationTables, RoomsTable
from scenes.room.schedules import ScheduleTable
from scenes.toml_file import read_table, validated

Tables = TypeVar("Tables", bound=OperationTables)
PREFIX = "of the building's file: "  # of the names of schedules that the building's file contains


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation file and its fenestration systems."""

    file: Path
    tables: OperationTables
    systems: tuple[FenestrationSystem, ...]  # states of every window; empty: the building file's

    @property
    def files(self) -> tuple[Path, ...]:
        """The BSDF files and CSV schedules that the file names."""
        tables = (one.csv for one in self.tables.schedules.values())
        states = [table.placed(self.file.parent) for table in self.tables.system]
        panes = [layer.pane for table in states if table.bsdf is None for layer in table.layers]
        named = [None if table.bsdf is None else self.file.parent / table.bsdf for table in states]
        return tuple(path for path in (*named, *panes, *tables) if path is not None)

    def outdoors(self, weather: Weather) -> Weather:
        """The weather of its rooms, with the urban heat island that the file states.

        Raises: `DataError` outside the range of the heat island's equation.
        """
        island = self.tables.heat_island
        return weather if island is None else island.warmed(weather, self.file)


def read_operation(path: str | PathLike[str]) -> Operation:
    """The operation of a TOML file; paths in it are relative to its folder.

    Raises: `DataError` that names file and field.
    """
    path = Path(path)
    tables = schedules_there(validated(OperationTables, read_table(path), path), path)
    systems = []
    for number, state in enumerate(tables.system):
        bsdf = None if state.bsdf is None else path.parent / state.bsdf
        if bsdf is not None and not bsdf.is_file():
            raise DataError(f"no such file: {state.bsdf}", file=path, field=f"system.{number}.bsdf")
        system = read_state(state.placed(path.parent), bsdf, by=f"[[system]] of {path.name},")
        if any(system.name == other.name for other in systems):
            name = f"{system.name} ({number + 1})" if bsdf is None else bsdf.stem
            system = replace(system, name=name)
        systems.append(system)
    return Operation(path, tables, tuple(systems))


def check_systems(operation: Operation) -> None:
    """Raise `DataError` for a state with inconsistent U, g and BSDF, naming its BSDF file.

    A state given by its panes names the operation file.
    """
    for table, system in zip(operation.tables.system, operation.systems, strict=True):
        bsdf = table.placed(operation.file.parent).bsdf
        checked_system(system, operation.file if bsdf is None else operation.file.parent / bsdf)


def schedules_there(tables: Tables, path: Path) -> Tables:
    """The tables of a file with absolute paths of CSV schedules.

    Raises: `DataError` for a file that does not exist.
    """
    schedules = {}
    for name, one in tables.schedules.items():
        csv = None if one.csv is None else (path.parent / one.csv).absolute()
        if csv is not None and not csv.is_file():
            field = f"schedules.{name}.csv"
            raise DataError(f"no such file: {one.csv}", file=path, field=field)
        schedules[name] = one.model_copy(update={"csv": csv})
    return tables.model_copy(update={"schedules": schedules})


def read_state(table: StateTable, path: Path | None, *, by: str = "") -> FenestrationSystem:
    """The system of a shading state from its BSDF file, with U, g and closure of its table.

    Args: path: of the BSDF; None: optics from the panes. by: start of the system's source.
    """
    if path is None:
        system = replace(system_of_panes(table.layers), source=f"{by} layers".strip())
    else:
        system = read_system(path, u_value=table.u_value, g_value=table.g_value, by=by)
    if table.layers:  # their U and g come before those of the BSDF's thermal file
        system = replace(system, u_value=table.u_value, g_value=table.g_value, g_by_patch=None)
    by_patch = table.g_by_patch()
    return replace(
        system,
        closure=table.closure() or system.closure,
        g_by_patch=system.g_by_patch if by_patch is None else by_patch,
        shading_position=table.shading_position or system.shading_position,
    )


def check_states(operation: Operation, states: int) -> None:
    """Raise `DataError` for a control that names states that the windows do not have."""
    for fault in (one.control_fault(states) for one in operation.tables.variants):
        if fault is None:
            continue
        field, message = fault
        raise DataError(message, file=operation.file, field=f"control.{field}")


def used_operation(operation: Operation | None, building: Building) -> Operation | None:
    """The operation, completed by the use of rooms in the building's file; None without either."""
    if not building.uses or building.file is None:
        return operation
    tables = OperationTables() if operation is None else operation.tables
    file = building.file if operation is None else operation.file
    systems = () if operation is None else operation.systems
    return Operation(file, with_stated_uses(tables, building), systems)


def with_stated_uses(tables: Tables, building: Building) -> Tables:
    """The tables with an entry for each room whose use the building's file states.

    Values of the operation file come before those of the building's file, key by key.

    Raises: `DataError` for an impossible value, naming the building's file.
    """
    if not building.uses:
        return tables
    file = building.file or Path(building.name)
    stated = _Schedules()
    entries = []
    for space in building.spaces:
        use = building.uses.get(space.guid)
        if use is None:
            continue
        own = stated_fields(use, space, stated)
        entries.append(validated(RoomsTable, _entry(tables, building, space, own), file))
    update = {"rooms": (*entries, *tables.rooms), "schedules": stated.tables | tables.schedules}
    return tables.model_copy(update=update)


def stated_note(building: Building, before: str = "") -> tuple[str, ...]:
    """A sentence on rooms whose use is that of the building's file; empty without any.

    Args: before: name of the file whose values come first.
    """
    count = sum(space.guid in building.uses for space in building.spaces)
    if not count or building.file is None:
        return ()
    values = {"count": count, "all": len(building.spaces), "file": building.file.name}
    if not before:
        note = Note(
            "Gains, outdoor air and set points of {count} of {all} rooms are from {file}.", **values
        )
        return (note,)
    note = Note(
        "Gains, outdoor air and set points of {count} of {all} rooms are from {file}; values of "
        "{operation} take precedence.",
        operation=before,
        **values,
    )
    return (note,)


def _entry(
    tables: OperationTables, building: Building, space: Space, own: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """The tables of one room: the building's, then the operation's own, then its `[[rooms]]`."""
    chosen = tables.entry_of(building, space)
    tables_of_room: dict[str, Any] = {"spaces": (space.guid,)}
    for part in PARTS:
        stated = getattr(tables, part).model_fields_set
        fields = {key: value for key, value in own.get(part, {}).items() if key not in stated}
        if chosen is not None:
            entry = getattr(chosen, part)
            fields |= {key: getattr(entry, key) for key in entry.model_fields_set}
        tables_of_room[part] = fields
    return tables_of_room


class _Schedules:
    """Schedules of a building's file as tables with unique names, each schedule once."""

    def __init__(self) -> None:
        self.tables: dict[str, ScheduleTable] = {}
        self._names: dict[tuple[int, float], str] = {}
        self._referenced: list[YearSchedule] = []  # kept alive, so that ids stay unique
        self._counts: Counter[str] = Counter()

    def name(self, schedule: YearSchedule, factor: float = 1.0) -> str:
        """The name of a schedule times a number."""
        key = (id(schedule), factor)
        if key not in self._names:
            self._referenced.append(schedule)
            self._counts[schedule.name] += 1
            count = self._counts[schedule.name]
            name = f"{PREFIX}{schedule.name}{f' {count}' if count > 1 else ''}"
            self._names[key] = name
            self.tables[name] = ScheduleTable.from_file(schedule, factor)
        return self._names[key]

    def value(self, value: ScheduledValue, per: float) -> str | float:
        """The name of the schedule of a quantity divided by a number, or a constant."""
        amount = value.peak / per
        return self.name(value.share, amount) if amount and value.share is not None else amount


def stated_fields(use: StatedUse, space: Space, schedules: _Schedules) -> dict[str, dict[str, Any]]:
    """The fields of a room's tables by part, from its stated use."""
    gains, air, loads = {}, {}, {}
    area, changes = space.floor_area, space.volume / 3600.0
    if use.persons is not None:
        gains["persons"] = use.persons.peak
        if use.persons.share is not None:
            gains["occupied"] = schedules.name(use.persons.share)
    for key, value in (("equipment_w_m2", use.equipment_w), ("lighting_w_m2", use.lighting_w)):
        if value is not None:
            gains[key] = schedules.value(value, area)
    if use.lighting_w is not None and use.lighting_target_lx is None:
        gains["lighting_dimmed"] = False
    for key, value in (
        ("infiltration_ach", use.infiltration_m3_s), ("ventilation_ach", use.ventilation_m3_s),
    ):  # fmt: skip
        if value is not None:
            air[key] = schedules.value(value, changes)
    for key, schedule in (("heating_c", use.heating_c), ("cooling_c", use.cooling_c)):
        if schedule is not None:
            loads[key] = schedules.name(schedule)
    single = {
        "gains": (gains, {"person_w": use.person_w, "person_vapour_g_h": use.person_vapour_g_h,
                          "lighting_target_lx": use.lighting_target_lx,
                          "radiant_share": use.radiant_share}),
        "air": (air, {"infiltration_factors": use.infiltration_factors,
                      "heat_recovery": use.heat_recovery}),
        "loads": (loads, {"heating_limit_w": use.heating_limit_w,
                          "cooling_limit_w": use.cooling_limit_w,
                          "humidify_to": use.humidify_to, "dehumidify_to": use.dehumidify_to}),
    }  # fmt: skip
    return {
        part: named | {key: value for key, value in plain.items() if value is not None}
        for part, (named, plain) in single.items()
    }
