"""Candidates with their measures: which meet the limits, which no other surpasses, which is best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.design.candidates import Candidate
from scenes.design.design_file import Design
from scenes.design.measures import Limit
from scenes.design.search import Outcome
from scenes.study.plan import Case, StudyPlan
from scenes.study.store import CaseResult


@dataclass(frozen=True, slots=True)
class LimitValue:
    """The value of a limited measure where it is worst among the cases of a candidate."""

    limit: Limit
    value: float
    place: str  # the case, where there are several

    @property
    def met(self) -> bool:
        """Whether the limit is kept."""
        return self.limit.met(self.value)


@dataclass(frozen=True, slots=True)
class Assessment:
    """A candidate with what its cases give."""

    candidate: Candidate
    keys: tuple[str, ...]  # of its cases
    objectives: tuple[float, ...] = ()  # as they are shown
    limits: tuple[LimitValue, ...] = ()
    error: str = ""  # one line; then there is nothing else

    @property
    def feasible(self) -> bool:
        """Whether every limit is met."""
        return not self.error and all(one.met for one in self.limits)

    @property
    def failed(self) -> tuple[LimitValue, ...]:
        """The limits that are not met."""
        return tuple(one for one in self.limits if not one.met)

    @property
    def violation(self) -> float:
        """Sum of the shares by which limits are missed."""
        return sum(_share(one) for one in self.failed)


def assessed(design: Design, candidate: Candidate, plan: StudyPlan, results: Sequence[CaseResult]) -> Assessment:
    """The measures of a candidate from the results of its cases.

    Raises: `DataError` for a column that a case does not have.
    """
    keys = tuple(case.key for case in plan.cases)
    errors = [result.error for result in results if result.error]
    if errors:
        return Assessment(candidate, keys, error=errors[0])
    cases = list(zip(plan.cases, results, strict=True))

    def values(value: Any) -> list[float]:
        return [float(value(result, plan.rooms[case.scene][1], candidate.system)) for case, result in cases]

    objectives = tuple(float(np.mean(values(one.measure.value))) for one in design.objective)
    limits = []
    for constraint in design.constraint:
        for limit in constraint.limits:
            every = values(limit.value)
            worst = int(np.argmax([limit.excess(value) for value in every]))
            place = _place(cases[worst][0]) if len(cases) > 1 else ""
            limits.append(LimitValue(limit, every[worst], place))
    return Assessment(candidate, keys, objectives, tuple(limits))


def outcome(design: Design, one: Assessment) -> Outcome | None:
    """An assessment as a search takes it; None for one that failed."""
    if one.error:
        return None
    signed = tuple(value * o.sign for value, o in zip(one.objectives, design.objective, strict=True))
    return Outcome(signed, tuple(_share(limited) for limited in one.limits))


def in_order(design: Design, every: Sequence[Assessment]) -> list[Assessment]:
    """The candidates from the best on; those that failed are left out.

    Limits come first: those that meet all, then by the sum of the shares that they are missed by.
    Among those that meet all, candidates that no other surpasses in every objective come first, and
    among these the least weighted sum of the shares by which objectives are worse than the best: of
    the best value, or of the range of the front where that is greater.
    """
    done = [one for one in every if not one.error]
    if not done:
        return []
    signed = np.array([[v * o.sign for v, o in zip(a.objectives, design.objective, strict=True)] for a in done])
    usable = [number for number, one in enumerate(done) if one.feasible] or list(range(len(done)))
    ranks = _ranks(signed[usable])
    front = signed[usable][ranks == 0]
    low, high = front.min(axis=0), front.max(axis=0)
    weights = np.array([o.weight for o in design.objective])
    shares = (signed - low) / np.maximum(np.maximum(np.abs(low), high - low), 1e-9)
    score = shares @ (weights / weights.sum())
    rank = np.full(len(done), len(done))
    rank[usable] = ranks
    order = sorted(range(len(done)), key=lambda n: (done[n].violation, rank[n], score[n], done[n].candidate.label))
    return [done[number] for number in order]


def on_front(design: Design, every: Sequence[Assessment]) -> list[Assessment]:
    """Those that meet all limits, else all, of which no other is better in every objective."""
    done = [one for one in every if not one.error]
    usable = [one for one in done if one.feasible] or done
    if not usable:
        return []
    signed = np.array([[v * o.sign for v, o in zip(a.objectives, design.objective, strict=True)] for a in usable])
    return [one for one, rank in zip(usable, _ranks(signed), strict=True) if rank == 0]


def _ranks(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Of each row [n, m]: how many fronts are before its own; 0 where no row surpasses it."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    return np.asarray(NonDominatedSorting().do(values, return_rank=True)[1])


def _share(one: LimitValue) -> float:
    """What a limit is missed by as a share of it; negative where there is room."""
    limit = one.limit
    bound = limit.at_least if limit.at_most is None else limit.at_most
    return (
        limit.excess(one.value) / max(abs(bound or 0.0), 1.0)
        if not one.met
        else min(limit.excess(one.value) / max(abs(bound or 0.0), 1.0), 0.0)
    )


def _place(case: Case) -> str:
    """A case among those of a candidate."""
    return f"{case.place}, {case.climate}, {case.orientation_deg:g}°"
