"""The page of a fit: parameters with their intervals, readings beside the model."""

from __future__ import annotations

import io
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from mitsuba_cfs.files import write_text
from scenes.figures.picture import bytes_uri
from scenes.fit.fit import FITTED_STUDY, FitResult
from scenes.fit.fit_file import UNITS
from scenes.fit.model import LIGHT_NOISE
from scenes.language.catalogue import N_, gettext, in_language
from scenes.language.numbers import rounded, significant
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.report import page as run_page
from scenes.report.page_files import page_files
from scenes.report.tables import Column, Table

FILES = page_files("scenes.fit")
QUANTITIES = {
    "air temperature": N_("Air temperature"),
    "operative temperature": N_("Operative temperature"),
    "illuminance": N_("Illuminance"),
    "luminance": N_("Luminance"),
}


@dataclass(frozen=True, slots=True)
class ReadingsChart:
    """Readings of a column beside the model."""

    title: str
    uri: str  # of the picture


def write_fit_report(result: FitResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the page of a fit as one self-contained HTML file."""
    scripts = [run_page.FILES[name] for name in run_page.SCRIPTS]
    with in_language(page.language):
        html = (
            run_page.environment(FILES)
            .get_template("fit.html.j2")
            .render(
                page=page,
                title=page.title or gettext("Model fitted to measurements"),
                facts=_facts(result) + page.facts,
                answer=answer(result),
                parameters=parameter_table(result),
                charts=[_chart(column, part) for column, part in result.comparison.groupby("column", sort=False)],
                noise=noise_table(result),
                study=FITTED_STUDY,
                head=run_page.head_lines(result.head, ()),
                version=metadata.version("mitsuba-cfs"),
                style=Markup(run_page.FILES["style.css"]),
                scripts=Markup("\n".join(scripts)),
            )
        )
    write_text(path, html)


def answer(result: FitResult) -> tuple[str, ...]:
    """What the readings determine, and how well the model predicts."""
    table = result.parameters
    lines = [
        gettext(
            "{name}: {value}, 95 % interval {low} to {high}.",
            name=row["parameter"],
            value=significant(row["value"], 3),
            low=significant(row["low_95"], 3),
            high=significant(row["high_95"], 3),
        )
        for _, row in table[table["determined"]].iterrows()
    ]
    lines += [
        gettext("The readings do not determine {name}: its interval is that of its prior.", name=name)
        for name in table.loc[~table["determined"], "parameter"]
    ]
    pairs = {tuple(sorted((a, b))) for a, b in zip(table["parameter"], table["only_with"], strict=True) if b}
    lines += [gettext("{first} and {second} are known only together.", first=a, second=b) for a, b in sorted(pairs)]
    lines += [
        gettext("{name} is at a bound or far from its prior: the model may lack something.", name=name)
        for name in table.loc[table["doubtful"], "parameter"]
    ]
    if "predicted" in result.coverage:
        share = rounded(100 * result.coverage["predicted"], 0)
        lines.append(gettext("{share} % of the predicted readings are within their 90 % interval.", share=share))
    if not result.estimate.converged:
        lines.append(gettext("The fit did not converge: give narrower priors or fewer parameters."))
    return tuple(lines)


def parameter_table(result: FitResult) -> Table:
    """Prior, value and interval of each parameter."""
    columns = (
        Column(gettext("Parameter"), numeric=False),
        Column(gettext("Prior, standard deviation")),
        Column(gettext("Fitted value")),
        Column(gettext("Standard error")),
        Column(gettext("95 % interval")),
        Column(gettext("Standard error over that of the prior"), "%"),
    )
    rows = [
        (
            row["parameter"],
            f"{significant(row['prior_mean'], 3)} ± {significant(row['prior_deviation'], 2)}",
            significant(row["value"], 3),
            significant(row["standard_error"], 2),
            gettext("{low} to {high}", low=significant(row["low_95"], 3), high=significant(row["high_95"], 3)),
            rounded(row["error_of_prior_percent"], 0),
        )
        for _, row in result.parameters.iterrows()
    ]
    return Table(gettext("Parameters"), columns, tuple(rows))


def noise_table(result: FitResult) -> Table:
    """What the readings scatter about the model."""
    columns = (
        Column(gettext("Readings"), numeric=False),
        Column(gettext("Number")),
        Column(gettext("Standard deviation about the model")),
        Column(gettext("Correlation time"), "h"),
        Column(gettext("Independent readings that tell as much")),
    )
    rows = []
    for name, one in result.estimate.noise.items():
        light = name == LIGHT_NOISE
        deviation = f"{significant(100 * one.deviation, 2)} %" if light else f"{significant(one.deviation, 2)} K"
        words = gettext("Light") if light else gettext("Temperatures")
        rows.append(
            (
                words,
                str(one.count),
                deviation,
                significant(one.correlation_h, 2) if one.correlation_h > 0.01 else "0",
                rounded(one.effective, 0),
            )
        )
    return Table(gettext("Differences between readings and model"), columns, tuple(rows))


def _facts(result: FitResult) -> tuple[tuple[str, str], ...]:
    fitted = int(result.comparison["fitted"].sum())
    return (
        (gettext("Parameters"), str(len(result.parameters))),
        (gettext("Readings fitted"), str(fitted)),
        (gettext("Readings predicted"), str(len(result.comparison) - fitted)),
    )


def _chart(column: object, part: pd.DataFrame) -> ReadingsChart:
    """Readings and model over time, the predicted part shaded."""
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    axes = figure.subplots()
    quantity = str(part["quantity"].iloc[0])
    times = part["time"].to_numpy()
    gaps = np.diff(times)
    breaks = (np.flatnonzero(gaps > 3 * np.median(gaps)) + 1 if len(gaps) else np.empty(0)).astype(int)
    for number, rows in enumerate(np.split(np.arange(len(part)), breaks)):
        own = part.iloc[rows]
        label = number == 0
        band = gettext("90 % interval of a reading") if label else None
        axes.fill_between(own["time"], own["low"], own["high"], color="#0072b2", alpha=0.2, lw=0, label=band)
        axes.plot(own["time"], own["model"], color="#0072b2", lw=1.2, label=gettext("model") if label else None)
    for fitted, colour, words in (
        (True, "#000000", gettext("measured, fitted")),
        (False, "#d55e00", gettext("measured, predicted")),
    ):
        own = part[part["fitted"] == fitted]
        if len(own):
            axes.plot(own["time"], own["measured"], ".", ms=2.5, color=colour, label=words)
    axes.set_ylabel(f"{gettext(QUANTITIES[quantity])} [{UNITS[quantity]}]")
    axes.legend(loc="upper left", fontsize="small", ncols=4)
    axes.grid(alpha=0.3)
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None})
    return ReadingsChart(f"{column}: {gettext(QUANTITIES[quantity])}", bytes_uri(file.getvalue(), "image/svg+xml"))
