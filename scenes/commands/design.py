"""`cfs design`: the best system, sizes and rule of control for a room, and how sure that is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    FILE,
    chosen_language,
    out_folder_option,
    page_option,
    processes_option,
    scheduler_option,
)

if TYPE_CHECKING:
    from scenes.design.assessment import Assessment
    from scenes.design.design import DesignResult
    from scenes.design.design_file import Design
    from scenes.study.store import Store


@click.command(cls=StrictCommand)
@click.argument("design", type=FILE, metavar="DESIGN.toml")
@out_folder_option
@processes_option(1, "1 by default, because candidates depend on those computed beside them")
@scheduler_option
@page_option
def command(design: Path, *, out: Path, processes: int, scheduler: str | None, page: Path | None) -> None:
    """Search the best system, sizes and rule of control for a room.

    docs/design.md describes the file: what may vary, what is sought, what must be met.  Candidates
    are compared by cheap methods, the best are computed in full.  Finished cases are stored in the
    folder of results: after an interruption the same command continues.
    """
    from scenes.design.design_file import read_design
    from scenes.page_options import DesignSection, read_page

    parsed = read_design(design)
    page_options = read_page(page, DesignSection, chosen_language())
    store = _checked((design, *parsed.files, *page_options.inputs), parsed, out, scheduler)
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.design.design import run_design, write_design
    from scenes.design.page import write_design_report, write_front_report

    with ProgressBar() as progress, compiled_beside():
        result = run_design(
            parsed, store, processes=processes, scheduler=scheduler, progress=progress, on_candidate=_print_candidate
        )
    write_design(
        result,
        store,
        lambda path: write_design_report(result, path, page_options),
        lambda path: write_front_report(result, path, page_options),
    )
    _print_outcome(result, out)


def _checked(files: tuple[Path, ...], parsed: Design, out: Path, scheduler: str | None) -> Store:
    """The folder of results; `DataError` for what cannot be, before anything heavy is loaded."""
    from mitsuba_cfs.matrices.cache import default_folder
    from scenes.study.files import check_files
    from scenes.study.store import Store
    from scenes.workers import check_dask

    store = Store(out, inputs=files, command="design")
    default_folder()  # of the cache, or one line that it cannot be one
    if scheduler is not None:
        check_dask()
    stated = tuple(system for system in parsed.system if not system.layers)
    check_files(parsed.model_copy(update={"system": stated}))
    return store


def _print_candidate(stage: str, one: Assessment, cases: int) -> None:
    """One line for each candidate that is ready."""
    label = f"[{stage}, {cases} cases] {one.candidate.label}"
    if one.error:
        click.echo(f"{label}: failed: {one.error}")
        return
    values = ", ".join(f"{value:.4g}" for value in one.objectives)
    failed = "; fails " + ", ".join(f"{f.limit.label} ({f.value:.4g})" for f in one.failed) if one.failed else ""
    click.echo(f"{label}: {values}{failed}")


def _print_outcome(result: DesignResult, out: Path) -> None:
    """The answer, the numbers of candidates and the pages."""
    from scenes.design.page import answer

    for sentence in answer(result):
        click.echo(sentence)
    click.echo(
        f"{len(result.searched)} candidates, {len(result.ranked)} in full; {result.cases} cases, {result.reused} from "
        f"an earlier run, {result.seconds:.0f} s; table: {out / 'results.parquet'}"
    )
    click.echo(f"report: {out / 'report.html'}")
