"""Studies on a Dask cluster: a real scheduler and workers on this machine, one of them killed."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from mitsuba_cfs.errors import DataError
from scenes.study.plan import Case, plan_of
from scenes.study.store import computed
from scenes.study.study_file import read_study
from tests.conftest import REPOSITORY
from tests.scenes.study_files import study_file
from tests.scenes.study_noted import SECONDS, held_up, noted

pytest.importorskip("distributed")


class Cluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, folder: Path, workers: int) -> None:
        self._folder = folder
        self.processes: list[subprocess.Popen] = []
        scheduler = self._start(
            "scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard",
            "--idle-timeout", "120 s",
        )  # fmt: skip
        self.address = self._said(scheduler, r"Scheduler at:\s+(tcp://\S+)")
        self.workers = [
            self._start(
                "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                "--death-timeout", "60", "--local-directory", str(folder), "--name", f"w{i}",
            )
            for i in range(workers)
        ]  # fmt: skip
        for worker in self.workers:
            self._said(worker, r"(Registered to:)")

    def _start(self, *arguments: str) -> subprocess.Popen:
        log = self._folder / f"{len(self.processes)}.log"
        with log.open("w") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments],
                stdout=output, stderr=subprocess.STDOUT, cwd=REPOSITORY,
            )  # fmt: skip
        process.log = log
        self.processes.append(process)
        return process

    def _said(self, process: subprocess.Popen, pattern: str) -> str:
        """What the process says, waited for."""
        return until(lambda: (m := re.search(pattern, process.log.read_text())) and m[1], 60)

    def stop(self) -> None:
        """End all processes that are still there."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()


def another_begun(log: Path) -> Callable[[], bool]:
    """Whether one more case was begun since now."""

    def begun() -> int:
        return log.read_text().count("begin")

    before = begun()
    return lambda: begun() > before


def until(condition: Callable, seconds: float):
    """What the condition gives once it holds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.05)
    raise AssertionError("waited in vain")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A scheduler and two workers."""
    found = Cluster(tmp_path_factory.mktemp("dask"), 2)
    yield found
    found.stop()


def cases(folder: Path, angles: list[int]) -> tuple[list[Case], Path]:
    """A case for each angle, and the log that they write."""
    log = folder / "log"
    text = f"orientations_deg = {angles}\n"
    study = read_study(study_file(folder, text))
    room = study.room[0].model_copy(update={"name": str(log)})
    return list(plan_of(study.model_copy(update={"room": (room,)})).cases), log


def test_a_worker_killed_midway_loses_and_doubles_nothing(cluster, tmp_path):
    wanted, log = cases(tmp_path, [10 * i for i in range(12)])
    wanted.append(wanted[3])  # asked for twice: computed once
    found, killed = [], None
    for result in computed(wanted, noted, scheduler=cluster.address):
        found.append(result)
        if len(found) == 2 and killed is None:
            killed = cluster.workers[0]
            until(lambda: log.read_text().count("end") >= 8, 20)  # while a result is looked at
            until(another_begun(log), 20)  # in the midst of a case
            killed.send_signal(signal.SIGKILL)
            killed.wait()
    keys = [result.key for result in found]
    assert sorted(keys) == sorted({case.key for case in wanted})
    assert not [result.error for result in found if result.error]
    angle = {case.key: case.orientation_deg for case in wanted}
    assert all(result.figures["angle"] == angle[result.key] for result in found)
    lines = log.read_text().splitlines()
    ends = [line for line in lines if line.startswith("end")]
    assert sorted(set(ends)) == sorted(f"end {case.orientation_deg:g}" for case in wanted[:-1])
    lost = len(lines) - 2 * len(ends)
    assert 0 <= lost <= 1  # at most the case that the killed worker had in hand
    assert len(ends) - len(set(ends)) <= 1  # ... or had just done, its result still on its way


def test_a_case_that_fails_on_a_worker_leaves_the_others(cluster, tmp_path):
    wanted, _ = cases(tmp_path, [0, 13, 20])
    found = {r.key: r for r in computed(wanted, noted, scheduler=cluster.address)}
    assert [found[case.key].error for case in wanted] == ["", "this one fails", ""]


def test_who_stops_early_waits_for_nothing_and_leaves_no_work_behind(cluster, tmp_path):
    wanted, log = cases(tmp_path, [10 * i for i in range(12)])
    with closing(computed(wanted, held_up, scheduler=cluster.address)) as results:
        next(results)
    assert log.read_text().count("begin") == 1  # the others are held up still
    Path(f"{log}.go").touch()
    until(lambda: log.read_text().count("end") > 1, 20)  # what a worker had in hand
    time.sleep(4 * SECONDS)
    assert log.read_text().count("begin") <= 3


def test_no_scheduler_is_one_clear_line(tmp_path, monkeypatch):
    monkeypatch.setattr("scenes.workers.CONNECT_SECONDS", 0.5)
    wanted, _ = cases(tmp_path, [0])
    with pytest.raises(DataError, match=r"--scheduler: no Dask scheduler answers there") as error:
        list(computed(wanted, noted, scheduler="tcp://127.0.0.1:9"))
    assert "\n" not in str(error.value)
