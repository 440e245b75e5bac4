"""Kill, SIGTERM, full disk, read-only, closed pipe: each command that writes.

What is demanded after each: the exit code, one line, the earlier result whole, nothing temporary
left.  The commands write made-up results (`quick_work`); all from the options to the files is their
own.  Folders that hold anything else: `test_folders_of_results`.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import click
import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import TEMPORARY, scratch_folder
from mitsuba_cfs.progress import silent
from scenes import cli
from scenes.result_folder import MARK
from scenes.study.store import CaseResult
from scenes.study.study import run_study
from scenes.study.study_file import read_study
from tests.conftest import REPOSITORY, default_signals, fill
from tests.scenes.quick_work import STOP
from tests.scenes.study_files import study_file
from tests.scenes.writing_jobs import JOBS, Job, Place, heavy_ones_slow, refused

pytestmark = pytest.mark.early

WRITES_NOTHING = {"doctor", "bsdf check", "bsdf info", "bsdf eval", "ifc query"}
SERVES = {"app"}  # until Ctrl-C: its files are those of tests/app, of the commands that it runs
EARLIER_NAMES = {"ifc check", "ifc export"}  # of `check` and `export`
# Inputs; and a list that no command replaces
NOT_TRIED = {"--geometry", "--product", "--fabrics", "--spectrum", "--fix"}
SHOWN = ("thermal", "sky wea")  # of those that need a process of their own, the rest slow
PROCESSES = [pytest.param(n, marks=() if n in SHOWN else pytest.mark.slow) for n in JOBS]
PIPES = [pytest.param(n, marks=() if n == "sky wea" else pytest.mark.slow) for n in JOBS]


def commands() -> dict[str, click.Command]:
    """Every command by the words that call it."""
    context, leaves = click.Context(cli.cfs), {}
    for name in cli.COMMANDS:
        command = cli.cfs.get_command(context, name)
        inner = getattr(command, "commands", None)
        leaves |= {name: command} if inner is None else {f"{name} {key}": one for key, one in inner.items()}
    return leaves


def test_every_command_that_writes_is_in_the_list() -> None:
    leaves = commands().keys()
    listed = {next((leaf for leaf in leaves if f"{job} ".startswith(f"{leaf} ")), job) for job in JOBS}
    assert listed | WRITES_NOTHING | SERVES | EARLIER_NAMES == leaves


def test_every_option_that_names_an_output_is_in_the_list(tmp_path) -> None:
    words = [" ".join(Place(job, tmp_path, tmp_path / job.name).words) for job in JOBS.values()]
    for name, command in commands().items():
        for option in command.params:
            path = isinstance(option, click.Option) and isinstance(option.type, click.Path) and not option.type.exists
            if path and not NOT_TRIED & {*option.opts} and name not in EARLIER_NAMES:
                called = [one.split() for one in words if one.startswith(f"{name} ")]
                assert any({*option.opts} & {*one} for one in called), f"{name} {option.opts}"


@pytest.mark.parametrize("name", heavy_ones_slow(JOBS))
def test_a_full_disk_is_one_line_and_keeps_the_earlier_result(name, place, small_disk, capsys):
    here = place(name, small_disk)
    assert cli.run(here.words) == 0
    before = here.content()
    assert before
    fill(small_disk)
    line = refused(here, capsys, "the disk is full", str(here.out))
    assert ".part" not in line
    assert here.content() == before
    (small_disk / "filler").unlink()
    assert cli.run(here.words) == 0
    assert here.content().keys() == before.keys()


@pytest.mark.parametrize("name", heavy_ones_slow(n for n in JOBS if n != "ifc survey"))
def test_a_file_over_the_limit_is_one_line(name, place, capsys):
    """As a full disk, without root: no file of this process may be larger than 16 bytes."""
    here = place(name)
    words = here.words
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, hard))
    try:
        code = cli.run(words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, old)
    told = capsys.readouterr().err
    errors = [line for line in told.splitlines() if line.startswith("error")]
    assert code == 1 and len(errors) == 1 and "larger than allowed" in errors[0], told
    assert "Traceback" not in told and not here.temporaries()
    kept = {MARK} if here.job.folder else set()
    assert {Path(one).name for one in here.content()} <= kept


@pytest.mark.parametrize("name", heavy_ones_slow(JOBS))
def test_a_read_only_disk_is_found_before_the_work(name, place, small_disk, capsys, monkeypatch):
    here = place(name, small_disk)
    assert cli.run(here.words) == 0
    before = here.content()
    words = here.words
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    here.job = Job(lambda *_: words, folder=here.job.folder)
    begun = []
    for module in (
        "scenes.run.run.run_job",
        "scenes.heat.study.run_study",
        "scenes.study.study.run_study",
        "scenes.year_of_glare.year.read_year",
        "scenes.calibration.measure.calibrated",
    ):
        monkeypatch.setattr(module, lambda *_a, **_k: begun.append(1))
    try:
        refused(here, capsys, "read-only")
    finally:
        subprocess.run(["mount", "-o", "remount,rw", str(small_disk)], check=True)
    assert not begun and here.content() == before


def test_a_cache_that_is_a_file_is_found_before_the_work(place, capsys, monkeypatch, tmp_path):
    (tmp_path / "cache").write_text("mine")
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "cache"))
    for name in ("run", "demo", "pv", "study"):
        here = place(name)
        refused(here, capsys, "CFS_CACHE", "is a file")
        assert not here.out.exists()


def start(place: Place, **options) -> subprocess.Popen:
    """`cfs` with quick work in a process of its own, its signals as they are at first."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.scenes.quick_work", *place.words],
        cwd=REPOSITORY,
        text=True,
        stderr=subprocess.PIPE,
        preexec_fn=default_signals,
        **({"stdout": subprocess.PIPE} | options),
    )


def stopped(place: Place, number: int, announce: Path) -> tuple[int, str]:
    """Exit code and stderr of `cfs` that gets a signal as its result is about to be there."""
    announce.unlink(missing_ok=True)
    process = start(place, env={**os.environ, STOP: str(announce)})
    end = time.monotonic() + 120
    while not announce.exists():
        assert process.poll() is None and time.monotonic() < end, process.communicate()
        time.sleep(0.01)
    process.send_signal(number)
    _, told = process.communicate(timeout=60)
    return process.returncode, told


TIMED = ("ifc survey", "check --bcf")  # two runs differ: files hold seconds or dates


@pytest.mark.parametrize("name", PROCESSES)
def test_a_signal_leaves_the_earlier_result_and_nothing_else(name, place, tmp_path):
    here = place(name)
    start(here).communicate(timeout=120)  # of its own: headers hold the command line
    before, same = here.content(), name not in TIMED
    assert before
    for number, code, word in (
        (signal.SIGTERM, 143, "terminated"),
        (signal.SIGHUP, 129, "terminated"),
        (signal.SIGINT, 130, "interrupted"),
    ):
        found, told = stopped(here, number, tmp_path / "stopped")
        assert found == code and told.splitlines()[-1] == word, told
        assert "Traceback" not in told and not here.temporaries()
        after = here.content()  # a single file is the earlier or the new one
        assert after == before if same else after.keys() == before.keys()
    found, _ = stopped(here, signal.SIGKILL, tmp_path / "stopped")
    assert found == -signal.SIGKILL and here.temporaries()
    whole = {n: c for n, c in here.content().items() if not TEMPORARY.search(n)}
    assert whole == (before if same else after)
    assert cli.run(here.words) == 0
    assert here.content().keys() == before.keys() and not here.temporaries()


@pytest.mark.parametrize("name", PIPES)
def test_closed_pipes_do_not_stop_the_work(name, place):
    """`cfs ... >&-`, `2>&-`, and a reader that has gone, as of `cfs ... | head -1`."""
    here = place(name)
    read, write = os.pipe()
    os.close(read)
    for stdout in (subprocess.PIPE, write):
        process = start(here, stdout=stdout)
        if stdout is subprocess.PIPE:
            process.stdout.close()
        _, told = process.communicate(timeout=120)
        assert process.returncode == 0, told
        assert "Traceback" not in told and "Exception ignored" not in told, told
        assert here.content() and not here.temporaries()
    os.close(write)
    command = [sys.executable, "-m", "tests.scenes.quick_work", *here.words]
    for closed in (">&-", "2>&-", ">&- 2>&- <&-"):
        process = subprocess.run(
            ["bash", "-c", f'"$@" {closed}', "-", *command], cwd=REPOSITORY, capture_output=True, text=True, check=False
        )
        assert process.returncode == 0, process.stderr
        assert "NoneType" not in process.stderr and "Traceback" not in process.stderr
        assert not here.temporaries()


def test_standard_output_on_a_full_disk_is_one_line():
    with open("/dev/full", "w") as full:
        process = subprocess.run(
            [sys.executable, "-m", "scenes.cli", "--help"],
            cwd=REPOSITORY,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert process.returncode == 1
    assert process.stderr.splitlines() == ["error: standard output: the disk is full"]


@pytest.mark.parametrize("name", ["thermal", pytest.param("study", marks=pytest.mark.slow)])
def test_the_second_of_two_runs_into_a_folder_is_refused_before_its_work(name, place, tmp_path, capsys, monkeypatch):
    here, announce = place(name), tmp_path / "stopped"
    process = start(here, env={**os.environ, STOP: str(announce)})
    end = time.monotonic() + 120
    while not announce.exists():
        assert process.poll() is None and time.monotonic() < end, process.communicate()
        time.sleep(0.01)
    module = {"thermal": "scenes.heat.study.run_study", "study": "scenes.study.study.run_study"}
    begun = []
    with monkeypatch.context() as patch:
        patch.setattr(module[name], lambda *_a, **_k: begun.append(1))
        capsys.readouterr()
        assert cli.run(here.words) == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.endswith("another run of cfs is writing there: wait for it, or name another folder")
    assert f"{here.out}: --out" in line and not begun
    process.kill()
    process.communicate()
    assert cli.run(here.words) == 0 and not here.temporaries()


def test_a_kill_leaves_no_folder_that_the_next_run_does_not_remove(tmp_path, monkeypatch):
    """kill -9 of a process with a folder in TMPDIR; one that is in use stays."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    program = (
        "import time\n"
        "from mitsuba_cfs.files import scratch_folder, taken\n"
        "release = taken('anywhere')\n"
        "with scratch_folder() as folder:\n"
        "    (folder / 'large').touch()\n"
        "    print(folder, flush=True)\n"
        "    time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        text=True,
        stdout=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    folder = Path(process.stdout.readline().strip())
    assert folder.parent == tmp_path and folder.stat().st_mode & 0o077 == 0
    with scratch_folder():
        assert len(list(tmp_path.iterdir())) == 3
    process.kill()
    process.communicate()
    with scratch_folder() as mine:
        assert list(tmp_path.iterdir()) == [mine]
    assert not list(tmp_path.iterdir())


def test_a_disk_that_fills_up_under_a_study_loses_no_finished_case(small_disk, tmp_path):
    study = read_study(study_file(tmp_path, "orientations_deg = [0, 10, 20, 30]\n"))
    out = small_disk / "results"

    def with_arrays(case, *, progress=silent):
        values = np.random.default_rng(int(case.orientation_deg)).random(10_000)
        return CaseResult(case.key, {"angle": case.orientation_deg}, {"values": values})

    def fill_after_two(case, result, ready, total):
        if ready == 2:
            fill(small_disk)

    with pytest.raises(DataError, match=r"results/cases/.*cannot be written: the disk is full"):
        run_study(study, out, compute=with_arrays, on_case=fill_after_two)
    assert len(list((out / "cases").glob("*.npz"))) == 2
    assert not [one for one in out.rglob("*") if TEMPORARY.fullmatch(one.name)]
    (small_disk / "filler").unlink()
    result = run_study(study, out, compute=with_arrays)
    assert result.reused == 2 and not result.failed
