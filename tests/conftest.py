"""Shared set-up of the tests: a good LLVM before Dr.Jit starts, and where the real files are."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.workers import (
    pytest_collection_finish as pytest_collection_finish,
)  # first: it sets what NumPy reads; a hook

from mitsuba_cfs import llvm  # isort: skip
from tests.left_out import pytest_terminal_summary as pytest_terminal_summary  # a hook

llvm.select_library()

REPOSITORY = Path(__file__).parent.parent
REAL_DATA = REPOSITORY.parent / "shared" / "data"
REFERENCE_DATA = REPOSITORY.parent / "shared" / "reference"
OWN_BLIND = "tests/reference/genbsdf_blind/tilt45.xml"  # for `bsdf_file`
WINDOW_GLAZING = REPOSITORY / "tests" / "reference" / "window_glazing"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """pytest's hook: files with a test marked `early` come first, the others in their order.

    Workers take files in this order (`make test`); a long one begun last would run on alone.
    """
    early = {item.path for item in items if item.get_closest_marker("early")}
    items.sort(key=lambda item: item.path not in early)


@pytest.fixture(scope="session", autouse=True)
def matrices_of_this_run(tmp_path_factory) -> Iterator[None]:
    """One cache of matrices for all tests of a run and all its workers, apart from the user's."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CFS_CACHE", str(folder / "matrices"))
        yield


def default_signals() -> None:
    """For `preexec_fn`: a child that signals can end, also where this suite ignores them.

    So it is under `make test &` and `nohup`; a child inherits what is ignored.
    """
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        signal.signal(getattr(signal, name), signal.SIG_DFL)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real IFC, EPW, BSDF and HDR files; the test is skipped without it."""
    if not REAL_DATA.is_dir():
        pytest.skip("the folder of real input files (../shared/data) is not here")
    return REAL_DATA


@pytest.fixture(scope="session")
def bsdf_file(request) -> Callable[[str], Path]:
    """A BSDF file by its name: one of the repository's, else a real one, skipped without it."""

    def find(name: str) -> Path:
        own = REPOSITORY / name
        return own if own.is_file() else request.getfixturevalue("real_data") / "bsdf" / name

    return find


@pytest.fixture(scope="session")
def reference_data() -> Path:
    """The folder of EnergyPlus and ASHRAE 140 reference results; skipped without it."""
    if not REFERENCE_DATA.is_dir():
        pytest.skip("the folder of reference results (../shared/reference) is not here")
    return REFERENCE_DATA


@pytest.fixture(scope="session")
def variant() -> str:
    """The Mitsuba variant that the tests trace with: LLVM, mono."""
    from mitsuba_cfs import variants

    return variants.activate("llvm_ad_mono")


@pytest.fixture
def shade(tmp_path) -> Path:
    """A BSDF file of a Lambertian sheet that passes 0.1 and reflects 0.5."""
    import numpy as np

    from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
    from mitsuba_cfs.bsdf.xml import BsdfFile, write_bsdf_xml

    t, r = (np.full((KLEMS_FULL.size,) * 2, share / np.pi) for share in (0.1, 0.5))
    sheet = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, t, t, r, r)
    path = tmp_path / "sheet.xml"
    write_bsdf_xml(BsdfFile({"Visible": sheet, "Solar": sheet}, name="sheet"), path)
    return path


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A disk of a few megabytes; only root may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64m", "none", str(disk)], capture_output=True, check=False
    )
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
