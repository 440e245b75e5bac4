"""`cfs dgp`: glare of a room's views in every hour of a year."""

from __future__ import annotations

from pathlib import Path

import click

from scenes import quick
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    PrintedHead,
    chosen_language,
    directions_option,
    eye_height_option,
    grid_option,
    input_options,
    light_options,
    method_option,
    page_option,
    quick_option,
    replacing,
    results_folder_option,
    samples_option,
    size_option,
    stated_options,
    subdivide_option,
    view_option,
    with_demo,
)
from scenes.year_of_glare.options import METHODS, METRICS, YearOptions

_DEFAULT = YearOptions(Path(), Path())


@click.command(cls=StrictCommand)
@input_options("the first with a window", several=False, weather="demo")
@results_folder_option
@view_option("views", "or a file of views", several=True)
@grid_option
@directions_option
@eye_height_option
@method_option(METHODS, "path tracing computes single pictures, see cfs picture", default=_DEFAULT.method)
@click.option(
    "--metric",
    type=click.Choice(METRICS),
    default=_DEFAULT.metric,
    show_default=True,
    help="DGP; eDGP: sources of direct light only; sDGP: illuminance at the eye only.",
)
@size_option("size", _DEFAULT.size, "as evalglare recommends")
@samples_option(_DEFAULT.samples, "shared by all hours")
@click.option(
    "--memory",
    "memory_gb",
    type=click.FloatRange(0.01, 1024),
    default=_DEFAULT.memory_gb,
    show_default=True,
    help="Memory for the matrices of a view [GiB]; larger ones go to disk.",
)
@click.option(
    "--occupied",
    type=click.IntRange(0, 24),
    nargs=2,
    default=_DEFAULT.occupied,
    show_default=True,
    help="First and last clock hour of use, every day; past midnight too: 18 8.",
)
@click.option(
    "--worst",
    type=click.IntRange(0, 100),
    default=_DEFAULT.worst,
    show_default=True,
    help="Number of pictures of each view's worst hours.",
)
@click.option("--hdr", is_flag=True, help="Also write these pictures as .hdr.")
@subdivide_option
@light_options
@page_option
@quick_option
def command(out: Path, page: Path | None, **chosen) -> None:
    """Compute the daylight glare probability of a room's views in every hour with the sun up.

    Without --cfs each window uses the BSDF attached to it or its type in the IFC, else the
    transmittance stated there.  Without BUILDING the demo's office is used.

    Writes a table of the views with their glare class and level of protection (EN 17037), and for
    each view its hours, a heat map and its worst hours.  After an interruption the same command
    continues.
    """
    if chosen["views"] and (chosen["grid"] is not None or chosen["directions"] > 1):
        raise click.UsageError("--view gives the views: not with --grid or --directions")
    start, end = chosen["occupied"]
    if start == end or start == 24:
        raise click.UsageError(f"--occupied {start} {end}: expected two different hours, 0 to 24")
    from scenes.page_options import GlareSection, read_page
    from scenes.result_folder import ResultFolder
    from scenes.year_of_glare.views import read_files

    if chosen["quick"]:
        chosen |= quick.picks(quick.VIEWS, stated_options())
    page_options = read_page(page, GlareSection, chosen_language())
    named = (chosen["building"], chosen["weather"], chosen["system"])
    files = (*named, *map(Path, chosen["views"]), *chosen["linked"], *chosen["surroundings"], *page_options.inputs)
    options = YearOptions(**with_demo(chosen))
    folder = ResultFolder(out, "dgp", inputs=files, replacing=replacing())
    read = read_files(options)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar
    from scenes.language.catalogue import in_language, ngettext
    from scenes.year_of_glare import outputs
    from scenes.year_of_glare.page import write_page
    from scenes.year_of_glare.year import rate_views, read_year

    if options.quick:
        click.echo(quick.NOTE)
    head = PrintedHead()
    with ProgressBar() as progress:
        year = read_year(options, progress, read, head)
        views = rate_views(year, folder.checkpoints(outputs.KEPT), progress)
        with folder.replaced() as place:
            with in_language(page_options.language):
                rows = [outputs.write_view(year, rated, place) for rated in views]
            table = outputs.write_summary(year, rows, place)
            write_page(year, table, place / "report.html", page_options)
    worst = table.loc[table["highest_dgp"].idxmax()]
    views = ngettext("{count} view", "{count} views", len(table))
    hours = ngettext("{count} hour", "{count} hours", len(year.sky.lit))
    click.echo(
        f"{year.room}: {views}, {hours} with the sun up.  Highest "
        f"{year.options.metric} {worst['highest_dgp']:.2f}{_error(worst)} "
        f"({worst['view']}, {worst['worst_hour']})"
    )
    for level, count in table["protection_en17037"].value_counts().items():
        views = ngettext("{count} view", "{count} views", count)
        click.echo(f"protection {level}: {views}")
    head.notes(outputs.all_notes(year, table))
    click.echo(f"{out / 'views.csv'}")
    click.echo(f"report: {out / 'report.html'}")


def _error(row) -> str:
    """The standard error of a view's highest DGP, where it is known, 0.0001 at the least."""
    error = row["highest_dgp_standard_error"]
    return "" if error != error else f" ± {max(error, 1e-4):.1g}"
