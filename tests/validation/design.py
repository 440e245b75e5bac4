"""The search of `cfs design` beside every point of a grid, points at random, CMA-ES and NSGA-II.

    python -m tests.validation design --seeds 10
    python -m tests.validation design --room --out FOLDER --seeds 10

Without `--room`: three published functions on grids, Hartmann's of 3 variables (10 values each),
Friedman's of 5 (5 each) and the borehole of 8 (3 each), by the search functions of the command.
With it: the energy of a south office in Chicago by the tilt and reflectance of its blind and the
irradiance that lowers it, limited by the hours above 26 C.  Every point of that grid is a case of
the command, computed once and kept in the folder; each search then goes through the command's own
functions.  What is printed is how far the best that a search found is from the best of the grid.

Source of the functions: Hartmann 3 and borehole as in Surjanovic and Bingham, "Virtual Library of
    Simulation Experiments" (sfu.ca/~ssurjano); Friedman 1991, doi:10.1214/aos/1176347963.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from scenes.demo import WEATHER
from scenes.design.assessment import Assessment, in_order
from scenes.design.design import SEARCH, Evaluations, searched_candidates, space_of
from scenes.design.design_file import Design, read_design
from scenes.design.search import METHODS, Axis, Evaluate, Outcome, Point, Same, Space, every_point, itself
from scenes.study.store import Store
from tests.design.designs import PANES

SHARE = 0.1  # of the points of a grid, that a search may take at most
NEAR = 1.0  # [%] of the grid's best
PENALTY = 10.0  # of the limits that are missed, for CMA-ES, which has none
ROOM = (
    """
title = "Tilt, reflectance, irradiance"
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
"""
    + PANES
    + """[[objective]]
name = "energy"
[[constraint]]
name = "warm hours"
at_most = 1500
[[variable]]
key = "system.blind.tilt_deg"
values = [0, 15, 30, 45, 60, 75]
[[variable]]
key = "system.blind.visible"
values = [0.2, 0.35, 0.5, 0.65, 0.8]
[[variable]]
name = "irradiance"
key = "operation.control.close_above"
values = [50, 150, 250, 350, 450]
"""
)
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


def hartmann(u: Sequence[float]) -> float:
    """Hartmann's function of 3 variables from 0 to 1; 3.86278 below 0 at its least."""
    a = np.array([[3.0, 10, 30], [0.1, 10, 35], [3.0, 10, 30], [0.1, 10, 35]])
    p = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
    return -float(np.array([1.0, 1.2, 3.0, 3.2]) @ np.exp(-(a * (np.asarray(u) - p) ** 2).sum(axis=1)))


def friedman(u: Sequence[float]) -> float:
    """Friedman's function of 5 variables from 0 to 1, the more the better."""
    a, b, c, d, e = u
    return -float(10 * np.sin(np.pi * a * b) + 20 * (c - 0.5) ** 2 + 10 * d + 5 * e)


def borehole(u: Sequence[float]) -> float:
    """Flow through a borehole [m3/year] by 8 variables of 0 to 1, the more the better."""
    low = (0.05, 100, 63070, 990, 63.1, 700, 1120, 9855)
    high = (0.15, 50000, 115600, 1110, 116, 820, 1680, 12045)
    rw, r, tu, hu, tl, hl, length, kw = (a + x * (b - a) for x, a, b in zip(u, low, high, strict=True))
    log = np.log(r / rw)
    return -float(2 * np.pi * tu * (hu - hl) / (log * (1 + 2 * length * tu / (log * rw**2 * kw) + tu / tl)))


# variables, values of each, evaluations of each search
FUNCTIONS = {"Hartmann": (hartmann, 3, 10, 40), "Friedman": (friedman, 5, 5, 60), "borehole": (borehole, 8, 3, 90)}


class _Spent(Exception):
    """The evaluations are used up."""


def room(folder: Path) -> Design:
    """The design of the office, written as a file and read as the command does."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "loads.toml").write_text(OPERATION)
    path = folder / "design.toml"
    path.write_text(ROOM.replace("WEATHER", str(WEATHER)))
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
            out["F"] = 1e6 if one is None else one.objectives[0] + PENALTY * one.violation

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


def of_function(name: str, seeds: int) -> list[dict[str, object]]:
    """The searches of a function on its grid."""
    function, count, values, budget = FUNCTIONS[name]
    scale = tuple(np.linspace(0.0, 1.0, values))
    space = (Axis(values, scale=scale),) * count
    grid = {point: function([scale[at] for at in point]) for point in every_point(space)}
    least = min(grid.values())

    def worse(search: Callable[..., None], seed: int) -> tuple[float, int]:
        taken: dict[Point, float] = {}

        def evaluate(points: Sequence[Point]) -> list[Outcome]:
            for point in points:
                if len(taken) < budget:
                    taken[point] = grid[point]
            return [Outcome((grid[point],)) for point in points]

        search(space, evaluate, budget, seed)
        return 100 * (min(taken.values()) - least) / abs(least), len(taken)

    return rows(name, count, len(grid), worse, seeds)


def of_room(folder: Path, seeds: int) -> list[dict[str, object]]:
    """The searches of the office, whose grid is computed where the folder does not have it."""
    design = room(folder)
    every = Evaluations(design, Store(folder / "results", command="design"))
    start = time.monotonic()
    grid = every.assessments(SEARCH, list(every_point(space_of(design))), quick=True)
    print(f"{len(grid)} points, {every.reused} were there, {time.monotonic() - start:.0f} s", flush=True)
    feasible = sum(one.feasible for one in grid)
    least, budget = best(design, grid), int(SHARE * len(grid))
    print(f"{feasible} meet the limit; the best: {least:.3f} kWh/m2", flush=True)

    def worse(search: Callable[..., None], seed: int) -> tuple[float, int]:
        asked = design.search.model_copy(update={"evaluations": budget, "seed": seed})
        every.design = design.model_copy(update={"search": asked})
        found = searched_candidates(every.design, every, search)
        return 100 * (best(design, found) / least - 1), len(found)

    return rows("office", len(design.variable), len(grid), worse, seeds)


def best(design: Design, every: list[Assessment]) -> float:
    """The least objective of those that meet every limit; infinite where none does."""
    first = in_order(design, every)[0]
    return first.objectives[0] if first.feasible else np.inf


def rows(
    name: str, count: int, size: int, worse: Callable[[Callable[..., None], int], tuple[float, int]], seeds: int
) -> list[dict[str, object]]:
    """A row of each search: how far from the grid's best, over seeds."""
    found = []
    for label, search in searches().items():
        start = time.monotonic()
        values, taken = zip(*(worse(search, seed) for seed in range(1, seeds + 1)), strict=True)
        found.append(
            {
                "problem": name,
                "variables": count,
                "points": size,
                "search": label,
                "evaluations": max(taken),
                "of the points [%]": 100 * max(taken) / size,
                "within 1 %": f"{sum(value <= NEAR for value in values)} of {seeds}",
                "median [%]": float(np.median(values)),
                "worst [%]": float(np.max(values)),
            }
        )
        print(found[-1], f"{time.monotonic() - start:.0f} s", flush=True)
    return found


def main(
    *,
    room: bool = False,
    out: Path = Path("/tmp/cfs-design"),
    seeds: int = 10,
    problems: Sequence[str] = tuple(FUNCTIONS),
) -> pd.DataFrame:
    """How far each search is from the best of the grid [%], over seeds 1, 2, ..."""
    if room:
        return pd.DataFrame(of_room(out, seeds))
    return pd.DataFrame([row for name in problems for row in of_function(name, seeds)])
