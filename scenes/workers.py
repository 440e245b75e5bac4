"""Tasks computed in this process, in parallel processes, or on a Dask cluster.

The first task of a scene runs before the others, which then read its matrices from the cache,
before other scenes begin. If a process crashes (fault of a library, out of memory), its tasks are
repeated one by one; a task that crashes a process of its own has failed.
"""

from __future__ import annotations

import logging
import os
import pickle
from collections import defaultdict, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.files import scratch_folder
from mitsuba_cfs.processes import MOST_ENDED, how_it_ended, process_pool
from mitsuba_cfs.variants import share_cores
from scenes.cluster import Cluster, Requirements

T = TypeVar("T")
R = TypeVar("R")
AHEAD = 2  # tasks submitted for each process: one that runs and one that waits
FETCHED = 8  # results of a cluster that are fetched ahead of their use
TASKS_A_PROCESS = 8  # at least, by default: fewer take no longer than a process needs to begin
MEMORY_A_PROCESS = 2 << 30  # [bytes] of half the machine's memory, by default

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Tasks(Generic[T, R]):
    """Tasks to compute; a failed task has `failed` of its error for a result."""

    items: Sequence[T]
    compute: Callable[[T], R]  # sent to each process of this machine once
    failed: Callable[[T, BaseException], R]
    key: Callable[[T], str]  # unique
    scene: Callable[[T], str]
    needs: Requirements = field(default_factory=Requirements)  # of a worker of a cluster

    def results(self, *, processes: int = 1, scheduler: str | None = None) -> Generator[R]:
        """The result of each task, in the order in which the tasks end.

        Closing the generator ends the processes. A consumer that may stop early uses
        `contextlib.closing`, because otherwise they run as long as its exception is referenced.

        Args:
            processes: number of parallel tasks on this machine.
            scheduler: address of a Dask scheduler, whose workers replace the processes.

        Raises: `DataError` if no scheduler answers, or if processes crash repeatedly.
        """
        if scheduler is not None:
            yield from self._on_cluster(scheduler)
        elif processes > 1:
            yield from self._in_parallel(processes)
        else:
            for item in self.items:
                yield _attempted(self.compute, self.failed, item)

    def _waves(self) -> tuple[list[T], dict[str, list[T]]]:
        """The first task of each scene, and by its key the other tasks of the scene."""
        leader: dict[str, str] = {}
        first, followers = [], defaultdict(list)
        for item in self.items:
            key, scene = self.key(item), self.scene(item)
            if leader.setdefault(scene, key) == key:
                first.append(item)
            else:
                followers[leader[scene]].append(item)
        return first, followers

    def _in_parallel(self, processes: int) -> Iterator[R]:
        leaders, followers = self._waves()
        left, again, ended = deque(leaders), deque[T](), 0
        crew = _Crew[T](processes, (self.compute, self.failed))
        try:
            while left or again or crew.at_work:
                if again:
                    crew.begin(again, 1)
                else:
                    crew.begin(left, AHEAD * processes)
                alone = len(crew.at_work) == 1
                done, lost = crew.wait()
                for item, result in done:
                    ended = 0
                    yield self._collected(result, item)
                    left.extendleft(reversed(followers.pop(self.key(item), [])))
                if not lost:
                    continue
                reason = crew.renew()
                if not alone:
                    log.warning("of a task, %s; %d are done again one by one", reason, len(lost))
                    again.extend(lost)
                    continue
                ended += 1
                if ended > MOST_ENDED:
                    raise DataError(f"{ended} tasks one after the other: {reason}")
                yield self.failed(lost[0], RoomError(reason))
                left.extendleft(reversed(followers.pop(self.key(lost[0]), [])))
        finally:
            crew.end()

    def _collected(self, result: Callable[[], R], item: T) -> R:
        """A future's result; a worker that is lost for good is a failure of the task."""
        try:
            return result()
        except (Exception, CancelledError) as error:
            return self.failed(item, error)

    def _on_cluster(self, address: str) -> Iterator[R]:
        check_dask()
        leaders, followers = self._waves()
        cluster = Cluster[T, R](
            address, self.needs, partial(_outcome, self.compute, self.failed), self.failed, self.key
        )
        results = cluster.results(leaders, lambda item: followers.pop(self.key(item), []))
        with closing(results):
            yield from _fetched(results, cluster.stop)


def processes_for(tasks: int, asked: int | None) -> int:
    """Number of parallel processes for some tasks: the one asked for, or by cores and memory.

    Most of a room's time is spent outside the traced kernels, on one core.
    """
    if asked is not None:
        return asked
    cores = os.cpu_count() or 1
    if hasattr(os, "sysconf"):  # not on Windows
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        cores = min(cores, memory // 2 // MEMORY_A_PROCESS)
    return max(min(cores, tasks // TASKS_A_PROCESS), 1)


def _fetched(ready: Iterator[R], cancel: Callable[[], object]) -> Iterator[R]:
    """Results fetched while the consumer uses earlier ones.

    Results that are not fetched are lost if their worker dies.
    """
    end = object()
    with ThreadPoolExecutor(1) as thread:
        asked = deque(thread.submit(next, ready, end) for _ in range(FETCHED))
        try:
            while (result := asked.popleft().result()) is not end:
                asked.append(thread.submit(next, ready, end))
                yield result
        finally:
            for one in asked:
                one.cancel()
            cancel()  # ends the pending fetch too


def check_dask() -> None:
    """Raise `DataError` if Dask is not installed; Dask is not imported."""
    if find_spec("distributed") is None:
        message = "needs Dask: pip install 'mitsuba-cfs[distributed]'"
        raise DataError(message, field="--scheduler")


class _Work:
    """The computation of the tasks in a process of the pool."""

    _work: ClassVar[tuple[Callable, Callable]]

    @classmethod
    def load(cls, file: Path, processes: int) -> None:
        """Start one of `processes` processes with the pickled computation of a file."""
        share_cores(processes)
        cls._work = pickle.loads(file.read_bytes())

    @classmethod
    def attempted(cls, item: T) -> Any:
        """The result of a task."""
        return _attempted(*cls._work, item)


def _attempted(compute: Callable[[T], R], failed: Callable[[T, BaseException], R], item: T) -> R:
    return _outcome(compute, failed, item)[0]


def _outcome(
    compute: Callable[[T], R], failed: Callable[[T, BaseException], R], item: T
) -> tuple[R, BaseException | None]:
    """The result of a task, and its error if it has failed."""
    try:
        return compute(item), None
    except Exception as error:
        log.debug("%s failed", item, exc_info=True)
        return failed(item, error), error


class _Crew(Generic[T]):
    """A pool of processes and its running tasks.

    The computation is passed by a file: a pipe to a process that is killed while it starts would
    block this process forever.
    """

    def __init__(self, processes: int, work: tuple[Callable, Callable]) -> None:
        pickled = pickle.dumps(work)
        self._folder = ExitStack()
        file = self._folder.enter_context(scratch_folder()) / "work"
        file.write_bytes(pickled)
        self._processes, self._first = processes, partial(_Work.load, file, processes)
        self._pool = process_pool(processes, self._first)
        self._started: dict[int | None, BaseProcess] = {}
        self.at_work: dict[Future, T] = {}

    def begin(self, tasks: deque[T], most: int) -> None:
        """Submit the first of the tasks until `most` are at work."""
        while tasks and len(self.at_work) < most:
            try:
                future = self._pool.submit(_Work.attempted, tasks[0])
            except BrokenProcessPool as error:  # crashed while idle, or just now
                future = Future()
                future.set_exception(error)
            self.at_work[future] = tasks.popleft()
            self._started |= self._pool._processes or {}

    def wait(self) -> tuple[list[tuple[T, Callable[[], Any]]], list[T]]:
        """Finished tasks with functions that return their results; tasks of crashed processes."""
        ready, _ = wait(self.at_work, return_when=FIRST_COMPLETED)
        if any(map(_lost, ready)):  # then no other task of this pool ends
            ready, _ = wait(self.at_work)
        items = {future: self.at_work.pop(future) for future in list(self.at_work) if future in ready}
        done = [(item, future.result) for future, item in items.items() if not _lost(future)]
        return done, [item for future, item in items.items() if _lost(future)]

    def renew(self) -> str:
        """Replace the processes after a crash; returns the reason of the crash."""
        _end(self._pool)
        reason = how_it_ended(self._started.values())
        self._pool, self._started = process_pool(self._processes, self._first), {}
        return reason

    def end(self) -> None:
        """Terminate the processes without waiting for their tasks."""
        _end(self._pool)
        self._folder.close()


def _lost(future: Future) -> bool:
    return not future.cancelled() and isinstance(future.exception(), BrokenProcessPool)


def _end(pool: ProcessPoolExecutor) -> None:
    running = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()
