"""`cfs fit`: inputs of a room's model fitted to measured light or temperatures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import FILE, chosen_language, page_option, replacing, results_folder_option

if TYPE_CHECKING:
    from scenes.fit.fit import FitResult


@click.command(cls=StrictCommand)
@click.argument("fit", type=FILE, metavar="FIT.toml")
@results_folder_option
@page_option
def command(fit: Path, *, out: Path, page: Path | None) -> None:
    """Fit inputs of a model to measured illuminance, luminance or temperatures.

    docs/fit.md describes the file: a study of `cfs thermal`, the parameters with what is known of
    them, and a CSV file of measurements.  Readings outside the fitted period are predicted.
    """
    from scenes.fit.fit_file import read_fit
    from scenes.page_options import FitSection, read_page
    from scenes.result_folder import ResultFolder

    parsed = read_fit(fit)
    page_options = read_page(page, FitSection, chosen_language())
    folder = ResultFolder(out, "fit", inputs=(fit, *parsed.files, *page_options.inputs), replacing=replacing())
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.fit.fit import FITTED_STUDY, run_fit, write_fit
    from scenes.fit.page import write_fit_report

    with ProgressBar() as progress, compiled_beside():
        result = run_fit(parsed, progress=progress)
    write_fit(result, folder, lambda place: write_fit_report(result, place / "report.html", page_options))
    _print(result)
    click.echo(f"study with the fitted values: {out / FITTED_STUDY}")
    click.echo(f"report: {out / 'report.html'}")


def _print(result: FitResult) -> None:
    """One line for each parameter, and how well readings are predicted."""
    for _, row in result.parameters.iterrows():
        line = f"{row['parameter']}: {row['value']:.4g}, 95 % interval {row['low_95']:.4g} to {row['high_95']:.4g}"
        if not row["determined"]:
            line += "; the readings do not determine it: this is the interval of its prior"
        elif row["only_with"]:
            line += f"; known only together with {row['only_with']}"
        if row["doubtful"]:
            line += "; at a bound or far from its prior: the model may lack something"
        click.echo(line)
    words = {"fitted": "fitted readings", "predicted": "predicted readings"}
    for name, share in result.coverage.items():
        click.echo(f"{words[name]} within their 90 % interval: {100 * share:.0f} %")
    if not result.estimate.converged:
        click.echo("The fit did not converge: give narrower priors or fewer parameters.")
