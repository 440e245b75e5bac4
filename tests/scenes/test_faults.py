"""Kill, SIGTERM, full disk, read-only, closed pipe, foreign folder: each command that writes.

What is demanded after each: the exit code, one line, the earlier result whole, nothing of anybody
else touched, nothing temporary left.  The commands write made-up results (`quick_work`); all from
the options to the files is their own.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import pytest

from mitsuba_cfs.files import TEMPORARY
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import fisheye
from scenes import cli
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.result_folder import MARK
from tests.conftest import REPOSITORY, default_signals
from tests.scenes.quick_work import STOP, quick_work
from tests.scenes.study_files import study_file
from tests.thermal.test_study import study_file as thermal_file

PV_STUDY = REPOSITORY / "scenes" / "demo" / "facade_pv.toml"
WRITES_NOTHING = {"doctor", "bsdf check", "bsdf info", "bsdf eval"}
ONE_LINE = 1


@dataclass(frozen=True)
class Job:
    """How a command is called, and what it writes."""

    words: Callable[[Path, Path], list[object]]  # of the folder of inputs and the output
    name: str = "out"  # of the output
    folder: bool = False
    adds: bool = False  # to a folder that may hold anything


def _folder(*words: object, **options) -> Job:
    return Job(lambda _inputs, out: [*words, "--out", out], folder=True, **options)


def _study(inputs: Path, out: Path) -> list[object]:
    return ["study", study_file(inputs, "orientations_deg = [0, 90]\n"), "--out", out]


def _measured(inputs: Path, out: Path) -> list[object]:
    rows = "time,global_horizontal,diffuse_horizontal\n2020-06-21 12:00,500,200\n"
    (inputs / "m.csv").write_text(rows + "2020-06-21 13:00,500,200\n")
    place = ["--latitude", 49, "--longitude", 8, "--timezone", 1]
    return ["sky", "measured", inputs / "m.csv", out, *place]


def _glare(option: str) -> Callable[[Path, Path], list[object]]:
    def words(inputs: Path, out: Path) -> list[object]:
        view = fisheye([0, 0, 1], [0, 1, 0], 64)
        write_hdr(inputs / "desk.hdr", np.full((64, 64), 500.0, np.float32), view)
        return ["glare", option, out, inputs / "desk.hdr"]

    return words


GENERATE = "bsdf generate --depth-mm 80 --spacing-mm 72 --visible 0.5 --out".split()
JOBS = {
    "run": _folder("run", OFFICE, "--weather", WEATHER, "--cfs", VENETIAN_BLIND),
    "demo": _folder("demo"),
    "thermal": Job(
        lambda inputs, out: ["thermal", thermal_file(inputs, ""), "--out", out], folder=True
    ),
    "pv": _folder("pv", OFFICE, "--weather", WEATHER, "--study", PV_STUDY),
    "dgp": _folder("dgp"),
    "study": Job(_study, folder=True),
    "study --write-ifc": Job(
        lambda inputs, out: [
            "study", _study_of_the_office(inputs), "--out", inputs / "results", "--write-ifc", out,
        ], "out.ifc",
    ),
    "ifc check": Job(lambda _, out: ["ifc", "check", OFFICE, "--csv", out], "out.csv"),
    "ifc attach": Job(lambda _, out: ["ifc", "attach", OFFICE, "--all", "--u", 1.1, "-o", out],
                      "out.ifc"),
    "ifc export --radiance": Job(lambda _, out: ["ifc", "export", OFFICE, "--radiance", out],
                                 folder=True, adds=True),
    "ifc export --mitsuba": Job(lambda _, out: ["ifc", "export", OFFICE, "--mitsuba", out],
                                folder=True, adds=True),
    "ifc export --epjson": Job(lambda _, out: ["ifc", "export", OFFICE, "--epjson", out],
                               "out.epJSON"),
    "ifc export --gltf": Job(lambda _, out: ["ifc", "export", OFFICE, "--gltf", out], "out.glb"),
    "ifc survey": Job(lambda _, out: ["ifc", "survey", OFFICE, "--markdown", out], "out.md"),
    "bsdf plot": Job(
        lambda _, out: ["bsdf", "plot", VENETIAN_BLIND, "--incident", 40, 0, "--out", out],
        "out.png",
    ),
    "bsdf generate": Job(lambda _, out: [*GENERATE, out], "out.xml"),
    "bsdf combine": Job(
        lambda _, out: ["bsdf", "combine", VENETIAN_BLIND, VENETIAN_BLIND, "--out", out], "out.xml"
    ),
    "bsdf combine --absorptances": Job(
        lambda inputs, out: [
            "bsdf", "combine", VENETIAN_BLIND, VENETIAN_BLIND, "--out", inputs / "both.xml",
            "--absorptances", out,
        ], "out.csv",
    ),
    "sky matrix": Job(lambda _, out: ["sky", "matrix", WEATHER, out, "-5", "-m", 1], "out.smx"),
    "sky positions": Job(lambda _, out: ["sky", "positions", WEATHER, out], "out.csv"),
    "sky wea": Job(lambda _, out: ["sky", "wea", WEATHER, out], "out.wea"),
    "sky measured": Job(_measured, "out.wea"),
    "sky cie": Job(lambda _, out: ["sky", "cie", "overcast", out], "out.smx"),
    "glare -c": Job(_glare("-c"), "out.hdr"),
    "glare --csv": Job(_glare("--csv"), "out.csv"),
    "glare --png": Job(_glare("--png"), folder=True, adds=True),
    **{
        f"picture {kind}": Job(
            lambda _, out: ["picture", "--at", "06-21 12:00", "--out", out], f"out.{kind}"
        )
        for kind in ("hdr", "exr", "png")
    },
    "calibrate": Job(lambda _, out: ["calibrate", "--out", out], "out.json"),
    "bench": Job(lambda _, out: ["bench", "--json", out], "out.json"),
}  # fmt: skip
FOLDERS = [name for name, job in JOBS.items() if job.folder]
OWN = [name for name in FOLDERS if not JOBS[name].adds]
FILES = [name for name, job in JOBS.items() if not job.folder]
SHOWN = ("thermal", "sky wea")  # of those that need a process of their own, the rest slow
PROCESSES = [pytest.param(n, marks=() if n in SHOWN else pytest.mark.slow) for n in JOBS]
PIPES = [pytest.param(n, marks=() if n == "sky wea" else pytest.mark.slow) for n in JOBS]


def _study_of_the_office(inputs: Path) -> Path:
    path = study_file(inputs)
    text = path.read_text()
    start, end = text.index("[[room]]"), text.index("[[system]]")
    path.write_text(text[:start] + f'[[room]]\nbuilding = "{OFFICE}"\n' + text[end:])
    return path


def test_every_command_that_writes_is_in_the_list() -> None:
    context = click.Context(cli.cfs)
    leaves = set()
    for name in cli.COMMANDS:
        command = cli.cfs.get_command(context, name)
        inner = getattr(command, "commands", None)
        leaves |= {name} if inner is None else {f"{name} {one}" for one in inner}
    listed = {next((leaf for leaf in leaves if f"{job} ".startswith(f"{leaf} ")), job)
              for job in JOBS}  # fmt: skip
    assert listed | WRITES_NOTHING == leaves


@dataclass
class Place:
    """A folder of inputs, and the output of one command in another folder."""

    job: Job
    inputs: Path
    out: Path

    @property
    def words(self) -> list[str]:
        """What follows `cfs`."""
        return [str(word) for word in self.job.words(self.inputs, self.out)]

    def content(self) -> dict[str, bytes]:
        """Every file beside and in the output, but for what a study or a year keeps on the way."""
        root = self.out.parent
        found = {p.relative_to(root).as_posix(): p for p in root.rglob("*") if p.is_file()}
        return {
            name: path.read_bytes()
            for name, path in found.items()
            if not {"cases", "ratings", "filler"} & set(name.split("/"))
        }

    def temporaries(self) -> list[Path]:
        """What is left of unfinished work."""
        roots = (self.out.parent, self.inputs)
        return [p for root in roots for p in root.rglob("*") if TEMPORARY.fullmatch(p.name)]


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """No file of the user's is touched."""
    monkeypatch.setenv("CFS_CACHE", str(tmp_path_factory.mktemp("cache")))


@pytest.fixture
def place(tmp_path, monkeypatch) -> Callable[[str], Place]:
    """The place of a job, whose command works quickly in this process."""
    quick_work(monkeypatch.setattr)

    def of(name: str, root: Path = tmp_path) -> Place:
        for folder in ("inputs", "results"):
            (tmp_path / folder).mkdir(exist_ok=True)
        (root / "results").mkdir(exist_ok=True)
        return Place(JOBS[name], tmp_path / "inputs", root / "results" / JOBS[name].name)

    return of


def refused(place: Place, capsys, *words: str, code: int = 1) -> str:
    """The one line of a command that fails."""
    capsys.readouterr()
    assert cli.run(place.words) == code
    told = capsys.readouterr().err
    lines = [line for line in told.splitlines() if line.startswith(("error", "cfs"))]
    assert len(lines) == ONE_LINE and "Traceback" not in told, told
    assert all(word in lines[0] for word in words), lines
    assert not place.temporaries()
    return lines[0]


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A disk of a few megabytes; only root may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64m", "none", str(disk)],
        capture_output=True, check=False,
    )  # fmt: skip
    if mounted.returncode:
        pytest.skip("no disk can be mounted here")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=False)


def fill(disk: Path) -> None:
    """Leave no free block."""
    with open(disk / "filler", "wb", buffering=0) as file:
        for size in (2**16, 2**10, 1):
            try:
                while True:
                    file.write(bytes(size))
            except OSError:
                pass


@pytest.mark.parametrize("name", JOBS)
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


@pytest.mark.parametrize("name", [name for name in JOBS if name != "ifc survey"])  # other process
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


@pytest.mark.parametrize("name", JOBS)
def test_a_read_only_disk_is_found_before_the_work(name, place, small_disk, capsys, monkeypatch):
    here = place(name, small_disk)
    assert cli.run(here.words) == 0
    before = here.content()
    words = here.words
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    here.job = Job(lambda *_: words, folder=here.job.folder)
    begun = []
    for module in ("scenes.run.run.run_job", "scenes.heat.study.run_study",
                   "scenes.study.study.run_study", "scenes.year_of_glare.year.read_year",
                   "scenes.calibration.measure.calibrated"):  # fmt: skip
        monkeypatch.setattr(module, lambda *_a, **_k: begun.append(1))
    try:
        refused(here, capsys, "read-only")
    finally:
        subprocess.run(["mount", "-o", "remount,rw", str(small_disk)], check=True)
    assert not begun and here.content() == before


@pytest.mark.parametrize("name", OWN)
def test_a_folder_is_ours_by_its_mark_alone(name, place, capsys):
    """A `run.json` of somebody else's, and a mark that another program wrote."""
    here = place(name)
    here.out.mkdir()
    (here.out / "thesis.docx").write_text("mine")
    (here.out / "run.json").write_text('{"inputs": {}, "options": {}}')
    before = here.content()
    refused(here, capsys, "--out", "holds other files")
    assert here.content() == before
    for wrong in ("{", "[]", '{"program": "other"}', '{"program": "mitsuba-cfs", "format": 99}'):
        (here.out / MARK).write_text(wrong)
        refused(here, capsys, "--out", "holds other files")
    assert (here.out / "thesis.docx").read_text() == "mine"


@pytest.mark.parametrize("name", FOLDERS)
def test_files_of_others_in_a_folder_of_ours_stay(name, place, capsys):
    here = place(name)
    assert cli.run(here.words) == 0
    ours = json.loads((here.out / MARK).read_text())["files"]
    assert ours and all((here.out / one).is_file() for one in ours)
    before = set(here.content())
    (here.out / "notes").mkdir()
    (here.out / "notes" / "thesis.docx").write_text("mine")
    assert cli.run(here.words) == 0
    assert set(here.content()) == before | {"out/notes/thesis.docx"}
    # a file of another's with the name of a result, known by the mark
    taken = sorted(ours)[0]
    record = json.loads((here.out / MARK).read_text())
    record["files"].remove(taken)
    (here.out / MARK).write_text(json.dumps(record))
    (here.out / taken).write_text("mine")
    refused(here, capsys, taken, "no earlier run wrote", "results-1")
    assert (here.out / taken).read_text() == "mine"
    assert (here.out / "results-1" / taken).is_file()


@pytest.mark.parametrize("name", OWN)
def test_the_current_folder_and_that_of_an_input_are_refused(name, place, capsys, monkeypatch):
    here = place(name)
    monkeypatch.chdir(here.out.parent)
    for out in (Path("."), here.out.parent.parent, here.out.parent):
        refused(Place(here.job, here.inputs, out), capsys, "the current folder")
    if name in ("study", "thermal"):
        refused(Place(here.job, here.inputs, here.inputs), capsys, "is or contains the input")
    assert not list(here.out.parent.iterdir())


def test_the_folder_of_an_input_is_refused(place, capsys, tmp_path):
    building = tmp_path / "model" / "office.ifc"
    building.parent.mkdir()
    shutil.copy(OFFICE, building)
    for name, *more in (["run"], ["dgp"], ["pv", "--study", PV_STUDY]):
        here = place("run")
        here.job = _folder(name, building, "--weather", WEATHER, *more)
        for out in (building.parent, tmp_path / "model" / ".." / "model"):
            refused(Place(here.job, here.inputs, out), capsys, "--out", str(building))
    assert building.read_bytes() == OFFICE.read_bytes()


@pytest.mark.parametrize("name", OWN)
def test_another_commands_results_are_refused(name, place, capsys):
    here = place(name)
    here.out.mkdir()
    record = {"program": "mitsuba-cfs", "format": 1, "command": "other", "files": []}
    (here.out / MARK).write_text(json.dumps(record | {"removed": []}))
    refused(here, capsys, "holds results of `cfs other`")


@pytest.mark.parametrize("name", FOLDERS)
def test_a_link_to_a_folder_is_followed(name, place, tmp_path):
    here = place(name)
    (tmp_path / "elsewhere").mkdir()
    here.out.symlink_to(tmp_path / "elsewhere")
    for _ in range(2):
        assert cli.run(here.words) == 0
    assert here.out.is_symlink() and (tmp_path / "elsewhere" / MARK).is_file()


@pytest.mark.parametrize("name", FILES)
def test_a_link_to_a_file_is_followed(name, place, tmp_path):
    here = place(name)
    real = tmp_path / f"real{here.out.suffix}"
    here.out.symlink_to(real)
    assert cli.run(here.words) == 0
    assert here.out.is_symlink() and real.stat().st_size > 0


@pytest.mark.parametrize("name", [name for name in JOBS if name != "glare -c"])
def test_a_file_for_a_folder_and_a_folder_for_a_file_are_refused(name, place, capsys):
    here = place(name)
    if here.job.folder:
        here.out.write_text("mine")
    else:
        here.out.mkdir()
    try:
        refused(here, capsys, "is a f")  # file, folder
    except AssertionError:  # click's own way to say it
        refused(here, capsys, "is a", str(here.out), code=cli.USAGE)
    assert here.out.is_dir() or here.out.read_text() == "mine"


@pytest.mark.parametrize(
    "words",
    [
        ["ifc", "check", "office.ifc", "--csv", "office.ifc"],
        ["ifc", "export", "office.ifc", "--epjson", "office.ifc"],
        ["ifc", "export", "office.ifc", "--gltf", "office.ifc"],
        ["ifc", "survey", "office.ifc", "--markdown", "office.ifc"],
        ["sky", "wea", "weather.epw", "weather.epw"],
        ["sky", "matrix", "weather.epw", "weather.epw"],
        ["sky", "positions", "weather.epw", "weather.epw"],
        ["bsdf", "combine", "blind.xml", "blind.xml", "--out", "blind.xml"],
    ],
)
def test_an_input_is_no_output(words, tmp_path, monkeypatch, capsys):
    for source, name in ((OFFICE, "office.ifc"), (WEATHER, "weather.epw"),
                         (VENETIAN_BLIND, "blind.xml")):  # fmt: skip
        shutil.copy(source, tmp_path / name)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    assert cli.run(words) == 1
    assert "is an input of this command" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_second_year_of_glare_leaves_no_picture_of_the_first(place):
    here = place("dgp")
    assert cli.run(here.words) == 0
    first = set(here.content())
    assert cli.run([*here.words, "--seed", "1"]) == 0
    second = set(here.content())
    assert len([name for name in second if name.endswith("_sources.png")]) == 1
    assert first != second and len(first) == len(second)
    assert list((here.out / "ratings").iterdir()), "what lets a run go on stays"


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
        cwd=REPOSITORY, text=True, stderr=subprocess.PIPE,
        preexec_fn=default_signals,
        **({"stdout": subprocess.PIPE} | options),
    )  # fmt: skip


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


@pytest.mark.parametrize("name", PROCESSES)
def test_a_signal_leaves_the_earlier_result_and_nothing_else(name, place, tmp_path):
    here = place(name)
    assert cli.run(here.words) == 0
    before = here.content()
    for number, code, word in (
        (signal.SIGTERM, 143, "terminated"),
        (signal.SIGHUP, 129, "terminated"),
        (signal.SIGINT, 130, "interrupted"),
    ):
        found, told = stopped(here, number, tmp_path / "stopped")
        assert found == code and told.splitlines()[-1] == word, told
        assert "Traceback" not in told and not here.temporaries()
        assert here.content() == before
    found, _ = stopped(here, signal.SIGKILL, tmp_path / "stopped")
    assert found == -signal.SIGKILL and here.temporaries()
    whole = {n: c for n, c in here.content().items() if not TEMPORARY.search(n)}
    assert whole == before
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
            ["bash", "-c", f'"$@" {closed}', "-", *command],
            cwd=REPOSITORY, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert process.returncode == 0, process.stderr
        assert "NoneType" not in process.stderr and "Traceback" not in process.stderr
        assert not here.temporaries()
