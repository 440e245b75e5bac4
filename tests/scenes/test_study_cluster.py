"""Studies on a Dask cluster: a real scheduler and workers on this machine, one of them killed."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import sha256
from scenes.cluster import Requirements
from scenes.demo import WEATHER
from scenes.study.plan import Case, plan_of
from scenes.study.store import computed
from scenes.study.study_file import read_study
from tests.conftest import REPOSITORY
from tests.scenes.study_files import study_file
from tests.scenes.study_noted import SECONDS, deadly, elsewhere, held_up, noted

pytest.importorskip("distributed")
pytestmark = pytest.mark.early


class Cluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, folder: Path, workers: int) -> None:
        self._folder = folder
        self.processes: list[subprocess.Popen] = []
        self.workers: list[subprocess.Popen] = []
        self.begin_scheduler("0")
        for _ in range(workers):
            self.add_worker()
        self.wait_for_workers()

    def begin_scheduler(self, port: str) -> None:
        """Start the scheduler."""
        self.scheduler = self._start(
            "scheduler", "--port", port, "--host", "127.0.0.1", "--no-dashboard",
            "--idle-timeout", "120 s",
        )  # fmt: skip
        self.address = self._said(self.scheduler, r"Scheduler at:\s+(tcp://\S+)")

    def add_worker(self, *options: str, cwd: Path = REPOSITORY) -> None:
        """Start a worker; w0 is the first."""
        worker = self._start(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
            "--death-timeout", "60", "--local-directory", str(self._folder),
            "--name", f"w{len(self.workers)}", *options, cwd=cwd,
        )  # fmt: skip
        self.workers.append(worker)

    def wait_for_workers(self) -> None:
        """Wait until all workers have registered."""
        for worker in self.workers:
            self._said(worker, r"(Registered to:)")

    def _start(self, *arguments: str, cwd: Path = REPOSITORY) -> subprocess.Popen:
        log = self._folder / f"{len(self.processes)}.log"
        with log.open("w") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments],
                stdout=output, stderr=subprocess.STDOUT, cwd=cwd,
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
            process.send_signal(signal.SIGCONT)
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


@pytest.fixture
def started():
    """Starts clusters, which end with the test."""
    clusters = []

    def start(folder: Path, workers: int) -> Cluster:
        folder.mkdir()
        clusters.append(Cluster(folder, workers))
        return clusters[-1]

    yield start
    for one in clusters:
        one.stop()


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
    monkeypatch.setattr("scenes.cluster.CONNECT_SECONDS", 0.5)
    wanted, _ = cases(tmp_path, [0])
    with pytest.raises(DataError, match=r"--scheduler: no Dask scheduler answers there") as error:
        list(computed(wanted, noted, scheduler="tcp://127.0.0.1:9"))
    assert "\n" not in str(error.value)


def blind(folder: Path) -> str:
    """A script for a worker that does not find the weather file."""
    script = folder / "blind.py"
    script.write_text(
        "import sys\n"
        "def hide(event, names):\n"
        f"    if event == 'open' and str(names[0]) == {str(WEATHER)!r}:\n"
        "        raise FileNotFoundError(2, 'No such file or directory', names[0])\n"
        "sys.addaudithook(hide)\n"
    )
    return str(script)


def another_version(folder: Path) -> Path:
    """The program with one line more in the module that computes cases."""
    copy = folder / "other"
    copy.mkdir()
    for package in ("mitsuba_cfs", "bim", "thermal", "tests"):
        (copy / package).symlink_to(REPOSITORY / package)
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(REPOSITORY / "scenes", copy / "scenes", ignore=ignored)
    with (copy / "scenes" / "study" / "one_case.py").open("a") as module:
        module.write("# another version\n")
    return copy


@pytest.mark.parametrize("number", [12, pytest.param(50, marks=pytest.mark.slow)])
def test_a_blind_a_dying_and_an_old_worker_lose_nothing(started, tmp_path, caplog, number):
    """A worker that comes later computes the rest; a line for each of the others."""
    cluster = started(tmp_path / "dask", 1)
    cluster.add_worker("--preload", blind(tmp_path))
    cluster.add_worker(cwd=another_version(tmp_path))
    cluster.wait_for_workers()
    wanted, log = cases(tmp_path, list(range(20, 20 + number)))
    results = []
    for result in computed(wanted, noted, scheduler=cluster.address):
        results.append(result)
        if len(results) == 2:
            until(another_begun(log), 20)
            cluster.workers[0].kill()
            cluster.add_worker()
    assert sorted(result.key for result in results) == sorted(case.key for case in wanted)
    assert not [result.error for result in results if result.error]
    warnings = [one for one in caplog.records if one.levelname == "WARNING"]
    lines = [one.getMessage() for one in warnings if one.name == "scenes.cluster"]  # not Dask's
    assert len(lines) == 3
    for name, words in (
        ("w0", "has ended; its tasks ("),
        ("w1", f"is left out: it cannot read {WEATHER}: No such file"),
        ("w2", "is left out: it has another version of the program"),
    ):
        assert [line for line in lines if f"worker {name} (" in line and words in line], lines


def test_without_a_worker_that_can_compute_the_reasons_are_named(started, tmp_path, monkeypatch):
    monkeypatch.setattr("scenes.cluster.CONNECT_SECONDS", 2.0)
    cluster = started(tmp_path / "dask", 0)
    cluster.add_worker("--preload", blind(tmp_path))
    cluster.wait_for_workers()
    wanted, _ = cases(tmp_path, [0, 20])
    errors = [result.error for result in computed(wanted, noted, scheduler=cluster.address)]
    assert len(errors) == 2
    for error in errors:
        assert "no worker of this scheduler can compute: worker w0 (" in error
        assert f"cannot read {WEATHER}" in error


@pytest.mark.slow
def test_a_scheduler_that_is_killed_and_started_again_goes_on(started, tmp_path):
    cluster = started(tmp_path / "dask", 1)
    wanted, _ = cases(tmp_path, [10 * i for i in range(8)])
    results = []
    for result in computed(wanted, noted, scheduler=cluster.address):
        results.append(result)
        if len(results) == 2:
            cluster.scheduler.kill()
            cluster.scheduler.wait()
            cluster.begin_scheduler(cluster.address.rpartition(":")[2])
            cluster.add_worker()
    assert sorted(result.key for result in results) == sorted(case.key for case in wanted)
    assert not [result.error for result in results if result.error]


@pytest.mark.slow
def test_the_tasks_of_a_worker_that_stands_still_are_computed_by_another(started, tmp_path):
    cluster = started(tmp_path / "dask", 2)
    wanted, log = cases(tmp_path, [10 * i for i in range(10)])
    results, begin = [], time.monotonic()
    for result in computed(wanted, noted, scheduler=cluster.address):
        results.append(result)
        if len(results) == 3:
            until(another_begun(log), 20)
            cluster.workers[0].send_signal(signal.SIGSTOP)
    assert sorted(result.key for result in results) == sorted(case.key for case in wanted)
    assert not [result.error for result in results if result.error]
    assert time.monotonic() - begin < 60.0  # Dask gives such a worker up after 300 s


@pytest.mark.slow
def test_a_case_that_ends_its_workers_has_failed_after_two(started, tmp_path):
    cluster = started(tmp_path / "dask", 3)
    wanted, _ = cases(tmp_path, [13, *(10 * i for i in range(4))])
    results = {r.key: r for r in computed(wanted, deadly, scheduler=cluster.address)}
    assert [results[case.key].error for case in wanted] == ["its process ended", "", "", "", ""]
    assert [worker.poll() is None for worker in cluster.workers].count(True) == 1


def test_a_case_without_memory_or_files_is_tried_on_another_worker(cluster, tmp_path):
    cluster.add_worker()
    cluster.add_worker()
    cluster.wait_for_workers()
    wanted, log = cases(tmp_path, [0, 13, 20])
    results = {r.key: r for r in computed(wanted, elsewhere, scheduler=cluster.address)}
    assert [results[case.key].error for case in wanted] == ["", "", "out of memory"]
    assert log.read_text().count("begin") == 1 + 2 + 2


def test_what_a_worker_lacks_is_named(tmp_path, monkeypatch):
    file = tmp_path / "weather.epw"
    file.write_text("a")
    needs = Requirements.of("scenes.study.plan", {file: sha256(file)})
    assert needs.missing() == needs.missing(2**50) == ""
    assert replace(needs, version="0").missing().startswith("has another version of the program")
    assert "has 0.0 GiB of memory, and 1 GiB are needed" in needs.missing(2**20)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    assert "cannot write to" in needs.missing()
    monkeypatch.undo()
    file.write_text("b")
    assert needs.missing() == f"has another {file}"
    file.unlink()
    assert needs.missing() == f"cannot read {file}: No such file or directory"
