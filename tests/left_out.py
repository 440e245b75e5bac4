"""The last lines of a test run: how many tests were left out, why, and what would bring them in."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

PEERS = "pip install -c constraints.txt '.[peers,distributed]' (`make test` does)"
BRINGS_IN = [  # what a reason looks like, and what would bring its tests in
    (r"nbclient", "pip install '.[notebooks]'"),
    (r"axe-core", "pip install --no-deps axe-playwright-python==0.1.8 (`make test` does)"),
    (r"\.\./shared/data", "a folder ../shared/data with real IFC, EPW, BSDF and HDR files"),
    (
        r"\.\./shared/reference",
        "a folder ../shared/reference with results of EnergyPlus and ASHRAE 140's example programs",
    ),
    (r"xarray|h5netcdf", "pip install -c constraints.txt '.[netcdf]'"),
    (r"pyproj", "pip install -c constraints.txt '.[georeference]'"),
    (r"pyradiance|Radiance|rfluxmtx|evalglare|no \w+$", PEERS),
    (r"pywincalc|the engine failed", f"{PEERS}; pywincalc has wheels for Python up to 3.12"),
    (r"pyenergyplus|EnergyPlus", PEERS),
    (r"distributed", PEERS),
    (r"Chromium", "a Chromium on the path (Debian: apt-get install chromium; as root `make test` does)"),
    (r"no disk can be mounted", "running as root where a small file system can be mounted"),
    (r"no LLVM 15 or 16", "an LLVM 15 or 16 beside the good one, and x86"),
    (r"Linux|linux|SIGKILL", "Linux"),
]
UNKNOWN = "not known: say it in tests/left_out.py"


def brings_in(reason: str) -> str:
    """What would bring in the tests that were skipped for this reason."""
    return next((means for pattern, means in BRINGS_IN if re.search(pattern, reason)), UNKNOWN)


def left_out_lines(reasons: Iterable[str], deselected: int) -> list[str]:
    """One line for each means, the most tests first.

    Args:
        reasons: of the skips, one each.
        deselected: how many tests `-m` left out.
    """
    found: Counter[str] = Counter()
    said: dict[str, str] = {}
    for reason in reasons:
        found[brings_in(reason)] += 1
        said.setdefault(brings_in(reason), reason)
    lines = [f"{count} left out ({said[means]}); brought in by: {means}" for means, count in found.most_common()]
    if deselected:
        lines.append(f"{deselected} left out by -m or -k; brought in by: make test-all")
    return lines


def pytest_terminal_summary(terminalreporter) -> None:
    """pytest's hook, imported by conftest.py."""
    reports = terminalreporter.stats.get("skipped", [])
    reasons = [str(report.longrepr[2]).removeprefix("Skipped: ") for report in reports]
    lines = left_out_lines(reasons, len(terminalreporter.stats.get("deselected", [])))
    if lines:
        terminalreporter.section("left out")
        for line in lines:
            terminalreporter.line(line)
