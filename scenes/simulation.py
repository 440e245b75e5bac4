"""The year of a room for people who write Python: one call, and a result that shows itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from bim.model import Room
from mitsuba_cfs.errors import DataError, check_type
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from scenes import plots
from scenes import quick as quick_run
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.thermal_system import checked_system
from scenes.head import NO_HEAD, Head
from scenes.input_files import InputFiles, overrides_of, read_weather
from scenes.inputs import inputs_of
from scenes.report.headline import cards
from scenes.report.page import write_report
from scenes.result_folder import ResultFolder
from scenes.results import RoomYear, RunResult
from scenes.room.operation import Controller, Operation, read_operation
from scenes.room.options import RoomOptions
from scenes.run.netcdf import attributes, year_dataset
from scenes.run.options import JobOptions
from scenes.run.outputs import write_results
from scenes.run.run import run_inputs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from xarray import Dataset


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SimulatedYear(RoomYear):
    """A room's year that can write its files and show itself."""

    run: RunResult  # that it is the one room of; without it
    head: Head = NO_HEAD  # what was left out of the model, what was assumed

    @property
    def hours(self) -> pd.DataFrame:
        """Every hour [H], as of `RoomYear`; `hours.attrs["units"]` has the unit of each column."""
        hours = super(SimulatedYear, self).hours
        hours.attrs["units"] = {name: attributes(name)["units"] for name in hours.columns}
        return hours

    def write(self, folder: str | PathLike[str], *, report: bool = True, netcdf: bool = False) -> None:
        """Write the files of `cfs run` in the place of its earlier ones.

        Raises: `DataError` where the folder holds anything else, or cannot be written to.
        """
        inputs = (Path(entry["path"]) for entry in self.run.manifest["inputs"].values())
        result_folder = ResultFolder(Path(folder), "run", inputs=inputs, field="folder")
        page = write_report if report else None
        write_results(self._whole_run(), result_folder, page, netcdf=netcdf)

    def to_xarray(self) -> Dataset:
        """All numbers of the year with their units, see `scenes.run.netcdf`.

        Raises: `DataError` where xarray is not installed.
        """
        return year_dataset(self._whole_run())

    def plot_illuminance(self, axes: Axes | None = None) -> Axes:
        """The work plane's mean illuminance by day and hour."""
        return plots.illuminance(self, axes)

    def plot_glare(self, axes: Axes | None = None) -> Axes:
        """DGP of every hour where it was rated, else of the pictures."""
        return plots.glare(self, axes)

    def plot_temperatures(self, axes: Axes | None = None) -> Axes:
        """Operative and outdoor temperature of the year, and what ASHRAE 55 finds comfortable."""
        return plots.temperatures(self, axes)

    def _repr_html_(self) -> str:
        """The headline figures of the report as a table, for notebooks."""
        run = self._whole_run()
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(card.label)}</th>"
            f"<td>{escape(f'{card.value} {card.unit}'.strip())}</td></tr>"
            for card in cards(run, self)
        )
        name = escape(f"{self.space.label}, {run.manifest['system']}, {run.method}")
        return f"<table><caption>{name}</caption>{rows}</table>"

    def _whole_run(self) -> RunResult:
        return replace(self.run, spaces=(self,))


def simulate(
    room: Room,
    system: FenestrationSystem | str | PathLike[str] | None,
    weather: Weather | str | PathLike[str],
    *,
    operation: Operation | str | PathLike[str] | None = None,
    control: Controller | None = None,
    quick: bool = False,
    cache: bool = True,
    progress: Progress = silent,
    **options: object,
) -> SimulatedYear:
    """Daylight, glare, temperatures and comfort of a room's year, as `cfs run` computes them.

    The same inputs, options and seed give the same numbers as there.

    Args:
        room: of a building, `read_building("house.ifc").room("Office")`.
        system: in all windows, a file or `read_system("blind.xml")`; None: the states of the
            operation, else what the building's file holds for each.
        weather: of the year, a file or `read_weather("city.epw")`.
        operation: shading control, gains, set points: a file, or `read_operation("office.toml")`;
            without it the first state holds all year and the room floats freely.
        control: function of each hour (`ControlHour`) that returns the shading states, in place of
            the operation's rules; see `Operation.controlled_by`.
        quick: few rays and one small picture, for a first look, as `--quick`.
        cache: keep traced matrices in the user's cache and find them again.
        progress: called with each stage and how much of it is done.
        options: choices by the names of `RoomOptions.of`, such as `method`, `seed`, `annual_glare`.

    Raises: `DataError` for a room that cannot be computed, a window without a system.
    """
    check_type("room", room, Room)
    building = room.building
    if isinstance(operation, str | PathLike):
        operation = read_operation(operation)
    if isinstance(weather, str | PathLike):
        weather = read_weather(weather)
    if isinstance(system, str | PathLike):
        system = read_system(system)
    check_type("weather", weather, Weather)
    for name, value, kind in (("system", system, FenestrationSystem), ("operation", operation, Operation)):
        if value is not None:
            check_type(name, value, kind)
    states = () if operation is None else operation.systems
    if system is None and not states and building.file is None:
        raise DataError("a building that is not from a file needs a system", element="simulate")
    if system is not None:
        checked_system(system, system.file)
    if control is not None:
        if operation is None:
            message = "needs an operation, whose file has the shading states: operation=..."
            raise DataError(message, element="simulate", field="control")
        operation = operation.controlled_by(control)
    if quick:
        options = quick_run.picks(quick_run.ROOM, options) | options
    chosen = JobOptions(
        building=building.file,
        weather=weather.file,
        system=None if system is None else system.file,
        operation=None if operation is None else operation.file,
        spaces=(room.space.guid,),
        cache=cache,
        colour=False,  # a picture of the report
        quick=quick,
        room=RoomOptions.of(**options),
    )
    overrides = overrides_of(chosen, system, operation)
    files = InputFiles(weather, overrides, operation)
    inputs = inputs_of(building, chosen, files, heat_of=chosen.room)
    run = run_inputs(inputs, chosen, progress)
    (year,) = run.spaces
    own = {name: getattr(year, name) for name in RoomYear.__dataclass_fields__}
    return SimulatedYear(**own, run=replace(run, spaces=()), head=inputs.head)
