"""`cfs app`: a project in a browser, from files to a dossier without a shell."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

from mitsuba_cfs.errors import DataError
from scenes.commands.examples import StrictCommand
from scenes.commands.served_page import port_fault, served_page_options


@click.command(cls=StrictCommand)
@click.argument("project", type=click.Path(file_okay=False, path_type=Path), default=Path("cfs-project"))
@served_page_options("also of the reports that it asks for")
def command(project: Path, port: int, language: str, no_browser: bool) -> None:
    """Open a project in a browser: files, rooms, systems, computation, results.

    PROJECT is a folder, by default ./cfs-project; it is made where there is none.  Each
    computation is a command of `cfs` in that folder, which the page shows.  The page is served to
    this machine only, until Ctrl-C, and loads nothing from the network.
    """
    import socket

    import uvicorn

    from scenes.app.jobs import Jobs
    from scenes.app.project import Project
    from scenes.app.server import LOOPBACK, AppServer
    from scenes.result_folder import FolderMark

    if FolderMark.read(project) is not None:
        raise DataError("is a folder of results: name one for a project", file=project)
    folder = Project(project)
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    with listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((LOOPBACK, port))
        except OSError as error:
            raise port_fault(port, error) from None
        number = listening.getsockname()[1]
        jobs = Jobs(folder)
        served = AppServer(folder, jobs, language=language)
        address = f"http://{LOOPBACK}:{number}/?token={served.token}"
        click.echo(f"project: {folder.folder}")
        click.echo(f"{address} until Ctrl-C")
        if not no_browser:
            webbrowser.open(address)
        settings = uvicorn.Config(
            served.app(number),
            log_level="warning",
            access_log=False,
            lifespan="on",
            timeout_graceful_shutdown=2,
            server_header=False,
        )
        try:
            uvicorn.Server(settings).run(sockets=[listening])
        except KeyboardInterrupt:  # uvicorn sends it again once it has ended
            pass
        finally:
            jobs.close()
    click.echo("ended")
