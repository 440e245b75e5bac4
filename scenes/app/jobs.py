"""Commands run one after the other, each in a process of its own that may die without the page."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.interpreter import own_paths, own_python
from scenes.app.actions import Action
from scenes.app.project import JOURNAL, LOGS, Project
from scenes.user_errors import user_message

KEPT = 400  # lines of a command that the page shows
ENDED = 80  # of those of a command that has ended
MOST = 100  # commands that wait
PATIENCE_S = 20.0  # after SIGINT, before SIGTERM
WAITING, RUNNING, DONE, FAILED, STOPPED = "waiting", "running", "done", "failed", "stopped"
INTERRUPTED = 130


@dataclass(slots=True)
class Job:
    """A command that waits, runs or has ended."""

    number: int
    action: Action
    state: str = WAITING
    started: float = 0.0
    ended: float = 0.0
    code: int | None = None
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT))
    progress: dict[str, Any] = field(default_factory=dict)  # the latest, see `cfs --progress json`

    def facts(self) -> dict[str, Any]:
        """What the page shows of it; of one that has ended the last lines."""
        shown = KEPT if self.state == RUNNING else ENDED
        return {
            "number": self.number,
            "kind": self.action.kind,
            "title": self.action.title,
            "command": self.action.text,
            "out": self.action.out,
            "state": self.state,
            "started": self.started,
            "ended": self.ended,
            "code": self.code,
            "progress": self.progress,
            "lines": list(self.lines)[-shown:],
        }


class Jobs:
    """The commands of a project; one runs at a time."""

    def __init__(self, project: Project) -> None:
        """Nothing runs yet."""
        self._project = project
        self.on_done: Callable[[Action], None] = lambda action: None  # after one that succeeded
        self._jobs: list[Job] = []
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._process: subprocess.Popen[str] | None = None
        self._closed = False
        self.version = 0  # rises with each change
        self._thread = threading.Thread(target=self._work, name="cfs-jobs", daemon=True)
        self._thread.start()

    def add(self, actions: list[Action]) -> list[Job]:
        """Put commands at the end of the queue; the same one that waits already is not added.

        Raises: `DataError` where too many wait.
        """
        with self._changed:
            waiting = {job.action.command for job in self._jobs if job.state == WAITING}
            fresh = [one for one in actions if one.command not in waiting]
            if len(waiting) + len(fresh) > MOST:
                raise DataError(f"more than {MOST} commands would wait", field="commands")
            first = len(self._jobs) + 1
            jobs = [Job(number, one) for number, one in enumerate(fresh, first)]
            self._jobs += jobs
            self._note()
            return jobs

    def facts(self) -> list[dict[str, Any]]:
        """What the page shows of all commands, the latest last."""
        with self._lock:
            return [job.facts() for job in self._jobs]

    @property
    def busy(self) -> bool:
        """Whether a command runs or waits."""
        with self._lock:
            return any(job.state in (WAITING, RUNNING) for job in self._jobs)

    def again(self, number: int) -> None:
        """Put an ended command at the end of the queue once more; what it had stored is used.

        Raises: `DataError` where there is no such command.
        """
        with self._changed:
            if not 1 <= number <= len(self._jobs):
                raise DataError(f"there is no command {number}", field="number")
            self.add([self._jobs[number - 1].action])

    def stop(self, number: int) -> None:
        """End a command by SIGINT, a second time by SIGTERM; one that waits is taken out.

        Raises: `DataError` where there is no such command.
        """
        with self._changed:
            if not 1 <= number <= len(self._jobs):
                raise DataError(f"there is no command {number}", field="number")
            job = self._jobs[number - 1]
            if job.state == WAITING:
                job.state, job.ended = STOPPED, time.time()
            elif job.state == RUNNING and self._process is not None:
                _interrupt(self._process, again=job.code == INTERRUPTED)
                job.code = INTERRUPTED  # until its own is known
            self._note()

    def touch(self) -> None:
        """Let the page look again: something else has changed."""
        with self._changed:
            self._note()

    def close(self) -> None:
        """End what runs, and wait for that."""
        with self._changed:
            self._closed = True
            for job in self._jobs:
                if job.state == WAITING:
                    job.state = STOPPED
            if self._process is not None:
                _interrupt(self._process)
            self._note()
        self._thread.join(PATIENCE_S)
        with self._lock:
            if self._process is not None:
                self._process.kill()

    def _note(self) -> None:
        self.version += 1
        self._changed.notify_all()

    def _work(self) -> None:
        while True:
            with self._changed:
                while not self._closed and not any(j.state == WAITING for j in self._jobs):
                    self._changed.wait()
                if self._closed:
                    return
                job = next(j for j in self._jobs if j.state == WAITING)
                job.state, job.started = RUNNING, time.time()
                self._note()
            self._run(job)

    def _run(self, job: Job) -> None:
        """Run a command to its end; whatever happens, the next one can run."""
        try:
            code = self._ended(job)
            if code == 0:
                self.on_done(job.action)
        except Exception as error:
            code = 1
            message = user_message(error)
            if message is None:
                traceback.print_exc()
            with self._changed:
                job.lines.append(f"error: {message or error!r}")
        with self._changed:
            self._process = None
            self._end(job, code)

    def _ended(self, job: Job) -> int:
        """The exit code of a command, whose output is shown and logged."""
        folder = self._project.folder / LOGS
        folder.mkdir(exist_ok=True)
        (self._project.folder / job.action.out).parent.mkdir(parents=True, exist_ok=True)
        log = folder / f"{time.strftime('%Y%m%d-%H%M%S')}-{job.number}.txt"
        with log.open("w", encoding="utf-8") as file, self._start(job.action) as process:
            with self._changed:
                self._process = process
                if self._closed:
                    _interrupt(process)
            file.write(f"$ {job.action.text}\n")
            for line in process.stdout or ():
                self._take(job, line.rstrip("\n"), file)
        return process.returncode

    def _start(self, action: Action) -> subprocess.Popen[str]:
        environment = own_paths() | {"CFS_PROGRESS": "json", "COLUMNS": "100", "NO_COLOR": "1"}
        environment |= {"PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8"}
        return subprocess.Popen(
            own_python("-m", "scenes.cli", *action.command),
            cwd=self._project.folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=os.name == "posix",
        )

    def _take(self, job: Job, line: str, log: Any) -> None:
        """A line of the command: progress, or what it prints."""
        progress = _progress(line)
        with self._changed:
            if progress is not None:
                job.progress = progress
            else:
                job.lines.append(line)
                log.write(line + "\n")
                log.flush()
            self._note()

    def _end(self, job: Job, code: int) -> None:
        stopped = job.code == INTERRUPTED or self._closed
        job.ended, job.code = time.time(), code
        job.state = DONE if code == 0 else STOPPED if stopped or code == INTERRUPTED else FAILED
        seconds = round(job.ended - job.started, 1)
        line = {
            "command": ["cfs", *job.action.command],
            "kind": job.action.kind,
            "title": job.action.title,
            "started": round(job.started),
            "seconds": seconds,
            "state": job.state,
            "code": code,
        }
        try:
            self._project.record(line)
        except OSError as error:
            job.lines.append(f"{JOURNAL} cannot be written: {reason(error)}")
        self._note()


def _progress(line: str) -> dict[str, Any] | None:
    """The progress that a line reports; None for another line."""
    if not line.startswith('{"stage"'):
        return None
    with contextlib.suppress(ValueError):
        record = json.loads(line)
        if isinstance(record, dict):
            return record
    return None


def _interrupt(process: subprocess.Popen[str], *, again: bool = False) -> None:
    """Ask a command and its workers to end."""
    with contextlib.suppress(ProcessLookupError, OSError):
        if os.name != "posix":
            process.terminate()
        elif again:
            os.killpg(process.pid, signal.SIGTERM)
        else:
            process.send_signal(signal.SIGINT)
