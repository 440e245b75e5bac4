"""What a benchmark is, how it is timed and how the ratio of two programs comes about.

A module of this package takes part by a table of its benchmarks:

    BENCHMARKS: dict[str, Callable[[Progress], Comparison]]

`PeerMissing` tells that the other program is not installed.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import platform
import resource
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.progress import Progress

THREADS = 2  # of either program


class PeerMissing(CfsError, RuntimeError):
    """The program to compare with is not installed."""


class PeerFailed(CfsError, RuntimeError):
    """The other program ended with an error."""


@dataclass(frozen=True, slots=True)
class Run:
    """One program's result: how long it took and how far it is from the reference."""

    program: str
    command: str  # how to get it again: a command line, or the call in Python
    seconds: float  # elapsed
    cpu_seconds: float  # of all threads, user and system
    error: float | None = None  # root mean square of the entries' errors; None where both agree

    @property
    def cost(self) -> float:
        """Elapsed time to unit error: both quarter when samples are twice as good."""
        return self.seconds * (1.0 if self.error is None else self.error**2)

    @property
    def cpu_cost(self) -> float:
        """Processor time to unit error."""
        return self.cpu_seconds * (1.0 if self.error is None else self.error**2)


@dataclass(frozen=True, slots=True)
class Comparison:
    """A benchmark's outcome: (time x error^2) of the peer over that of ours."""

    name: str
    of: str  # what is computed, with its unit
    ours: Run
    peer: Run
    note: str = ""

    @property
    def ratio(self) -> float:
        """How many times faster ours reaches the same error, in elapsed time."""
        return self.peer.cost / self.ours.cost

    @property
    def cpu_ratio(self) -> float:
        """The same in processor time, which other work on the machine disturbs less."""
        return self.peer.cpu_cost / self.ours.cpu_cost

    def record(self) -> dict[str, object]:
        """Everything as plain data, with the machine."""
        return {**asdict(self), "ratio": self.ratio, "cpu_ratio": self.cpu_ratio, "machine": machine()}


Benchmark = Callable[[Progress], "Comparison"]


def benchmarks() -> dict[str, Benchmark]:
    """All benchmarks of this package by name, from the modules' `BENCHMARKS`."""
    package = import_module(__package__)
    found: dict[str, Benchmark] = {}
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda m: m.name):
        table = getattr(import_module(f"{__package__}.{module.name}"), "BENCHMARKS", {})
        twice = found.keys() & table.keys()
        if twice:
            raise ValueError(f"{module.name}: a benchmark of this name exists: {sorted(twice)}")
        found.update(table)
    return found


def machine() -> dict[str, object]:
    """The processor, its cores and how busy they were in the last minute."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "threads": THREADS,
        "load": load,
        "python": platform.python_version(),
        "versions": {name: importlib.metadata.version(name) for name in ("mitsuba", "drjit", "numpy")},
    }


def _processor() -> str:
    table = Path("/proc/cpuinfo")
    if table.is_file():
        for line in table.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def timed(work: Callable[[], object], *, repeat: int = 3, warm: bool = True) -> tuple:
    """The last result of `work()`, and the least elapsed and processor time [s] of the repetitions.

    The processor time counts all threads and the child processes that have ended.  `warm`: run
    once before, so that kernels are compiled, as they are kept on disk between sessions.
    """
    if warm:
        work()
    elapsed, processor = [], []
    for _ in range(repeat):
        start, before = time.perf_counter(), _processor_seconds()
        result = work()
        elapsed.append(time.perf_counter() - start)
        processor.append(_processor_seconds() - before)
    return result, min(elapsed), min(processor)


def _processor_seconds() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def rms_error(values: ArrayLike, reference: ArrayLike) -> float:
    """Root mean square difference of all entries from the reference."""
    difference = np.asarray(values) - np.asarray(reference)
    return float(np.sqrt(np.mean(difference**2)))
