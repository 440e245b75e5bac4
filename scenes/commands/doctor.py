"""`cfs doctor`: what is installed, what traces the rays, and whether that works."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
from importlib import metadata

import click

from mitsuba_cfs import llvm
from mitsuba_cfs.interpreter import own_paths, own_python
from scenes.commands.examples import StrictCommand

PROGRAM = "mitsuba-cfs"
PEERS = {"pyradiance": "Radiance", "pyenergyplus-lbnl": "EnergyPlus", "pywincalc": "WINDOW"}
TIME_LIMIT = 120  # seconds for the self-test; it takes two


@click.command(cls=StrictCommand)
def command() -> None:
    """Print versions, LLVM libraries, the chosen Mitsuba variant, peer programs; run a self-test.

    If something is wrong, the last line says what and what to do, and the exit code is 1.
    """
    fault = _print_versions()
    _print_llvm()
    _print_gpus()
    _print_peers()
    tested = self_test()
    if fault or tested:  # what is missing may be why the test failed: it goes first
        raise click.ClickException(fault or tested)


def self_test() -> str | None:
    """Run the self-test in a process of its own; print its result, or return what went wrong."""
    command_line = own_python("-m", "scenes.commands.self_test")
    try:
        done = subprocess.run(
            command_line, env=own_paths(), capture_output=True, text=True, timeout=TIME_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return f"self-test: no result after {TIME_LIMIT} s"
    if done.returncode != 0:
        return f"self-test: {_cause(done.returncode, done.stderr)}; {llvm.INSTALL_HINT}"
    result = json.loads(done.stdout.splitlines()[-1])
    click.echo(f"{'variant':<16} {result['variant']} ({result['reason']})")
    traced = f"{result['rays']} rays: view factor {result['traced']:.5f}"
    click.echo(
        f"{'self-test':<16} {'passed' if result['agrees'] else 'FAILED'}: {traced}, "
        f"closed form {result['expected']:.5f}, {result['seconds']:.1f} s"
    )
    if not result["agrees"]:
        return f"self-test: the traced rays miss the closed form; {llvm.INSTALL_HINT}"
    if result["variant"].startswith("scalar"):
        return f"rays are traced one by one: only slow single images work; {llvm.INSTALL_HINT}"
    return None


def _cause(code: int, stderr: str) -> str:
    """One line on why the self-test's process ended."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    telling = [line for line in lines if "LLVM ERROR" in line or "Cannot select" in line]
    last = (telling or lines or ["no message"])[-1 if not telling else 0]
    last = last.removeprefix("mitsuba_cfs.errors.VariantError: ")
    return f"aborted by signal {-code}: {last}" if code < 0 else last


def _print_versions() -> str | None:
    """Print the version of each package that the program needs; which are missing, if any."""
    click.echo(f"{'python':<16} {platform.python_version()} on {platform.platform()}")
    missing = []
    for name in (PROGRAM, *required()):
        version = _version(name)
        click.echo(f"{name:<16} {version or 'MISSING'}")
        missing += [] if version else [name]
    if not missing:
        return None
    return f"not installed: {', '.join(missing)}; pip install {' '.join(missing)}"


def required() -> list[str]:
    """The packages that the installed program needs, without those of its extras."""
    try:
        lines = metadata.requires(PROGRAM) or []
    except metadata.PackageNotFoundError:
        return []
    return [re.match(r"[\w.-]+", line)[0] for line in lines if "extra ==" not in line]


def _print_llvm() -> None:
    own = os.environ.get(llvm.VARIABLE)
    if own:
        click.echo(f"{'LLVM':<16} {own} (set by you in {llvm.VARIABLE})")
    chosen = own
    for candidate in llvm.candidates():
        mark = candidate.reason if candidate.usable else f"rejected: {candidate.reason}"
        if candidate.usable and not chosen:
            mark, chosen = "chosen", str(candidate.path)
        click.echo(f"LLVM {candidate.version_text:<11} {candidate.path} ({mark})")
    if not chosen:
        click.echo(f"{'LLVM':<16} none usable: {llvm.INSTALL_HINT}")


def _print_gpus() -> None:
    tool = shutil.which("nvidia-smi")
    query = ["--query-gpu=name,driver_version,memory.total", "--format=csv,noheader"]
    lines: list[str] = []
    if tool:
        done = subprocess.run([tool, *query], capture_output=True, text=True, check=False)
        lines = done.stdout.splitlines() if done.returncode == 0 else []
    for line in lines or ["none"]:
        click.echo(f"{'GPU':<16} {line}")


def _print_peers() -> None:
    for package, program in PEERS.items():
        version = _version(package)
        hint = "not installed (pip install 'mitsuba-cfs[peers]')"
        click.echo(f"{'peer':<16} {program}: {f'{package} {version}' if version else hint}")


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
