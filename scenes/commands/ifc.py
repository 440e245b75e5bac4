"""`cfs ifc`: what an IFC file holds, what is wrong with it, and what can be made of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bim.report.issue import COLUMNS, issue_rows
from mitsuba_cfs.files import check_file, write_table, write_text
from mitsuba_cfs.progress import Stage
from scenes.commands.bonsai import bonsai
from scenes.commands.ifc_exports import (
    export_files,
    export_folders,
    result_folders,
    room_writers,
)
from scenes.commands.parameters import FILE, IFC_FILE
from scenes.commands.room_options import (
    furniture_option,
    height_option,
    join_option,
    out_folder_option,
    space_option,
    spacing_option,
    subdivision_option,
    u_option,
)
from scenes.result_folder import ResultFolder

if TYPE_CHECKING:
    from rich.table import Table

    from bim.model import Building

BANDS = ("Visible", "Solar")
UNCUT = 100_000  # columns of a table that nobody sees


@click.group(commands=[bonsai])
def command() -> None:
    """What an IFC file holds, and what is wrong with it."""


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.option("--csv", "issues", type=click.Path(path_type=Path), help="Also write the problems.")
@join_option
@furniture_option
def check(building: Path, join: tuple[str, ...], furniture: bool, issues: Path | None) -> None:
    """Rooms, windows and problems of an IFC file, as the simulation will see them."""
    if issues is not None:
        check_file(issues, field="--csv", inputs=[building])
    from rich.console import Console

    from bim.ifc.building import read_ifc
    from scenes.commands.progress_bar import ProgressBar

    with ProgressBar() as progress:
        read = read_ifc(building, join=join, furniture=furniture, progress=progress)
    # a file or a program that reads on gets every line whole, however long
    console = Console(width=None if Console().is_terminal else UNCUT)
    for line in read.account.lines if read.account is not None else ():
        console.print(line, markup=False, highlight=False)
    console.print(_rooms(read))
    console.print(_issues(read))
    console.print(
        f"{len(read.spaces)} rooms, {sum(bool(s.windows) for s in read.spaces)} with windows, "
        f"{len(read.windows)} windows, {sum(w.area for w in read.windows):.1f} m2 of glass, "
        f"{len(read.issues)} problems"
    )
    if issues is not None:
        import pandas as pd

        rows = issue_rows(read.issues, "command")
        write_table(pd.DataFrame(rows, columns=list(COLUMNS)), issues, index=False)


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.option("--window", "windows", multiple=True, metavar="GUID", help="A window or door.")
@click.option("--type", "types", multiple=True, metavar="NAME", help="Windows of a type.")
@space_option("rooms", "its windows")
@click.option("--storey", "storeys", multiple=True, metavar="NAME", help="Windows of a storey.")
@click.option(
    "--facade", "facades", multiple=True, metavar="N|E|S|W|FROM-TO",
    help="Windows that face there: also NE ..., roof, or azimuths such as 150-210.",
)  # fmt: skip
@click.option(
    "--all", "every_window", is_flag=True,
    help="Every IfcWindow; glazed doors and panels only by GUID, room, storey or facade.",
)  # fmt: skip
@click.option(
    "--bsdf", type=FILE,
    help="BSDF XML file: Klems or tensor tree; U, g and more of the .toml beside it come along.",
)  # fmt: skip
@click.option(
    "--g", "g_value", metavar="NUMBER|FILE.csv",
    help="g at normal incidence; or a CSV: polar_deg, g and maybe azimuth_deg.",
)  # fmt: skip
@u_option
@click.option("--state", default="", help="Name of the shading state; default: the usual one.")
@click.option("--reference", is_flag=True, help="Name the BSDF file instead of copying it.")
@click.option(
    "-o", "--out", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="IFC file to write.",
)  # fmt: skip
def attach(
    building: Path,
    *,
    bsdf: Path | None,
    g_value: str | None,
    u_value: float | None,
    state: str,
    reference: bool,
    out: Path,
    **chosen,
) -> None:
    """Write BSDF, U, g, thermal closure and the place of the shade into an IFC file's windows.

    --space, --storey, --facade and --type narrow each other; one of them given twice widens.
    """
    if bsdf is None and g_value is None and u_value is None:
        raise click.UsageError("nothing to attach: give --bsdf, --g or --u")
    # g may be a number, which no file is; the building may be written back
    check_file(out, inputs=[bsdf, None if g_value is None else Path(g_value)])
    from scenes.fenestration.state_to_attach import state_to_attach

    one, notes = state_to_attach(
        bsdf, name=state, u_value=u_value, g_value=g_value, copy_bsdf=not reference
    )
    from bim.ifc.attach import attach as attach_to_ifc
    from bim.ifc.targets import Targets

    count = attach_to_ifc(
        building, out, one, Targets(**chosen), bsdf_reference=bsdf if reference else None
    )
    for note in notes:
        click.echo(f"note: {note}")
    click.echo(f"{out}: {count} windows or window types")


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@space_option("spaces", "default: all")
@join_option
@furniture_option
@click.option(
    "--radiance", type=click.Path(file_okay=False, path_type=Path),
    help="Folder of Radiance scenes; one folder inside for each room.",
)  # fmt: skip
@click.option(
    "--mitsuba", type=click.Path(file_okay=False, path_type=Path),
    help="Folder of Mitsuba scenes; one folder inside for each room with a window.",
)  # fmt: skip
@click.option("--epjson", type=click.Path(path_type=Path), help="EnergyPlus input file.")
@click.option("--gltf", type=click.Path(path_type=Path), help="Binary glTF file (.glb).")
@click.option("--honeybee", type=click.Path(path_type=Path), help="honeybee model (.hbjson).")
@click.option("--gbxml", type=click.Path(path_type=Path), help="gbXML file (.gbxml).")
@click.option(
    "--band", type=click.Choice(BANDS, case_sensitive=False), default="Visible", show_default=True,
    help="Visible or Solar; of the Radiance and Mitsuba scenes.",
)  # fmt: skip
@spacing_option
@height_option
@subdivision_option
def export(
    building: Path,
    *,
    spaces: tuple[str, ...],
    join: tuple[str, ...],
    furniture: bool,
    radiance: Path | None,
    mitsuba: Path | None,
    epjson: Path | None,
    gltf: Path | None,
    honeybee: Path | None,
    gbxml: Path | None,
    band: str,
    sensor_spacing: float,
    sensor_height: float,
    subdivision: str,
) -> None:
    """Write the rooms for Radiance, Mitsuba or EnergyPlus, or for viewing.

    Windows go with the BSDF, U and g that the file holds or states for them; where they come from,
    and what is not known, is said.
    """
    files = {"--epjson": epjson, "--gltf": gltf, "--honeybee": honeybee, "--gbxml": gbxml}
    asked = {"--radiance": radiance, "--mitsuba": mitsuba, **files}
    if not any(asked.values()):
        raise click.UsageError(f"nothing to write: give one of {', '.join(asked)}")
    for field, path in files.items():
        if path is not None:
            check_file(path, field=field, inputs=[building])
    folders = result_folders({"--radiance": radiance, "--mitsuba": mitsuba})
    from bim.ifc.building import read_ifc
    from scenes.commands.progress_bar import ProgressBar
    from scenes.fenestration_exports import known_fenestration
    from scenes.run.inputs import named_spaces

    with ProgressBar() as progress:
        read = read_ifc(building, join=join, furniture=furniture, progress=progress)
    chosen = named_spaces(read, spaces, building)
    known = known_fenestration(chosen, building)
    writers = room_writers(
        known, band.lower(), spacing=sensor_spacing, height=sensor_height,
        sky_division=int(subdivision),
    )  # fmt: skip
    export_folders(read, chosen, writers, folders)
    exported = replace(read, spaces=tuple(chosen))
    assumed = export_files(exported, known, epjson=epjson, honeybee=honeybee, gbxml=gbxml)
    if gltf is not None:
        from bim.to_gltf import write_gltf

        write_gltf(exported, gltf)
        click.echo(gltf)
    notes = known.notes() if folders or epjson or honeybee or gbxml else ()
    for note in (*notes, *assumed):
        click.echo(f"note: {note}")


@command.command()
@out_folder_option
def templates(out: Path) -> None:
    """Write the property set that windows hold as definitions for other programs.

    An IFC library with its IfcPropertySetTemplate, buildingSMART's PSD XML, and an IDS that checks
    models for it.
    """
    folder = ResultFolder(out, "ifc templates")
    from bim.ifc.property_definition import write_psd
    from bim.ifc.property_templates import write_ids, write_templates

    with folder.replaced() as place:
        write_templates(place / "fenestration_templates.ifc")
        write_ids(place / "fenestration.ids")
        write_psd(place / "fenestration_psd.xml")
    click.echo(out)


@command.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="BUILDING.ifc...")
@click.option("--markdown", "table", type=click.Path(path_type=Path), help="Also write the table.")
def survey(files: tuple[Path, ...], table: Path | None) -> None:
    """Check and convert many IFC files: rooms, windows, quantities, seconds and memory of each."""
    if table is not None:
        check_file(table, field="--markdown", inputs=files)
    from bim.ifc.survey import markdown
    from bim.ifc.survey import survey as surveyed
    from scenes.commands.progress_bar import ProgressBar

    rows = []
    with ProgressBar() as progress:
        progress(Stage("", "file", 1, len(files)), 0.0)
        for row in surveyed(files):
            rows.append(row)
            if len(rows) < len(files):
                progress(Stage("", "file", len(rows) + 1, len(files)), 0.0)
            if table is not None:  # what is done is kept if the rest is broken off
                write_text(table, markdown(rows) + "\n")
    click.echo(markdown(rows))


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.argument("selector")
def query(building: Path, selector: str) -> None:
    """The elements that a SELECTOR of the corrections chooses, such as 'IfcWall, layer="A-WALL"'.

    By GUID, class, Name, type, material, location (storey), property (Pset_WallCommon.IsExternal),
    each with = or a regular expression (Name=/Louvre.*/), and by CAD layer; + joins groups.
    """
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from bim.ifc.query import query as chosen_elements

    found = chosen_elements(building, selector)
    table = Table()
    for head in ("class", "name", "type", "storey", "material", "layer", "GUID"):
        table.add_column(head, overflow="fold")
    for one in found:
        row = (one.ifc_class, one.name, one.type_name, one.storey, one.material, one.layer)
        table.add_row(*map(escape, row), one.guid)
    console = Console(width=None if Console().is_terminal else UNCUT)
    if found:
        console.print(table)
    console.print(f"{len(found)} elements")


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


def _issues(building: Building) -> Table:
    """The problems by their weight, alike ones counted once."""
    from rich.table import Table

    from bim.report.ranking import ranked

    table = Table(title="Problems", title_justify="left")
    table.add_column("glass m2", justify="right")
    for head in ("where", "what", "consequence or repair"):
        table.add_column(head, overflow="fold")
    for one in ranked(building.issues):
        glass = f"{one.glass:.2f}" if one.glass else ""
        table.add_row(glass, one.first.where, *one.text("command").pair)
    return table
