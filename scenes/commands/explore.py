"""`cfs explore`: any hour of the results of `cfs run --explore`, in a browser."""

from __future__ import annotations

import webbrowser
from collections.abc import Sequence
from pathlib import Path

import click

from mitsuba_cfs.files import read_json, scratch_folder
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import replace_option, replacing
from scenes.commands.served_page import port_fault, served_page_options

RESULTS = click.Path(exists=True, file_okay=False, path_type=Path)


@click.command(cls=StrictCommand)
@click.argument("results", type=RESULTS, nargs=-1, required=True, metavar="RESULTS...")
@click.option("--out", type=click.Path(path_type=Path), help="Write one folder that opens as a file, and exit.")
@replace_option
@served_page_options("results of a run state none")
def command(results: Sequence[Path], out: Path | None, port: int, language: str, no_browser: bool) -> None:
    """Show any hour of a run: pictures, glare, plans with sunlit areas, temperatures.

    RESULTS are folders of `cfs run --explore`; several are shown side by side.  The page is served
    to this machine only, until Ctrl-C, and loads nothing from the network.
    """
    from scenes.explore.folder import copy_explorer, explorer_of, join_explorers
    from scenes.language.catalogue import in_language
    from scenes.result_folder import ResultFolder

    folders = [explorer_of(result) for result in results]
    for one in results:
        _print_head(one, several=len(results) > 1)
    if out is not None:
        folder = ResultFolder(out, "explore", inputs=results, replacing=replacing())
        with in_language(language), folder.replaced() as place:
            join_explorers(results, place)
        click.echo(f"explorer: {out / 'index.html'}")
        return
    with scratch_folder() as place:
        with in_language(language):
            if len(results) > 1:
                join_explorers(results, place)
            else:
                copy_explorer(folders[0], place)
        _serve(place, port, open_it=not no_browser)


def _print_head(results: Path, *, several: bool) -> None:
    """What was left out and assumed of the inputs of a run."""
    from scenes.head import record_lines
    from scenes.user_errors import one_line

    file = results / "run.json"
    if not file.exists():  # an explorer that was copied without its run
        return
    record = read_json(file)
    if several:
        click.echo(f"{results}:")
    for line in record_lines(record["head"], file) if "head" in record else ():
        click.echo(one_line(line))


def _serve(folder: Path, port: int, *, open_it: bool) -> None:
    from scenes.explore.folder import server

    try:
        running = server(folder, port)
    except OSError as error:
        raise port_fault(port, error) from None
    with running:
        address = f"http://127.0.0.1:{running.server_port}/"
        click.echo(f"{address} until Ctrl-C")
        if open_it:
            webbrowser.open(address)
        try:
            running.serve_forever()
        except KeyboardInterrupt:
            click.echo("ended")
