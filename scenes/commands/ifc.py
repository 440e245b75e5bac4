"""`cfs ifc`: what an IFC file holds, what is wrong with it, and what can be made of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from bim.fenestration import ShadingState, read_g_table
from bim.ifc.attach import attach as attach_to_ifc
from bim.ifc.survey import markdown
from bim.ifc.survey import survey as surveyed
from bim.model import Building, Space
from bim.read_ifc import read_ifc
from bim.to_energyplus import write_epjson
from bim.to_gltf import write_gltf
from bim.to_mitsuba import write_mitsuba
from bim.to_radiance import identifier, write_radiance
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Stage
from scenes.commands.progress_bar import ProgressBar

FILE = click.Path(exists=True, dir_okay=False, readable=True, path_type=Path)


@click.group()
def command() -> None:
    """What an IFC file holds, and what is wrong with it."""


@command.command()
@click.argument("building", type=FILE, metavar="BUILDING.ifc")
@click.option("--csv", "table", type=click.Path(path_type=Path), help="Also write the problems.")
def check(building: Path, table: Path | None) -> None:
    """Rooms, windows and problems of an IFC file, as the simulation will see them."""
    with ProgressBar() as progress:
        read = read_ifc(building, progress=progress)
    console = Console(width=None if Console().is_terminal else 200)
    console.print(_rooms(read))
    console.print(_problems(read))
    console.print(
        f"{len(read.spaces)} rooms, {sum(bool(s.windows) for s in read.spaces)} with windows, "
        f"{len(read.windows)} windows, {sum(w.area for w in read.windows):.1f} m2 of glass, "
        f"{len(read.problems)} problems"
    )
    if table is not None:
        import pandas as pd

        rows = [(p.where, p.what, p.consequence) for p in read.problems]
        pd.DataFrame(rows, columns=["where", "what", "consequence"]).to_csv(table, index=False)


@command.command()
@click.argument("building", type=FILE, metavar="BUILDING.ifc")
@click.option("--window", "windows", multiple=True, metavar="GUID", help="A window or door.")
@click.option("--type", "types", multiple=True, metavar="NAME", help="Windows of a type.")
@click.option("--all", "every_window", is_flag=True, help="Every window.")
@click.option("--bsdf", type=FILE, help="BSDF XML file: Klems or tensor tree.")
@click.option("--g", "g_table", type=FILE, help="CSV: polar_deg, g and maybe azimuth_deg.")
@click.option("--u", "u_value", type=click.FloatRange(0.1, 7), help="U-value [W/(m2 K)].")
@click.option("--state", default="", help="Name of the shading state; default: the usual one.")
@click.option("--reference", is_flag=True, help="Name the BSDF file instead of copying it.")
@click.option(
    "-o", "--out", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="IFC file to write.",
)  # fmt: skip
def attach(
    building: Path,
    windows: tuple[str, ...],
    types: tuple[str, ...],
    every_window: bool,
    bsdf: Path | None,
    g_table: Path | None,
    u_value: float | None,
    state: str,
    reference: bool,
    out: Path,
) -> None:
    """Write BSDF, angular g-values and U into an IFC file's windows."""
    if bsdf is None and g_table is None and u_value is None:
        raise click.UsageError("nothing to attach: give --bsdf, --g or --u")
    file = None if bsdf is None else read_bsdf_xml(bsdf)
    copied = file is not None and not reference
    one = ShadingState(
        state,
        file.bands if copied else {},
        None if g_table is None else read_g_table(g_table),
        u_value,
    )
    count = attach_to_ifc(
        building, out, one, windows=windows, types=types, every_window=every_window,
        bsdf_reference=bsdf if reference else None,
    )  # fmt: skip
    click.echo(f"{out}: {count} windows or window types")


@command.command()
@click.argument("building", type=FILE, metavar="BUILDING.ifc")
@click.option("--space", "names", multiple=True, help="Name or GUID; default: all.")
@click.option(
    "--radiance", type=click.Path(file_okay=False, path_type=Path),
    help="Folder; one folder inside for each room with a window.",
)  # fmt: skip
@click.option(
    "--mitsuba", type=click.Path(file_okay=False, path_type=Path),
    help="Folder; one folder inside for each room with a window.",
)  # fmt: skip
@click.option("--epjson", type=click.Path(path_type=Path), help="EnergyPlus input file.")
@click.option("--gltf", type=click.Path(path_type=Path), help="Binary glTF file (.glb).")
def export(
    building: Path,
    names: tuple[str, ...],
    radiance: Path | None,
    mitsuba: Path | None,
    epjson: Path | None,
    gltf: Path | None,
) -> None:
    """Write the rooms for Radiance, Mitsuba or EnergyPlus, or for viewing."""
    if radiance is None and mitsuba is None and epjson is None and gltf is None:
        raise click.UsageError("nothing to write: give --radiance, --mitsuba, --epjson or --gltf")
    with ProgressBar() as progress:
        read = read_ifc(building, progress=progress)
    spaces = _chosen(read, names, building)
    for parent, write in ((radiance, write_radiance), (mitsuba, write_mitsuba)):
        for space in spaces if parent is not None else ():
            if not space.windows:
                continue
            folder = parent / identifier(space.name)
            try:
                write(space, read, folder)
            except ValueError as error:  # a void too low for a work plane or an eye
                click.echo(f"{space.name}: left out: {error}", err=True)
                continue
            click.echo(folder)
    if epjson is not None:
        write_epjson(read, epjson, spaces=spaces)
        click.echo(epjson)
    if gltf is not None:
        write_gltf(replace(read, spaces=spaces), gltf)
        click.echo(gltf)


@command.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="BUILDING.ifc...")
@click.option("--markdown", "out", type=click.Path(path_type=Path), help="Also write the table.")
def survey(files: tuple[Path, ...], out: Path | None) -> None:
    """Check and convert many IFC files: rooms, windows, quantities, seconds and memory of each."""
    rows = []
    with ProgressBar() as progress:
        progress(Stage("", "file", 1, len(files)), 0.0)
        for row in surveyed(files):
            rows.append(row)
            if len(rows) < len(files):
                progress(Stage("", "file", len(rows) + 1, len(files)), 0.0)
            if out is not None:  # what is done is kept if the rest is broken off
                out.write_text(markdown(rows) + "\n", encoding="utf-8")
    click.echo(markdown(rows))


def _chosen(building: Building, names: tuple[str, ...], path: Path) -> tuple[Space, ...]:
    """The rooms of those names; all without any."""
    if not names:
        return building.spaces
    try:
        return tuple(building.space(name) for name in names)
    except (KeyError, ValueError) as error:
        raise DataError(str(error.args[0]), file=path) from None


def _rooms(building: Building) -> Table:
    """One line for each room, drawn figures beside those that the file states."""
    table = Table(title=f"Rooms of {building.name}", title_justify="left")
    table.add_column("room")
    table.add_column("storey")
    for head in ("floor m2", "stated", "volume m3", "stated", "faces", "windows", "glass m2"):
        table.add_column(head, justify="right")
    for space in building.spaces:
        table.add_row(
            _label(space), space.storey, f"{space.floor_area:.2f}", _number(space.stated_area),
            f"{space.room_volume:.2f}", _number(space.stated_volume), str(len(space.faces)),
            str(len(space.windows)), f"{sum(w.area for w in space.windows):.2f}",
        )  # fmt: skip
    return table


def _label(space: Space) -> str:
    return space.name if space.long_name in ("", space.name) else f"{space.name} {space.long_name}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _problems(building: Building) -> Table:
    table = Table(title="Problems", title_justify="left")
    for head in ("where", "what", "consequence or repair"):
        table.add_column(head, overflow="fold")
    for problem in building.problems:
        table.add_row(problem.where, problem.what, problem.consequence)
    return table
