"""`cfs demo`: a study of the office, weather and blind that come with the program."""

from __future__ import annotations

from pathlib import Path

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.study import study_to_folder
from scenes.demo import STUDY


@click.command(cls=StrictCommand)
@click.option(
    "--out", default="cfs-demo", show_default=True, type=click.Path(path_type=Path), help="Folder of results."
)
def command(out: Path) -> None:
    """Compare an office in Chicago with its blind up, down and controlled."""
    from scenes.study.study_file import read_study

    study_to_folder(STUDY, read_study(STUDY), out)
