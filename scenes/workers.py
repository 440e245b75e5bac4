"""Who computes which task when: this process, processes beside each other, or a Dask cluster.

The first task of a scene goes before its others, which then find the scene's matrices in the cache.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any, ClassVar, Generic, TypeVar

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.processes import process_pool, shared_blas
from mitsuba_cfs.variants import share_cores
from scenes.user_errors import one_line

T = TypeVar("T")
R = TypeVar("R")
CONNECT_SECONDS = 10

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Tasks(Generic[T, R]):
    """What is to be computed; a task that fails has its failure for a result."""

    items: Sequence[T]
    compute: Callable[[T], R]  # each process of this machine gets it once
    failed: Callable[[T, BaseException], R]
    key: Callable[[T], str]  # of each item once
    scene: Callable[[T], str]

    def results(self, *, processes: int = 1, scheduler: str | None = None) -> Iterator[R]:
        """The result of each task in the order in which they are ready.

        Closing the iterator ends the work.

        Args:
            processes: how many tasks at a time on this machine.
            scheduler: address of a Dask scheduler, whose workers then do the work.

        Raises: `DataError` where no scheduler answers, or a process ends by itself.
        """
        if scheduler is not None:
            yield from self._on_cluster(scheduler)
        elif processes > 1:
            with shared_blas(processes):
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
        begin = partial(_Work.keep, self.compute, self.failed, processes)
        pool = process_pool(processes, begin)
        try:
            waiting: dict[Future, T] = {}

            def begin(some: Sequence[T]) -> None:
                waiting.update({pool.submit(_Work.attempted, item): item for item in some})

            begin(leaders)
            while waiting:
                done, _ = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    item = waiting.pop(future)
                    yield self._collected(future.result, item)
                    try:
                        begin(followers.pop(self.key(item), []))
                    except BrokenProcessPool as error:
                        raise DataError("a process beside this one ended by itself") from error
        finally:
            _end(pool)

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
        with client:
            held = {}

            def begin(some: Sequence[T]) -> list:
                # one task for each key, whoever runs it: a worker that dies has its tasks run again
                started = [
                    client.submit(
                        _attempted, self.compute, self.failed, item,
                        key=self._name(item), pure=True,
                    )
                    for item in some
                ]  # fmt: skip
                held.update({future.key: future for future in started})
                return started

            try:
                ready = as_completed(begin(leaders), loop=client.loop)
                for future in ready:
                    item = by_key[future.key]
                    result = self._collected(future.result, item)
                    held.pop(future.key).release()  # or a dying worker would have it done again
                    ready.update(begin(followers.pop(self.key(item), [])))
                    yield result
            finally:
                client.cancel(list(held.values()))

    def _name(self, item: T) -> str:
        return f"cfs-{self.key(item)}"


def check_dask() -> None:
    """Raise `DataError` where Dask is not installed; it is not loaded."""
    if find_spec("distributed") is None:
        message = "needs Dask: pip install 'mitsuba-cfs[distributed]'"
        raise DataError(message, field="--scheduler")


class _Work:
    """What a process of the pool does with every task that it gets."""

    _kept: ClassVar[tuple[Callable, Callable]]

    @classmethod
    def keep(cls, compute: Callable, failed: Callable, processes: int) -> None:
        """Begin one of so many processes with this."""
        share_cores(processes)
        cls._kept = compute, failed

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


def _end(pool: ProcessPoolExecutor) -> None:
    """End the pool now, without waiting for the tasks under way."""
    running = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()
