"""`cfs ifc`: what is only for IFC files: attach data, query, survey, property templates."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from mitsuba_cfs.files import check_file, json_text, write_text
from mitsuba_cfs.progress import Stage
from scenes.commands.check import command as check
from scenes.commands.examples import CommandGroup, StrictCommand
from scenes.commands.export import command as export
from scenes.commands.room_options import FILE, IFC_FILE, out_folder_option, space_option, u_option
from scenes.result_folder import ResultFolder

out_option = click.option(
    "-o", "--out", required=True, type=click.Path(dir_okay=False, path_type=Path), help="IFC file to write."
)


@click.command(cls=StrictCommand)
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="ADDON.zip",
    help="The add-on, for Blender's Preferences, Add-ons, Install from Disk.",
)
def bonsai(out: Path) -> None:
    """Write the Bonsai panel: cfs run on the open IFC file, rooms coloured by result."""
    check_file(out, field="--out")
    from bim.bonsai.package import write_add_on

    write_add_on(out)
    click.echo(out)


BANDS = ("Visible", "Solar")
UNCUT = 100_000  # columns of a table that nobody sees


@click.group(cls=CommandGroup, commands=[bonsai])
def command() -> None:
    """Attach data to IFC files, query and survey them.  See also `cfs check` and `cfs export`."""


def _renamed(name: str, current: click.Command) -> click.Command:
    """A command by its earlier name, which prints the name that it has now."""

    def callback(**chosen: object) -> object:
        click.echo(f"note: `cfs ifc {name}` is now `cfs {name}`", err=True)
        return current.callback(**chosen) if current.callback is not None else None

    return click.Command(
        name, params=current.params, callback=callback, help=current.help, short_help=f"Renamed to `cfs {name}`."
    )


for _name, _current in (("check", check), ("export", export)):
    command.add_command(_renamed(_name, _current))


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.option("--window", "windows", multiple=True, metavar="GUID", help="GUID of a window or door.")
@click.option("--type", "types", multiple=True, metavar="NAME", help="Windows of a type.")
@space_option("rooms", "its windows")
@click.option("--storey", "storeys", multiple=True, metavar="NAME", help="Windows of a storey.")
@click.option(
    "--facade",
    "facades",
    multiple=True,
    metavar="N|E|S|W|FROM-TO",
    help="Windows of this orientation: also NE ..., roof, or azimuths such as 150-210.",
)
@click.option(
    "--all",
    "every_window",
    is_flag=True,
    help="Every IfcWindow; choose glazed doors and panels by GUID, room, storey or facade.",
)
@click.option(
    "--bsdf", type=FILE, help="BSDF XML file: Klems or tensor tree; U, g and more come from the .toml beside it."
)
@click.option(
    "--g",
    "g_value",
    metavar="NUMBER|FILE.csv",
    help="g-value at normal incidence; or a CSV file: polar_deg, g and, optionally, azimuth_deg.",
)
@u_option
@click.option("--state", default="", help="Name of the shading state; default: the usual one.")
@click.option("--reference", is_flag=True, help="Store a reference to the BSDF file instead of its contents.")
@out_option
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
    """Write BSDF, U, g, thermal model and shade position into the windows of an IFC file.

    --space, --storey, --facade and --type restrict each other; repeat one of them to select more.
    """
    if bsdf is None and g_value is None and u_value is None:
        raise click.UsageError("nothing to attach: give --bsdf, --g or --u")
    # g may be a number, which no file is; the building may be written back
    check_file(out, inputs=[bsdf, None if g_value is None else Path(g_value)])
    from scenes.fenestration.state_to_attach import state_to_attach

    one, notes = state_to_attach(bsdf, name=state, u_value=u_value, g_value=g_value, copy_bsdf=not reference)
    from bim.ifc.attach import attach as attach_to_ifc
    from bim.ifc.targets import Targets

    count = attach_to_ifc(building, out, one, Targets(**chosen), bsdf_reference=bsdf if reference else None)
    for note in notes:
        click.echo(f"note: {note}")
    click.echo(f"{out}: windows and window types: {count}")


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.argument("operation", type=FILE, metavar="OPERATION.toml")
@out_option
def control(building: Path, operation: Path, out: Path) -> None:
    """Write the rules of shading control of an operation file into an IFC file.

    The windows of each room that move together become an IfcGroup with its rule as property set.
    An operation file with `control_of = "BUILDING.ifc"` takes the rules from there.
    """
    check_file(out, inputs=[building, operation])
    from bim.ifc.control import write_control
    from scenes.input_files import read_building
    from scenes.room.operation import read_operation
    from scenes.room.stored_control import stored_groups

    tables = read_operation(operation).tables
    groups = stored_groups(read_building(building), tables, operation)
    write_control(building, out, groups)
    click.echo(f"{out}: groups of windows with a rule: {len(groups)}")


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@out_option
def correct(building: Path, out: Path) -> None:
    """Write the corrections beside an IFC file into a copy of it.

    North, outdoor spaces, properties of materials and elements left out are written; entries that
    IFC cannot hold are written to a corrections file beside the copy.
    """
    check_file(out, inputs=[building])
    from bim.ifc.correct import correct as corrected

    done = corrected(building, out)
    if done.north_deg is not None:
        click.echo(f"north: the model's +y axis points {done.north_deg:g} degrees from north")
    click.echo(f"spaces outdoors: {done.outdoors}, materials: {done.materials}, elements removed: {done.removed}")
    if done.left_file is not None:
        click.echo(f"remain corrections, in {done.left_file}: {', '.join(done.left)}")
    click.echo(out)


@command.command()
@out_folder_option
def templates(out: Path) -> None:
    """Write the definition of the windows' property set for other programs.

    An IFC library with its IfcPropertySetTemplate, buildingSMART's PSD XML, and an IDS that checks
    models for it.
    """
    folder = ResultFolder(out, "ifc templates")
    from bim.ifc.property_templates import write_ids, write_psd, write_templates

    with folder.replaced() as place:
        write_templates(place / "fenestration_templates.ifc")
        write_ids(place / "fenestration.ids")
        write_psd(place / "fenestration_psd.xml")
    click.echo(out)


@command.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="BUILDING.ifc...")
@click.option("--markdown", "table", type=click.Path(path_type=Path), help="Also write the table.")
def survey(files: tuple[Path, ...], table: Path | None) -> None:
    """Check and convert many IFC files: rooms, windows, quantities, time and memory of each."""
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
@click.option(
    "--json",
    "record",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.json",
    help="Also write it as data for other programs.",
)
def info(building: Path, record: Path | None) -> None:
    """Show what an IFC file states: program, units, site, north, storeys, elements.

    Its geometry is not read: `cfs check` lists rooms, windows and problems.
    """
    if record is not None:
        check_file(record, field="--json", inputs=[building])
    from bim.ifc.summary import summary

    models = summary(building)
    for model in models:
        for line in _info_lines(model):
            click.echo(line)
    if record is not None:
        write_text(record, json_text(models))


def _info_lines(model: dict[str, Any]) -> Iterator[str]:
    """The summary of a model as lines."""
    yield f"{model['file']}: {model['schema']}, written by {', '.join(model['written_by']) or 'an unnamed program'}"
    yield f"units: 1 unit of length = {model['metres_per_unit']:g} m"
    if model["latitude_deg"] is None:
        yield "site: no latitude and longitude; the weather file decides"
    else:
        place = f"latitude {model['latitude_deg']:.4f}, longitude {model['longitude_deg']:.4f}"
        yield f"site: {place}, elevation {model['elevation_m']:.1f} m"
    north = model["north_deg"]
    if north is None:
        yield "north: not stated; +y is taken"
    else:
        yield f"north: +y points {abs(north):.1f} degrees {'east' if north >= 0 else 'west'} of north"
    yield f"map: {model['map'] or 'not stated'}"
    storeys = (f"{name or 'unnamed'} ({count})" for name, count in model["storeys"].items())
    yield f"storeys (spaces): {', '.join(storeys) or 'none'}"
    yield ", ".join(f"{label}: {count}" for label, count in model["counts"].items())
    yield f"windows with attached systems: {model['windows_with_attached_data']}"


@command.command()
@click.argument("building", type=IFC_FILE, metavar="BUILDING.ifc")
@click.argument("selector")
def query(building: Path, selector: str) -> None:
    """List the elements that a SELECTOR matches, such as 'IfcWall, layer="A-WALL"'.

    By GUID, class, Name, type, material, location (storey), property (Pset_WallCommon.IsExternal),
    each with = or a regular expression (Name=/Louvre.*/), and by CAD layer; + joins groups.
    """
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from bim.ifc.targets import query as chosen_elements

    elements = chosen_elements(building, selector)
    table = Table()
    for head in ("class", "name", "type", "storey", "material", "layer", "GUID"):
        table.add_column(head, overflow="fold")
    for one in elements:
        row = (one.ifc_class, one.name, one.type_name, one.storey, one.material, one.layer)
        table.add_row(*map(escape, row), one.guid)
    console = Console(width=None if Console().is_terminal else UNCUT)
    if elements:
        console.print(table)
    console.print(f"elements: {len(elements)}")
