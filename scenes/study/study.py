"""A whole study: what is planned, what is computed, and the table that comes of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bim.model import Space
from bim.report.issue import Issue
from mitsuba_cfs.progress import Progress, Stage, silent
from scenes.calibration.durations import spoken_time
from scenes.head import NO_HEAD, Head
from scenes.report.glare_figures import compass
from scenes.results import method_notes
from scenes.study.automatic import settled
from scenes.study.explored import ExploredCase, explorer_key, explorers
from scenes.study.one_case import compute_case, plan_head
from scenes.study.plan import Case, StudyPlan, plan_of
from scenes.study.store import CaseResult, Compute, Store, computed
from scenes.study.study_file import NO_SYSTEM, Study


@dataclass(frozen=True, slots=True, repr=False)
class StudyResult:
    """The cases of a study with their results, in the grid's order."""

    title: str
    plan: StudyPlan
    results: tuple[CaseResult, ...]  # of each case of the plan
    reused: int  # cases that an earlier run had finished
    seconds: float
    quick: bool = False
    explored: dict[int, ExploredCase] = field(default_factory=dict)  # by number from 1
    head: Head = NO_HEAD  # what was left out of the buildings, what was assumed in the cases

    def __repr__(self) -> str:
        failed = f", {self.failed} without a result" if self.failed else ""
        return f"<{type(self).__name__} {self.title!r}: {len(self.results)} cases{failed}>"

    @property
    def failed(self) -> int:
        """How many cases have no result."""
        return sum(bool(result.error) for result in self.results)

    @property
    def first_error(self) -> str:
        """Why the first case that failed did; empty where none did."""
        return next((result.error for result in self.results if result.error), "")

    @property
    def clock(self) -> str:
        """Predicted and actual time of the cases whose method `auto` chose, in words."""
        pairs = zip(self.plan.cases, self.results, strict=True)
        seconds = [r.figures["seconds"] for case, r in pairs if case.chosen and not r.error]
        if self.plan.predicted is None or not seconds:
            return ""
        taken, predicted = sum(seconds), self.plan.predicted
        return (
            f"predicted {spoken_time(predicted)}, took {spoken_time(taken)}: "
            f"{taken / predicted:.2f} times the prediction"
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What the methods and undecided transmission peaks do to the cases' results."""
        return method_notes(result.figures for result in self.results)

    @property
    def issues(self) -> tuple[Issue, ...]:
        """The faults of all building models, each once."""
        buildings = (building for building, _ in self.plan.rooms.values())
        return tuple(dict.fromkeys(issue for one in buildings for issue in one.issues))

    @property
    def table(self) -> pd.DataFrame:
        """One row per case, as `rows`."""
        return pd.DataFrame(self.rows())

    def _repr_html_(self) -> str:
        """The table, for notebooks."""
        return self.table._repr_html_()

    def rows(self) -> list[dict[str, Any]]:
        """One row per case: its inputs, its status and every result."""
        columns = dict.fromkeys(name for r in self.results for name in r.figures)
        rows = []
        for case, result in zip(self.plan.cases, self.results, strict=True):
            _, space = self.plan.rooms[case.scene]
            empty = dict.fromkeys(columns)
            rows.append(
                described(case, space)
                | {"status": _status(result), "error": result.error}
                | empty
                | result.figures
                | {"key": case.key}
            )
        return rows


OnReused = Callable[[Mapping[str, CaseResult]], None]


def run_study(
    study: Study,
    store: Store | str | PathLike[str],
    *,
    plan: StudyPlan | None = None,
    processes: int = 1,
    scheduler: str | None = None,
    compute: Compute = compute_case,
    progress: Progress = silent,
    on_case: Callable[[Case, CaseResult, int, int], None] | None = None,
    on_reused: OnReused = lambda results: None,
    on_head: Callable[[Head], None] = lambda head: None,
) -> StudyResult:
    """Compute what the folder does not have yet; `write_study` writes what comes of it.

    Finished cases are kept one by one: a run that is cut off goes on where it was.

    Args:
        store: the folder of the finished cases.
        plan: of the study, with the methods that `auto` chose; made here by default.
        processes, scheduler: see `scenes.study.store.computed`.
        on_case: called with each case that is ready, how many are, and of how many.
        on_reused: called before with the finished cases that the folder has, by key.
        on_head: called with what was left out and assumed, before anything is computed.
    """
    start = time.monotonic()
    plan = plan or settled(study, plan_of(study))
    head = plan_head(plan)
    on_head(head)
    if not isinstance(store, Store):
        store = Store(Path(store), inputs=study.files)
    finished, reused = finished_cases(
        plan.cases,
        store,
        processes=processes,
        scheduler=scheduler,
        compute=compute,
        progress=progress,
        on_case=on_case,
        on_reused=on_reused,
    )
    results = tuple(finished[case.key] for case in plan.cases)
    seconds = round(time.monotonic() - start, 3)
    return StudyResult(study.title, plan, results, reused, seconds, study.quick, head=head)


def finished_cases(
    every: Sequence[Case],
    store: Store,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    compute: Compute = compute_case,
    progress: Progress = silent,
    on_case: Callable[[Case, CaseResult, int, int], None] | None = None,
    on_reused: OnReused = lambda results: None,
) -> tuple[dict[str, CaseResult], int]:
    """The result of each case by its key, computed where the folder does not have it, and kept.

    Args: as of `run_study`.

    Returns: the results, and how many the folder had.
    """
    store.open()
    cases = {case.key: case for case in every}
    finished = {key: result for key in cases if (result := store.load(key)) is not None}
    reused, total = len(finished), len(cases)
    on_reused(finished)

    def under_way(stage: str = "", fraction: float = 0.0) -> None:
        progress(Stage(stage, "case", min(len(finished) + 1, total), total), fraction)

    under_way()
    left = [case for key, case in cases.items() if key not in finished]
    results_of_left = computed(left, compute, processes=processes, scheduler=scheduler, progress=under_way)
    with closing(results_of_left):
        for result in results_of_left:
            if not result.error and cases[result.key].control is None:
                store.save(result)
            finished[result.key] = result
            under_way()
            if on_case is not None:
                on_case(cases[result.key], result, len(finished), total)
    return finished, reused


def with_explorers(
    result: StudyResult,
    chosen: Mapping[int, Case],
    store: Store,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
    on_case: Callable[[Case, ExploredCase], None] | None = None,
) -> StudyResult:
    """The study with the explorers of some of its cases; the folder's own are not made again.

    Args:
        chosen: the cases by number from 1.
        processes, scheduler, progress: as of `run_study`.
        on_case: called with each case that is ready.
    """
    by_case: dict[str, ExploredCase] = {}

    def under_way(stage: str = "", fraction: float = 0.0) -> None:
        number, total = min(len(by_case) + 1, len(chosen)), len(chosen)
        progress(Stage(stage, "explorer", number, total), fraction)

    under_way()
    made = explorers(
        tuple(chosen.values()), store.explorers(), processes=processes, scheduler=scheduler, progress=under_way
    )
    with closing(made):
        for case, explored in made:
            by_case[explored.key] = explored
            under_way()
            if on_case is not None:
                on_case(case, explored)
    every = {number: by_case[explorer_key(case)] for number, case in chosen.items()}
    return replace(result, explored={n: one for n, one in every.items() if not one.error})


def write_study(
    study: Study,
    result: StudyResult,
    store: Store,
    report: Callable[[Path], object] | None,
    explorer: Callable[[Path], object] | None = None,
) -> None:
    """Write table, manifest, report and explorer of a study in the place of earlier ones."""
    store.write(result.rows(), manifest(study, result), report, explorer)


def described(case: Case, space: Space) -> dict[str, Any]:
    """What a case is, in the columns that come first."""
    return {
        "room": case.room,
        "space": case.space_name,
        "system": case.system,
        "fenestration": source_of(case),
        "climate": case.climate,
        "orientation_deg": case.orientation_deg,
        "facing": facing(space, case.orientation_deg),
        "method": case.options.method,
        "glare": case.glare,
        "why": case.chosen,
    }


def source_of(case: Case) -> str:
    """Where a case's systems come from, in words."""
    file = case.inputs.system or (case.inputs.operation if case.system != NO_SYSTEM.name else None)
    return "held by the building's file" if file is None else f"[[system]] {file.name}"


def facing(space: Space, orientation_deg: float) -> str:
    """Where the biggest window of a turned room looks."""
    normal = max(space.windows, key=lambda window: window.area).normal
    if normal[2] > 0.7:
        return "up"
    azimuth = np.arctan2(normal[0], normal[1]) + np.radians(orientation_deg)
    return compass([np.sin(azimuth), np.cos(azimuth)])


def _status(result: CaseResult) -> str:
    return "failed" if result.error else "done"


def manifest(study: Study, result: StudyResult) -> dict[str, Any]:
    """What makes the same table again: the study, and the hashes of its files."""
    plan = result.plan
    files = {str(file.path): file.sha256 for case in plan.cases for file in case.files}
    return {
        "quick": study.quick,
        "study": study.model_dump(mode="json"),
        "sha256": files,
        "fenestration": {case.system: source_of(case) for case in plan.cases},
        "cases": [case.key for case in plan.cases],
        "head": result.head.record,
        "notes": list(result.notes),
    }
