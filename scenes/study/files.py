"""The small files of a study, read and checked before its buildings are."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from bim.building_file import check_building_file
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_system import checked_system
from scenes.heat.box import box_building
from scenes.room.operation import check_states, read_operation
from scenes.room.operation_hours import check_schedules
from scenes.run.files import check_names
from scenes.run.inputs import read_weather
from scenes.study.study_file import Study


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
    operation = None if study.operation is None else read_operation(study.operation)
    if operation is not None:
        if study.system:
            check_states(operation, 1)
    for climate in study.climate:
        weather = read_weather(climate.weather)
        if operation is not None:
            check_schedules(operation.tables, weather, operation.file)
    for system in study.system:
        read = read_system(system.bsdf, u_value=system.u_value, g_value=system.g_value)
        checked_system(read, system.bsdf)


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
