"""Who computes which case when: this process, processes beside each other, or a Dask cluster.

The first case of a room goes before its others, which then find the room's matrices in the cache.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from importlib.util import find_spec

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.processes import process_pool
from scenes.study.case import Case
from scenes.study.store import CaseResult
from scenes.user_errors import one_line, user_message

Compute = Callable[[Case], CaseResult]
CONNECT_SECONDS = 10

log = logging.getLogger(__name__)


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
    if scheduler is not None:
        yield from _on_cluster(once, compute, scheduler)
    elif processes > 1:
        yield from _beside_each_other(once, compute, processes)
    else:
        for case in once:
            yield attempted(compute, case)


def attempted(compute: Compute, case: Case) -> CaseResult:
    """The result of the case, or what kept it from having one."""
    try:
        return compute(case)
    except Exception as error:
        log.debug("case %s failed", case.key, exc_info=True)
        return CaseResult(case.key, error=said(error))


def said(error: BaseException) -> str:
    """A failure in one line: the message of an expected one, what is known of another."""
    message = user_message(error)
    fault = f"fault of the program: {one_line(repr(error))}; cfs -vv tells where"
    return message or fault


def _waves(cases: Sequence[Case]) -> tuple[list[Case], dict[str, list[Case]]]:
    """The first case of each scene, and by the key of that one those that follow it."""
    leader: dict[str, Case] = {}
    followers: dict[str, list[Case]] = defaultdict(list)
    for case in cases:
        first = leader.setdefault(case.scene, case)
        if first is not case:
            followers[first.key].append(case)
    return list(leader.values()), followers


def _beside_each_other(
    cases: Sequence[Case], compute: Compute, processes: int
) -> Iterator[CaseResult]:
    leaders, followers = _waves(cases)
    pool = process_pool(processes)
    try:
        waiting: dict[Future, Case] = {}

        def begin(some: Sequence[Case]) -> None:
            waiting.update({pool.submit(attempted, compute, case): case for case in some})

        begin(leaders)
        while waiting:
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                case = waiting.pop(future)
                yield _collected(future.result, case)
                try:
                    begin(followers.pop(case.key, []))
                except BrokenProcessPool as error:
                    raise DataError("a process of the study ended by itself") from error
    finally:
        _end(pool)


def _end(pool: ProcessPoolExecutor) -> None:
    """End the pool now, without waiting for the cases under way."""
    running = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()


def _collected(result: Callable[[], CaseResult], case: Case) -> CaseResult:
    """A future's result; that of a worker lost for good is a failure of the case."""
    try:
        return result()
    except (Exception, CancelledError) as error:
        return CaseResult(case.key, error=said(error))


def check_dask() -> None:
    """Raise `DataError` where Dask is not installed; it is not loaded."""
    if find_spec("distributed") is None:
        message = "needs Dask: pip install 'mitsuba-cfs[distributed]'"
        raise DataError(message, field="--scheduler")


def _on_cluster(cases: Sequence[Case], compute: Compute, address: str) -> Iterator[CaseResult]:
    check_dask()
    from distributed import Client, as_completed

    try:
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        message = f"no Dask scheduler answers there: {one_line(str(error))}"
        raise DataError(message, element=address, field="--scheduler") from error
    leaders, followers = _waves(cases)
    by_key = {_task(case): case for case in cases}
    with client:
        held = {}

        def begin(some: Sequence[Case]) -> list:
            # one task for each key, whoever runs it: a worker that dies has its tasks run again
            started = [
                client.submit(attempted, compute, case, key=_task(case), pure=True) for case in some
            ]
            held.update({future.key: future for future in started})
            return started

        try:
            ready = as_completed(begin(leaders), loop=client.loop)
            for future in ready:
                case = by_key[future.key]
                result = _collected(future.result, case)
                held.pop(future.key).release()  # or a dying worker would have it done again
                ready.update(begin(followers.pop(case.key, [])))
                yield result
        finally:
            client.cancel(list(held.values()))


def _task(case: Case) -> str:
    return f"cfs-{case.key}"
