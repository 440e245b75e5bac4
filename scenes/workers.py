"""Who computes which task when: this process, processes beside each other, or a Dask cluster.

The first task of a scene goes before its others, which then find the scene's matrices in the cache.
A process that ends by itself (a library's fault, too little memory) takes nothing with it: the
tasks that were at work are done again, each alone, and one that ends its process then has failed.
"""

from __future__ import annotations

import logging
import pickle
from collections import defaultdict, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar, Generic, TypeVar

from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.processes import MOST_ENDED, how_it_ended, process_pool
from mitsuba_cfs.variants import share_cores
from scenes.user_errors import one_line

T = TypeVar("T")
R = TypeVar("R")
CONNECT_SECONDS = 10
AHEAD = 2  # tasks for each process: one at work, one for when its result is being looked at
FETCHED = 8  # results of a cluster that are here before they are looked at

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Tasks(Generic[T, R]):
    """What is to be computed; a task that fails has its failure for a result."""

    items: Sequence[T]
    compute: Callable[[T], R]  # each process of this machine gets it once
    failed: Callable[[T, BaseException], R]
    key: Callable[[T], str]  # of each item once
    scene: Callable[[T], str]

    def results(self, *, processes: int = 1, scheduler: str | None = None) -> Generator[R]:
        """The result of each task in the order in which they are ready.

        Closing the generator ends the work: a consumer that may stop before the end uses
        `contextlib.closing`, or the processes work on for as long as its exception is held.

        Args:
            processes: how many tasks at a time on this machine.
            scheduler: address of a Dask scheduler, whose workers then do the work.

        Raises: `DataError` where no scheduler answers, or a process ends by itself.
        """
        if scheduler is not None:
            yield from self._on_cluster(scheduler)
        elif processes > 1:
            yield from self._beside_each_other(processes)
        else:
            for item in self.items:
                yield _attempted(self.compute, self.failed, item)

    def _waves(self) -> tuple[list[T], dict[str, list[T]]]:
        """The first task of each scene, and by the key of that one those that follow it."""
        leader: dict[str, str] = {}
        first, followers = [], defaultdict(list)
        for item in self.items:
            key, scene = self.key(item), self.scene(item)
            if leader.setdefault(scene, key) == key:
                first.append(item)
            else:
                followers[leader[scene]].append(item)
        return first, followers

    def _beside_each_other(self, processes: int) -> Iterator[R]:
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
                    left.extend(followers.pop(self.key(item), []))
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
                left.extend(followers.pop(self.key(lost[0]), []))
        finally:
            crew.end()

    def _collected(self, result: Callable[[], R], item: T) -> R:
        """A future's result; that of a worker lost for good is a failure of the task."""
        try:
            return result()
        except (Exception, CancelledError) as error:
            return self.failed(item, error)

    def _on_cluster(self, address: str) -> Iterator[R]:
        check_dask()
        from distributed import Client, as_completed

        try:
            client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            message = f"no Dask scheduler answers there: {one_line(str(error))}"
            raise DataError(message, element=address, field="--scheduler") from error
        leaders, followers = self._waves()
        by_key = {self._name(item): item for item in self.items}
        held: dict[str, Any] = {}

        def begin(some: Sequence[T]) -> list:
            # one task for each key, whoever runs it: a worker that dies has its tasks run again
            started = [
                client.submit(
                    _attempted, self.compute, self.failed, item, key=self._name(item), pure=True
                )
                for item in some
            ]
            held.update({future.key: future for future in started})
            return started

        def ready() -> Iterator[R]:
            done = as_completed(begin(leaders), loop=client.loop)
            for future in done:
                item = by_key[future.key]
                result = self._collected(future.result, item)
                held.pop(future.key).release()  # or a dying worker would have it done again
                done.update(begin(followers.pop(self.key(item), [])))
                yield result

        with client:
            yield from _fetched(ready(), lambda: client.cancel(list(held.values())))

    def _name(self, item: T) -> str:
        return f"cfs-{self.key(item)}"


def _fetched(ready: Iterator[R], cancel: Callable[[], object]) -> Iterator[R]:
    """What is ready, fetched while what came before is being looked at.

    A worker that dies takes with it what it has done and nobody has fetched.
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
            cancel()  # the one that is being waited for ends, too


def check_dask() -> None:
    """Raise `DataError` where Dask is not installed; it is not loaded."""
    if find_spec("distributed") is None:
        message = "needs Dask: pip install 'mitsuba-cfs[distributed]'"
        raise DataError(message, field="--scheduler")


class _Work:
    """What a process of the pool does with every task that it gets."""

    _kept: ClassVar[tuple[Callable, Callable]]

    @classmethod
    def keep(cls, file: Path, processes: int) -> None:
        """Begin one of so many processes with what a file holds."""
        share_cores(processes)
        cls._kept = pickle.loads(file.read_bytes())

    @classmethod
    def attempted(cls, item: T) -> Any:
        """The result of a task."""
        return _attempted(*cls._kept, item)


def _attempted(compute: Callable[[T], R], failed: Callable[[T, BaseException], R], item: T) -> R:
    try:
        return compute(item)
    except Exception as error:
        log.debug("%s failed", item, exc_info=True)
        return failed(item, error)


class _Crew(Generic[T]):
    """So many processes, and the tasks that one of them takes with it when it ends.

    They get their work by a file: one that is killed while it starts does not read to its end what
    this process writes to it, which then waits for ever.
    """

    def __init__(self, processes: int, work: tuple[Callable, Callable]) -> None:
        given = pickle.dumps(work)
        self._folder = TemporaryDirectory()
        file = Path(self._folder.name) / "work"
        file.write_bytes(given)
        self._processes, self._first = processes, partial(_Work.keep, file, processes)
        self._pool = process_pool(processes, self._first)
        self._started: dict[int | None, BaseProcess] = {}
        self.at_work: dict[Future, T] = {}

    def begin(self, tasks: deque[T], most: int) -> None:
        """Begin the first of these until so many have begun."""
        while tasks and len(self.at_work) < most:
            try:
                future = self._pool.submit(_Work.attempted, tasks[0])
            except BrokenProcessPool as error:  # ended with nothing to do, or just now
                future = Future()
                future.set_exception(error)
            self.at_work[future] = tasks.popleft()
            self._started |= self._pool._processes or {}

    def wait(self) -> tuple[list[tuple[T, Callable[[], Any]]], list[T]]:
        """Tasks that are ready, with what gives their results; those that went with a process."""
        ready, _ = wait(self.at_work, return_when=FIRST_COMPLETED)
        if any(map(_lost, ready)):  # then no task of this pool will end any more
            ready, _ = wait(self.at_work)
        items = {
            future: self.at_work.pop(future) for future in list(self.at_work) if future in ready
        }
        done = [(item, future.result) for future, item in items.items() if not _lost(future)]
        return done, [item for future, item in items.items() if _lost(future)]

    def renew(self) -> str:
        """Fresh processes in place of those of which one ended; how it did."""
        _end(self._pool)
        reason = how_it_ended(self._started.values())
        self._pool, self._started = process_pool(self._processes, self._first), {}
        return reason

    def end(self) -> None:
        """End the processes now, without waiting for the tasks under way."""
        _end(self._pool)
        self._folder.cleanup()


def _lost(future: Future) -> bool:
    return not future.cancelled() and isinstance(future.exception(), BrokenProcessPool)


def _end(pool: ProcessPoolExecutor) -> None:
    running = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()
