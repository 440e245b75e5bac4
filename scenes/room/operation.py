"""An operation file: shading states and their control, gains, outdoor air, set points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TypeVar

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.pane_system import system_of_panes
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.tables import StateTable
from scenes.fenestration.thermal_system import checked_system
from scenes.room.operation_tables import OperationTables
from scenes.toml_file import read_table, validated

Tables = TypeVar("Tables", bound=OperationTables)


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation file with its systems read."""

    file: Path
    tables: OperationTables
    systems: tuple[FenestrationSystem, ...]  # states of every window; empty: the windows' own

    @property
    def files(self) -> tuple[Path, ...]:
        """The BSDF files and the tables of schedules that it names."""
        tables = (one.csv for one in self.tables.schedules.values())
        states = [table.placed(self.file.parent) for table in self.tables.system]
        panes = [layer.pane for table in states if table.bsdf is None for layer in table.layers]
        named = [None if table.bsdf is None else self.file.parent / table.bsdf for table in states]
        return tuple(path for path in (*named, *panes, *tables) if path is not None)

    def outdoors(self, weather: Weather) -> Weather:
        """The weather of its rooms: with the air of a street where it states one.

        Raises: `DataError` out of the range of the heat island's equation.
        """
        island = self.tables.heat_island
        return weather if island is None else island.warmed(weather, self.file)


def read_operation(path: str | PathLike[str]) -> Operation:
    """The operation of a TOML file; the paths in it start at its folder.

    Raises: `DataError` that names file and field.
    """
    path = Path(path)
    tables = schedules_there(validated(OperationTables, read_table(path), path), path)
    systems = []
    for number, one in enumerate(tables.system):
        place = None if one.bsdf is None else path.parent / one.bsdf
        if place is not None and not place.is_file():
            raise DataError(f"no such file: {one.bsdf}", file=path, field=f"system.{number}.bsdf")
        system = read_state(one.placed(path.parent), place, by=f"[[system]] of {path.name},")
        if any(system.name == other.name for other in systems):
            name = f"{system.name} ({number + 1})" if place is None else place.stem
            system = replace(system, name=name)
        systems.append(system)
    return Operation(path, tables, tuple(systems))


def check_systems(operation: Operation) -> None:
    """Raise `DataError` where a state's U, g and BSDF do not go together, naming its BSDF's file.

    Of a state by its panes that file is the operation's own.
    """
    for table, system in zip(operation.tables.system, operation.systems, strict=True):
        bsdf = table.placed(operation.file.parent).bsdf
        checked_system(system, operation.file if bsdf is None else operation.file.parent / bsdf)


def schedules_there(tables: Tables, path: Path) -> Tables:
    """The tables of a file with absolute paths of the schedules' CSV files, which are there."""
    found = {}
    for name, one in tables.schedules.items():
        place = None if one.csv is None else (path.parent / one.csv).absolute()
        if place is not None and not place.is_file():
            field = f"schedules.{name}.csv"
            raise DataError(f"no such file: {one.csv}", file=path, field=field)
        found[name] = one.model_copy(update={"csv": place})
    return tables.model_copy(update={"schedules": found})


def read_state(table: StateTable, path: Path | None, *, by: str = "") -> FenestrationSystem:
    """The system of a shading state from its BSDF file, with U, g and closure of its table.

    Args: path: None: its panes say its optics; by: what names the file, for the system's source.
    """
    if path is None:
        system = replace(system_of_panes(table.layers), source=f"{by} layers".strip())
    else:
        system = read_system(path, u_value=table.u_value, g_value=table.g_value, by=by)
    if table.layers:  # they say U and g too: those of the file beside are of another model
        system = replace(system, u_value=table.u_value, g_value=table.g_value, g_by_patch=None)
    by_patch = table.g_by_patch()
    return replace(
        system,
        closure=table.closure() or system.closure,
        g_by_patch=system.g_by_patch if by_patch is None else by_patch,
        shading_position=table.shading_position or system.shading_position,
    )


def check_states(operation: Operation, states: int) -> None:
    """Raise `DataError` where the control names states that the windows do not have."""
    for fault in (one.control_fault(states) for one in operation.tables.variants):
        if fault is None:
            continue
        field, message = fault
        raise DataError(message, file=operation.file, field=f"control.{field}")
