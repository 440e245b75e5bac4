"""`cfs bsdf thermal`: U, g_tot, secondary heat and EN 14501 classes of BSDF files."""

from __future__ import annotations

import json
from pathlib import Path

import click

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, write_table, write_text

PLACES = ("external", "internal", "integrated")
FILE = click.Path(path_type=Path)


@click.command("thermal")
@click.argument("states", nargs=-1, required=True, type=FILE, metavar="STATE.xml ...")
@click.option(
    "--place", type=click.Choice(PLACES), help="The files are shades alone, at this position."
)
@click.option(
    "--glazing",
    type=click.Choice(["A", "B", "C", "D"]),
    help="Reference glazing of EN 14501, with --place.",
)
@click.option(
    "--kappa", type=click.FloatRange(0, 1), default=0.4, show_default=True,
    help="Parameter of Kuhn's formula for interior shades.",
)  # fmt: skip
@click.option("--out", type=FILE, help="Write the table as .csv, or as .json with g by patch.")
@click.option("--toml", type=FILE, help="Write the thermal data of one state for the heat balance.")
def thermal(
    states: tuple[Path, ...],
    place: str | None,
    glazing: str | None,
    kappa: float,
    out: Path | None,
    toml: Path | None,
) -> None:
    """Print U, g_tot, tau_e, secondary heat and EN 14501 classes of each STATE of a system.

    A state is a BSDF file with a .toml file beside it that gives U and g, or the layers, which are
    rated by ISO 15099 (NFRC), ISO 52022-3, EN 673 and EN 410.  With --place and --glazing the
    files are shades alone, rated by EN 13363-1 and Kuhn.
    """
    from scenes.fenestration.ratings import printed, rated_state, thermal_toml

    if (place is None) != (glazing is None):
        raise click.UsageError("--place and --glazing belong together")
    if toml is not None and (len(states) != 1 or place is not None):
        raise click.UsageError("--toml writes the data of one state, not of a shade alone")
    for option, path in (("--out", out), ("--toml", toml)):
        if path is not None:
            check_file(path, field=option, inputs=states)
    missing = [path for path in states if not path.is_file()]
    if missing:
        raise DataError("no such file", file=missing[0])
    found = [rated_state(path, place=place, glazing=glazing, kappa=kappa) for path in states]
    rows = [row for state in found for row in state.rows()]
    for line in printed(rows):
        click.echo(line)
    for note in dict.fromkeys(n for s in found for n in s.notes):
        if place is None:
            click.echo(f"note: {note}")
    if out is not None and out.suffix == ".json":
        by_patch = {s.path.stem: [round(float(g), 5) for g in s.heat.g_value] for s in found}
        record = {"rows": rows} if place else {"rows": rows, "g by patch": by_patch}
        write_text(out, json.dumps(record, indent=2) + "\n")
    elif out is not None:
        import pandas as pd

        write_table(pd.DataFrame(rows), out, index=False, float_format="%.4f")
    if toml is not None:
        write_text(toml, thermal_toml(found[0]))
