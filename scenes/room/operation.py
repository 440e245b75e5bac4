"""An operation file: shading states and their control, gains, outdoor air, set points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.tables import StateTable
from scenes.room.operation_tables import OperationTables
from scenes.toml_file import read_table, validated


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation file with its systems read."""

    file: Path
    tables: OperationTables
    systems: tuple[FenestrationSystem, ...]  # states of every window; empty: the windows' own

    @property
    def files(self) -> tuple[Path, ...]:
        """The BSDF files that it names."""
        return tuple(self.file.parent / table.bsdf for table in self.tables.system)


def read_operation(path: str | PathLike[str]) -> Operation:
    """The operation of a TOML file; the paths in it start at its folder.

    Raises: `DataError` that names file and field.
    """
    path = Path(path)
    tables = validated(OperationTables, read_table(path), path)
    systems = []
    for number, one in enumerate(tables.system):
        place = path.parent / one.bsdf
        if not place.is_file():
            raise DataError(f"no such file: {one.bsdf}", file=path, field=f"system.{number}.bsdf")
        system = read_state(one, place, by=f"[[system]] of {path.name},")
        if any(system.name == other.name for other in systems):
            system = replace(system, name=place.stem)
        systems.append(system)
    return Operation(path, tables, tuple(systems))


def read_state(table: StateTable, path: Path, *, by: str = "") -> FenestrationSystem:
    """The system of a shading state from its BSDF file, with U, g and closure of its table.

    Args: by: what names the file, for the system's source.
    """
    system = read_system(path, u_value=table.u_value, g_value=table.g_value, by=by)
    return replace(system, closure=table.closure() or system.closure)


def check_states(operation: Operation, states: int) -> None:
    """Raise `DataError` where the control names states that the windows do not have."""
    fault = operation.tables.control.fault(states)
    if fault is not None:
        field, message = fault
        raise DataError(message, file=operation.file, field=f"control.{field}")
