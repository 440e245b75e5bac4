"""A whole design: searched by cheap methods, its front computed in full, the best with its error."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, Stage, silent
from scenes.design.assessment import Assessment, assessed, in_order, on_front, outcome
from scenes.design.candidates import Candidate, candidate, mattering, same_candidate, value_of
from scenes.design.design_file import Design, VariableTable
from scenes.design.search import METHODS, Axis, Outcome, Point, size
from scenes.result_folder import SYSTEMS
from scenes.study.one_case import compute_case, plan_head
from scenes.study.plan import StudyPlan, plan_of, read_rooms
from scenes.study.store import CaseResult, Compute, Store
from scenes.study.study import StudyResult, finished_cases, manifest
from scenes.study.study_file import RoomTable, Study

COMMAND = "design"
OF_CLUSTER = 8  # candidates at a time with a scheduler
NEARLY = 0.1  # sum of the shares of limits that are missed, up to which a candidate may meet them in full
ROUNDS = 3  # in which more candidates are computed in full where none met all limits
SEED_STEP = 1000  # between the seeds of repetitions
SEARCH, FULL, REPEAT = "search", "full", "repeat"  # stages of a candidate
Searched = Callable[..., None]  # as the functions of `METHODS`


@dataclass(frozen=True, slots=True)
class DesignResult:
    """The candidates of a design, and what was computed of them."""

    design: Design
    searched: tuple[Assessment, ...]  # by the methods of the search, in their order
    ranked: tuple[Assessment, ...]  # computed in full, the best first
    front: tuple[Assessment, ...]  # of `ranked`: no other is better in every objective
    errors: tuple[tuple[float, ...], ...]  # standard errors of the objectives, of the first ranked
    study: StudyResult  # the cases of `ranked`
    of_best: StudyResult  # those of the best
    reused: int  # cases that an earlier run had finished
    cases: int  # that were computed or reused
    seconds: float

    @property
    def best(self) -> Assessment:
        """The recommended candidate."""
        return self.ranked[0]

    @property
    def first_error(self) -> str:
        """Why the first candidate that failed did; empty where none did."""
        return next((one.error for one in self.searched if one.error), "")

    @property
    def table(self) -> pd.DataFrame:
        """One row per candidate of the search, then of those computed in full."""
        return pd.DataFrame(self.rows())

    def rows(self) -> list[dict[str, Any]]:
        """One row per candidate and stage: its variables, objectives, limits and cases."""
        best = [(FULL, one) for one in self.ranked]
        return [_row(self.design, stage, one) for stage, one in [*((SEARCH, s) for s in self.searched), *best]]


class Evaluations:
    """The candidates of one design, computed at most once for each set of cases."""

    def __init__(
        self,
        design: Design,
        store: Store,
        *,
        processes: int = 1,
        scheduler: str | None = None,
        compute: Compute = compute_case,
        progress: Progress = silent,
        on_candidate: Callable[[str, Assessment, int], None] | None = None,
    ) -> None:
        """Args: as of `run_design`."""
        self.design, self.store = design, store
        self.folder = store.checkpoints(SYSTEMS).absolute()
        self.matter = mattering(design, self.folder)
        self.plans: dict[tuple[str, ...], StudyPlan] = {}
        self.results: dict[str, CaseResult] = {}
        self.reused = 0
        self._how: dict[str, Any] = {"processes": processes, "scheduler": scheduler, "compute": compute}
        self._progress, self._on_candidate = progress, on_candidate
        self._rooms: dict[str, tuple[Building, list[Space]]] = {}
        self._made: dict[tuple[Point, bool, int], tuple[Candidate, StudyPlan] | Assessment] = {}

    def assessments(self, stage: str, points: Sequence[Point], *, quick: bool, seed: int = 0) -> list[Assessment]:
        """The candidates of points, in their order.

        Args: stage: SEARCH, FULL or REPEAT; quick, seed: as of `candidate`.
        """
        made: list[tuple[Candidate, StudyPlan] | Assessment] = []
        for point in points:
            if (point, quick, seed) not in self._made:
                self._made[point, quick, seed] = self._planned(point, quick, seed)
            made.append(self._made[point, quick, seed])
        cases = [case for one in made if isinstance(one, tuple) for case in one[1].cases]
        left = [case for case in cases if case.key not in self.results]
        total = len({case.key for case in left})

        def under_way(label: str = "", fraction: float = 0.0) -> None:
            self._progress(Stage(str(label), "case", min(getattr(label, "number", 1), max(total, 1)), total), fraction)

        if left:
            done, reused = finished_cases(left, self.store, progress=under_way, **self._how)
            self.results |= done
            self.reused += reused
        result = []
        for one in made:
            if isinstance(one, tuple):
                one = assessed(self.design, *one, [self.results[case.key] for case in one[1].cases])
            result.append(one)
            if self._on_candidate is not None:
                self._on_candidate(stage, one, len(self.results))
        return result

    def study(self, ranked: Sequence[Assessment], seconds: float) -> StudyResult:
        """The cases of candidates as the result of a study."""
        plans = [self.plans[one.keys] for one in ranked]
        cases = {case.key: case for plan in plans for case in plan.cases}
        rooms = {scene: room for plan in plans for scene, room in plan.rooms.items()}
        plan = StudyPlan(tuple(cases.values()), rooms)
        results = tuple(self.results[key] for key in cases)
        title = self.design.title
        return StudyResult(title, plan, results, self.reused, seconds, head=plan_head(plan))

    def _planned(self, point: Point, quick: bool, seed: int) -> tuple[Candidate, StudyPlan] | Assessment:
        """The candidate of a point with its cases, or why it cannot be."""
        try:
            one = candidate(self.design, point, self.folder, quick=quick, seed=seed)
            plan = plan_of(one.study, self._read_rooms)
        except DataError as error:
            values = zip(self.design.variable, point, strict=True)
            label = ", ".join(f"{variable.name} {value_of(variable, at)}" for variable, at in values)
            return Assessment(Candidate(point, label, (), None, self.design), (), error=str(error))
        self.plans[tuple(case.key for case in plan.cases)] = plan
        return one, plan

    def _read_rooms(self, room: RoomTable, study: Study) -> tuple[Building, list[Space]]:
        """The rooms of an entry, read once for all candidates that have it."""
        key = room.model_dump_json()
        if key not in self._rooms:
            self._rooms[key] = read_rooms(room, study)
        return self._rooms[key]


def run_design(
    design: Design,
    store: Store | str | PathLike[str],
    *,
    processes: int = 1,
    scheduler: str | None = None,
    compute: Compute = compute_case,
    search: Searched | None = None,
    progress: Progress = silent,
    on_candidate: Callable[[str, Assessment, int], None] | None = None,
) -> DesignResult:
    """Search a design, compute its front in full and rank it; `write_design` writes what comes of it.

    Every case is kept at once, as those of a study: a run that is cut off goes the same way again,
    by its seed, and computes what the folder does not have.

    Args:
        store: the folder of the finished cases.
        processes, scheduler: see `scenes.study.store.computed`.
        search: in place of the design's method, see `scenes.design.search`.
        on_candidate: called with the stage, each candidate that is ready, and how many cases are.

    Raises: `DataError` where no candidate can be computed, `ValueError` for a design with `each`.
    """
    start = time.monotonic()
    if design.search.each is not None:
        raise ValueError("search.each: `run_each` gives one answer for each")
    if not isinstance(store, Store):
        store = Store(Path(store), inputs=design.files, command=COMMAND)
    every = Evaluations(
        design,
        store,
        processes=processes,
        scheduler=scheduler,
        compute=compute,
        progress=progress,
        on_candidate=on_candidate,
    )
    searched = searched_candidates(design, every, search, OF_CLUSTER if scheduler else processes)
    if all(one.error for one in searched):
        raise DataError(f"no candidate can be computed; the first: {searched[0].error}")
    asked = design.search
    full = every.assessments(FULL, [one.candidate.point for one in finalists(design, searched)], quick=False)
    for _ in range(ROUNDS):
        if any(one.feasible for one in full):
            break
        known = {one.candidate.point for one in full}
        next_ones = [one.candidate.point for one in in_order(design, corrected(searched, full))]
        left = [point for point in next_ones if point not in known][: asked.front]
        if not left:
            break
        full += every.assessments(FULL, left, quick=False)
    ranked = in_order(design, full)
    if not ranked:
        raise DataError(f"no candidate of the front can be computed in full; the first: {full[0].error}")
    repeated = [[one] for one in ranked[:2]]
    for number in range(1, asked.repeats + 1):
        points = [one.candidate.point for one in ranked[:2]]
        more = every.assessments(REPEAT, points, quick=False, seed=SEED_STEP * number)
        for rows, one in zip(repeated, more, strict=True):
            rows.append(one)
    seconds = round(time.monotonic() - start, 3)
    return DesignResult(
        design,
        tuple(searched),
        tuple(ranked),
        tuple(on_front(design, ranked)),
        tuple(_errors(rows) for rows in repeated),
        every.study(ranked, seconds),
        every.study(ranked[:1], seconds),
        every.reused,
        len(every.results),
        seconds,
    )


def searched_candidates(
    design: Design, every: Evaluations, search: Searched | None = None, batch: int = 1
) -> list[Assessment]:
    """The candidates of the search, each set of cases once, in the order in which they came."""
    found: dict[tuple[str, ...], Assessment] = {}

    def evaluate(points: Sequence[Point]) -> list[Outcome | None]:
        made = every.assessments(SEARCH, points, quick=design.search.quick)
        for one in made:
            found.setdefault(one.keys or (one.candidate.label,), one)
        return [outcome(design, one) for one in made]

    asked, space = design.search, space_of(design)
    method = search or METHODS[asked.method]
    if method is METHODS["all"] and not np.isfinite(size(space)):
        raise DataError('"all" needs `step` or `values` of every variable', field="search.method")
    method(space, evaluate, asked.evaluations, asked.seed, batch, partial(same_candidate, design, every.matter))
    return list(found.values())


def space_of(design: Design) -> tuple[Axis, ...]:
    """The variables of a design as axes of a search."""
    return tuple(_axis(variable) for variable in design.variable)


def finalists(design: Design, searched: Sequence[Assessment]) -> list[Assessment]:
    """The candidates to be computed in full: the best of the search, and the best of each system."""
    order = in_order(design, searched)
    near = [one for one in order if one.violation <= NEARLY] or order
    chosen = near[: design.search.front]
    for name in design.names:
        of_system = [one for one in order if one.candidate.system is not None and one.candidate.system.name == name]
        if of_system and not any(one in chosen for one in of_system):
            chosen.append(of_system[0])
    return chosen


def corrected(searched: Sequence[Assessment], full: Sequence[Assessment]) -> list[Assessment]:
    """The candidates of the search with limited values as the full method would give them.

    Each value moves by the median difference of the candidates that both have computed.
    """
    known = {one.candidate.point: one for one in full if not one.error}
    pairs = [(one, known[one.candidate.point]) for one in searched if one.candidate.point in known and not one.error]
    if not pairs:
        return list(searched)
    differences = [[b.value - a.value for a, b in zip(s.limits, f.limits, strict=True)] for s, f in pairs]
    moved = np.median(np.array(differences), axis=0)
    return [
        replace(one, limits=tuple(replace(v, value=v.value + by) for v, by in zip(one.limits, moved, strict=True)))
        if not one.error
        else one
        for one in searched
    ]


def design_manifest(result: DesignResult) -> dict[str, Any]:
    """What makes the same result again: the design, its seeds, the files, every candidate."""
    table = manifest(result.design, result.study)
    return table | {
        "study": result.design.model_dump(mode="json"),
        "searched": [{"point": list(one.candidate.point), "cases": list(one.keys)} for one in result.searched],
        "ranked": [one.candidate.label for one in result.ranked],
        "standard_errors": [list(one) for one in result.errors],
    }


def write_design(
    result: DesignResult,
    store: Store,
    report: Callable[[Path], object] | None = None,
    front: Callable[[Path], object] | None = None,
) -> None:
    """Write the table of the candidates, the cases of the front, the manifest and the pages.

    Args: report, front: write the page of the design and that of its cases.
    """
    more = {} if front is None else {FRONT: front}
    cases = pd.DataFrame(result.study.rows())
    more[FRONT_TABLE] = lambda path: cases.to_csv(path, index=False, float_format="%.6g")
    store.write(result.rows(), design_manifest(result), report, more=more)


FRONT, FRONT_TABLE = "front.html", "front.csv"


def _axis(variable: VariableTable) -> Axis:
    options = variable.options
    if not options:
        return Axis(0, *variable.span)
    if not variable.is_number or len(options) == 1:
        return Axis(len(options))
    low, high = min(options), max(options)
    return Axis(len(options), scale=tuple((one - low) / (high - low) for one in options))


def _errors(repeated: Sequence[Assessment]) -> tuple[float, ...]:
    """Standard deviation of each objective over seeds; none of a single one."""
    values = [one.objectives for one in repeated if not one.error]
    if len(values) < 2:
        return ()
    return tuple(float(one) for one in np.std(np.array(values), axis=0, ddof=1))


def _row(design: Design, stage: str, one: Assessment) -> dict[str, Any]:
    """A candidate in the table."""
    row: dict[str, Any] = {"stage": stage, "candidate": one.candidate.label, "error": one.error}
    for variable, at in zip(design.variable, one.candidate.point, strict=True):
        value = value_of(variable, at)
        row[f"variable {variable.name}"] = value if isinstance(value, int | float | str) else str(value)
    for objective, value in zip(design.objective, one.objectives, strict=False):
        row[f"objective {objective.name or objective.column}"] = value
    for limited in one.limits:
        row[f"limit {limited.limit.label}"] = limited.value
    row["meets all limits"] = one.feasible
    row["cases"] = " ".join(one.keys)
    return row
