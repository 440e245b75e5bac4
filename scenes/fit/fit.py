"""Fit a study of `cfs thermal` to measurements: parameters with intervals, predictions, result files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomlkit
from numpy.typing import NDArray
from scipy.stats import t as student

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import json_text, write_table, write_text
from mitsuba_cfs.progress import Progress, silent
from scenes.fit.estimate import FittedValues, estimate
from scenes.fit.fit_file import LEAST_READINGS, Fit
from scenes.fit.model import KELVIN_NOISE, LIGHT_NOISE, FittedModel
from scenes.head import Head
from scenes.result_folder import ResultFolder

Array = NDArray[np.float64]
PRIOR_SHARE = 0.9  # of the prior's deviation: above it the readings do not determine a parameter
UNLIKELY = 3.0  # prior deviations: a value farther from its mean contradicts the prior
CORRELATED = 0.9  # of two parameters: above it only a combination of them is known
BAND = 1.644854  # normal quantile of 90 %: intervals of readings
FITTED_STUDY = "fitted.toml"


@dataclass(frozen=True, slots=True)
class FitResult:
    """A fitted study."""

    fit: Fit
    estimate: FittedValues
    parameters: pd.DataFrame  # a row each: prior, value, interval, whether readings determine it
    correlations: pd.DataFrame  # of the parameters, given the readings
    comparison: pd.DataFrame  # every reading beside the model, with 90 % intervals
    coverage: dict[str, float]  # share of the readings within these: "fitted", "predicted"
    head: Head

    @property
    def table(self) -> dict[str, Any]:
        """The study's table with the fitted values, files by absolute paths."""
        return self.fit.table_at(self.estimate.value)

    def write(self, folder: Path) -> None:
        """Write tables and the fitted study into a folder."""
        write_table(self.parameters, folder / "parameters.csv", index=False)
        write_table(self.correlations.round(4), folder / "correlations.csv")
        write_table(self.comparison, folder / "comparison.csv", index=False)
        write_text(folder / FITTED_STUDY, tomlkit.dumps(self.table))
        write_text(folder / "fit.json", json_text(self.record, indent=2) + "\n")

    @property
    def record(self) -> dict[str, Any]:
        """Noise of the instruments, steps and coverage, for fit.json."""
        return {
            "fit": self.fit.tables.model_dump(mode="json"),
            "noise": {name: asdict(one) for name, one in self.estimate.noise.items()},
            "steps": self.estimate.steps,
            "converged": self.estimate.converged,
            "coverage": self.coverage,
            "head": self.head.record,
        }


def run_fit(fit: Fit, *, progress: Progress = silent, model: FittedModel | None = None) -> FitResult:
    """The parameters of a fit with 95 % intervals, and every reading beside the fitted model.

    Args: model: of the same study, parameters and instruments, with what it has computed already.

    Raises: `DataError` where too few readings are within the weather's period.
    """
    model = FittedModel(fit) if model is None else model.of(fit)
    readings = model.readings()
    few = [one.name for one in readings if not len(one.values)]
    if few:
        raise DataError("no reading is in the period of the weather and of the fit", file=fit.file, field=few[0])
    if sum(len(one.values) for one in readings) < LEAST_READINGS + len(fit.mean):
        count = LEAST_READINGS + len(fit.mean)
        raise DataError(f"expected at least {count} readings for {len(fit.mean)} parameters", file=fit.file)
    found = estimate(model, readings, model.prior(), lambda share: progress("fit", share)).of_first(len(fit.mean))
    comparison = _comparison(model, found)
    coverage = {}
    for name, part in (("fitted", comparison[comparison.fitted]), ("predicted", comparison[~comparison.fitted])):
        if len(part):
            coverage[name] = float(((part.low <= part.measured) & (part.measured <= part.high)).mean())
    names = [one.label for one in fit.tables.parameter]
    error = found.standard_error
    correlations = pd.DataFrame(found.covariance / np.outer(error, error), index=names, columns=names)
    return FitResult(fit, found, _parameters(fit, found, correlations), correlations, comparison, coverage, model.head)


def _parameters(fit: Fit, found: FittedValues, correlations: pd.DataFrame) -> pd.DataFrame:
    """The table of the parameters."""
    rows = []
    for number, one in enumerate(fit.tables.parameter):
        share = float(found.standard_error[number] / fit.deviation[number])
        others = correlations.iloc[number].drop(one.label).abs()
        partner = str(others.idxmax()) if len(others) and others.max() > CORRELATED else ""
        far = abs(found.value[number] - fit.mean[number]) / fit.deviation[number]
        rows.append(
            {
                "parameter": one.label,
                "keys": " ".join(one.all_keys),
                "prior_mean": fit.mean[number],
                "prior_deviation": fit.deviation[number],
                "value": found.value[number],
                "standard_error": found.standard_error[number],
                "low_95": found.low[number],
                "high_95": found.high[number],
                "error_of_prior_percent": 100 * share,
                "determined": share <= PRIOR_SHARE or far > UNLIKELY,
                "only_with": partner,
                "doubtful": far > UNLIKELY or bool(found.value[number] in (fit.low[number], fit.high[number])),
            }
        )
    return pd.DataFrame(rows)


def _comparison(model: FittedModel, found: FittedValues) -> pd.DataFrame:
    """Each reading beside the fitted model, with the 90 % interval of a single reading."""
    whole, slopes = model.whole(found.value), model.whole_derivatives(found.expanded_at)
    variance = np.einsum("np,pq,nq->n", slopes, found.covariance, slopes)
    of_noise = float(student.ppf(0.95, found.freedom)) / BAND  # its deviation is estimated
    tables: list[pd.DataFrame] = []
    first = 0
    for one, fitted in zip(model.columns, model.fitted(), strict=True):
        rows = slice(first, first + len(one.values))
        first += len(one.values)
        light = one.light
        noise = of_noise * found.noise[LIGHT_NOISE if light else KELVIN_NOISE].deviation
        scale = np.abs(whole[rows]) if light else np.ones(len(one.values))
        traced = model.tracing_error.get(len(tables), 0.0)
        half = BAND * np.sqrt(variance[rows] + (noise**2 + traced**2) * scale**2)
        tables.append(
            pd.DataFrame(
                {
                    "time": one.ends,
                    "column": one.table.column,
                    "quantity": one.table.quantity,
                    "fitted": fitted,
                    "measured": one.values,
                    "model": whole[rows],
                    "low": np.maximum(whole[rows] - half, 0.0) if light else whole[rows] - half,
                    "high": whole[rows] + half,
                }
            )
        )
    return pd.concat(tables, ignore_index=True)


def write_fit(result: FitResult, folder: ResultFolder, page: Callable[[Path], None] | None = None) -> None:
    """Write all files of a fit in the place of earlier ones; page: writes its report into a folder."""
    with folder.replaced() as place:
        result.write(place)
        if page is not None:
            page(place)


def with_readings(fit: Fit, readings: pd.DataFrame) -> Fit:
    """The fit with other readings of the same columns."""
    return replace(fit, readings=readings)
