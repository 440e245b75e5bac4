"""The small files of a study, read and checked before its buildings are."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from bim.building_file import check_building_file
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_system import checked_system
from scenes.heat.box import box_building
from scenes.input_files import check_names, read_weather
from scenes.room.operation import (
    Operation,
    check_schedules,
    check_states,
    check_systems,
    read_operation,
)
from scenes.study.study_file import Study, SystemTable


def check_files(study: Study) -> None:
    """Raise `DataError` for the first of a study's files that cannot be used, the quick ones first.

    What they hold is read again by the process that computes a case.
    """
    for room in study.room:
        check_names(room.spaces, f"room {room.name}: spaces")
        if room.building is not None:
            check_building_file(room.building)
        else:
            box_building(room.box)
    operations = [_checked_operation(study, system) for system in study.system or (None,)]
    for climate in study.climate:
        weather = read_weather(climate.weather)
        for operation in operations:
            if operation is not None:
                check_schedules(operation.tables, weather, operation.file)
                operation.outdoors(weather)
    for system in study.system:
        if system.bsdf is not None:
            read = read_system(system.bsdf, u_value=system.u_value, g_value=system.g_value)
            checked_system(read, system.bsdf)


def _checked_operation(study: Study, system: SystemTable | None) -> Operation | None:
    """The operation of a system, its states checked; None as for a study that names no system."""
    path = system.operation or study.operation if system is not None else study.operation
    if path is None:
        return None
    operation = read_operation(path)
    check_systems(operation)
    if system is not None:
        check_states(operation, len(operation.systems) or 1)
    return operation


def one_building(buildings: Iterable[Path | None]) -> Path:
    """The one file that all rooms of a study are of; None is a box.

    Raises: `DataError` where there are boxes among them, or several files.
    """
    files = set(buildings)
    if len(files) != 1 or None in files:
        count = len(files - {None})
        message = f"needs a study of one building file; this one has {count}, or boxes"
        raise DataError(message, field="--write-ifc")
    return files.pop()
