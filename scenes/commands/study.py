"""`cfs study`: rooms x systems x orientations x climates x methods to one table and one report."""

from __future__ import annotations

from pathlib import Path

import click

from scenes import quick as quick_run
from scenes.commands.quick_option import quick_option

FILE = click.Path(exists=True, dir_okay=False, readable=True, path_type=Path)


@click.command()
@click.argument("study", type=FILE, metavar="STUDY.toml")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder of results.")
@click.option(
    "--processes", type=click.IntRange(1, 64), default=1, show_default=True,
    help="Cases at a time on this machine; one already uses all cores.",
)  # fmt: skip
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786.")
@click.option("--method", type=click.Choice(["auto"]), help="Choose by cost and error.")
@click.option("--time-budget", metavar="TIME", help="Of the whole study for auto: 90s, 20min, 2h.")
@click.option("--dgp-error", metavar="PERCENT", help="Relative error of DGP for auto: 10%.")
@click.option(
    "--write-ifc", type=click.Path(path_type=Path, dir_okay=False), metavar="OUT.ifc",
    help="The study's building with each case's results in property sets.",
)  # fmt: skip
@quick_option
def command(
    study: Path,
    out: Path,
    processes: int,
    scheduler: str | None,
    method: str | None,
    time_budget: str | None,
    dgp_error: str | None,
    write_ifc: Path | None,
    quick: bool,
) -> None:
    """Every room of a study with every system, orientation, climate and method.

    docs/studies.md lists what the file may hold.  Finished cases are kept in the folder of
    results: the same command goes on after an interruption, and a longer grid computes only what
    is new.
    """
    from scenes.commands.progress_bar import ProgressBar
    from scenes.study.automatic import settled
    from scenes.study.plan import plan_of
    from scenes.study.store import Store
    from scenes.study.study import run_study
    from scenes.study.study_file import read_study
    from scenes.study.write_ifc import building_file, write_study_ifc
    from scenes.study_report import write_study_report

    asked = {"time_budget": time_budget, "dgp_error": dgp_error}
    asked = {key: text for key, text in asked.items() if text is not None}
    parsed = read_study(study, automatic=method is not None, quick=quick, **asked)
    if parsed.quick:
        click.echo(quick_run.NOTE)
    plan = settled(parsed, plan_of(parsed))
    for why in dict.fromkeys(case.chosen for case in plan.cases if case.chosen):
        click.echo(f"auto: {why}")
    if write_ifc is not None:
        building_file(plan)  # or one line that there is none
    store = Store(out)
    with ProgressBar() as progress:
        result = run_study(
            parsed, store, plan=plan, processes=processes, scheduler=scheduler,
            progress=progress, told=_tell,
        )  # fmt: skip
    click.echo(
        f"{len(result.results)} cases: {result.reused} were there, {result.failed} failed, "
        f"{result.seconds:.0f} s; table: {out / 'results.parquet'}"
    )
    if result.clock:
        click.echo(f"auto: {result.clock}")
    if result.failed == len(result.results):
        raise click.ClickException("no case could be computed")
    store.write("report.html", lambda path: write_study_report(result, path))
    click.echo(f"report: {out / 'report.html'}")
    if write_ifc is not None:
        for problem in write_study_ifc(result, write_ifc):
            click.echo(f"note: {problem.where}: {problem.what}")
        click.echo(f"building with results: {write_ifc}")


def _tell(case, result, ready: int, total: int) -> None:
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
