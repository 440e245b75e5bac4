"""`cfs demo`: the main job on the office, weather and blind that come with the program."""

from __future__ import annotations

from pathlib import Path

import click

from scenes.commands.run import run_to_folder
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.run.options import JobOptions


@click.command()
@click.option(
    "--out", default="cfs-demo", show_default=True, type=click.Path(path_type=Path),
    help="Folder of results.",
)  # fmt: skip
def command(out: Path) -> None:
    """Run the main job on a two-room office with exterior venetian blinds in Chicago."""
    run_to_folder(JobOptions(OFFICE, WEATHER, VENETIAN_BLIND), out, "demo")
