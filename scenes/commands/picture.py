"""`cfs picture`: a luminance picture of a room under the sky of an hour."""

from __future__ import annotations

import time
from pathlib import Path

import click

from mitsuba_cfs.files import check_file
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    PrintedHead,
    eye_height_option,
    input_options,
    light_options,
    samples_option,
    size_option,
    view_option,
    with_demo,
)
from scenes.picture_options import SUFFIXES, PictureOptions


@click.command(cls=StrictCommand)
@input_options("the first with a window", several=False, weather="demo")
@click.option(
    "--at",
    required=True,
    metavar="'MM-DD HH[:MM]'",
    help="Date and time; the hour of the weather file that contains it is used.",
)
@view_option("view", "perspective or fisheye", several=False)
@eye_height_option
@size_option("size", 800, "as evalglare recommends")
@samples_option(16, "for a single hour")
@click.option("--tone", is_flag=True, help="Tone-map the PNG instead of writing falsecolour.")
@click.option("--colour", is_flag=True, help="Use the colours of the surfaces, white-balanced; the PNG is tone-mapped.")
@light_options
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    multiple=True,
    required=True,
    help=f"File to write ({', '.join(SUFFIXES)}); may be repeated.",
)
def command(out: tuple[Path, ...], tone: bool, **chosen) -> None:
    """Render a luminance picture of a room under sun and sky of one hour by path tracing.

    Without --cfs each window uses the BSDF attached to it or its type in the IFC, else
    the transmittance stated there.  Without BUILDING the demo's office is used.
    """
    for file in out:
        if file.suffix not in SUFFIXES:
            raise click.UsageError(f"--out {file}: expected one of {', '.join(SUFFIXES)}")
        check_file(file)
    from scenes.picture_files import read_files

    start = time.perf_counter()
    options = PictureOptions(**with_demo(chosen))
    read = read_files(options)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar
    from scenes.view_picture import room_picture, write_picture

    head = PrintedHead()
    with ProgressBar() as progress:
        result = room_picture(options, progress, read, head)
    for file in out:
        write_picture(result, file, print_like=tone)
    view, rated = result.view, result.glare
    says = f"{result.room}, {result.time:%d %B %H:%M}: {view.width} x {view.height} pixels"
    if rated is not None:
        eye = f"{rated.Ev:,.0f}" if rated.Ev >= 100 else f"{rated.Ev:.1f}"
        says += f", Ev {eye} lx, DGP {rated.dgp:.3f}, {rated.count} glare source(s)"
    click.echo(f"{says}; {time.perf_counter() - start:.1f} s")
    head.notes(result.notes)
