r"""A measured house by `cfs fit`: each phase of a Twin House experiment fitted, the next predicted.

    python -m tests.validation fit_twin_house ../shared/reference/twinhouse FOLDER --experiment 2

Writes the study of `twin_house` with its inputs, the measured air, and a fit file for each phase into
FOLDER (`cfs fit FOLDER/fit_1.toml` is the first), and compares means of six hours.  Fitted are what the
house's description leaves open: air through the two shut doors to the north, the share of the heater's
heat that reaches surfaces before the air, and leaks to outdoors.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from scenes.fit.fit import FitResult, run_fit
from scenes.fit.fit_file import read_fit
from scenes.fit.model import FittedModel
from tests.validation.twin_house import EXPERIMENTS, measured, write_inputs

FIT = """
study = "STUDY"
measured = "air.csv"
begin = BEGIN
end = END
average_h = 6
[[measurement]]
column = "living"
quantity = "air temperature"
[[parameter]]
name = "north"
key = "air.neighbour.1.m3_h"
mean = 40
deviation = 40
low = 0
[[parameter]]
name = "radiant"
key = "gains.radiant_share"
deviation = 0.2
low = 0
high = 1
[[parameter]]
name = "leaks"
key = "air.infiltration_ach"
deviation = 0.05
low = 0
"""
UNITS = {"north": "m3/h", "radiant": "-", "leaks": "1/h"}


def main(source: Path, folder: Path, *, experiment: Annotated[int, EXPERIMENTS] = 2) -> dict[str, pd.DataFrame]:
    """Fit each phase but the last, predict the next."""
    chosen = EXPERIMENTS[experiment]
    data = measured(source, chosen)
    study = write_inputs(data, folder, chosen.study)
    air = data[["living"]].assign(time=data.index.strftime("%Y-%m-%dT%H:%M"))
    air.to_csv(folder / "air.csv", index=False, float_format="%.4f")
    phases = list(chosen.phases.items())
    model, parameters, predictions = None, [], []
    for number, (name, times) in enumerate(phases[:-1]):
        text = FIT.replace("STUDY", study.name)
        for key, time in (("BEGIN", times.start), ("END", times.stop)):
            text = text.replace(key, pd.Timestamp(time).isoformat())
        file = folder / f"fit_{number + 1}.toml"
        file.write_text(text)
        fit = read_fit(file)
        model = FittedModel(fit) if model is None else model
        result = run_fit(fit, model=model)
        parameters.append({"fitted": name} | _values(result))
        predictions.append({"fitted": name} | _prediction(result, model, *phases[number + 1]))
        print(pd.DataFrame(predictions).round(2).to_string(), flush=True)
    table = pd.DataFrame(predictions)
    within = f"{table['within'].sum()} of {table['means'].sum()} means within their 90 % interval"
    return {"parameters": pd.DataFrame(parameters), within: table.round(2)}


def _values(result: FitResult) -> dict[str, object]:
    """Fitted values with standard errors, and the errors of the means."""
    table = result.parameters
    found: dict[str, object] = {
        f"{row['parameter']} [{UNITS[row['parameter']]}]": f"{row['value']:.3g} +- {row['standard_error']:.2g}"
        for _, row in table.iterrows()
    }
    (noise,) = result.estimate.noise.values()
    undetermined = table.loc[~table["determined"], "parameter"]
    return found | {
        "not determined": ", ".join(undetermined),
        "deviation [K]": round(noise.deviation, 2),
        "correlation time [h]": round(noise.correlation_h, 1),
        "converged": result.estimate.converged,
    }


def _prediction(result: FitResult, model: FittedModel, name: str, times: slice) -> dict[str, object]:
    """The next phase beside the measured air, by the fitted study and by the one of the description."""
    table = result.comparison.assign(described=model.whole(_described(result)))
    inside = (table["time"] > pd.Timestamp(times.start)) & (table["time"] <= pd.Timestamp(times.stop))
    part = table[inside]
    gap, before = part["model"] - part["measured"], part["described"] - part["measured"]
    return {
        "predicted": name,
        "means": len(part),
        "within": int(((part["low"] <= part["measured"]) & (part["measured"] <= part["high"])).sum()),
        "half interval [K]": (0.5 * (part["high"] - part["low"])).mean(),
        "RMSE [K]": np.sqrt((gap**2).mean()),
        "bias [K]": gap.mean(),
        "RMSE of the description [K]": np.sqrt((before**2).mean()),
    }


def _described(result: FitResult) -> np.ndarray:
    """The parameters of the house's description: those of the priors, with tight doors."""
    names = result.parameters["parameter"].tolist()
    values = result.fit.mean.copy()
    values[names.index("north")] = 0.0
    return values
