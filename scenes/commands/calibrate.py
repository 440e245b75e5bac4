"""`cfs calibrate`: what each method costs on this machine, for `cfs study --method auto`."""

from __future__ import annotations

from pathlib import Path

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import size_option


@click.command(cls=StrictCommand)
@size_option("size", 300, "costs are scaled to those of a study")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help="File to write; default: the one that `cfs study` reads.",
)
def command(size: int, out: Path | None) -> None:
    """Time every method and glare metric on this machine.

    Seconds for each scene, system and time step of a room of 3.65 x 4.60 x 3.00 m with the demo's
    blind.  Run nothing else on the machine meanwhile.
    """
    from mitsuba_cfs.files import check_file
    from scenes.calibration.costs import calibration_file

    target = out or calibration_file()
    if out is not None:
        check_file(out)
    from scenes.calibration.measure import calibrated
    from scenes.commands.progress_bar import ProgressBar

    with ProgressBar() as progress:
        result = calibrated(size, progress=progress)
    click.echo(f"{result.machine}; pictures of {result.picture_size} x {result.picture_size} pixels")
    click.echo(f"{'method':14} {'metric':12} {'scene [s]':>10} {'system [s]':>11} {'step [s]':>10}")
    for c in result.costs:
        click.echo(f"{c.method:14} {c.metric:12} {c.per_scene:10.2f} {c.per_system:11.2f} {c.per_step:10.4f}")
    result.write(target)
    click.echo(f"results: {target}")
