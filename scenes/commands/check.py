"""`cfs check`: what a building's file holds, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mitsuba_cfs.files import check_file, write_table
from scenes.commands.room_options import input_options
from scenes.input_options import InputOptions

if TYPE_CHECKING:
    from rich.table import Table

    from bim.model import Building

UNCUT = 100_000  # columns of a table that nobody sees


@click.command()
@input_options("all", weather="", system=False, glazing=False)
@click.option(
    "--csv",
    "issues",
    type=click.Path(path_type=Path),
    help="Also write the problems to a CSV file.",
)
def command(issues: Path | None, **chosen) -> None:
    """List rooms, windows and problems of a building model as the simulation reads them.

    BUILDING is an IFC file, a honeybee model (.hbjson), gbXML or a Radiance scene (.rad).
    """
    options = InputOptions(**chosen, weather=None)
    if issues is not None:
        check_file(issues, field="--csv", inputs=[options.building])
    from rich.console import Console

    from scenes.commands.progress_bar import ProgressBar
    from scenes.fenestration_exports import known_fenestration
    from scenes.head import head_of
    from scenes.input_files import building_of

    with ProgressBar() as progress:
        read = building_of(options, progress)
    spaces = [read.space(name) for name in options.spaces] or list(read.spaces)
    known = known_fenestration(spaces, options.building)
    # a file or a program that reads on gets every line whole, however long
    console = Console(width=None if Console().is_terminal else UNCUT)
    head = head_of(read, light_only=True).with_assumptions(known.notes("a run needs --cfs"))
    for line in (*head.model, *(f"assumed: {text}" for text in head.assumed)):
        console.print(line, markup=False, highlight=False)
    console.print(_rooms(read))
    if read.issues:
        console.print("Problems, by the glass that they concern; a repeated one with an example:")
    for line in _issues(read):
        console.print(line, markup=False, highlight=False)
    console.print(
        f"rooms: {len(read.spaces)} (with windows: {sum(bool(s.windows) for s in read.spaces)}), "
        f"windows: {len(read.windows)} ({sum(w.area for w in read.windows):.1f} m2 of glass), "
        f"problems: {len(read.issues)}"
    )
    if issues is not None:
        import pandas as pd

        from bim.report.issue import COLUMNS, issue_rows

        rows = issue_rows(read.issues, "command")
        write_table(pd.DataFrame(rows, columns=list(COLUMNS)), issues, index=False)


def _rooms(building: Building) -> Table:
    """One line for each room, drawn figures beside those that the file states."""
    from rich.table import Table

    table = Table(title=f"Rooms of {building.name}", title_justify="left")
    table.add_column("room", overflow="fold")
    table.add_column("storey", overflow="fold")
    for head in ("floor m2", "stated", "volume m3", "stated", "faces", "windows", "glass m2"):
        table.add_column(head, justify="right")
    for space in building.spaces:
        table.add_row(
            space.label, space.storey, f"{space.floor_area:.2f}", _number(space.stated_area),
            f"{space.drawn_volume:.2f}", _number(space.stated_volume), str(len(space.faces)),
            str(len(space.windows)), f"{sum(w.area for w in space.windows):.2f}",
        )  # fmt: skip
    return table


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _issues(building: Building) -> Iterator[str]:
    """One line for each kind of problem, the weightiest first."""
    from bim.report.ranking import ranked

    for kind in ranked(building.issues):
        glass = f", {kind.glass:.2f} m2 of glass" if kind.glass else ""
        yield f"- {kind.text('command').line} ({kind.first.where}{glass})"
