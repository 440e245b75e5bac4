"""Compiled functions where nothing can be kept: a read-only install without a home folder."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
PACKAGES = ("mitsuba_cfs", "bim", "thermal", "scenes")


def compiling_modules() -> list[str]:
    """The modules that hold compiled functions."""
    found = []
    for package in PACKAGES:
        for path in (REPOSITORY / package).rglob("*.py"):
            if re.search(r"^@(compiled|inlined|\w*\.?njit)", path.read_text(), re.MULTILINE):
                found.append(".".join(path.relative_to(REPOSITORY).with_suffix("").parts))
    return found


def test_modules_import_where_no_folder_can_be_written() -> None:
    names = compiling_modules()
    assert {"bim.rays", "mitsuba_cfs.glare.scan", "thermal.kernel"} <= set(names)
    code = f"""
import importlib
import numba.core.caching
numba.core.caching.CacheImpl._locator_classes = []  # numba finds no folder
for name in {names!r}:
    importlib.import_module(name)
"""
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr[-500:]


def test_every_kept_function_goes_through_one_door() -> None:
    """`cache=True` of numba's own stops the import where no folder can be written."""
    doors = {"mitsuba_cfs/compiled.py", "thermal/records.py"}
    found = {
        path.relative_to(REPOSITORY).as_posix()
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
        if re.search(r"(njit|vectorize)\(.*cache=True", path.read_text())
        or re.search(r"cache=True, \*\*options", path.read_text())
    }
    assert found == doors
