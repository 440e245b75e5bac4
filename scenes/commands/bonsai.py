"""`cfs ifc bonsai`: the panel for Bonsai (Blender) as an add-on to install."""

from __future__ import annotations

from pathlib import Path

import click

from mitsuba_cfs.files import check_file


@click.command()
@click.option(
    "--out", required=True, type=click.Path(path_type=Path, dir_okay=False), metavar="ADDON.zip",
    help="The add-on, for Blender's Preferences, Add-ons, Install from Disk.",
)  # fmt: skip
def bonsai(out: Path) -> None:
    """Write the Bonsai panel: cfs run on the open IFC file, rooms coloured by result."""
    check_file(out, field="--out")
    from bim.bonsai.package import write_add_on

    write_add_on(out)
    click.echo(out)
