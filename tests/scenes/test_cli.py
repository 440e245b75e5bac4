"""The console command's contract: one line and an exit code for every mistake of the user's."""

from __future__ import annotations

import logging
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import click
import pydantic
import pytest
import trimesh

from bim.surroundings.placement import read_surroundings
from mitsuba_cfs.errors import DataError, VariantError
from scenes import cli
from scenes.commands.progress_bar import ProgressBar
from tests.conftest import REPOSITORY, default_signals
from thermal.errors import ThermalInputError


class _Options(pydantic.BaseModel):
    views: int
    seed: int


def _cfs(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from scenes.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
        timeout=180,
    )


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], object]], int]:
    """Run `cfs fail`, whose command calls the given function; gives the exit code."""

    def run(action: Callable[[], object]) -> int:
        monkeypatch.setattr(cli.LazyGroup, "list_commands", lambda *_: ["fail"])
        monkeypatch.setattr(cli.LazyGroup, "get_command", lambda *_: click.Command("fail", callback=action))
        return cli.run(["fail"])

    return run


def _raise(error: BaseException) -> Callable[[], object]:
    def action() -> None:
        raise error

    return action


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (
            DataError("expected 145 values, got 144", file="blind.xml", element="Wavelength 2"),
            "error: blind.xml: Wavelength 2: expected 145 values, got 144",
        ),
        (VariantError("no LLVM"), "error: no LLVM"),
        (ThermalInputError("zone A", "volume\nis negative"), "error: zone A: volume is negative"),
        (FileNotFoundError(2, "No such file", "a.ifc"), "error: a.ifc: No such file"),
        (PermissionError(13, "Permission denied", "out"), "error: out: Permission denied"),
        (click.ClickException("bad"), "error: bad"),
        (MemoryError(), "error: out of memory"),
    ],
)
def test_a_users_mistake_is_one_line(failing, capsys, error: Exception, line: str) -> None:
    assert failing(_raise(error)) == 1
    captured = capsys.readouterr()
    assert captured.err == line + "\n"
    assert captured.out == ""


def test_a_bad_study_file_names_its_field(failing, capsys) -> None:
    code = failing(lambda: _Options.model_validate({"views": "many"}))
    assert code == 1
    line = capsys.readouterr().err
    assert line.startswith("error: views: ")
    assert line.endswith("(and 1 more)\n")
    assert len(line.splitlines()) == 1


@pytest.mark.parametrize("error", [KeyboardInterrupt(), click.Abort()])
def test_interruption_is_exit_130(failing, capsys, error: BaseException) -> None:
    assert failing(_raise(error)) == 130
    assert capsys.readouterr().err.strip() == "interrupted"


def test_a_fault_of_the_program_keeps_its_traceback(failing) -> None:
    with pytest.raises(ZeroDivisionError):
        failing(lambda: 1 / 0)


def test_debugging_adds_the_traceback_of_a_users_mistake(failing, monkeypatch, capsys) -> None:
    monkeypatch.setenv("CFS_DEBUG", "1")
    assert failing(_raise(DataError("bad"))) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("Traceback") and lines[-1] == "error: bad"
    assert failing(_raise(click.UsageError("bad"))) == 2


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("doktor",), "cfs: No such command 'doktor'"),
        (("run", "a.ifc", "--cfs", "a.xml", "--cfs", "b.xml"), "cfs run: --cfs is given 2 times and takes one value."),
        (("bsdf", "plot", "a.xml", "--out", "a.png", "--out", "b.png"), "cfs bsdf plot: --out is given 2 times"),
        (("doctor", "--loud"), "cfs doctor: No such option"),
        (("doctor", "now"), "cfs doctor: Got unexpected extra argument"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_2(arguments: tuple[str, ...], line: str) -> None:
    done = _cfs(*arguments)
    assert done.returncode == 2
    assert done.stderr.startswith(line)
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""


def test_help_lists_every_command_that_there_is() -> None:
    done = _cfs("--help")
    assert done.returncode == 0
    for name in cli.COMMANDS:
        assert any(line.split()[:1] == [name] for line in done.stdout.splitlines()), name


def test_help_needs_no_heavy_imports() -> None:
    code = (
        "import sys\n"
        "from scenes import cli\n"
        "cli.run(['--help'])\n"
        "heavy = {'numpy', 'pandas', 'mitsuba', 'drjit', 'ifcopenshell', 'rich', 'pydantic'}\n"
        "sys.exit(', '.join(heavy & set(sys.modules)) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_threads_of_blas_do_not_wait_busily() -> None:
    """OpenBLAS is told before NumPy is loaded, and what the user says of it stays."""
    program = "import os, sys; from scenes import cli; print('numpy' in sys.modules); " + (
        "import atexit; atexit.register(lambda: print(os.environ['OPENBLAS_THREAD_TIMEOUT'])); cli.main(['--version'])"
    )
    for given, expected in (({}, "4"), ({"OPENBLAS_THREAD_TIMEOUT": "9"}, "9")):
        environment = {k: v for k, v in os.environ.items() if k not in cli.BLAS_WAIT} | given
        done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
        said = done.stdout.split()
        assert (said[0], said[-1]) == ("False", expected)


def test_every_command_listed_can_be_loaded() -> None:
    context = click.Context(cli.cfs)
    for name in cli.cfs.list_commands(context):
        assert isinstance(cli.cfs.get_command(context, name), click.Command), name


def test_version() -> None:
    assert _cfs("--version").stdout.startswith("cfs ")


def test_interrupt_from_the_keyboard_ends_quietly() -> None:
    code = (
        "import time, click\n"
        "from scenes import cli\n"
        "def wait():\n"
        "    click.echo('ready')\n"
        "    time.sleep(60)\n"
        "cli.LazyGroup.get_command = lambda *_: click.Command('wait', callback=wait)\n"
        "cli.main(['wait'])\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-u", "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=default_signals,
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors.strip() == "interrupted"


def test_progress_without_a_terminal_is_one_line_a_stage(capsys) -> None:
    with ProgressBar(terminal=False) as progress:
        for stage in ("reading", "tracing"):
            for fraction in (0.0, 0.5, 1.0):
                progress(stage, fraction)
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["reading", "tracing"]


def test_progress_of_a_stage_that_failed_is_not_reported_as_done(capsys) -> None:
    with pytest.raises(DataError), ProgressBar(terminal=False) as progress:
        progress("reading", 0.5)
        raise DataError("bad")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("name", [*cli.FOREIGN, cli.FILES, "__del__"])
@pytest.mark.parametrize(
    ("number", "raised"),
    [(signal.SIGTERM, cli.Terminated), (signal.SIGHUP, cli.Terminated), (signal.SIGINT, KeyboardInterrupt)],
)
def test_no_signal_ends_a_call_of_a_library(name, number, raised):
    """IfcOpenShell answers an exception in its calls with `SystemError`, Python's `__del__` with
    a printed traceback: the signal comes once they have returned."""
    function = "__del__" if name == "__del__" else "call"
    module = name if name == cli.FILES else f"{name}.fake"
    space = {"__name__": module, "signal": signal, "ended": []}
    exec(f"def {function}(n):\n    signal.raise_signal(n)\n    ended.append(n)\n", space)
    before = signal.signal(number, cli.Stop())
    try:
        with pytest.raises(raised):
            space[function](number)
            assert space["ended"] == [number]
            time.sleep(5)
    finally:
        signal.signal(number, before)
    assert space["ended"] == [number]


def test_no_signal_ends_the_body_of_a_traced_loop(variant):
    """Dr.Jit answers an exception in it with a `RuntimeError`: the signal comes after the loop."""
    import drjit as dr
    import mitsuba as mi

    ended = []

    def body(number):
        signal.raise_signal(signal.SIGTERM)
        ended.append(number)
        return (number + 1,)

    before = signal.signal(signal.SIGTERM, cli.Stop())
    try:
        with pytest.raises(cli.Terminated):
            dr.while_loop((mi.UInt(0),), lambda number: number < 5, body)
            assert ended
            time.sleep(5)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert ended


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="Linux")
def test_a_signal_is_held_back_without_a_thread():
    before, threads = signal.signal(signal.SIGTERM, cli.Stop()), threading.active_count()
    space = {"__name__": "trimesh.fake", "signal": signal}
    exec("def call():\n    signal.raise_signal(signal.SIGTERM)\n", space)
    try:
        with pytest.raises(cli.Terminated):
            space["call"]()
            assert threading.active_count() == threads
            time.sleep(5)
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGINT", 130)])
def test_a_signal_while_an_error_is_printed_has_its_exit_code(name, code):
    program = (
        "import signal\n"
        "from scenes import cli\n"
        f"cli._user_line = lambda error: signal.raise_signal(signal.{name})\n"
        "cli.main(['glare', 'nowhere.hdr'])\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=default_signals,
    )
    assert process.returncode == code and "Traceback" not in process.stderr
    assert process.stderr.splitlines()[-1] == ("interrupted" if code == 130 else "terminated")


def test_a_second_signal_does_not_end_the_cleaning_up():
    """Nor the exit: Python has its own handlers by then."""
    program = (
        "import signal, time\n"
        "from scenes import cli\n"
        "def work(arguments):\n"
        "    try:\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "        time.sleep(5)\n"
        "    except KeyboardInterrupt:\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "        print('cleaned up', flush=True)\n"
        "        return 130\n"
        "class Late:\n"
        "    def __del__(self):\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "late = Late()\n"
        "cli.run = work\n"
        "cli.main([])\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=default_signals,
    )
    assert (process.returncode, process.stdout, process.stderr) == (130, "cleaned up\n", "")


def test_a_librarys_warning_is_its_message_alone(tmp_path, capsys):
    """A library may log a failure with its traceback, as trimesh does for a damaged STL file."""
    mesh = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type="stl_ascii")
    file = tmp_path / "m.stl"
    file.write_text(re.sub("facet normal [^ ]*", "facet normal x", mesh, count=1))
    before = logging.getLogger().handlers[:]
    try:
        assert cli.run(["sky", "cie", "overcast", str(tmp_path / "a.smx")]) == 0  # logs as every command does
        capsys.readouterr()
        assert read_surroundings(file).objects
        assert capsys.readouterr().err == ""
        try:
            raise ValueError("inner")
        except ValueError:
            logging.getLogger("a_library").warning("cannot do this", exc_info=True)
        assert capsys.readouterr().err == "warning: cannot do this\n"
    finally:
        logging.getLogger().handlers[:] = before
