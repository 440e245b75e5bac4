"""`cfs design`: the best system, sizes and rule of control for a room, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    FILE,
    chosen_language,
    page_option,
    processes_option,
    replacing,
    results_folder_option,
    scheduler_option,
)

if TYPE_CHECKING:
    from scenes.design.assessment import Assessment
    from scenes.design.design import DesignResult
    from scenes.design.design_file import Design
    from scenes.study.store import Store


@click.command(cls=StrictCommand)
@click.argument("design", type=FILE, metavar="DESIGN.toml")
@results_folder_option
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
    from scenes.design.design import FRONT, run_design, write_design
    from scenes.design.each import run_each, write_each
    from scenes.design.each_page import write_each_report
    from scenes.design.page import write_design_report, write_front_report
    from scenes.result_folder import REPORT

    with ProgressBar() as progress, compiled_beside():
        options: dict[str, Any] = {"processes": processes, "scheduler": scheduler, "progress": progress}
        options["on_candidate"] = _print_candidate
        if parsed.search.each is None:
            results = {"": run_design(parsed, store, **options)}
        else:
            results = run_each(parsed, store, on_part=click.echo, **options)

    def pages(result: DesignResult) -> dict[str, Callable[[Path], object]]:
        return {
            REPORT: lambda path: write_design_report(result, path, page_options),
            FRONT: lambda path: write_front_report(result, path, page_options),
        }

    if parsed.search.each is None:
        (result,) = results.values()
        write_design(result, store, *pages(result).values())
    else:
        report = partial(write_each_report, parsed, results, page=page_options)
        write_each(parsed, results, store, report, pages)
    _print_outcome(parsed, results, out)


def _checked(files: tuple[Path, ...], parsed: Design, out: Path, scheduler: str | None) -> Store:
    """The folder of results; `DataError` for what cannot be, before anything heavy is loaded."""
    from mitsuba_cfs.matrices.cache import default_folder
    from scenes.study.files import check_files
    from scenes.study.store import Store
    from scenes.workers import check_dask

    store = Store(out, inputs=files, command="design", replacing=replacing())
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


def _print_outcome(design: Design, results: Mapping[str, DesignResult], out: Path) -> None:
    """The answer, the numbers of candidates and the pages."""
    from scenes.design.each_page import answers
    from scenes.design.page import answer

    every = list(results.values())
    for sentence in answer(every[0]) if design.search.each is None else answers(results):
        click.echo(sentence)
    searched, full = sum(len(one.searched) for one in every), sum(len(one.ranked) for one in every)
    cases, reused = sum(one.cases for one in every), sum(one.reused for one in every)
    click.echo(
        f"{searched} candidates, {full} in full; {cases} cases, {reused} from an earlier run, "
        f"{sum(one.seconds for one in every):.0f} s; table: {out / 'results.parquet'}"
    )
    click.echo(f"report: {out / 'report.html'}")
