"""The files of a run."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from bim.names import folder_names
from mitsuba_cfs.files import write_table, write_text
from mitsuba_cfs.images.hdr import write_hdr
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.result_folder import EXPLORER, ResultFolder
from scenes.results import GridDaylight, RoomYear, RunResult
from scenes.room.daylight import illuminance_table
from scenes.room.glare import glare_table
from scenes.run.csv_text import csv_text
from scenes.run.netcdf import NAME as NETCDF
from scenes.run.netcdf import write_netcdf
from scenes.user_errors import user_message

REPORT = "report.html"


def write_results(
    result: RunResult,
    folder: ResultFolder,
    write_report=None,
    write_explorer=None,
    *,
    netcdf: bool = False,
) -> None:
    """Write all files of a run; earlier results are replaced at the end.

    Args:
        write_report: `scenes.report.write_report`, or None for no report.
        write_explorer: `scenes.explore.folder.write_explorer`, or None for no explorer.
        netcdf: whether all numbers are written as one netCDF file besides.

    A fault of the program in one of these pages is raised when all else is in place.
    """
    faults = []
    with folder.replaced() as temporary:
        several = len(result.spaces) > 1
        names = folder_names([room.space for room in result.spaces])
        for room, name in zip(result.spaces, names, strict=True):
            place = temporary / name if several else temporary
            place.mkdir(exist_ok=True)
            _write_room(result, room, place)
        write_table(_problems(result), temporary / "problems.csv", index=False)
        if netcdf:
            write_netcdf(result, temporary / NETCDF)
        for write, page in ((write_report, REPORT), (write_explorer, EXPLORER)):
            if write is not None:
                faults += _faults(write, result, temporary / page)
        places = (name if several else "." for name in names)
        guids = (room.space.guid for room in result.spaces)
        folders = dict(zip(guids, places, strict=True))  # of each room's tables
        text = json.dumps(result.manifest | {"folders": folders}, indent=2, ensure_ascii=False)
        write_text(temporary / "run.json", text + "\n")
    if faults:
        raise faults[0] if len(faults) == 1 else ExceptionGroup("no page was written", faults)


def _faults(
    write: Callable[[RunResult, Path], None], result: RunResult, page: Path
) -> list[Exception]:
    """Write a page; the fault that it was left out for, so that hours of work are not lost to it.

    A full disk and the like are no such fault: the earlier results stay then, as for every file.
    """
    try:
        write(result, page)
    except Exception as fault:
        if user_message(fault) is not None:
            raise
        if page.is_dir():
            shutil.rmtree(page)
        page.unlink(missing_ok=True)
        fault.add_note(f"{page.name} was left out; the other results are whole")
        return [fault]
    return []


def _write_room(result: RunResult, room: RoomYear, place: Path) -> None:
    table = illuminance_table(room.daylight, result.times)
    write_table(table, place / "illuminance.parquet")
    metrics = room.daylight.sensor_metrics.copy()
    metrics["relative_standard_error"] = room.daylight.relative_error
    _csv(metrics, place / "daylight_metrics.csv")
    _csv(pd.DataFrame([room.daylight.room_metrics]), place / "room_metrics.csv", index=False)
    _write_grids(room.daylight.grids, place)
    _csv(glare_table(room.glare, result.times), place / "dgp.csv")
    heat = room.heat
    _csv(heat.temperatures.join([heat.gains, heat.comfort]), place / "temperatures.csv")
    if room.operation is not None:
        _csv(room.operation.hours, place / "operation.csv")
        _csv(pd.DataFrame([room.operation.summary]), place / "loads.csv", index=False)
    if room.annual_glare is not None:
        _csv(room.annual_glare, place / "annual_glare.csv")
    _csv(pd.DataFrame([heat.comfort_summary]), place / "comfort.csv", index=False)
    for picture in room.glare.pictures:
        name = f"view_{result.times[picture.hour]:%m-%d_%Hh}"
        write_hdr(place / f"{name}.hdr", picture.luminance, room.glare.view)
        title = f"{result.times[picture.hour]:%d %B %H:%M}, DGP {picture.glare['dgp']:.2f}"
        write_falsecolour(place / f"{name}.png", picture.luminance, title=title)
    if (colour := room.glare.colour) is not None:
        name = f"view_{result.times[colour.hour]:%m-%d_%Hh}_colour"
        write_hdr(place / f"{name}.hdr", colour.radiance, room.glare.view)
        title = f"{result.times[colour.hour]:%d %B %H:%M}"
        write_tone_mapped(place / f"{name}.png", colour.radiance, scale=True, title=title)


def _write_grids(grids: Sequence[GridDaylight], place: Path) -> None:
    """Tables of the sensor grids of the building's file: one row a grid, one row a sensor."""
    if not grids:
        return
    rows = [{"grid": g.name, "sensors": len(g.sensor_metrics)} | g.metrics for g in grids]
    _csv(pd.DataFrame(rows), place / "grids.csv", index=False)
    tables = []
    for grid in grids:
        table = grid.sensor_metrics.reset_index()
        table.insert(0, "grid", grid.name)
        for number, axis in enumerate("xyz"):
            table.insert(5 + number, f"direction_{axis}", grid.directions[:, number])
        tables.append(table)
    _csv(pd.concat(tables), place / "grid_sensors.csv", index=False)


def _csv(table: pd.DataFrame, path: Path, index: bool = True) -> None:
    """A table with six significant digits, the same in every run."""
    write_text(path, csv_text(table, index=index))


def _problems(result: RunResult) -> pd.DataFrame:
    rows = [(p.where, p.what, p.consequence) for p in result.problems]
    return pd.DataFrame(rows, columns=["where", "what", "consequence"])
