"""A case that takes its time and leaves its traces; a module that workers import quickly."""

from __future__ import annotations

import os
import time
from pathlib import Path

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, silent
from scenes.study.plan import Case
from scenes.study.store import CaseResult

SECONDS = 0.25  # of a case of these tests
SAID = ("sda300_50", "da300", "operative_max_c", "seconds")  # in the line of a case


def noted(case: Case, *, progress: Progress = silent) -> CaseResult:
    """A case that takes its time and leaves a line when it is begun and when it is done."""
    log = Path(case.room)  # the tests put the log's path there
    with log.open("a") as file:
        file.write(f"begin {case.orientation_deg:g}\n")
    progress("daylight", 0.5)
    time.sleep(SECONDS)
    if case.orientation_deg == 13:
        raise DataError("this one fails")
    with log.open("a") as file:
        file.write(f"end {case.orientation_deg:g}\n")
    return CaseResult(case.key, {"angle": case.orientation_deg} | dict.fromkeys(SAID, 0.0))


def held_up(case: Case, *, progress: Progress = silent) -> CaseResult:
    """The same; a case of 90 degrees or more waits until a file beside the log lets it continue.

    Its line in the log holds the number of its process.
    """
    log, go = Path(case.room), Path(f"{case.room}.go")
    if case.orientation_deg >= 90:
        with log.open("a") as file:
            file.write(f"held {os.getpid()}\n")
    end = time.monotonic() + 20.0
    while case.orientation_deg >= 90 and not go.exists() and time.monotonic() < end:
        time.sleep(0.05)
    return noted(case, progress=progress)


def deadly(case: Case, *, progress: Progress = silent) -> CaseResult:
    """The same; the case of 13 degrees ends its process."""
    if case.orientation_deg == 13:
        os._exit(1)
    return noted(case, progress=progress)


def elsewhere(case: Case, *, progress: Progress = silent) -> CaseResult:
    """A case of 13 degrees fails on the first disk, one of 20 degrees has no memory anywhere."""
    log = Path(case.room)
    with log.open("a") as file:
        file.write(f"begin {case.orientation_deg:g}\n")
    if case.orientation_deg == 20:
        raise MemoryError
    if case.orientation_deg == 13 and log.read_text().count("begin 13") == 1:
        raise DataError("cannot be read") from OSError(5, "Input/output error")
    return CaseResult(case.key, dict.fromkeys(SAID, 0.0))
