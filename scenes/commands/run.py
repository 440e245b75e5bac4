"""`cfs run`: a building, a weather and a fenestration system to a folder of results."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from mitsuba_cfs.methods import METHODS
from scenes import quick as quick_run
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    BY_MACHINE,
    FILE,
    PrintedHead,
    bands_option,
    channels_option,
    chosen_language,
    explore_option,
    height_option,
    input_options,
    method_option,
    named_settings,
    processes_option,
    replacing,
    room_options,
    scheduler_option,
    sensitivities_option,
    size_option,
    spacing_option,
    spectral_option,
    stated_options,
    taken,
    u_option,
)
from scenes.commands.under_way import FirstPlanPage
from scenes.room.options import RoomOptions
from scenes.run.options import JobOptions

LOADS = ("heating", "cooling", "lighting")
NEED_PHASES = {
    "annual_glare": "--annual-glare",
    "spectral": "--spectral",
    "sensitivities": "--sensitivities",
    "bands": "--bands",
    "explore": "--explore",
    "inner_glass": "--inner-glass",
    "error": "--error",
}
_DEFAULT = RoomOptions()


class Percentage(click.ParamType):
    """A share in per cent, such as 5%."""

    name = "PERCENT"

    def convert(self, value: str | float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The share, 0 to 1."""
        if isinstance(value, float):
            return value
        try:
            share = float(value.removesuffix("%")) / 100
        except ValueError:
            share = -1.0
        if not 0 < share < 1:
            self.fail(f"{value!r}: expected a percentage above 0 and below 100, such as 5%")
        return share


@click.command(cls=StrictCommand)
@input_options("all with a window")
@room_options
@spectral_option
@channels_option
@sensitivities_option
@bands_option
@method_option(METHODS, "see docs/daylight.md", default=_DEFAULT.method)
@u_option
@click.option("--g", "g_value", type=click.FloatRange(0, 1), help="g-value at normal incidence.")
@click.option(
    "--picture",
    "picture_hours",
    multiple=True,
    metavar="'MM-DD HH[:MM]'",
    help="Hour to render and rate, may be repeated; default: nine hours and the brightest.",
)
@size_option("picture_size", _DEFAULT.outputs.picture_size, "up to ten pictures in each room's report")
@spacing_option
@height_option
@click.option(
    "--ach",
    "infiltration_ach",
    type=click.FloatRange(0, 50),
    default=_DEFAULT.infiltration_ach,
    show_default=True,
    help="Outdoor air change rate [1/h].",
)
@click.option(
    "--operation", type=FILE, help="TOML file: shading states and control, gains, set points; see docs/thermal.md."
)
@click.option(
    "--inner-glass",
    is_flag=True,
    help="Let daylight through glass and open doorways between rooms; rooms lit by that alone are "
    "computed too, and those open to each other by more than a door are one room.",
)
@click.option(
    "--no-coupled-heat",
    "coupled_heat",
    is_flag=True,
    flag_value=False,
    default=True,
    help="Simulate each room alone, with adjacent rooms at its own temperature.",
)
@click.option("--no-colour", is_flag=True, help="Omit the colour picture of each room; implied by --quick.")
@explore_option()
@processes_option(None, BY_MACHINE)
@scheduler_option
@click.option(
    "--error",
    type=Percentage(),
    help="Relative standard error of the sensors' yearly means that is enough, such as 5%: fewer "
    "rays are traced where a first plan shows that these suffice.",
)
@click.option(
    "--energyplus", is_flag=True, help="Also write the rooms as EnergyPlus input (model.epJSON, schedules.csv)."
)
@click.option("--netcdf", is_flag=True, help="Also write all results to results.nc, for xarray; see docs/formats.md.")
@click.option(
    "--ladybug",
    is_flag=True,
    help="Also write illuminances to ladybug, a results folder of Ladybug Tools; see docs/formats.md.",
)
def command(
    out: Path, page: Path | None, settings: tuple[str, ...], processes: int | None, scheduler: str | None, **chosen
) -> None:
    """Compute daylight, glare, temperatures and comfort of a building's rooms.

    BUILDING is a honeybee model (.hbjson), gbXML, a Radiance scene (.rad) or IFC: one file or
    several of one building (architecture, facade, site), a folder or an .ifczip of them.
    """
    phases = chosen["method"] != "point-in-time"
    for name, flag in NEED_PHASES.items():
        if chosen[name] and not phases:
            raise click.UsageError(f"{flag} needs --method three-phase or five-phase")
    if chosen["inner_glass"] and chosen["explore"]:
        raise click.UsageError("--inner-glass and --explore exclude each other")
    named = named_settings(settings)
    if chosen["quick"]:
        chosen |= quick_run.picks(quick_run.ROOM, stated_options())
    chosen |= named
    colour = not (chosen.pop("no_colour") or chosen["quick"])
    own = taken(JobOptions, chosen)
    options = JobOptions(**own, colour=colour, room=RoomOptions.of(**chosen))
    run_to_folder(options, out, page, processes=processes, scheduler=scheduler)


def run_to_folder(
    options: JobOptions, out: Path, page: Path | None = None, *, processes: int | None = 1, scheduler: str | None = None
) -> None:
    """Run the job with a progress bar, say what comes out room by room, and write its files."""
    from mitsuba_cfs.matrices.cache import default_folder
    from scenes.page_options import RunSection, read_page
    from scenes.result_folder import ResultFolder
    from scenes.run.files import read_files
    from scenes.workers import check_dask

    if scheduler is not None:
        check_dask()
    page_options = read_page(page, RunSection, chosen_language())
    inputs = (options.building, options.weather, options.system, options.operation)
    inputs += (*options.linked, *options.surroundings, *page_options.inputs)
    folder = ResultFolder(out, "run", inputs=inputs, replacing=replacing())
    if options.cache:
        default_folder()  # or one line that it cannot be one
    files = read_files(options)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.language.catalogue import in_language, ngettext
    from scenes.result_folder import EXPLORER, REPORT
    from scenes.run.run import Workers, run_job

    if options.quick:
        click.echo(quick_run.NOTE)
    head, plan = PrintedHead(), FirstPlanPage(folder, REPORT, page_options.language, refined=True)
    lines = _RoomLines(plan)
    with ProgressBar() as progress, compiled_beside():
        result = run_job(
            options,
            progress,
            files,
            on_room=lines.year,
            on_light=lines.light,
            on_head=head,
            on_plan=plan,
            workers=Workers(processes, scheduler),
        )
        progress("results", 0.0)
        from scenes.explore.folder import write_explorer  # half a second, which the first plan does not wait for
        from scenes.report.page import write_report
        from scenes.run.outputs import write_results

        report = partial(write_report, page=page_options)
        explorer = partial(write_explorer, page=page_options) if options.explore else None
        with in_language(page_options.language):
            write_results(
                result,
                folder,
                report,
                explorer,
                netcdf=options.netcdf,
                ladybug=options.ladybug,
                processes=processes,
                first_plan=plan.table,
                progress=progress,
            )
        progress("results", 1.0)
    head.notes(note for note in result.notes if note != quick_run.NOTE)
    if result.issues:
        problems = ngettext("{count} problem", "{count} problems", len(result.issues))
        click.echo(f"{problems} in the model: {out / 'problems.csv'}")
    click.echo(f"report: {out / 'report.html'}")
    if options.explore:
        click.echo(f"explorer: {out / EXPLORER / 'index.html'}")


class _RoomLines:
    """The headline figures of each room as it comes: of its light first where heat comes later."""

    def __init__(self, plan: FirstPlanPage) -> None:
        self._lit: set[str] = set()
        self._plan = plan

    def light(self, room) -> None:
        """Print those of a room's light."""
        self._lit.add(room.space.guid)
        self._plan.light(room)
        click.echo(f"{room.space.label}: {_light_figures(room)}")
        _print_grids(room)

    def year(self, room) -> None:
        """Print those of its heat, and of its light where that was not said."""
        light_printed = room.space.guid in self._lit
        if not light_printed:
            self._plan.light(room)
        click.echo(f"{room.space.label}: {_heat_figures(room)}" if light_printed else summary_line(room))
        if not light_printed:
            _print_grids(room)


def _print_grids(room) -> None:
    """A line for each sensor grid of the building's file."""
    for grid in room.daylight.grids:
        click.echo(
            f"{room.space.label}: grid {grid.name}, {len(grid.sensor_metrics)} sensors: "
            f"mean DA {grid.metrics['da300']:.0f} %, sDA {grid.metrics['sda300_50']:.0f} %"
        )


def summary_line(room) -> str:
    """One line of headline figures of a room."""
    return f"{room.space.label}: {_light_figures(room)}, {_heat_figures(room)}"


def _light_figures(room) -> str:
    daylight = room.daylight.room_metrics
    direct = f"ASE {daylight['ase1000_250']:.0f} %, " if "ase1000_250" in daylight else ""
    return (
        f"sDA {daylight['sda300_50']:.0f} %, "
        f"{direct}mean DA {daylight['da300']:.0f} %"
        f"{f', worst DGP {room.glare.worst:.2f}' if room.glare.pictures else ''}"
    )


def _heat_figures(room) -> str:
    heat, loads = room.heat, ""
    if room.operation is not None:
        kwh = {name: room.operation.summary[f"{name}_kwh"] for name in LOADS}
        loads = "".join(f", {name} {value:.0f} kWh" for name, value in kwh.items() if value > 0)
    return (
        f"operative {heat.temperatures['operative_c'].min():.1f} "
        f"to {heat.temperatures['operative_c'].max():.1f} C, "
        f"comfortable {heat.comfort_summary['within_80']:.0f} % of occupied hours{loads}"
    )
