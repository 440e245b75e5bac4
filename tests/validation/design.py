"""The search of `cfs design` beside every point of a grid, points at random, CMA-ES and NSGA-II.

    python -m tests.validation design 3 5 8 --out FOLDER --seeds 10

Three problems of 3, 5 and 8 variables: the energy of a south office in Chicago with a blind,
limited by the hours above 26 C.  Every point of the grid is a case of the command, computed once
and kept in the folder; each search then takes a tenth of the points through the command's own
functions.  What is printed is how far the best that a search found is from the best of the grid.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from scenes.demo import WEATHER
from scenes.design.assessment import Assessment, in_order
from scenes.design.design import SEARCH, Evaluations, searched_candidates, space_of
from scenes.design.design_file import Design, read_design
from scenes.design.search import METHODS, Evaluate, Outcome, Point, Same, Space, every_point, itself
from scenes.study.store import Store

SHARE = 0.1  # of the points of the grid, that a search may take
NEAR = 0.01  # of the grid's best
PENALTY = 10.0  # of the limits that are missed, for CMA-ES, which has none
HEAD = """
title = "COUNT variables"
glare = "none"
methods = ["three-phase"]
operation = "loads.toml"
[[climate]]
name = "Chicago"
weather = "WEATHER"
[options]
sensor_spacing = 2.0
sensor_samples = 256
patch_samples = 256
sun_points = 16
sky_subdivision = 1
heat_step_s = 3600.0
[[room]]
name = "office"
[room.box]
width = 4.0
depth = 5.0
height = 3.0
[[room.box.window]]
x = 0.4
sill = 0.8
width = 3.2
height = 1.8
[[system]]
name = "Blind"
[system.blind]
slat_radius = 0.104
paths = 1024
[[system.layers]]
thickness = 0.004
visible = [0.90, 0.08, 0.08]
solar = [0.84, 0.075, 0.075]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.004
visible = [0.88, 0.05, 0.055]
solar = [0.62, 0.27, 0.20]
emissivity = [0.03, 0.84]
[[objective]]
name = "energy"
[[constraint]]
name = "warm hours"
at_most = 1500
"""
OPERATION = """
[control]
rule = "irradiance"
[gains]
equipment_w_m2 = 12
lighting_w_m2 = 10
lighting_target_lx = 500
[loads]
heating_c = 20
cooling_c = 26
"""
VARIABLES = {
    3: {
        "system.blind.tilt_deg": [0, 15, 30, 45, 60, 75],
        "system.blind.visible": [0.2, 0.35, 0.5, 0.65, 0.8],
        "operation.control.close_above": [50, 150, 250, 350, 450],
    },
    5: {
        "room.box.window.width": [1.6, 2.4, 3.2],
        "room.box.window.overhang": [0, 0.5, 1.0],
        "system.blind.tilt_deg": [0, 30, 60],
        "operation.control.close_above": [100, 250, 400],
        "operation.loads.cooling_c": [25, 26, 27],
    },
    8: {
        "room.box.window.width": [1.6, 3.2],
        "room.box.window.overhang": [0, 0.6],
        "system.blind.tilt_deg": [15, 45],
        "system.blind.visible": [0.3, 0.7],
        "operation.control.close_above": [100, 300],
        "operation.loads.cooling_c": [25, 27],
        "room.box.window.sill": [0.8, 1.1],
        "system.layers.1.solar": [[0.62, 0.27, 0.20], [0.40, 0.45, 0.35]],
    },
}


class _Spent(Exception):
    """The evaluations are used up."""


def problem(count: int, folder: Path) -> Design:
    """The design of so many variables, written as a file and read as the command does."""
    (folder / "loads.toml").write_text(OPERATION)
    tables = (
        f'[[variable]]\nname = "{key}"\nkey = "{key}"\nvalues = {values}\n' for key, values in VARIABLES[count].items()
    )
    path = folder / f"design_{count}.toml"
    path.write_text(HEAD.replace("COUNT", str(count)).replace("WEATHER", str(WEATHER)) + "".join(tables))
    return read_design(path)


def cma_es(space: Space, evaluate: Evaluate, budget: int, seed: int, batch: int = 1, same: Same = itself) -> None:
    """CMA-ES of pymoo on the unit cube, begun again where it stops; limits by a penalty."""
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    known: dict[Point, Outcome | None] = {}

    class Cube(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(n_var=len(space), n_obj=1, xl=0.0, xu=1.0)

        def _evaluate(self, x, out, *args, **kwargs) -> None:
            point = tuple(axis.sampled(float(u)) for axis, u in zip(space, x, strict=True))
            if point not in known:
                if len(known) == budget:
                    raise _Spent
                (known[point],) = evaluate([point])
            one = known[point]
            out["F"] = 1e6 if one is None else one.objectives[0] * (1 + PENALTY * one.violation)

    try:
        for again in range(100):
            start = np.full(len(space), 0.5) if not again else np.random.default_rng(seed + again).random(len(space))
            minimize(Cube(), CMAES(x0=start, sigma=0.3), ("n_eval", 20 * budget), seed=seed + again)
    except _Spent:
        return


def searches() -> dict[str, Callable[..., None]]:
    """The searches by name, that of the command first."""
    named = {name: METHODS[name] for name in ("surrogate", "random", "NSGA-II")}
    return {**named, "CMA-ES": cma_es}


def best(design: Design, every: list[Assessment]) -> float:
    """The least objective of those that meet every limit; infinite where none does."""
    first = in_order(design, every)[0]
    return first.objectives[0] if first.feasible else np.inf


def main(
    problems: Annotated[Sequence[int], tuple(VARIABLES)] = tuple(VARIABLES),
    *,
    out: Annotated[Path, "folder of the cases"] = Path("/tmp/cfs-design"),
    seeds: int = 10,
    processes: int = 1,
) -> pd.DataFrame:
    """How far each search is from the best of the grid [%], over seeds."""
    rows = []
    for count in problems:
        folder = out / str(count)
        folder.mkdir(parents=True, exist_ok=True)
        design = problem(count, folder)
        store = Store(folder / "results", command="design")
        every = Evaluations(design, store, processes=processes)
        space = space_of(design)
        start = time.monotonic()
        grid = every.assessments(SEARCH, list(every_point(space)), quick=True)
        print(
            f"{count} variables: {len(grid)} points, {every.reused} were there, {time.monotonic() - start:.0f} s",
            flush=True,
        )
        least, budget = best(design, grid), int(SHARE * len(grid))
        for name, search in searches().items():
            worse, taken = [], []
            for seed in range(1, seeds + 1):
                asked = design.search.model_copy(update={"evaluations": budget, "seed": seed})
                seeded = design.model_copy(update={"search": asked})
                every.design = seeded
                found = searched_candidates(seeded, every, search)
                worse.append(100 * (best(design, found) / least - 1))
                taken.append(len(found))
            rows.append(
                {
                    "variables": count,
                    "points": len(grid),
                    "meet the limit": sum(one.feasible for one in grid),
                    "best [kWh/m2]": least,
                    "search": name,
                    "evaluations": max(taken),
                    "within 1 %": f"{sum(one <= 100 * NEAR for one in worse)} of {seeds}",
                    "median [%]": float(np.median(worse)),
                    "worst [%]": float(np.max(worse)),
                }
            )
            print(rows[-1], flush=True)
    return pd.DataFrame(rows)
