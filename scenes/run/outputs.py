"""The files of a run."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from contextvars import copy_context
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pandas as pd

from bim.names import folder_names
from bim.report.issue import COLUMNS, issue_rows
from mitsuba_cfs.files import json_text, write_table, write_text
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.progress import Progress, silent
from scenes.language.catalogue import current_language, gettext, in_language
from scenes.language.numbers import rounded, spoken
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.result_folder import EXPLORER, FIRST_PLAN, REPORT, ResultFolder
from scenes.results import GridDaylight, RoomYear, RunResult, SpectralYear, glare_table, sensor_table
from scenes.run.csv_text import csv_text
from scenes.run.ladybug import NAME as LADYBUG
from scenes.run.ladybug import write_ladybug
from scenes.run.netcdf import NAME as NETCDF
from scenes.run.netcdf import write_netcdf
from scenes.user_errors import user_message
from scenes.workers import TASKS_A_PROCESS, Tasks, processes_for


def write_results(
    result: RunResult,
    folder: ResultFolder,
    write_report=None,
    write_explorer=None,
    *,
    netcdf: bool = False,
    ladybug: bool = False,
    processes: int | None = 1,
    first_plan: str = "",
    progress: Progress = silent,
) -> None:
    """Write all files of a run; earlier results are replaced at the end.

    Args:
        write_report: `scenes.report.write_report`, or None for no report.
        write_explorer: `scenes.explore.folder.write_explorer`, or None for no explorer.
        netcdf: whether all numbers are written as one netCDF file besides.
        ladybug: whether the illuminances are written as a folder of Ladybug Tools besides.
        processes: that many rooms' files are written at a time; None: as of `processes_for`.
        first_plan: the table of the first plan, where there was one.

    Captions in pictures are in the language of `in_language`. A fault of the program in one of
    these pages is raised when all else is in place.
    """
    faults = []
    with folder.replaced() as temporary:
        several = len(result.spaces) > 1
        names = folder_names([room.space for room in result.spaces])
        places = [temporary / name if several else temporary for name in names]
        with _writing_rooms(result, places, processes, progress):
            write_table(_issues(result), temporary / "problems.csv", index=False)
            if first_plan:
                write_text(temporary / FIRST_PLAN, first_plan)
            if netcdf:
                write_netcdf(result, temporary / NETCDF)
            if ladybug:
                write_ladybug(result, temporary / LADYBUG)
            if result.twin is not None:
                result.twin.write(temporary)
            for write, page in ((write_report, REPORT), (write_explorer, EXPLORER)):
                if write is not None:
                    faults += _faults(write, result, temporary / page)
        guids = (room.space.guid for room in result.spaces)
        within = (name if several else "." for name in names)
        folders = dict(zip(guids, within, strict=True))  # of each room's tables
        text = json_text(result.manifest | {"folders": folders}, indent=2, ensure_ascii=False)
        write_text(temporary / "run.json", text + "\n")
    if faults:
        raise faults[0] if len(faults) == 1 else ExceptionGroup("no page was written", faults)


def _faults(write: Callable[[RunResult, Path], None], result: RunResult, page: Path) -> list[Exception]:
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


@contextmanager
def _writing_rooms(
    result: RunResult, places: Sequence[Path], processes: int | None, progress: Progress
) -> Iterator[None]:
    """Write the files of the rooms before the block; where several processes do so, while it runs."""
    rooms = len(result.spaces)
    # a process takes as long to begin as it does to write some rooms
    count = min(processes_for(rooms, processes), rooms // TASKS_A_PROCESS)
    if count < 2:
        _write_rooms(result, places, 1, progress)
        yield
        return
    with ThreadPoolExecutor(1) as thread:
        written = thread.submit(copy_context().run, _write_rooms, result, places, count, progress)
        yield
        written.result()


def _write_rooms(result: RunResult, places: Sequence[Path], processes: int, progress: Progress) -> None:
    """The files of each room in its folder."""
    rooms = list(zip(result.spaces, places, strict=True))
    tasks = Tasks(
        rooms,
        _Files(result.times, current_language()),
        _fault,
        key=lambda item: item[0].space.guid,
        scene=lambda item: item[0].space.guid,
    )
    with closing(tasks.results(processes=processes)) as written:
        passed = zip(result.spaces, written, strict=True)
        for number, (_, error) in enumerate(passed, 1):  # a room passed goes out of memory
            if error is not None:
                raise error
            progress("results", number / (len(rooms) + 1))


def _fault(item: tuple[RoomYear, Path], error: BaseException) -> BaseException:
    return error


@dataclass(frozen=True, slots=True)
class _Files:
    """Writes the files of a room."""

    times: pd.DatetimeIndex
    language: str  # of captions in pictures

    def __call__(self, item: tuple[RoomYear, Path]) -> None:
        room, place = item
        place.mkdir(exist_ok=True)
        with in_language(self.language):
            _write_room(room, self.times, place)


def _write_room(room: RoomYear, times: pd.DatetimeIndex, place: Path) -> None:
    table = sensor_table(room.daylight.illuminance, times)
    write_table(table, place / "illuminance.parquet")
    metrics = room.daylight.sensor_metrics.copy()
    metrics["relative_standard_error"] = room.daylight.relative_error
    _csv(metrics, place / "daylight_metrics.csv")
    _csv(pd.DataFrame([room.daylight.room_metrics]), place / "room_metrics.csv", index=False)
    _write_grids(room.daylight.grids, place)
    if room.glare.pictures:
        _csv(glare_table(room.glare, times), place / "dgp.csv")
    heat = room.heat
    _csv(heat.temperatures.join([heat.gains, heat.comfort]), place / "temperatures.csv")
    if room.operation is not None:
        _csv(room.operation.hours, place / "operation.csv")
        _csv(pd.DataFrame([room.operation.summary]), place / "loads.csv", index=False)
        _write_shading(room, times, place)
    if room.annual_glare is not None:
        _csv(room.annual_glare, place / "annual_glare.csv")
    if room.glare_map is not None:
        _csv(room.glare_map.table(), place / "glare_map.csv", index=False)
    if room.spectral is not None:
        _csv(room.spectral.eye, place / "melanopic.csv")
        sensors = metrics[list("xyz")].join(room.spectral.sensor_metrics)
        _csv(sensors, place / "melanopic_sensors.csv")
        _csv(pd.DataFrame([room.spectral.summary]), place / "melanopic_year.csv", index=False)
        write_table(sensor_table(room.spectral.melanopic, times), place / "melanopic.parquet")
        write_table(eye_spectrum(room.spectral, times), place / "eye_spectrum.parquet")
    if room.sensitivities is not None:
        _csv(room.sensitivities, place / "sensitivities.csv", index=False)
    if room.bands is not None:
        _csv(room.bands.figures, place / "bands.csv", index=False)
        _csv(room.bands.verdicts, place / "bands_verdicts.csv", index=False)
    _csv(pd.DataFrame([heat.comfort_summary]), place / "comfort.csv", index=False)
    for picture in room.glare.pictures:
        name = f"view_{times[picture.hour]:%m-%d_%Hh}"
        write_hdr(place / f"{name}.hdr", picture.luminance, room.glare.view)
        title = f"{spoken(times[picture.hour])}, DGP {rounded(picture.glare['dgp'], 2)}"
        write_falsecolour(place / f"{name}.png", picture.luminance, title=title)
    if (colour := room.glare.colour) is not None:
        name = f"view_{times[colour.hour]:%m-%d_%Hh}_colour"
        write_hdr(place / f"{name}.hdr", colour.radiance, room.glare.view)
        title = f"{spoken(times[colour.hour])}; {gettext('white balance: daylight outdoors')}"
        write_tone_mapped(place / f"{name}.png", colour.radiance, scale=True, title=title)


def eye_spectrum(spectral: SpectralYear, times: pd.DatetimeIndex) -> pd.DataFrame:
    """Irradiance of the eye [W/m2] in each band in every hour; columns are named by the bands."""
    names = [f"{a:g}-{b:g}_nm_w_m2" for a, b in pairwise(spectral.edges_nm)]
    return pd.DataFrame(spectral.spectrum, index=times, columns=names).rename_axis("time")


def _write_shading(room: RoomYear, times: pd.DatetimeIndex, place: Path) -> None:
    """Figures of each group of windows that moves, and every move; of windows with states."""
    if room.operation is None or len(room.operation.states) < 2:
        return
    shading = room.operation.shading
    occupied = room.heat.comfort["occupied"].to_numpy(bool)
    _csv(shading.figures(occupied, times), place / "shading.csv", index=False)
    _csv(shading.moves(times), place / "shading_moves.csv", index=False)


def _write_grids(grids: Sequence[GridDaylight], place: Path) -> None:
    """Tables of the sensor grids of the building's file: one row per grid, one row per sensor."""
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


def _issues(result: RunResult) -> pd.DataFrame:
    return pd.DataFrame(issue_rows(result.issues, "command"), columns=list(COLUMNS))
