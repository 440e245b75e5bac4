"""Options that every command which reads rooms has."""

from __future__ import annotations

import click

join_option = click.option(
    "--join", multiple=True, metavar="'ROOM + ROOM'",
    help="Rooms open to each other that are to be one.",
)  # fmt: skip
