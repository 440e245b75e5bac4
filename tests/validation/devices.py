"""The validation tables and the benchmarks on the processor and on a GPU, figure by figure.

    python -m tests.validation devices --keep out/devices
    python -m tests.validation devices cie171 gloss --keep out/devices
    python -m tests.validation devices --every --keep out/devices

Each runner runs as a user would start it, once with `CFS_DEVICE=cpu` and once with
`CFS_DEVICE=cuda`; every number that it prints is compared.  `FOLDER/NAME.cpu.txt` and
`FOLDER/NAME.cuda.txt` keep what each printed.  `--every`: all benchmarks, and all runners that
need no option; else a choice of both.  The same seeds draw the same random numbers on
both devices, so that rounding is all that may differ.
"""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated

import pandas as pd

from mitsuba_cfs.variants import DEVICE, DEVICES
from tests.benchmarks import harness
from tests.scripts import scripts

PACKAGE = "tests.validation"
RUNNERS = ("cie171", "gloss", "mirroring_street", "clear_equinox", "goniophotometer")
BENCHMARKS = ("view-matrix", "daylight-matrix-shaded-c1000", "direct-sun", "annual-product")
OTHERS = {"devices", "hostile_files", "mutants", "signals"}  # this one, and those whose answer is not a result
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")
SAME = 0.01  # of the larger of two figures


@dataclass(frozen=True)
class Printed:
    """What a runner printed on a device."""

    text: str
    seconds: float
    failed: bool

    @property
    def lines(self) -> list[str]:
        """Its lines."""
        return self.text.splitlines()


def main(
    names: Annotated[Sequence[str], "runners of tests.validation; default: those of `RUNNERS`"] = RUNNERS,
    *,
    benchmarks: Annotated[Sequence[str], "benchmarks; default: those of `BENCHMARKS`"] = BENCHMARKS,
    every: Annotated[bool, "all that need no option"] = False,
    keep: Annotated[Path, "folder for what the runners print"] = Path("devices"),
) -> dict[str, pd.DataFrame]:
    """Figures of each runner on both devices, and the seconds that each took."""
    keep.mkdir(parents=True, exist_ok=True)
    if every:
        names, benchmarks = runners_without_options(), list(harness.benchmarks())
    tables = [_compared(PACKAGE, name, keep) for name in names]
    speed = [_compared("tests.benchmarks", name, keep) for name in benchmarks]
    return {
        "Figures": pd.DataFrame([row for row in tables if row]).set_index("runner"),
        "Speed (figures are times)": pd.DataFrame(speed).set_index("runner"),
    }


def runners_without_options() -> list[str]:
    """The scripts of `tests.validation` that run by their name alone, but `OTHERS`."""
    names = [name for name in scripts(PACKAGE) if name not in OTHERS]
    mains = {name: import_module(f"{PACKAGE}.{name}").main for name in names}
    return [name for name, main in mains.items() if not _required(main)]


def _required(main: Callable[..., object]) -> list[str]:
    """The parameters that a call needs."""
    return [p.name for p in inspect.signature(main).parameters.values() if p.default is p.empty]


def _compared(package: str, name: str, keep: Path) -> dict[str, object]:
    """A row of the table: how many figures of a runner there are, and how far apart."""
    printed = {device: _printed(package, name, device, keep) for device in DEVICES}
    cpu, cuda = printed["cpu"], printed["cuda"]
    row: dict[str, object] = {"runner": name, "cpu [s]": cpu.seconds, "cuda [s]": cuda.seconds}
    if cpu.failed or cuda.failed:
        return {**row, "where": f"failed: see {keep}/{name}.*.txt"}
    figures = apart = 0
    worst, where = 0.0, ""
    for one, other in zip(cpu.lines, cuda.lines, strict=False):
        for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=False):
            figures += 1
            difference = abs(float(a) - float(b))
            step = 10.0 ** -len(a.partition(".")[2]) if "e" not in a else 0.0
            apart += difference > max(SAME * max(abs(float(a)), abs(float(b))), 1.01 * step)
            if difference > worst:
                worst, where = difference, one.strip()[:60]
    lines = len(cpu.lines) == len(cuda.lines)
    return {
        **row,
        "figures": figures,
        "over 1 % and the last digit": apart,
        "largest difference": worst,
        "where": where if lines else "not the same lines",
    }


def _printed(package: str, name: str, device: str, keep: Path) -> Printed:
    """What a runner prints on a device."""
    environment = {**os.environ, DEVICE: device}
    command = [sys.executable, "-m", package, name]
    start = time.monotonic()
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    seconds = round(time.monotonic() - start, 1)
    text = done.stdout
    (keep / f"{name}.{device}.txt").write_text(text + done.stderr)
    print(f"{name} {device}: {seconds} s", file=sys.stderr, flush=True)
    return Printed(text, seconds, done.returncode != 0)
