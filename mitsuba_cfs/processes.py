"""Processes that work beside this one, and end with it however it ends."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import connection, get_context, parent_process
from pathlib import Path
from typing import Any

Told = Callable[[str], None]


class ProcessEnded(RuntimeError):
    """A process of our own ended without an answer; `last`: the last that it told."""

    def __init__(self, reason: str, last: str) -> None:
        super().__init__(reason)
        self.last = last


def process_pool(processes: int) -> ProcessPoolExecutor:
    """A pool of fresh interpreters (Dr.Jit does not survive a fork).

    A worker of `concurrent.futures` waits for work for ever once its parent was killed; these end.
    """
    return ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=_end_with_parent
    )


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()


def answer_apart(
    function: Callable, *arguments: Any, limit_s: float, told: Told | None = None
) -> Any:
    """What `function(*arguments, tell)` returns in a fresh interpreter that may die or be stopped.

    For native libraries that end a process by a signal, or work for hours, on some inputs. Unlike
    a process pool it does not run the main module again, so that a script needs no guard.

    Args:
        function: of a module; `tell(text)`, its last argument, sends one line to `told` here.
        limit_s: seconds until it is stopped.
    Raises: `ProcessEnded` where it was stopped or died; what the function raises otherwise.
    """
    with tempfile.TemporaryDirectory() as folder:
        task, answer = Path(folder) / "task", Path(folder) / "answer"
        task.write_bytes(pickle.dumps((function, arguments)))
        code = f"from {__name__} import _work; _work({str(task)!r}, {str(answer)!r})"
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code], env=os.environ | {"PYTHONPATH": paths},
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        stopped = threading.Event()
        timer = threading.Timer(limit_s, lambda: (stopped.set(), process.kill()))
        timer.start()
        last = ""
        try:
            for line in process.stdout or ():
                last = line.rstrip("\n")
                if told is not None:
                    told(last)
            process.wait()
        finally:
            timer.cancel()
            process.kill()
            process.communicate()
        if not answer.is_file():
            raise ProcessEnded(_reason(process.returncode, stopped.is_set(), limit_s), last)
        value, error = pickle.loads(answer.read_bytes())
    if error is not None:
        raise error
    return value


def _reason(code: int, stopped: bool, limit_s: float) -> str:
    if stopped:
        return f"not finished after {limit_s:.0f} s"
    if code < 0:
        return f"a library ended its process by signal {signal.Signals(-code).name}"
    return f"its process ended with code {code}"


def _work(task: str, answer: str) -> None:
    """In the process of its own: do the task, and end where the parent has."""
    # descriptor 0 itself: a thread inside sys.stdin's lock would hold up the interpreter's end
    threading.Thread(target=lambda: (os.read(0, 1), os._exit(1)), daemon=True).start()
    function, arguments = pickle.loads(Path(task).read_bytes())
    value, error = None, None
    try:
        value = function(*arguments, _tell)
    except Exception as raised:  # raised again by the parent, whatever it is
        error = raised
    part = Path(answer + ".part")
    part.write_bytes(pickle.dumps((value, error)))
    part.rename(answer)


def _tell(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
