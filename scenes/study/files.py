"""The small files of a study, read and checked before its buildings are."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from bim.building_file import check_building_file
from mitsuba_cfs.errors import DataError
from scenes.heat.box import box_building
from scenes.input_files import check_hours, check_names, read_files, read_weather
from scenes.study.study_file import NO_SYSTEM, SYSTEM_TABLE, Study


def check_files(study: Study) -> None:
    """Raise `DataError` for the first of a study's files that cannot be used, the quick ones first.

    What they hold is read again by the process that computes a case.
    """
    for room in study.room:
        check_names(room.spaces, f"room {room.name}: spaces")
        if room.building is not None:
            for path in (room.building, *room.linked):
                check_building_file(path)
        else:
            box_building(room.box)
    first, *others = [read_weather(climate.weather) for climate in study.climate]
    for system in study.system or (NO_SYSTEM,):
        options = study.inputs(None, system, study.climate[0])
        operation = read_files(options, weather=first, table=SYSTEM_TABLE).operation
        for weather in others if operation is not None else ():
            check_hours(operation, weather)


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
