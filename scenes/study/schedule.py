"""Which case of a study is computed when, and what is said of one that fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter

from scenes.study.case import Case
from scenes.study.store import CaseResult
from scenes.user_errors import one_line, user_message
from scenes.workers import Tasks

Compute = Callable[[Case], CaseResult]


def computed(
    cases: Sequence[Case], compute: Compute, *, processes: int = 1, scheduler: str | None = None
) -> Iterator[CaseResult]:
    """The result of each case, once for each key, in the order in which they are ready.

    A case that fails gives a result with its error.  Closing the iterator ends the work.

    Args:
        processes: how many cases at a time on this machine.
        scheduler: address of a Dask scheduler, whose workers then do the work.  They read the
            input files under the same paths.
    """
    once = list({case.key: case for case in cases}.values())
    tasks = Tasks(once, compute, _failed, key=attrgetter("key"), scene=attrgetter("scene"))
    return tasks.results(processes=processes, scheduler=scheduler)


def _failed(case: Case, error: BaseException) -> CaseResult:
    return CaseResult(case.key, error=said(error))


def said(error: BaseException) -> str:
    """A failure in one line: the message of an expected one, what is known of another."""
    message = user_message(error)
    fault = f"fault of the program: {one_line(repr(error))}; cfs -vv tells where"
    return message or fault
