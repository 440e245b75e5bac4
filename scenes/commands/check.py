"""`cfs check`: what a building's file holds, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, write_table, write_text
from mitsuba_cfs.notes import Note
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import check_is_ifc, input_options, no_cache_option
from scenes.input_options import InputOptions

if TYPE_CHECKING:
    from rich.table import Table

    from bim.model import Building, Space
    from mitsuba_cfs.progress import Progress

UNCHANGED = (), False, ()  # rooms to join, furniture, storeys: as the building is read without options
UNCUT = 100_000  # columns of a table that nobody sees


@click.command(cls=StrictCommand)
@input_options("all", weather="", system=False, glazing=False)
@click.option("--csv", "issues", type=click.Path(path_type=Path), help="Also write the problems to a CSV file.")
@click.option(
    "--fix",
    type=click.Path(path_type=Path, dir_okay=False, allow_dash=True),
    is_flag=False,
    flag_value="-",
    metavar="[FILE]",
    help="Also write a corrections file with every doubt of the model, its default and "
    "alternatives as comments; default: MODEL.corrections.toml beside the model, where it is used.",
)
@click.option(
    "--bcf",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.bcfzip",
    help="Also write a BCF 2.1 file: a topic for each kind of problem, with its elements, for the author of the model.",
)
@click.option(
    "--html",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.html",
    help="Also write a page: the 3D model with a mark at each leak, the rooms without the "
    "corrections beside those with them, and the problems.",
)
@click.option(
    "--json",
    "record",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.json",
    help="Also write it as data for other programs; rooms, windows, problems and the 3D model.",
)
@no_cache_option
def command(
    issues: Path | None, fix: Path | None, bcf: Path | None, html: Path | None, record: Path | None, **chosen
) -> None:
    """List rooms, windows and problems of a building model as the simulation reads them.

    BUILDING is a honeybee model (.hbjson), gbXML, a Radiance scene (.rad) or IFC: one file or
    several of one building (architecture, facade, site), a folder or an .ifczip of them.
    """
    options = InputOptions(**chosen, weather=None)
    if issues is not None:
        check_file(issues, field="--csv", inputs=options.building_files)
    if fix is not None:
        from bim.ifc.corrections import corrections_file

        check_is_ifc(options.building, "--fix")
        fix = corrections_file(options.building) if fix == Path("-") else fix
        check_file(fix, field="--fix", inputs=options.building_files)
        if fix.exists():
            raise DataError("exists; give another name", file=fix, field="--fix")
    if bcf is not None:
        check_is_ifc(options.building, "--bcf")
        check_file(bcf, field="--bcf", inputs=options.building_files)
    if html is not None:
        check_file(html, field="--html", inputs=options.building_files)
    if record is not None:
        check_file(record, field="--json", inputs=options.building_files)
    from rich.console import Console

    from bim.building_file import named_spaces
    from scenes.commands.progress_bar import ProgressBar
    from scenes.fenestration_exports import glazing_data, known_fenestration
    from scenes.head import head_of
    from scenes.input_files import building_of

    with ProgressBar() as progress:
        read = building_of(options, progress)
    spaces = named_spaces(read, options.rooms, options.building) if options.rooms else read.spaces
    windows = [window for space in spaces for window in space.windows]
    known = known_fenestration(spaces, options.building)
    # a file or a program that reads on gets every line whole, however long
    console = Console(width=None if Console().is_terminal else UNCUT)
    missing = known.missing("a run needs --glazing NAME, --cfs FILE, or step 3 of cfs app")
    head = head_of(read, light_only=True)
    known_words = known.sources()
    stated = (*head.model, *_site(read), *(f"assumed: {text}" for text in head.assumed))
    lines = (*stated, *(f"glazing: {text}" for text in known_words), *(f"missing: {text}" for text in missing))
    for line in lines:
        console.print(line, markup=False, highlight=False)
    console.print(_rooms(read.name, spaces))
    if read.issues:
        console.print("Problems, by the glass that they concern; a repeated one with an example:")
    for line in _issues(read):
        console.print(line, markup=False, highlight=False)
    console.print(
        f"rooms: {len(spaces)} (with windows: {sum(bool(s.windows) for s in spaces)}), "
        f"windows: {len(windows)} ({sum(w.area for w in windows):.1f} m2 of glass), "
        f"problems: {len(read.issues)}"
    )
    if fix is not None:
        from bim.ifc.corrections_draft import corrections_draft

        write_text(fix, corrections_draft(read))
        console.print(f"corrections: {fix}", markup=False, highlight=False)
    if bcf is not None:
        from bim.bcf import write_bcf

        console.print(f"{bcf}: topics: {write_bcf(read, bcf)}", markup=False, highlight=False)
    if html is not None:
        from scenes.report.page import write_check

        with ProgressBar() as progress:
            before = _uncorrected(options, progress)
        write_check(read, (*head.model, *_site(read)), html, before)
        console.print(f"page: {html}", markup=False, highlight=False)
    if record is not None:
        from mitsuba_cfs.files import json_text
        from scenes.comply.dwellings import uses_of_rooms
        from scenes.comply.uses import read_uses
        from scenes.report.checked import check_record

        uses = uses_of_rooms(read, read.spaces, read_uses(), options.linked)
        facts = {guid: (use.key, str(use.source), use.assumed) for guid, use in uses.items()}
        data = check_record(read, stated, facts, glazing_data(read.spaces, options.building))
        write_text(record, json_text(data, ensure_ascii=False) + "\n")
        console.print(f"data: {record}", markup=False, highlight=False)
    if issues is not None:
        import pandas as pd

        from bim.report.issue import COLUMNS, issue_rows

        rows = issue_rows(read.issues, "command")
        write_table(pd.DataFrame(rows, columns=list(COLUMNS)), issues, index=False)


def _site(building: Building) -> Iterator[str]:
    """The position of the site, which many exporters leave at a default."""
    from scenes.head import position_words

    if building.latitude_deg is not None and building.longitude_deg is not None:
        yield Note("Site: {position}", position=position_words(building.latitude_deg, building.longitude_deg))


def _uncorrected(options: InputOptions, progress: Progress) -> Building | None:
    """The building without the corrections beside it; None where there are none."""
    from bim.building_file import files_beside, read_once
    from bim.ifc.building import read_ifc
    from bim.ifc.corrections import Corrections
    from mitsuba_cfs.matrices.cache import MatrixCache

    first, *linked = options.building_files
    if not files_beside(first):
        return None
    read = partial(read_ifc, first, linked=linked, corrections=Corrections(), progress=progress)
    if not options.cache:
        return read()
    return read_once(read, (first, *linked), UNCHANGED, MatrixCache.of_user(), corrected=False)


def _rooms(building: str, spaces: Sequence[Space]) -> Table:
    """One line for each room, drawn figures beside those that the file states."""
    from rich.table import Table

    from bim.names import natural_key

    table = Table(title=f"Rooms of {building}", title_justify="left")
    table.add_column("room", overflow="fold")
    table.add_column("storey", overflow="fold")
    for head in ("floor m2", "stated", "volume m3", "stated", "faces", "windows", "glass m2"):
        table.add_column(head, justify="right")
    for space in sorted(spaces, key=lambda space: natural_key(space.label)):
        table.add_row(
            space.label,
            space.storey,
            f"{space.floor_area:.2f}",
            _number(space.stated_area),
            _volume(space),
            _number(space.stated_volume),
            str(len(space.faces)),
            str(len(space.windows)),
            f"{sum(w.area for w in space.windows):.2f}",
        )
    return table


def _volume(space: Space) -> str:
    """The volume of the room, and that of the space as drawn where it was cut or raised."""
    if space.cut or space.raised:
        return f"{space.room_volume:.2f} (drawn {space.drawn_volume:.2f})"
    return f"{space.room_volume:.2f}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _issues(building: Building) -> Iterator[str]:
    """One line for each kind of problem, the weightiest first."""
    from bim.report.ranking import ranked

    for kind in ranked(building.issues):
        glass = f", {kind.glass:.2f} m2 of glass" if kind.glass else ""
        yield f"- {kind.text('command').line} ({kind.first.where}{glass})"
