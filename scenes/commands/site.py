"""`cfs site`: daylight and sun that neighbours lose, and sun that glass reflects to them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mitsuba_cfs.files import json_text, write_table, write_text
from scenes.commands.examples import CommandGroup
from scenes.commands.room_options import (
    FILE,
    PrintedHead,
    input_options,
    no_cache_option,
    replacing,
    results_folder_option,
)
from scenes.input_options import InputOptions

if TYPE_CHECKING:
    import pandas as pd

    from bim.model import Building
    from mitsuba_cfs.sky.weather import Weather
    from scenes.result_folder import ResultFolder


@click.group(cls=CommandGroup)
def command() -> None:
    """Daylight and sun that neighbours lose, and sun that glass reflects to them."""


@command.command()
@input_options("all with windows", system=False, glazing=False)
@click.option(
    "--proposed",
    required=True,
    multiple=True,
    type=FILE,
    help="Proposed building: a file as those of --surroundings (cfs export --gltf writes one).",
)
@click.option(
    "--height",
    type=click.FloatRange(0, 5),
    default=0.85,
    show_default=True,
    help="Height of the work plane above the floor [m]; of the no-sky line.",
)
@no_cache_option
@results_folder_option
def neighbours(proposed: tuple[Path, ...], height: float, out: Path, **chosen: Any) -> None:
    """Daylight and sun that the windows of BUILDING lose by a proposed neighbour (BRE's BR 209).

    Vertical sky component and annual probable sunlight hours of each window, and the no-sky line of each
    room, before and after. --surroundings are the existing obstructions.
    """
    options, weather, folder = _inputs(out, chosen, "site neighbours", proposed)
    from bim.surroundings.placement import with_surroundings
    from scenes.site.neighbours import Site, room_table, window_table
    from scenes.site.sun_year import sun_year

    before, head = _building(options)
    after = with_surroundings(before, proposed, options.surroundings_offset)
    sites = Site.of(before), Site.of(after)
    sun = sun_year(weather)
    windows, rooms = window_table(*sites, sun), room_table(*sites, height=height)
    record = {"head": head.record, "proposed": [str(path) for path in proposed], "height_m": height}
    _write(folder, record, {"windows.csv": windows, "rooms.csv": rooms})
    lost = [*windows.itertuples()]
    judged = [one for one in lost if one.apsh_met is not None]
    click.echo(
        f"VSC: {sum(one.vsc_met for one in lost)} of {len(lost)} windows keep 27 % or 0.8 times their value; "
        f"least {windows.vsc_after_percent.min():.1f} %"
    )
    click.echo(
        f"sunlight hours: {sum(bool(one.apsh_met) for one in judged)} of {len(judged)} windows that face the sun"
    )
    click.echo(f"no-sky line: {int(rooms.no_sky_line_met.sum())} of {len(rooms)} rooms keep 0.8 times their area")
    click.echo(f"results: {out}")


@command.command()
@input_options("all with windows", system=False, glazing=False)
@click.option(
    "--points",
    required=True,
    type=FILE,
    help="CSV file of eyes outdoors: name, x, y, z [m]; and, if wanted, sight_azimuth_deg, sight_altitude_deg.",
)
@click.option(
    "--reflectance",
    type=click.FloatRange(0, 0.9, min_open=True),
    default=0.15,
    show_default=True,
    help="Visible reflectance of the glass at normal incidence, outdoors; 0.15: clear double glazing.",
)
@no_cache_option
@results_folder_option
def reflections(points: Path, reflectance: float, out: Path, **chosen: Any) -> None:
    """Sun that the panes of BUILDING reflect to streets, rails and windows.

    Hours a year, the longest day, illuminance and luminance at each point, and whether the reflection is near the
    line of sight.
    """
    options, weather, folder = _inputs(out, chosen, "site reflections", (points,))
    import pandas as pd

    from scenes.site.reflections import mirrors_of, observer_row, read_observers
    from scenes.site.reflections import reflections as reflected
    from scenes.site.sun_year import sun_year

    observers = read_observers(points)
    building, head = _building(options)
    mirrors, sun = mirrors_of(building, reflectance), sun_year(weather)
    tables = {observer.name: reflected(observer, mirrors, sun) for observer in observers}
    rows = pd.DataFrame([observer_row(one, tables[one.name], sun.step_h) for one in observers])
    moments = pd.concat([t.assign(point=name) for name, t in tables.items()])
    record = {"head": head.record, "points": str(points), "reflectance": reflectance}
    _write(folder, record, {"points.csv": rows, "moments.csv": moments})
    for row in rows.to_dict("records"):
        brightest = ""
        if row["hours_cloudless"]:
            brightest = (
                f"; up to {row['brightest_lux']:,.0f} lx from {row['brightest_window']} "
                f"on {row['brightest_time']:%d %b %H:%M}"
            )
        click.echo(
            f"{row['point']}: {row['hours_weather']:.1f} h a year by the weather, {row['hours_cloudless']:.1f} h if "
            f"it were cloudless, at most {row['longest_day_min_cloudless']:.0f} min a day{brightest}"
        )
    click.echo(f"results: {out}")


def _inputs(
    out: Path, chosen: dict[str, Any], name: str, files: tuple[Path, ...]
) -> tuple[InputOptions, Weather, ResultFolder]:
    """Options, weather and folder of a command; what is small is read before what is heavy."""
    from scenes.input_files import read_files
    from scenes.result_folder import ResultFolder

    options = InputOptions(**chosen)
    read = read_files(options, hourly=False)
    inputs = (options.building, *options.linked, options.weather, *files)
    folder = ResultFolder(out, name, inputs=inputs, replacing=replacing())
    return options, read.weather, folder


def _building(options: InputOptions) -> tuple[Building, PrintedHead]:
    """The building with the chosen rooms, its head printed."""
    from bim.building_file import named_spaces
    from scenes.commands.progress_bar import ProgressBar
    from scenes.head import head_of
    from scenes.input_files import building_of

    with ProgressBar() as progress:
        read = building_of(options, progress)
    rooms = options.rooms
    spaces = named_spaces(read, rooms, options.building) if rooms and options.building else read.spaces
    head = PrintedHead()
    head(head_of(read, spaces, light_only=True))
    return replace(read, spaces=tuple(space for space in spaces if space.windows)), head


def _write(results: ResultFolder, record: dict[str, Any], tables: dict[str, pd.DataFrame]) -> None:
    with results.replaced() as folder:
        for name, table in tables.items():
            digits = dict.fromkeys(table.select_dtypes("number"), 3)  # moments have their times, too
            write_table(table.round(digits), folder / name, index=False)
        write_text(folder / "run.json", json_text(record, indent=2) + "\n")
