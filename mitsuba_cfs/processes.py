"""Worker processes, which end with this process however it ends."""

from __future__ import annotations

import atexit
import base64
import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextvars import ContextVar, copy_context
from multiprocessing import connection, get_context, parent_process
from multiprocessing.process import BaseProcess
from typing import Any, ClassVar

Told = Callable[[str], None]
TOLD, DONE = "told ", "done "  # how lines of a process apart begin
ENDS_WITHIN = 10.0  # s: processes that were told to end
MOST_ENDED = 5  # items that end their process, one after the other, before the rest is given up


class ProcessEnded(RuntimeError):
    """A worker process ended without an answer; `last`: its last report."""

    def __init__(self, reason: str, last: str) -> None:
        super().__init__(reason)
        self.last = last


_ENDED: ContextVar[list[ProcessEnded] | None] = ContextVar("ended processes", default=None)


@contextlib.contextmanager
def ended_processes() -> Iterator[list[ProcessEnded]]:
    """The processes of `answer_apart` that end without an answer within the block."""
    ended: list[ProcessEnded] = []
    token = _ENDED.set(ended)
    try:
        yield ended
    finally:
        _ENDED.reset(token)


def process_pool(processes: int, begin: Callable[[], object] | None = None) -> ProcessPoolExecutor:
    """A pool of fresh interpreters (Dr.Jit does not survive a fork).

    A worker of `concurrent.futures` waits for work for ever once its parent was killed; these end.

    Args: begin: what each worker does first.
    """
    return ProcessPoolExecutor(processes, mp_context=get_context("spawn"), initializer=_begin, initargs=(begin,))


def _begin(begin: Callable[[], object] | None) -> None:
    parent = parent_process()
    if parent is not None:
        _end_after(lambda: connection.wait([parent.sentinel]))
    if begin is not None:
        begin()


def _end_after(parent_left: Callable[[], object]) -> None:
    """End this process when its parent ends, which closes the pipe that a thread reads."""

    def watch() -> None:
        parent_left()
        os._exit(1)

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()


def answer_apart(function: Callable, *arguments: Any, limit_s: float, told: Told | None = None) -> Any:
    """Result of `function(*arguments, tell)` in a subprocess that may crash or be stopped.

    For native libraries that end a process by a signal, or work for hours, on some inputs. Unlike
    a process pool it does not run the main module again, so that a script needs no guard. The
    interpreter stays for the next call, until it dies or this process ends.

    Args:
        function: of a module; `tell(text)`, its last argument, sends one line to `told` here.
        limit_s: seconds until it is stopped.
    Raises: `ProcessEnded` where it was stopped or died; what the function raises otherwise.
    """
    apart = _Apart.waiting()
    try:
        value, error = apart.answer((function, arguments), limit_s, told or (lambda text: None))
    except BaseException:
        apart.end()
        raise
    _Apart.idle.append(apart)
    if error is not None:
        raise error
    return value


def beside(function: Callable, *arguments: Any, limit_s: float) -> Future:
    """Begin `answer_apart(function, *arguments, limit_s=limit_s)`; its future result."""
    future: Future = Future()
    context = copy_context()

    def wait() -> None:
        try:
            future.set_result(context.run(answer_apart, function, *arguments, limit_s=limit_s))
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=wait, name="answer-beside", daemon=True).start()
    return future


class _Apart:
    """A subprocess that does one task after the other."""

    idle: ClassVar[list[_Apart]] = []
    taking: ClassVar[threading.Lock] = threading.Lock()  # threads take one at a time

    @classmethod
    def waiting(cls) -> _Apart:
        """One that has nothing to do, else a new one."""
        with cls.taking:
            one = cls.idle.pop() if cls.idle else None
        return one or cls()

    def __init__(self) -> None:
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", f"from {__name__} import _work; _work()"],
            env=os.environ | {"PYTHONPATH": paths},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def end(self) -> None:
        """Kill it unless it has ended."""
        self._process.kill()
        self._process.communicate()

    def answer(self, task: object, limit_s: float, told: Told) -> tuple[Any, Exception | None]:
        """Value and error of a task; `ProcessEnded` if the process was stopped or crashed."""
        process, stopped = self._process, threading.Event()
        timer = threading.Timer(limit_s, lambda: (stopped.set(), process.kill()))
        timer.daemon = True  # an exit that a signal begins in `start` does not wait for it
        last, answer = "", ""
        try:
            timer.start()
            with contextlib.suppress(BrokenPipeError):  # it died while it had nothing to do
                process.stdin.write(_packed(task) + "\n")
                process.stdin.flush()
            for line in process.stdout or ():
                if line.startswith(DONE):
                    answer = line.removeprefix(DONE)
                    break
                if line.startswith(TOLD):
                    last = line.removeprefix(TOLD).rstrip("\n")
                    told(last)
        finally:
            timer.cancel()
        if not answer.endswith("\n") or stopped.is_set():  # or it died in the midst of the line
            self.end()
            error = ProcessEnded(_reason(process.returncode, stopped.is_set(), limit_s), last)
            if (ended := _ENDED.get()) is not None:
                ended.append(error)
            raise error
        return _unpacked(answer)


@atexit.register
def _end_idle() -> None:
    while _Apart.idle:
        _Apart.idle.pop().end()


def each_apart(function: Callable, items: Sequence, *, limit_s: float) -> list[Any]:
    """Results of `function` for each item, computed in one separate process (`answer_apart`).

    An item that ends the process gets the `ProcessEnded` in place of an answer, and the others are
    computed again; so do all that are left after `MOST_ENDED` of these, or when the time is over.

    Args: function: of a module, of one item; what it raises is raised.
    """
    results: list[Any] = [None] * len(items)
    left, until, ended = list(range(len(items))), time.monotonic() + limit_s, 0
    while left:
        try:
            given = [items[index] for index in left]
            rest_s = max(until - time.monotonic(), 0.0)
            for index, value in zip(left, answer_apart(_each, function, given, limit_s=rest_s), strict=True):
                results[index] = value
            break
        except ProcessEnded as error:
            ended += 1
            over = ended > MOST_ENDED or time.monotonic() >= until or not error.last
            for index in left if over else [left[int(error.last)]]:
                results[index] = error
            left = [] if over else [i for n, i in enumerate(left) if n != int(error.last)]
    return results


def _each(function: Callable, items: Sequence, tell: Told) -> list[Any]:
    results = []
    for number, item in enumerate(items):
        tell(str(number))
        results.append(function(item))
    return results


def how_it_ended(processes: Iterable[BaseProcess]) -> str:
    """Exit of the first process of a broken pool; the pool ended the others."""
    codes = []
    for process in processes:
        process.join(ENDS_WITHIN)
        codes.append(process.exitcode or 0)
    own = [code for code in codes if code not in (0, -signal.SIGTERM)]
    return _reason(own[0], False, 0.0) if own else "its process ended by itself"


def _reason(code: int, stopped: bool, limit_s: float) -> str:
    if stopped:
        return f"not finished after {limit_s:.0f} s"
    if code == -getattr(signal, "SIGKILL", signal.SIGTERM):
        return "its process was killed, as the system does where there is too little memory"
    if code < 0:
        return f"a library ended its process by signal {signal.Signals(-code).name}"
    return f"its process ended with code {code}"


def _work() -> None:
    """In the subprocess: do the tasks that stdin has, one in each line."""
    tasks: queue.Queue[str] = queue.Queue()

    def read() -> None:
        with open(0, encoding="utf-8", closefd=False) as lines:
            for line in lines:
                tasks.put(line)

    _end_after(read)
    while True:
        function, arguments = _unpacked(tasks.get())
        value, error = None, None
        try:
            value = function(*arguments, _tell)
        except Exception as raised:  # raised again by the parent, whatever it is
            error = raised
        _send(DONE + _packed((value, error)))


def _packed(value: object) -> str:
    """A value as one line for a pipe: no file of it is left where the processes are killed."""
    return base64.b64encode(pickle.dumps(value)).decode()


def _unpacked(line: str) -> Any:
    return pickle.loads(base64.b64decode(line))


def _tell(text: str) -> None:
    _send(f"{TOLD}{text}")


def _send(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
