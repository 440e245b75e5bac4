"""`cfs study`: rooms x systems x orientations x climates x methods to one table and one report."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bim.report.issue import issue_text
from scenes import quick as quick_run
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    BY_MACHINE,
    FILE,
    PrintedHead,
    check_is_ifc,
    chosen_language,
    explore_option,
    method_option,
    page_option,
    processes_option,
    quick_option,
    replacing,
    results_folder_option,
    scheduler_option,
    surroundings_offset_option,
    surroundings_option,
    with_flags,
    write_ifc_option,
)
from scenes.commands.under_way import StudyPage

if TYPE_CHECKING:
    from scenes.study.explored import ExploredCase
    from scenes.study.plan import Case, StudyPlan
    from scenes.study.store import CaseResult, Store
    from scenes.study.study import StudyResult
    from scenes.study.study_file import Study


@click.command(cls=StrictCommand)
@click.argument("study", type=FILE, metavar="STUDY.toml")
@results_folder_option
@processes_option(None, BY_MACHINE)
@scheduler_option
@method_option(["auto"], "auto: chosen by cost and error, instead of the file's")
@click.option("--time-budget", metavar="TIME", help="Time limit of the whole study for --method auto: 90s, 20min, 2h.")
@click.option("--dgp-error", metavar="PERCENT", help="Relative error limit of DGP for --method auto: 10%.")
@explore_option("for at most 12 cases, which open from the marks of the report")
@write_ifc_option("one property set for each case; for studies of a single IFC file")
@surroundings_option
@surroundings_offset_option
@quick_option
@page_option
def command(
    study: Path,
    *,
    out: Path,
    processes: int | None,
    scheduler: str | None,
    method: str | None,
    time_budget: str | None,
    dgp_error: str | None,
    explore: bool,
    write_ifc: Path | None,
    surroundings: tuple[Path, ...],
    surroundings_offset: tuple[float, float, float] | None,
    quick: bool,
    page: Path | None,
) -> None:
    """Compute every room of a study with every system, orientation, climate and method.

    docs/studies.md describes the file.  Finished cases are stored in the folder of results: after
    an interruption the same command continues, and after additions to the file it computes only
    the new cases.
    """
    from scenes.study.study_file import read_study

    asked = {"time_budget": time_budget, "dgp_error": dgp_error}
    asked = {key: text for key, text in asked.items() if text is not None}
    parsed = read_study(study, automatic=method is not None, quick=quick, **asked)
    parsed = with_flags(parsed, surroundings, surroundings_offset)
    study_to_folder(study, parsed, out, processes, scheduler, write_ifc, page=page, explore=explore)


def study_to_folder(
    file: Path,
    parsed: Study,
    out: Path,
    processes: int | None = 1,
    scheduler: str | None = None,
    write_ifc: Path | None = None,
    *,
    page: Path | None = None,
    explore: bool = False,
) -> None:
    """Compute a study with a progress bar, say what comes out case by case, write its files."""
    from scenes.page_options import StudySection, read_page

    page_options = read_page(page, StudySection, chosen_language())
    files = (file, *parsed.files, *page_options.inputs)
    store = _checked(files, parsed, out, scheduler, write_ifc)
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.study.automatic import settled
    from scenes.study.plan import plan_of
    from scenes.study.study import run_study, with_explorers, write_study
    from scenes.study.write_ifc import write_study_ifc
    from scenes.study_report import write_study_report
    from scenes.study_report.page import explorable, write_study_explorer
    from scenes.workers import processes_for

    if parsed.quick:
        click.echo(quick_run.NOTE)
    plan = settled(parsed, plan_of(parsed))
    pages = StudyPage(store.results, plan, page_options.language)
    chosen: dict[int, Case] = {}
    head = PrintedHead()
    processes = processes_for(len(plan.cases), processes)
    _check_explorable(plan, explore)
    _print_plan(plan)
    with ProgressBar() as progress, compiled_beside():
        result = run_study(
            parsed,
            store,
            plan=plan,
            processes=processes,
            scheduler=scheduler,
            progress=progress,
            on_case=partial(_ready_case, pages),
            on_reused=pages.reused,
            on_head=head,
        )
        nothing = result.failed == len(result.results)
        if explore and not nothing:
            chosen = explorable(result)
            result = with_explorers(
                result,
                chosen,
                store,
                processes=processes,
                scheduler=scheduler,
                progress=progress,
                on_case=_print_explorer,
            )
    report = None if nothing else lambda path: write_study_report(result, path, page_options)
    page_of_cases = partial(write_study_explorer, result, page=page_options) if result.explored else None
    write_study(parsed, result, store, report, page_of_cases)
    _print_outcome(result, out)
    head.notes(result.notes)
    if write_ifc is not None and not nothing:
        for issue in write_study_ifc(result, write_ifc):
            click.echo(f"note: {issue.where}: {issue_text(issue, 'command').what}")
        click.echo(f"building with results: {write_ifc}")
    _raise_failures(result, len(chosen))


def _raise_failures(result: StudyResult, explorers: int) -> None:
    """End with an error that counts the cases, or the explorers begun, that failed."""
    failed, total = result.failed, len(result.results)
    if failed == total:
        raise click.ClickException(f"{failed} of {total} cases failed: {result.first_error}")
    if failed:
        raise click.ClickException(
            f"{failed} of {total} cases failed, the first: {result.first_error}; "
            f"the others are kept, and the same command tries these again"
        )
    if len(result.explored) < explorers:
        lost = explorers - len(result.explored)
        raise click.ClickException(f"{lost} of {explorers} explorers failed; the notes say why")


def _check_explorable(plan: StudyPlan, explore: bool) -> None:
    """Raise `click.UsageError` where no case could get the explorer that was asked for."""
    from scenes.study.explored import PHASED

    if explore and not any(case.options.method in PHASED for case in plan.cases):
        raise click.UsageError("--explore needs cases by three-phase or five-phase")


def _checked(files: tuple[Path, ...], parsed: Study, out: Path, scheduler: str | None, write_ifc: Path | None) -> Store:
    """The folder of results; `DataError` for what cannot be, before anything heavy is loaded."""
    from mitsuba_cfs.files import check_file
    from mitsuba_cfs.matrices.cache import default_folder
    from scenes.study.files import check_files, one_building
    from scenes.study.store import Store
    from scenes.workers import check_dask

    if write_ifc is not None:
        check_file(write_ifc, field="--write-ifc", inputs=parsed.files)
        check_is_ifc(one_building(room.building for room in parsed.room), "--write-ifc")
    store = Store(out, inputs=files, replacing=replacing())
    default_folder()  # of the cache, or one line that it cannot be one
    if scheduler is not None:
        check_dask()
    check_files(parsed)
    return store


def _print_plan(plan: StudyPlan) -> None:
    """Why methods were chosen."""
    for why in dict.fromkeys(case.chosen for case in plan.cases if case.chosen):
        click.echo(f"auto: {why}")


def _print_outcome(result: StudyResult, out: Path) -> None:
    """How many cases there are, what they took, and the pages."""
    from scenes.language.catalogue import ngettext
    from scenes.result_folder import EXPLORER

    click.echo(
        f"{ngettext('{count} case', '{count} cases', len(result.results))}: {result.reused} from "
        f"an earlier run, {result.failed} failed, {result.seconds:.0f} s; table: {out / 'results.parquet'}"
    )
    if result.clock:
        click.echo(f"auto: {result.clock}")
    if result.failed < len(result.results):
        click.echo(f"report: {out / 'report.html'}")
    if result.explored:
        number = ngettext("{count} case", "{count} cases", len(result.explored))
        click.echo(f"explorer: {out / EXPLORER / 'index.html'}, {number}")


def _print_explorer(case: Case, explored: ExploredCase) -> None:
    """One line for an explorer that could not be made."""
    if explored.error:
        click.echo(f"note: no explorer of {case.place}, {case.system}: {explored.error}")


def _ready_case(page: StudyPage, case: Case, result: CaseResult, ready: int, total: int) -> None:
    """Print a case that is ready, and put it on the page."""
    _print_case(case, result, ready, total)
    page(case, result)


def _print_case(case, result, ready: int, total: int) -> None:
    """One line for each case that is ready."""
    label = f"[{ready}/{total}] {case.place}, {case.system}, {case.climate}"
    label += f", {case.orientation_deg:g} deg"
    if result.error:
        click.echo(f"{label}: failed: {result.error}")
        return
    f = result.figures
    glare = f", DGP above 0.45 in {f['glare_intolerable_h']:.0f} h" if "dgp_max" in f else ""
    click.echo(
        f"{label}, {case.options.method}: sDA {f['sda300_50']:.0f} %, DA {f['da300']:.0f} %"
        f"{glare}, operative up to {f['operative_max_c']:.1f} C, {f['seconds']:.1f} s"
    )
