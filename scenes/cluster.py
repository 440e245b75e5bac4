"""Tasks on those workers of a Dask scheduler that can compute them.

A worker is asked before its first task, and after each task that fails, whether it has the
program, the input files, memory and a disk. One that has not is left out with a warning, and its
tasks go to others: faults of a worker are not results of a task.
"""

from __future__ import annotations

import logging
import os
import queue
import secrets
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.files import reason, sha256
from mitsuba_cfs.source_code import code_version
from scenes.user_errors import one_line

if TYPE_CHECKING:
    from distributed import Client, Future

T = TypeVar("T")
R = TypeVar("R")
CONNECT_SECONDS = 10.0
POLL_SECONDS = 1.0  # between two looks at the scheduler's workers
WAIT_SECONDS = 60.0  # for a scheduler or a worker, after the last one has ended
ANSWER_SECONDS = 600.0  # for the first answer of a worker, which imports the program for it
AHEAD = 2  # tasks sent for each thread of a worker: one that runs and one that waits
MOST_LOST = 2  # workers that end, or run out of memory, with one task before it has failed
SLOW = 3.0  # times the longest finished task: then an idle worker computes a task too
LEAST_MEMORY = 2**30  # bytes; a five-phase case of a box room takes 0.85 GiB
TEMPORARY_BYTES = 2**20  # that a worker has to be able to write

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Requirements:
    """What a worker needs for a list of tasks: the same program and the same files."""

    module: str = ""  # that computes; its source and all that it imports has the version
    version: str = ""  # `code_version` of the module
    files: tuple[tuple[Path, str], ...] = ()  # with the SHA-256 of their bytes

    @classmethod
    def of(cls, module: str, files: dict[Path, str]) -> Requirements:
        """Of a module of this process, and files with their hashes."""
        return cls(module, code_version(module), tuple(sorted(files.items())))

    def missing(self, memory_limit: int | None = None) -> str:
        """Why this process cannot compute the tasks; empty if it can.

        Args: memory_limit: of this process [bytes].
        """
        if self.module and code_version(self.module) != self.version:
            return "has another version of the program or of its packages"
        for path, expected in self.files:
            try:
                same = sha256(Path(path)) == expected
            except OSError as error:
                return f"cannot read {path}: {reason(error)}"
            if not same:
                return f"has another {path}"
        return _no_memory(memory_limit) or _no_disk()


def _no_memory(limit: int | None) -> str:
    """Why this process cannot have the memory of a case, that which it has included."""
    import psutil

    memory = psutil.virtual_memory().available + psutil.Process().memory_info().rss
    memory = min(memory, limit or memory)
    if memory >= LEAST_MEMORY:
        return ""
    return f"has {memory / 2**30:.1f} GiB of memory, and {LEAST_MEMORY / 2**30:.0f} GiB are needed"


def _no_disk() -> str:
    try:
        with tempfile.TemporaryFile(buffering=0) as file:
            file.write(os.urandom(TEMPORARY_BYTES))
    except OSError as error:
        return f"cannot write to {tempfile.gettempdir()}: {reason(error)}"
    return ""


@dataclass(frozen=True, slots=True)
class _Answer(Generic[R]):
    """What a worker says of a task, or of its requirements."""

    result: R | None = None  # of the task; of a question the worker's number of threads
    unfit: str = ""  # why the worker can compute no task
    of_worker: BaseException | None = None  # error of a task that another worker may not have


def _asked(requirements: Requirements) -> _Answer:
    """Whether a worker can compute the tasks; on the worker."""
    from distributed import get_worker

    worker = get_worker()
    return _Answer(worker.state.nthreads, requirements.missing(worker.memory_manager.memory_limit))


def _attempted(requirements: Requirements, attempt: Callable[[T], tuple[R, BaseException | None]], item: T) -> _Answer:
    """The answer to a task; on the worker."""
    result, error = attempt(item)
    if error is None:
        return _Answer(result)
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, MemoryError | OSError):
        cause = cause.__cause__
    return _Answer(result, _asked(requirements).unfit, None if cause is None else error)


@dataclass(slots=True, eq=False)
class _Attempt(Generic[T]):
    """A task sent to a worker; without an item the question whether it can compute tasks."""

    worker: str
    item: T | None
    future: Future
    begun: float = field(default_factory=time.monotonic)


class _SchedulerEnded(Exception):
    """The connection to the scheduler is lost."""


class Cluster(Generic[T, R]):
    """Tasks at work on the workers of one scheduler."""

    def __init__(
        self,
        address: str,
        requirements: Requirements,
        attempt: Callable[[T], tuple[R, BaseException | None]],
        failed: Callable[[T, BaseException], R],
        key: Callable[[T], str],
    ) -> None:
        """Connect; raises `DataError` if no scheduler answers.

        Args:
            attempt: the result of a task and its error; sent to the workers.
            failed: the result of a task that has failed with an error.
            key: of a task; unique.
        """
        self._address, self._requirements = address, requirements
        self._attempt, self._failed, self._key = attempt, failed, key
        self._threads: dict[str, int] = {}  # of the workers that can compute, by address
        self._left_out: dict[str, str] = {}  # reasons by the worker's address
        self._asked: set[str] = set()  # addresses of the workers present
        self._names: dict[str, str] = {}  # of all workers so far
        self._attempts: set[_Attempt[T]] = set()
        self._ended: queue.SimpleQueue[tuple[_Attempt[T], Any] | None] = queue.SimpleQueue()
        self._unfinished: dict[str, T] = {}
        self._waiting: deque[T] = deque()  # unfinished, and sent to no worker
        self._lost: Counter[str] = Counter()  # workers that a task has cost, by its key
        self._tried: set[tuple[str, str]] = set()  # keys and workers not to be tried again
        self._longest = 0.0  # finished task [s]
        self._stopped = False
        self._client = self._connected(CONNECT_SECONDS)

    def stop(self) -> None:
        """End the work, from any thread."""
        self._stopped = True
        self._ended.put(None)

    def results(self, first: Sequence[T], then: Callable[[T], Sequence[T]]) -> Generator[R]:
        """The result of each task.

        Args: then: the tasks that follow one when it has ended.
        """
        self._add(first)
        try:
            working = time.monotonic()
            while self._unfinished and not self._stopped:
                try:
                    ended = self._look()
                    self._send()
                    ended += self._answers()
                except _SchedulerEnded:
                    ended = self._reconnect()
                if self._threads or not self._names:
                    working = time.monotonic()
                elif time.monotonic() - working > self._patience():
                    ended = self._all_failed(self._no_worker())
                for item, result in ended:
                    if self._unfinished.pop(self._key(item), None) is not None:
                        self._add(then(item))
                        yield result
        finally:
            for attempt in self._attempts:
                attempt.future.release()
            self._client.close(timeout=CONNECT_SECONDS)

    def _add(self, items: Sequence[T]) -> None:
        self._unfinished.update((self._key(item), item) for item in items)
        self._waiting.extend(items)

    def _connected(self, seconds: float) -> Client:
        from distributed import Client

        try:
            return Client(self._address, timeout=seconds, set_as_default=False)
        except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two: of TLS
            message = f"no Dask scheduler answers there: {one_line(str(error))}"
            raise DataError(message, element=self._address, field="--scheduler") from error

    def _reconnect(self) -> list[tuple[T, R]]:
        """Connect to the scheduler that comes in place of one that ended; the tasks begin anew."""
        log.warning(
            "the Dask scheduler %s has ended; waiting %.0f s for another one there", self._address, WAIT_SECONDS
        )
        self._client.close(timeout=CONNECT_SECONDS)
        self._attempts.clear()
        self._threads.clear()
        self._asked.clear()
        self._waiting = deque(self._unfinished.values())
        end = time.monotonic() + WAIT_SECONDS
        while not self._stopped:
            try:
                self._client = self._connected(CONNECT_SECONDS)
                return []
            except DataError as error:
                if time.monotonic() > end:
                    return self._all_failed(error)
                time.sleep(POLL_SECONDS)
        return []

    def _all_failed(self, error: DataError) -> list[tuple[T, R]]:
        return [(item, self._failed(item, error)) for item in self._unfinished.values()]

    def _patience(self) -> float:
        """Seconds without a worker that can compute: short where none has ended."""
        if self._questioned():
            return ANSWER_SECONDS
        return CONNECT_SECONDS if set(self._names) <= set(self._left_out) else WAIT_SECONDS

    def _questioned(self) -> set[str]:
        """Addresses of the workers that have not answered yet whether they can compute."""
        return {attempt.worker for attempt in self._attempts if attempt.item is None}

    def _no_worker(self) -> DataError:
        reasons = dict.fromkeys(self._names, "has ended")
        reasons |= dict.fromkeys(self._questioned(), "has not answered") | self._left_out
        named = "; ".join(f"{name} {reasons[worker]}" for worker, name in self._names.items())
        message = f"no worker of this scheduler can compute: {named}"
        return DataError(message, element=self._address, field="--scheduler")

    def _look(self) -> list[tuple[T, R]]:
        """Ask the workers that are new; forget those that have ended, and begin their tasks anew.

        Returns: tasks that have failed, because workers ended with them.
        """
        if self._client.status != "running":
            raise _SchedulerEnded
        try:
            present = self._client.sync(self._client.scheduler.identity)["workers"]
        except OSError as error:
            raise _SchedulerEnded from error
        for worker in present.keys() - self._asked:
            self._names[worker] = f"worker {present[worker]['name']} ({worker})"
            self._left_out.pop(worker, None)
            self._submit(worker, None, _asked, self._requirements)
        failed = []
        for worker in self._asked - present.keys():
            threads = self._threads.pop(worker, 0)
            lost = sorted(self._of_worker(worker), key=lambda attempt: attempt.begun)
            if threads:
                count = sum(attempt.item is not None for attempt in lost)
                name = self._names[worker]
                log.warning("%s has ended; its tasks (%d) are computed by others", name, count)
            for index, attempt in enumerate(lost):
                error = RoomError("its process ended") if index < threads else None
                failed += self._again(attempt, error)
        self._asked = set(present)
        return failed

    def _of_worker(self, worker: str) -> list[_Attempt[T]]:
        return [attempt for attempt in self._attempts if attempt.worker == worker]

    def _again(self, attempt: _Attempt[T], error: BaseException | None = None) -> list[tuple[T, R]]:
        """Compute the task of an attempt again, unless it has failed too often.

        Args: error: for which the task may be the reason.
        """
        self._drop(attempt)
        item = attempt.item
        if item is None or self._key(item) not in self._unfinished:
            return []
        key = self._key(item)
        if error is not None:
            self._lost[key] += 1
            self._tried.add((key, attempt.worker))
            if self._lost[key] >= MOST_LOST:
                return [(item, self._failed(item, error))]
        if not any(one.item is item for one in self._attempts):
            self._waiting.appendleft(item)
        return []

    def _drop(self, attempt: _Attempt[T]) -> None:
        self._attempts.discard(attempt)
        attempt.future.release()

    def _send(self) -> None:
        """Send tasks to the workers, those first that have the fewest for each thread."""
        for _ in range(len(self._waiting)):
            item = self._waiting.popleft()
            if not self._sent(item, AHEAD):
                self._waiting.append(item)
        if self._waiting or not self._longest:
            return
        slow = time.monotonic() - SLOW * max(self._longest, POLL_SECONDS)
        for attempt in list(self._attempts):
            item = attempt.item
            if item is None or attempt.begun > slow or self._key(item) not in self._unfinished:
                continue
            if sum(one.item is item for one in self._attempts) == 1 and self._sent(item, 1):
                name = self._names[attempt.worker]
                log.warning("%s is slow; another worker computes its task too", name)

    def _sent(self, item: T, most: int) -> bool:
        """Whether a worker with fewer than `most` tasks for each thread has got the task."""
        key = self._key(item)
        able = {one for one in self._threads if (key, one) not in self._tried} or self._threads
        free = []
        for worker in able:
            attempts, threads = self._of_worker(worker), self._threads[worker]
            if len(attempts) < most * threads and all(one.item is not item for one in attempts):
                free.append((len(attempts) / threads, worker))
        if free:
            self._submit(min(free)[1], item, _attempted, self._requirements, self._attempt, item)
        return bool(free)

    def _submit(self, worker: str, item: T | None, function: Callable, *arguments: Any) -> None:
        future = self._client.submit(
            function, *arguments, key=f"cfs-{secrets.token_hex(8)}", workers=[worker], pure=False
        )
        attempt = _Attempt(worker, item, future)
        self._attempts.add(attempt)
        future.add_done_callback(lambda done: self._ended.put((attempt, _outcome(done))))

    def _answers(self) -> list[tuple[T, R]]:
        """Tasks that have ended, with their results; waits for the first of them."""
        results: list[tuple[T, R]] = []
        wait = True
        while True:
            try:
                ended = self._ended.get(timeout=POLL_SECONDS if wait else 0.0)
            except queue.Empty:
                return results
            wait = False
            if ended is not None and ended[0] in self._attempts:
                results += self._answered(*ended)

    def _answered(self, attempt: _Attempt[T], answer: Any) -> list[tuple[T, R]]:
        item = attempt.item
        if isinstance(answer, CancelledError):
            raise _SchedulerEnded  # an attempt that is cancelled here is none any more
        if isinstance(answer, BaseException):
            if item is not None:
                return self._again(attempt, answer)
            answer = _Answer(unfit=f"cannot be asked: {one_line(str(answer))}")
        if answer.unfit:
            return self._leave_out(attempt.worker, answer.unfit)
        if item is None:
            self._drop(attempt)
            self._threads[attempt.worker] = answer.result
            return []
        if answer.of_worker is not None and self._lost[self._key(item)] + 1 < MOST_LOST:
            return self._again(attempt, answer.of_worker)
        self._drop(attempt)
        self._longest = max(self._longest, time.monotonic() - attempt.begun)
        return [(item, answer.result)]

    def _leave_out(self, worker: str, why: str) -> list[tuple[T, R]]:
        self._threads.pop(worker, None)
        self._left_out[worker] = why
        log.warning("%s is left out: it %s", self._names[worker], why)
        return [one for attempt in self._of_worker(worker) for one in self._again(attempt)]


def _outcome(future: Future) -> Any:
    """The answer of a worker, or the error that stands for it."""
    try:
        return future.result()
    except Exception as error:
        return error
