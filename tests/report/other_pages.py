"""Pages of `cfs check`, `cfs fit` and `cfs design` with figures that need no ray and no heat balance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from bim.ifc.building import read_ifc
from scenes.design.design import run_design
from scenes.design.design_file import read_design
from scenes.design.each import run_each
from scenes.design.each_page import write_each_report
from scenes.design.page import design_report_html
from scenes.fit.estimate import FittedValues, ReadingNoise
from scenes.fit.fit import FitResult
from scenes.fit.model import KELVIN_NOISE
from scenes.fit.page import write_fit_report
from scenes.head import Head
from scenes.report.page import write_check
from tests.bim.small_ifc import box_room
from tests.design.designs import COOLING, ENERGY, PLAIN, SEARCH, WIDTH, by_formula, design_file
from tests.validation.fit import planted_fit


def write_check_page(folder: Path) -> Path:
    """The check of a room with a leak."""
    box_room(gap=0.3).write(str(folder / "m.ifc"))
    write_check(read_ifc(folder / "m.ifc"), ("Model: usable",), folder / "check.html")
    return folder / "check.html"


def write_design_page(folder: Path) -> Path:
    """A design of width and set point by a formula."""
    design = read_design(design_file(folder, PLAIN, WIDTH, COOLING, ENERGY, SEARCH))
    result = run_design(design, folder / "out", compute=by_formula)
    (folder / "design.html").write_text(design_report_html(result), encoding="utf-8")
    return folder / "design.html"


def write_each_page(folder: Path) -> Path:
    """The same for each of two orientations."""
    search = SEARCH + 'each = "orientation"\nmethod = "all"\n'
    head = "orientations_deg = [0, 90]\n"
    design = read_design(design_file(folder, PLAIN, WIDTH, COOLING, ENERGY, search, head=head))
    write_each_report(design, run_each(design, folder / "each", compute=by_formula), folder / "each.html")
    return folder / "each.html"


def write_fit_page(folder: Path) -> Path:
    """Two days of an air temperature beside a sine, the second predicted; one parameter is not determined."""
    fit = planted_fit(folder / "fit", "heat")
    count = len(fit.mean)
    hours = pd.date_range("2017-05-01", periods=48, freq="h")
    wave = 21.0 + 2.0 * np.sin(np.arange(48) / 4.0)
    comparison = pd.DataFrame(
        {
            "time": hours,
            "column": "air",
            "quantity": "air temperature",
            "fitted": hours < hours[24],
            "measured": wave + 0.1 * np.cos(np.arange(48)),
            "model": wave,
            "low": wave - 0.3,
            "high": wave + 0.3,
        }
    )
    names = [one.label for one in fit.tables.parameter]
    parameters = pd.DataFrame(
        {
            "parameter": names,
            "prior_mean": fit.mean,
            "prior_deviation": fit.deviation,
            "value": fit.mean,
            "standard_error": 0.2 * fit.deviation,
            "low_95": fit.mean - 0.4 * fit.deviation,
            "high_95": fit.mean + 0.4 * fit.deviation,
            "error_of_prior_percent": 20.0,
            "determined": [True] * (count - 1) + [False],
            "only_with": "",
            "doubtful": False,
        }
    )
    error = 0.2 * fit.deviation
    values = FittedValues(
        fit.mean,
        np.diag(error**2),
        fit.mean - 2 * error,
        fit.mean + 2 * error,
        wave,
        fit.mean,
        {KELVIN_NOISE: ReadingNoise(0.2, 1.5, 24, 9.0)},
        7.0,
        4,
        True,
    )
    coverage = {"fitted": 0.9, "predicted": 0.9}
    head = Head(("Model: usable",), assumed=("Air change as stated.",))
    result = FitResult(fit, values, parameters, pd.DataFrame(np.eye(count)), comparison, coverage, head)
    write_fit_report(result, folder / "fit.html")
    return folder / "fit.html"
