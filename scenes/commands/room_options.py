"""Options that every command which reads rooms has, and the demo's room where none is given."""

from __future__ import annotations

from pathlib import Path

import click

from scenes.commands.parameters import FILE
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER

join_option = click.option(
    "--join", multiple=True, metavar="'ROOM + ROOM'",
    help="Rooms open to each other that are to be one.",
)  # fmt: skip

weather_option = click.option(
    "--weather", type=FILE, help="EPW file, hourly; needed with a building of your own."
)
system_option = click.option(
    "--cfs", "system", type=FILE,
    help="BSDF XML file of every window, Klems full or tensor tree; default: what the IFC holds.",
)  # fmt: skip


def room_files(
    building: Path | None, weather: Path | None, system: Path | None
) -> tuple[Path, Path, Path | None]:
    """Building, weather and system; the demo's, which is said, only where there is no building."""
    if building is not None:
        if weather is None:
            raise click.UsageError("--weather: give the EPW file of the building's place")
        return building, weather, system
    demo = ["office"]
    demo += ["weather"] * (weather is None) + ["venetian blind"] * (system is None)
    click.echo(f"no BUILDING given: the demo's {', '.join(demo)}")
    return OFFICE, weather or WEATHER, system or VENETIAN_BLIND
