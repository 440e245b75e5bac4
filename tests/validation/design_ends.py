"""The ends of a design's front in some hours by path tracing, beside the method of the design.

    python -m tests.validation design_ends design.toml --out FOLDER --hours 16

FOLDER has the results of `cfs design design.toml`.  The ends are the candidates of the front that
are best in one objective each.  Both sides have the states of the windows that the design chose.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from mitsuba_cfs import variants
from scenes.design.design import DesignResult, run_design
from scenes.design.design_file import read_design
from scenes.room.inputs import skies_for
from scenes.room.room import lit_room
from scenes.study.one_case import _rated_hours, case_inputs
from scenes.study.plan import Case
from scenes.study.store import Store

PATHS = {"path_samples": 4096, "picture_samples": 64, "method": "point-in-time", "seed": 77}


def ends(result: DesignResult) -> dict[str, str]:
    """The candidate of the front that is best in each objective: its label, by the objective."""
    found = {}
    for number, objective in enumerate(result.design.objective):
        best = min(result.front, key=lambda one: objective.sign * one.objectives[number])
        found[objective.name or objective.column or ""] = best.candidate.label
    return found


def compared(case: Case, count: int) -> dict[str, float]:
    """Differences of a case in some hours of use with the sun up, spread over its year."""
    inputs, (space,) = case_inputs(case), case_inputs(case).spaces
    rated = _rated_hours(inputs.weather, case.options)
    hours = rated[np.linspace(0, len(rated) - 1, count + 2)[1:-1].astype(int)]
    light, dgp, states = [], [], []
    for options in (case.options, case.options.changed(**PATHS)):
        skies = skies_for(inputs.weather, options.sampling, **options.sky)
        part = skies.part(np.flatnonzero(np.isin(skies.lit, hours)))
        room = lit_room(
            inputs.building,
            space,
            inputs.systems,
            inputs.weather,
            options,
            operation=inputs.operation,
            skies=part,
            pictures=False,
            rate=("DGP", hours),
        )
        light.append(room.daylight.illuminance[hours].mean(axis=1))
        dgp.append(room.dgp.dgp)
        moved = room.operation
        states.append(np.zeros(len(hours)) if moved is None else moved.shading.of_windows[hours].sum(axis=1))
    same = states[0] == states[1]
    both = light[0][same].sum() / light[1][same].sum() - 1
    by_hour = light[0][same] / light[1][same] - 1
    return {
        "hours": int(same.sum()),
        "illuminance, all hours [%]": 100 * both,
        "illuminance, rms of an hour [%]": 100 * float(np.sqrt(np.mean(by_hour**2))),
        "DGP, mean": float(np.mean(dgp[0][same] - dgp[1][same])),
        "DGP, rms": float(np.sqrt(np.mean((dgp[0][same] - dgp[1][same]) ** 2))),
        "DGP, worst": float(np.abs(dgp[0][same] - dgp[1][same]).max()),
    }


def main(
    design: Annotated[Path, "file of `cfs design`"], *, out: Annotated[Path, "folder of its results"], hours: int = 16
) -> pd.DataFrame:
    """Light and glare of the design's method less those of paths, at the ends of the front."""
    variants.activate()
    parsed = read_design(design)
    result = run_design(parsed, Store(out, inputs=parsed.files, command="design"))
    rows = []
    for objective, label in ends(result).items():
        case = next(one for one in result.study.plan.cases if one.system == label)
        rows.append({"best in": objective, "candidate": label} | compared(case, hours))
        print(rows[-1], flush=True)
    return pd.DataFrame(rows)
