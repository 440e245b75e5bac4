"""`cfs dgp`: glare of a room's views in every hour of a year."""

from __future__ import annotations

from pathlib import Path

import click

from scenes import quick
from scenes.commands.parameters import IFC_FILE
from scenes.commands.quick_option import given, quick_option
from scenes.commands.room_options import (
    join_option,
    room_files,
    system_option,
    weather_option,
)
from scenes.year_of_glare.options import METHODS, METRICS, YearOptions

_DEFAULT = YearOptions(Path(), Path())


@click.command()
@click.argument("building", type=IFC_FILE, required=False, metavar="[BUILDING.ifc]")
@weather_option
@system_option
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder of results.")
@click.option("--space", help="Name or GUID of the room; default: the first with a window.")
@join_option
@click.option(
    "--view", "views", multiple=True, metavar="'-vta ...'|FILE.vf",
    help="View in Radiance's syntax, or a file of them; default: the room's middle, to its window.",
)  # fmt: skip
@click.option(
    "--grid", type=click.FloatRange(0.1, 20), help="Eyes all over the room, so far apart [m]."
)
@click.option(
    "--directions", type=click.IntRange(1, 64), default=_DEFAULT.directions, show_default=True,
    help="Directions of every eye, the first to the biggest window.",
)  # fmt: skip
@click.option(
    "--eye-height", type=click.FloatRange(0.3, 3), default=_DEFAULT.eye_height, show_default=True,
    help="Above the floor [m].",
)  # fmt: skip
@click.option("--method", type=click.Choice(METHODS), default=_DEFAULT.method, show_default=True)
@click.option(
    "--metric", type=click.Choice(METRICS), default=_DEFAULT.metric, show_default=True,
    help="DGP; enhanced simplified (sources of direct light); simplified (illuminance alone).",
)  # fmt: skip
@click.option(
    "--size", type=click.IntRange(64, 4096), default=_DEFAULT.size, show_default=True,
    help="Pixels of a side.",
)  # fmt: skip
@click.option(
    "--samples", type=click.IntRange(1, 4096), default=_DEFAULT.samples, show_default=True,
    help="Paths of a pixel.",
)  # fmt: skip
@click.option(
    "--memory", "memory_gb", type=click.FloatRange(0.01, 1024), default=_DEFAULT.memory_gb,
    show_default=True, help="Of a view's matrices [GiB]; above it they lie on disk.",
)  # fmt: skip
@click.option(
    "--occupied", type=click.IntRange(0, 24), nargs=2, default=_DEFAULT.occupied,
    show_default=True, help="Clock hours of use, every day.",
)  # fmt: skip
@click.option(
    "--worst", type=click.IntRange(0, 100), default=_DEFAULT.worst, show_default=True,
    help="Pictures of each view's worst hours.",
)  # fmt: skip
@click.option("--hdr", is_flag=True, help="These pictures as .hdr too.")
@click.option("--seed", type=int, default=_DEFAULT.seed, show_default=True)
@quick_option
def command(
    building: Path | None, weather: Path | None, system: Path | None, out: Path, **chosen
) -> None:
    """Daylight glare probability of a room's views in every hour with the sun up.

    What fills the windows without --cfs: the BSDF attached to them or their types in the IFC, else
    the transmittance that it states.  Without BUILDING the demo's office.

    Writes a table of the views with their classes and EN 17037's protection, each view's hours, a
    heat map and its worst hours.  A run that was stopped goes on where it was when it is called
    again.
    """
    if chosen["views"] and (chosen["grid"] is not None or chosen["directions"] > 1):
        raise click.UsageError("--view gives the views: not with --grid or --directions")
    start, end = chosen["occupied"]
    if start >= end:
        raise click.UsageError(f"--occupied {start} {end}: expected the first hour before the last")
    from scenes.result_folder import ResultFolder
    from scenes.year_of_glare.files import read_files

    if chosen["quick"]:
        chosen |= quick.picks(quick.VIEWS, given())
    files = (building, weather, system, *map(Path, chosen["views"]))
    options = YearOptions(*room_files(building, weather, system), **chosen)
    folder = ResultFolder(out, "dgp", inputs=files)
    read = read_files(options)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar
    from scenes.year_of_glare import outputs
    from scenes.year_of_glare.year import rate_views, read_year

    if options.quick:
        click.echo(quick.NOTE)
    with ProgressBar() as progress:
        year = read_year(options, progress, read)
        views = rate_views(year, folder.kept(outputs.KEPT), progress)
        with folder.replaced() as place:
            rows = [outputs.write_view(year, rated, place) for rated in views]
            table = outputs.write_summary(year, rows, place)
    worst = table.loc[table["highest_dgp"].idxmax()]
    click.echo(
        f"{year.room}: {len(table)} view(s), {len(year.sky.lit)} hours with the sun up.  Highest "
        f"{year.options.metric} {worst['highest_dgp']:.2f} ({worst['view']}, {worst['worst_hour']})"
    )
    for level, count in table["protection_en17037"].value_counts().items():
        click.echo(f"protection {level}: {count} view(s)")
    for note in year.notes:
        click.echo(f"note: {note}")
    click.echo(f"{out / 'views.csv'}")
