"""The console command `cfs`: its subcommands, loaded when called, and its errors, one line each."""

from __future__ import annotations

import errno
import io
import logging
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from importlib import import_module, metadata
from types import FrameType

import click

from scenes.commands.examples import CommandGroup, with_examples


class _Stream(io.FileIO):
    """A standard stream that says nothing more once nobody reads it or nothing more fits."""

    def __init__(self, handle: int, name: str) -> None:
        super().__init__(handle, "w", closefd=False)
        self._told = name

    def write(self, data) -> int:  # type: ignore[override]
        """Write; `OSError` names the stream, but where its reader has gone the work goes on."""
        try:
            return super().write(data)
        except OSError as error:
            if error.errno == errno.EAGAIN:
                raise
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            if error.errno == errno.EPIPE:
                return len(memoryview(data).cast("B"))
            raise OSError(error.errno, error.strerror, self._told) from None


def open_streams() -> None:
    """Give the program its three standard streams, whatever the shell left of them.

    A closed one becomes the null device: else the next file that is opened takes its number.
    """
    for handle in range(3):
        try:
            os.fstat(handle)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
    for handle, name, told in ((1, "stdout", "standard output"), (2, "stderr", "standard error")):
        old = getattr(sys, name)
        text = io.TextIOWrapper(
            io.BufferedWriter(_Stream(handle, told)),
            encoding=getattr(old, "encoding", None) or "utf-8",
            errors=getattr(old, "errors", None) or "backslashreplace",
            line_buffering=handle == 2 or getattr(old, "line_buffering", False),
            write_through=getattr(old, "write_through", False),
        )
        setattr(sys, name, text)


# name: help in one line. The module scenes.commands.<name> defines `command`.
COMMANDS = {
    "app": "Open a project in a browser: files, rooms, systems, results, without a shell.",
    "run": "Compute daylight, glare, heat and comfort of the rooms of a building.",
    "comply": "Check rooms against EN 17037, LM-83, LEED, BREEAM; write a printable dossier.",
    "demo": "Compare an office with its blind up, down and controlled.",
    "explore": "Show any hour of a run in a browser: pictures, plans, temperatures.",
    "doctor": "Print versions and the Mitsuba variant, and run a self-test.",
    "check": "List rooms, windows and problems of a building model.",
    "export": "Write rooms for Radiance, Mitsuba, EnergyPlus, Honeybee, gbXML or glTF viewers.",
    "ifc": "Attach data to IFC files, query and survey them.",
    "bsdf": "Read, check, plot and make BSDF files.",
    "sky": "Write sun positions and sky matrices of a weather file.",
    "glare": "Compute glare indices of fisheye luminance pictures, as evalglare does.",
    "picture": "Render a luminance picture of a room for one hour.",
    "dgp": "Compute the glare of views in a room for every hour of the year.",
    "thermal": "Compute hourly gains, temperatures, loads and comfort of rooms (heat only).",
    "study": "Compare rooms, systems, orientations and climates of a study file.",
    "design": "Search the best system, sizes and rule of control for a room.",
    "site": "Compute daylight and sun that neighbours lose, and sun that glass reflects.",
    "fit": "Fit inputs of a model to measured light or temperatures.",
    "pv": "Compute the yield of the photovoltaic modules of a building.",
    "calibrate": "Measure the computing time of each method on this machine.",
}
USAGE, FAILED, INTERRUPTED = 2, 1, 130
# Modules whose calls no signal may end. Trimesh drops any exception, and so do extension modules
# that try an import; Numba answers one while it compiles with `RuntimeError`
IMPORT = ("importlib", "_frozen_importlib", "_frozen_importlib_external")
FOREIGN = ("ifcopenshell", "mitsuba", "drjit", "trimesh", "numba", *IMPORT)
FILES = "mitsuba_cfs.files"  # whose locks and temporary files it would leave
AGAIN_S = 0.05  # after which a signal that came in one of their calls is looked at again
CLEANING_S = 5.0  # after a signal, in which others are ignored
SIGNALLED = 128  # and the signal's number
# OpenBLAS reads it when NumPy is loaded: its threads wait for work in 2^4 turns of a loop, not in
# the 2^28 that they are busy for between two small products of a room, beside Dr.Jit's own
BLAS_WAIT = {"OPENBLAS_THREAD_TIMEOUT": "4"}
# Workers are Pythons that would look for modules in the user's current folder first
SAFE_PATH = {"PYTHONSAFEPATH": "1"}


class Terminated(BaseException):
    """The program was told to end: whatever is open is cleared away on the way out."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


class LazyGroup(CommandGroup):
    """A group that imports a subcommand's module only when that subcommand is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The subcommands, in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The subcommand, imported now; None if there is no such one."""
        if cmd_name not in COMMANDS:
            return None
        return with_examples(import_module(f"scenes.commands.{cmd_name}").command, cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands by the table, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name]) for name in self.list_commands(ctx)])


class _StderrHandler(logging.Handler):
    """Writes to the stderr of the moment, which a progress bar may have redirected."""

    def emit(self, record: logging.LogRecord) -> None:
        debug = logging.getLogger().isEnabledFor(logging.DEBUG)  # else the message, without a traceback
        text = self.format(record) if debug else record.getMessage()
        click.echo(f"{record.levelname.lower()}: {text}", err=True)


def _print_version(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        click.echo(f"cfs {metadata.version('mitsuba-cfs')}")
        ctx.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option("-v", "--verbose", count=True, help="Log progress (-v) or all details (-vv).")
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version, help="Print the version."
)
@click.option(
    "--device",
    type=click.Choice(["cpu", "cuda"]),
    envvar="CFS_DEVICE",
    default="cpu",
    show_default=True,
    help="Where rays are traced; docs/benchmarks.md has the tables that were compared on a GPU.",
)
@click.option(
    "--progress",
    type=click.Choice(["bar", "json"]),
    envvar="CFS_PROGRESS",
    default="bar",
    show_default=True,
    help="Progress on standard error: bars or lines, or a JSON object a line.",
)
def cfs(verbose: int, device: str, progress: str) -> None:
    """Daylight, glare, temperatures and comfort behind complex fenestration systems."""
    os.environ["CFS_DEVICE"] = device  # worker processes inherit it
    os.environ["CFS_PROGRESS"] = progress
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(level=level, format="%(message)s", handlers=[_StderrHandler()], force=True)
    for noisy in ("matplotlib", "numba", "h5py", "PIL"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    logging.getLogger("trimesh").setLevel(logging.ERROR)  # it warns of normals that are not needed


def main(arguments: Sequence[str] | None = None) -> None:
    """Run `cfs` and exit: 0 done, 1 a problem with the input, 2 wrong usage, 130 interrupted.

    143 and 129: ended by SIGTERM or SIGHUP.  A problem gives one line on stderr; with CFS_DEBUG=1
    also its traceback.
    """
    os.environ.update(BLAS_WAIT | os.environ | SAFE_PATH)
    open_streams()
    stop, handled = Stop(), []
    for name in ("SIGTERM", "SIGHUP", "SIGINT"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        own = (signal.SIG_DFL, signal.default_int_handler)
        if number is not None and signal.getsignal(number) in own:  # not under nohup
            signal.signal(number, stop)
            handled.append(number)
    try:
        code = run(sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt:  # while an error was printed
        code = _ended(signal.SIGINT)
    except Terminated as ended:
        code = _ended(ended.number)
    if handled and hasattr(signal, "SIGALRM"):
        handled.insert(0, signal.SIGALRM)
    for number in handled:
        signal.signal(number, signal.SIG_IGN)  # the exit code is that of what has been done
    if stop.waiting and not code:  # it came while the last file was written
        code = _ended(stop.waiting)
    sys.exit(code)


class Stop:
    """Handler of signals: end the program, but not inside of a library or while it cleans up.

    What is raised in a library is lost, or answered with `SystemError`; the signal is sent again
    until that code has returned. A second signal does not end the cleaning up after the first.
    """

    def __init__(self) -> None:
        self._cleaning = -CLEANING_S  # when it began, by `time.monotonic`
        self.waiting = 0  # the signal that waits for a library or a file

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise what ends the program."""
        if time.monotonic() < self._cleaning + CLEANING_S:
            return
        if _inside_a_library(frame):
            self._wait(number)
            return
        self._cleaning = time.monotonic()
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise Terminated(number)

    def _wait(self, number: int) -> None:
        """Look again after `AGAIN_S`, by the timer of the process: no thread is started."""
        self.waiting = number
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, lambda _number, frame: self(number, frame))
            signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
        else:  # Windows
            again = threading.Timer(AGAIN_S, signal.raise_signal, (number,))
            again.daemon = True
            again.start()


def _inside_a_library(frame: FrameType | None) -> bool:
    """Whether a library, the writing of a file or Python's garbage collector waits for it."""
    while frame is not None:
        module = str(frame.f_globals.get("__name__", ""))
        if module == FILES or module.partition(".")[0] in FOREIGN:
            return True
        if frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    # the body of a loop, and a BSDF plugin's, are called by Dr.Jit without a frame
    drjit = sys.modules.get("drjit")
    return drjit is not None and drjit.flag(drjit.JitFlag.SymbolicScope)


def run(arguments: Sequence[str]) -> int:
    """The exit code of `cfs` with these arguments."""
    try:
        result = cfs.main(list(arguments), prog_name="cfs", standalone_mode=False)
        sys.stdout.flush()
        return result if isinstance(result, int) else 0
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return USAGE
    except (click.Abort, KeyboardInterrupt):
        return _ended(signal.SIGINT)
    except Terminated as ended:
        return _ended(ended.number)
    except Exception as error:
        line = _user_line(error)
        if line is None:
            raise
        if os.environ.get("CFS_DEBUG") == "1":
            traceback.print_exception(error)
        click.echo(line, err=True)
        return USAGE if isinstance(error, click.UsageError) else FAILED


def _ended(number: int) -> int:
    """The exit code of a program that a signal ended, whose word is printed."""
    click.echo("interrupted" if number == signal.SIGINT else "terminated", err=True)
    return INTERRUPTED if number == signal.SIGINT else SIGNALLED + number


def _user_line(error: Exception) -> str | None:
    """The one line that tells the user what is wrong; None for a fault of the program's own."""
    from scenes.user_errors import one_line, user_message

    if isinstance(error, click.UsageError):
        path = error.ctx.command_path if error.ctx else "cfs"
        return one_line(f"{path}: {error.format_message()} (see {path} --help)")
    if isinstance(error, click.ClickException):
        return one_line(f"error: {error.format_message()}")
    if type(error).__module__.startswith("pydantic"):
        return _validation_line(error)
    message = user_message(error)
    return None if message is None else f"error: {message}"


def _validation_line(error: Exception) -> str | None:
    """The first fault that pydantic found, with its field, and how many more there are."""
    from pydantic import ValidationError

    if not isinstance(error, ValidationError):
        return None
    first, *others = error.errors(include_url=False)
    field = ".".join(str(part) for part in first["loc"])
    more = f" (and {len(others)} more)" if others else ""
    return " ".join(f"error: {field}: {first['msg']}{more}".split())


if __name__ == "__main__":
    main()
