"""`cfs bench`: accuracy and speed against other programs, on this machine."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command()
@click.option("--only", "only", multiple=True, metavar="NAME", help="Only this; may be repeated.")
@click.option("--list", "names_only", is_flag=True, help="Print the names and stop.")
@click.option(
    "--json", "json_file", type=click.Path(dir_okay=False, path_type=Path),
    help="Write every figure to this file.",
)  # fmt: skip
def command(only: tuple[str, ...], names_only: bool, json_file: Path | None) -> None:
    """Time to equal error against Radiance and others, as a ratio; needs the peers installed.

    ratio = (their time x their error^2) / (our time x our error^2), first in elapsed time, then in
    processor time.  Kernels are compiled before the clock starts.
    """
    from mitsuba_cfs.files import check_file, write_text
    from scenes.benchmarks.harness import PeerMissing, benchmarks
    from scenes.commands.progress_bar import ProgressBar

    found = benchmarks()
    unknown = [name for name in only if name not in found]
    if unknown:
        raise click.UsageError(f"no benchmark {unknown[0]!r}; there are {', '.join(found)}")
    if names_only:
        click.echo("\n".join(found))
        return
    if json_file is not None:
        check_file(json_file, field="--json")
    records = []
    for name in only or found:
        try:
            with ProgressBar() as progress:
                result = found[name](progress)
        except PeerMissing as missing:
            click.echo(f"{name}: left out, {missing}")
            continue
        records.append(result.record())
        click.echo(_table(result))
        if json_file is not None:  # after each, so that an interrupted run keeps what it has
            write_text(json_file, json.dumps(records, indent=1) + "\n")
    if not records:
        raise click.ClickException("no benchmark could run")


def _table(result) -> str:
    """The outcome as a few lines."""
    lines = [f"{result.name}: {result.of}"]
    for run in (result.ours, result.peer):
        error = "" if run.error is None else f"   error {run.error:.3g}"
        lines.append(
            f"  {run.program:<12} {run.seconds:9.3f} s   processor {run.cpu_seconds:9.3f} s{error}"
        )
    lines.append(f"  ratio {result.ratio:.1f}, in processor time {result.cpu_ratio:.1f}")
    lines += [f"  {result.note}"] if result.note else []
    return "\n".join(lines)
