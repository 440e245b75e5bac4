"""Shading states of the hours in the EnergyPlus models that `cfs thermal` and `cfs run` write with `--energyplus`.

    python -m tests.validation exported_states

A room in Chicago with equal windows to the south and to the north, each in three states by its own
irradiance.  EnergyPlus runs the written files; its "Surface Construction Index" says which
construction each window had, its transmitted sun whether that is the closed one.

The demo's two offices, by the command `cfs run`: their windows move by the irradiance of each facade.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.progress import silent
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.heat.energyplus import energyplus_twin
from scenes.heat.study import BalancedRooms, run_study
from scenes.heat.study_file import read_study
from tests.validation.energyplus_program import run_written
from tests.validation.shading_control import GLAZING, STUDY

CONTROL = """
rule = "any"
[[control.parts]]
rule = "irradiance"
close_above = 250
state = 2
[[control.parts]]
rule = "irradiance"
close_above = 100
state = 1
"""
AREA = 4.5  # of each window [m2]
INDEX = "Surface Construction Index"
INCIDENT = "Surface Outside Face Incident Solar Radiation Rate per Area"
PASSED = "Surface Window Transmitted Solar Radiation Rate"


def compare(control: str = CONTROL, step_minutes: int = 60) -> pd.DataFrame:
    """By window: moves of the year, hours of each state, hours with another state in EnergyPlus."""
    systems = "".join(
        f'[[system]]\nbsdf = "{path}"\n{more}'
        for path, more in ((GLAZING, ""), (VENETIAN_BLIND, ""), (VENETIAN_BLIND, "u_value = 1.0\ng_value = 0.18\n"))
    )
    text = STUDY.format(weather=WEATHER, plates="", systems=systems, control=control)
    text = f"step_minutes = {step_minutes}\n" + text
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "study.toml"
        file.write_text(text)
        study, kept = read_study(file), []
        run_study(study, silent, balanced=kept.append)
        balanced: BalancedRooms = kept[0]
        twin = energyplus_twin(study, balanced)
        twin.model["Output:Diagnostics"] = {"all": {"diagnostics": [{"key": "DisplayAdvancedReportVariables"}]}}
        windows = [w for w in twin.model["FenestrationSurface:Detailed"]]
        for window in windows:
            for variable in (INDEX, INCIDENT, PASSED):
                twin.model["Output:Variable"][f"{window} {variable}"] = {
                    "key_value": window,
                    "variable_name": variable,
                    "reporting_frequency": "Hourly",
                }
        model, *_ = twin.write(folder)
        theirs = run_written(model, WEATHER)
    ours = balanced.rooms[0].shading
    rows = []
    for number, window in enumerate(windows):
        states = ours.of_windows[:, number]
        index = theirs[f"{window.upper()}:{INDEX}"].to_numpy()
        sun = theirs[f"{window.upper()}:{INCIDENT}"].to_numpy()
        passed = theirs[f"{window.upper()}:{PASSED}"].to_numpy()
        # the construction that most hours of a state have
        own = {j: float(pd.Series(index[states == j]).mode()[0]) for j in np.unique(states)}
        expected = np.array([own[j] for j in states])
        share = {j: passed[states == j].sum() / max(AREA * sun[states == j].sum(), 1e-9) for j in own}
        rows.append(
            {
                "window": window,
                "moves": int(np.count_nonzero(np.diff(states))),
                **{f"state {j} h": int((states == j).sum()) for j in own},
                "constructions": len(set(own.values())),
                "differ h": int(np.count_nonzero(index != expected)),
                **{f"passed {j}": round(float(one), 3) for j, one in share.items()},
            }
        )
    return pd.DataFrame(rows)


RUN = """
[[system]]
bsdf = "{glazing}"
[[system]]
bsdf = "{blind}"
[control]
rule = "irradiance"
close_above = 200
"""


def compare_run() -> pd.DataFrame:
    """The same of `cfs run --energyplus` for the demo's offices, without what windows pass."""
    with tempfile.TemporaryDirectory() as name:
        folder, out = Path(name), Path(name) / "out"
        operation = folder / "office.toml"
        operation.write_text(RUN.format(glazing=GLAZING, blind=VENETIAN_BLIND))
        arguments = ["--weather", str(WEATHER), "--operation", str(operation), "--quick", "--energyplus"]
        if run(["run", str(OFFICE), *arguments, "--out", str(out)]) != 0:
            raise RuntimeError("cfs run failed")
        states = [pd.read_csv(file)["shading_state"].to_numpy() for file in sorted(out.glob("*/operation.csv"))]
        model = json.loads((out / "model.epJSON").read_text())
        windows = list(model["FenestrationSurface:Detailed"])
        model["Output:Diagnostics"] = {"all": {"diagnostics": [{"key": "DisplayAdvancedReportVariables"}]}}
        model["Output:Variable"] = {
            window: {"key_value": window, "variable_name": INDEX, "reporting_frequency": "Hourly"} for window in windows
        }
        (out / "model.epJSON").write_text(json.dumps(model))
        theirs = run_written(out / "model.epJSON", WEATHER)
    rows = []
    for window, ours in zip(windows, states, strict=True):
        index = theirs[f"{window.upper()}:{INDEX}"].to_numpy()
        own = {j: float(pd.Series(index[ours == j]).mode()[0]) for j in np.unique(ours)}
        rows.append(
            {
                "window": window,
                "moves": int(np.count_nonzero(np.diff(ours))),
                **{f"state {j} h": int((ours == j).sum()) for j in own},
                "constructions": len(set(own.values())),
                "differ h": int(np.count_nonzero(index != np.array([own[j] for j in ours]))),
            }
        )
    return pd.DataFrame(rows)


def main() -> pd.DataFrame:
    """The windows of the study, and of the run."""
    return pd.concat([compare(), compare_run()], ignore_index=True)
