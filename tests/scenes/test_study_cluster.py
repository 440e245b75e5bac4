"""Studies on a Dask cluster: a real scheduler and workers on this machine, one of them killed."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
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


LOOPBACK = ("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0")  # as SECURITY.md has it


class Cluster:
    """A scheduler and its workers, each a process of its own.

    Args: options: of both, beside those that let them listen on the loopback address alone.
    """

    def __init__(self, folder: Path, workers: int, options: Sequence[str] = ()) -> None:
        self._folder, self._options = folder, (*LOOPBACK, *options)
        self.processes: list[subprocess.Popen] = []
        self.workers: list[subprocess.Popen] = []
        self.begin_scheduler("0")
        for _ in range(workers):
            self.add_worker()
        self.wait_for_workers()

    def begin_scheduler(self, port: str) -> None:
        """Start the scheduler."""
        self.scheduler = self._start("scheduler", "--port", port, *self._options, "--idle-timeout", "120 s")
        self.address = self._said(self.scheduler, r"Scheduler at:\s+(t\w+://\S+)")

    def add_worker(self, *options: str, cwd: Path = REPOSITORY) -> None:
        """Start a worker; w0 is the first."""
        worker = self._start(
            "worker",
            self.address,
            *self._options,
            "--nthreads",
            "1",
            "--no-nanny",
            "--death-timeout",
            "60",
            "--local-directory",
            str(self._folder),
            "--name",
            f"w{len(self.workers)}",
            *options,
            cwd=cwd,
        )
        self.workers.append(worker)

    def wait_for_workers(self) -> None:
        """Wait until all workers have registered."""
        for worker in self.workers:
            self._said(worker, r"(Registered to:)")

    def _start(self, *arguments: str, cwd: Path = REPOSITORY) -> subprocess.Popen:
        log = self._folder / f"{len(self.processes)}.log"
        with log.open("w") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments], stdout=output, stderr=subprocess.STDOUT, cwd=cwd
            )
        process.log = log
        self.processes.append(process)
        return process

    def _said(self, process: subprocess.Popen, pattern: str) -> str:
        """What the process says, waited for."""
        return until(lambda: (m := re.search(pattern, process.log.read_text())) and m[1], 60)

    def holding(self, log: Path) -> subprocess.Popen:
        """The worker whose case is the first to wait in `held_up`; waited for."""
        pid = until(lambda: (m := re.search(r"held (\d+)\n", log.read_text())) and m[1], 20)
        return next(one for one in self.workers if one.pid == int(pid))

    def stop(self) -> None:
        """End all processes that are still there."""
        for process in reversed(self.processes):
            process.send_signal(signal.SIGCONT)
            process.kill()
            process.wait()


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

    def start(folder: Path, workers: int, options: Sequence[str] = ()) -> Cluster:
        folder.mkdir()
        clusters.append(Cluster(folder, workers, options))
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
    found = []
    for result in computed(wanted, held_up, scheduler=cluster.address):
        found.append(result)
        if len(found) == 2:
            until(lambda: log.read_text().count("end") >= 8, 20)  # while a result is looked at
            killed = cluster.holding(log)  # in the midst of a case
            killed.kill()
            killed.wait()
            Path(f"{log}.go").touch()
    keys = [result.key for result in found]
    assert sorted(keys) == sorted({case.key for case in wanted})
    assert not [result.error for result in found if result.error]
    angle = {case.key: case.orientation_deg for case in wanted}
    assert all(result.figures["angle"] == angle[result.key] for result in found)
    lines = [line for line in log.read_text().splitlines() if not line.startswith("held")]
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
    wanted, log = cases(tmp_path, [0, *(10 * i for i in range(9, 20))])
    with closing(computed(wanted, held_up, scheduler=cluster.address)) as results:
        next(results)
        until(lambda: "held" in log.read_text(), 20)  # a worker has a case in hand
    assert log.read_text().count("begin") == 1  # the others are held up still
    Path(f"{log}.go").touch()
    until(lambda: log.read_text().count("end") > 1, 20)  # what a worker had in hand
    time.sleep(4 * SECONDS)
    assert log.read_text().count("begin") <= 3


def test_only_the_loopback_address_is_listened_on(cluster, tmp_path):
    """By the scheduler and the workers with the options of SECURITY.md, and by the command."""
    import psutil

    wanted, _ = cases(tmp_path, [0])
    with closing(computed(wanted, noted, scheduler=cluster.address)) as results:
        assert next(results).error == ""
        listening = {}
        for pid in (os.getpid(), *(one.pid for one in cluster.processes if one.poll() is None)):
            process = psutil.Process(pid)
            listening[pid] = {one.laddr.ip for one in process.net_connections() if one.status == psutil.CONN_LISTEN}
    assert listening.pop(os.getpid()) == set()
    assert len(listening) >= 2 and set(map(frozenset, listening.values())) == {frozenset({"127.0.0.1"})}


@pytest.mark.slow
def test_a_cluster_with_tls_computes_for_those_with_its_certificate_alone(started, tmp_path, monkeypatch):
    """The options and variables that SECURITY.md names."""
    import dask

    certificate, key = tmp_path / "me.pem", tmp_path / "me.key"
    request = "openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=localhost".split()
    subprocess.run([*request, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    options = ["--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key]
    cluster = started(tmp_path / "dask", 1, ["--protocol", "tls", *map(str, options)])
    plain = cluster.address.replace("tls", "tcp")
    wanted, _ = cases(tmp_path, [0, 20])
    try:
        with monkeypatch.context() as patch:
            patch.setenv("DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION", "true")
            patch.setenv("DASK_DISTRIBUTED__COMM__TLS__CA_FILE", str(certificate))
            patch.setenv("DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT", str(certificate))
            patch.setenv("DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY", str(key))
            dask.config.refresh()
            results = list(computed(wanted, noted, scheduler=cluster.address))
            with pytest.raises(DataError, match="refusing communication"):
                list(computed(wanted, noted, scheduler=plain))
    finally:
        dask.config.refresh()
    assert [result.error for result in results] == ["", ""]
    for address in (cluster.address, plain):
        with pytest.raises(DataError, match="no Dask scheduler answers there"):
            list(computed(wanted, noted, scheduler=address))


def test_no_scheduler_is_one_clear_line(tmp_path, monkeypatch):
    monkeypatch.setattr("scenes.cluster.CONNECT_SECONDS", 0.5)
    wanted, _ = cases(tmp_path, [0])
    with pytest.raises(DataError, match=r"--scheduler: no Dask scheduler answers there") as error:
        list(computed(wanted, noted, scheduler="tcp://127.0.0.1:9"))
    assert "\n" not in str(error.value)


NOT_THERE = "raise FileNotFoundError(2, 'No such file or directory', names[0])"


def blind(folder: Path, instead: str = NOT_THERE) -> str:
    """A script for a worker that does not find the weather file, or does something else."""
    script = folder / "blind.py"
    script.write_text(
        "import sys\n"
        "def hide(event, names):\n"
        f"    if event == 'open' and str(names[0]) == {str(WEATHER)!r}:\n"
        f"        {instead}\n"
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
    wanted, log = cases(tmp_path, [0, 20, *range(90, 88 + number)])
    results = []
    for result in computed(wanted, held_up, scheduler=cluster.address):
        results.append(result)
        if len(results) == 2:
            assert cluster.holding(log) is cluster.workers[0]
            cluster.workers[0].kill()
            cluster.add_worker()
            Path(f"{log}.go").touch()
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


@pytest.mark.parametrize(("answer", "error"), [(600.0, ""), (1.0, "has not answered")])
def test_a_worker_that_reads_its_files_slowly_is_waited_for(started, tmp_path, monkeypatch, answer, error):
    """The first import of the program from a cluster's disks takes longer than the start."""
    monkeypatch.setattr("scenes.cluster.WAIT_SECONDS", 0.5)
    monkeypatch.setattr("scenes.cluster.ANSWER_SECONDS", answer)
    cluster = started(tmp_path / "dask", 0)
    cluster.add_worker("--preload", blind(tmp_path, "__import__('time').sleep(4)"))
    cluster.wait_for_workers()
    wanted, _ = cases(tmp_path, [0])
    (result,) = computed(wanted, noted, scheduler=cluster.address)
    assert error in result.error and bool(error) == bool(result.error)


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
    wanted, log = cases(tmp_path, [0, *(10 * i for i in range(9, 18))])
    results, begin = [], time.monotonic()
    for result in computed(wanted, held_up, scheduler=cluster.address):
        results.append(result)
        if len(results) == 1:
            cluster.holding(log).send_signal(signal.SIGSTOP)
            Path(f"{log}.go").touch()
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
