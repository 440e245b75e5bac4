"""Which case of a study is computed when, and what is said of one that fails."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial
from operator import attrgetter
from typing import Protocol

from mitsuba_cfs.progress import Progress, silent
from scenes.study.case import Case
from scenes.study.store import CaseResult
from scenes.user_errors import one_line, user_message
from scenes.workers import Tasks


class Compute(Protocol):
    """A function of a module that computes a case."""

    def __call__(self, case: Case, /, *, progress: Progress = ...) -> CaseResult:
        """The result of a case."""
        ...


def computed(
    cases: Sequence[Case],
    compute: Compute,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Generator[CaseResult]:
    """The result of each case, once for each key, in the order in which they are ready.

    A case that fails gives a result with its error.  Closing the generator ends the work.

    Args:
        processes: how many cases at a time on this machine.
        scheduler: address of a Dask scheduler, whose workers then do the work.  They read the
            input files under the same paths.
        progress: of the case under way, where this process computes the cases itself.
    """
    once = list({case.key: case for case in cases}.values())
    here = processes == 1 and scheduler is None
    of_case = partial(compute, progress=progress) if here else compute
    tasks = Tasks(once, of_case, _failed, key=attrgetter("key"), scene=attrgetter("scene"))
    return tasks.results(processes=processes, scheduler=scheduler)


def _failed(case: Case, error: BaseException) -> CaseResult:
    return CaseResult(case.key, error=said(error))


def said(error: BaseException) -> str:
    """A failure in one line: the message of an expected one, what is known of another."""
    message = user_message(error)
    fault = f"fault of the program: {one_line(repr(error))}; cfs -vv tells where"
    return message or fault
