"""What commands share that serve a page to this machine: their options, and a port in use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

Command = Callable[..., Any]


def served_page_options(language: str) -> Callable[[Command], Command]:
    """`--port`, `--language` and `--no-browser`.

    Args: language: what the language means to the command, behind a semicolon in its help.
    """

    def decorated(command: Command) -> Command:
        for option in (
            click.option("--no-browser", is_flag=True, help="Print the address only."),
            click.option(
                "--language",
                type=click.Choice(["en", "de", "fr"]),
                default="en",
                show_default=True,
                help=f"Language of the page; {language}.",
            ),
            click.option(
                "--port",
                type=click.IntRange(0, 65535),
                default=0,
                help="Port on the loopback address; 0: any free port.",
            ),
        ):
            command = option(command)
        return command

    return decorated


def port_fault(port: int, error: OSError) -> DataError:
    """The error of a port that cannot be used."""
    return DataError(f"port {port} cannot be used: {reason(error)}", field="--port")
