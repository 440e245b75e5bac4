"""Compiled functions where nothing can be kept: a read-only install without a home folder."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
PACKAGES = ("mitsuba_cfs", "bim", "thermal", "scenes")


def compiling_modules() -> list[str]:
    """The modules that hold compiled functions, without those of pythermalcomfort, which cannot be imported there."""
    found = []
    for package in PACKAGES:
        for path in (REPOSITORY / package).rglob("*.py"):
            text = path.read_text()
            own = "from pythermalcomfort" not in text
            if own and re.search(r"^@(compiled|inlined|\w*\.?njit)", text, re.MULTILINE):
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
    ran = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr[-500:]


def test_every_kept_function_goes_through_one_door() -> None:
    """`cache=True` of numba's own stops the import where no folder can be written."""
    found = {
        path.relative_to(REPOSITORY).as_posix()
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
        if re.search(r"\bcache=True", path.read_text())
    }
    assert found == {"mitsuba_cfs/compiled.py"}


TUPLES = """
from collections import namedtuple
import numpy as np
from mitsuba_cfs.compiled import compiled
{name} = namedtuple("{name}", "x")
@compiled()
def first(values):
    return values.x[0]
print(first({name}(np.array([7.0]))))
"""


def test_code_of_another_version_with_other_types_is_compiled_again(tmp_path) -> None:
    """An index that names a type which is gone stopped every command after a change of version."""
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "kept"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(REPOSITORY)]),
    }
    for name in ("Older", "Newer"):
        (tmp_path / "tuples.py").write_text(TUPLES.format(name=name))
        ran = subprocess.run(
            [sys.executable, "-c", "import tuples"],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert ran.stdout == "7.0\n", ran.stderr[-500:]


CALL = """
import sys, time
from pathlib import Path

import pytest
import numpy as np
from numba.core.caching import IndexDataCacheFile
import increment
kind, before = sys.argv[1:]
act = getattr(IndexDataCacheFile, before, None)
def waiting(*given):
    Path(f"{kind}.waits").touch()
    while not Path(f"{kind}.goes").exists():
        time.sleep(0.01)
    act(*given)
if act:
    setattr(IndexDataCacheFile, before, waiting)
print(increment.increment(np.array([1], dtype=kind)))
"""


def test_processes_that_compile_at_once_never_get_each_others_code(tmp_path) -> None:
    """Both have found the index empty; then one writes it last, and the other the code."""
    (tmp_path / "increment.py").write_text(
        "from mitsuba_cfs.compiled import compiled\n@compiled()\ndef increment(x):\n    return x[0] + 1\n"
    )
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "kept"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(REPOSITORY)]),
    }

    def start(kind: str, before: str = "-") -> subprocess.Popen[str]:
        command = [sys.executable, "-c", CALL, kind, before]
        return subprocess.Popen(command, cwd=tmp_path, env=environment, text=True, stdout=subprocess.PIPE)

    started = []
    for kind, before in (("f8", "_save_index"), ("i8", "_save_data")):
        started.append(start(kind, before))
        end = time.monotonic() + 120
        while not (tmp_path / f"{kind}.waits").exists():
            assert started[-1].poll() is None and time.monotonic() < end
            time.sleep(0.01)
    for kind, process in zip(("f8", "i8"), started, strict=True):
        (tmp_path / f"{kind}.goes").touch()
        assert process.communicate(timeout=120)[0] and process.returncode == 0
    found = {kind: start(kind).communicate(timeout=120)[0].strip() for kind in ("i8", "f8")}
    assert found == {"i8": "2", "f8": "2.0"}


ENTRY = """
from mitsuba_cfs.compiled import compiled, must_compile
from thermal.part import grown

@compiled()
def entry(x):
    return grown(x)

if __name__ == "__main__":
    from thermal.entry import entry
    print(must_compile(entry), entry(1), must_compile(entry))
"""


def test_code_is_compiled_anew_when_what_is_inlined_changes(tmp_path) -> None:
    """Also where the new source is of the same age, as in an unpacked archive."""
    for name in ("mitsuba_cfs", "thermal"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    for name in ("compiled.py", "source_code.py"):
        shutil.copy(REPOSITORY / "mitsuba_cfs" / name, tmp_path / "mitsuba_cfs")
    (tmp_path / "thermal" / "entry.py").write_text(ENTRY)
    part = tmp_path / "thermal" / "part.py"

    def said(step: int) -> str:
        part.write_text(f"from numba import njit\n@njit\ndef grown(x):\n    return x + {step}\n")
        os.utime(part, (1e9, 1e9))
        return subprocess.run(
            [sys.executable, "-B", "-m", "thermal.entry"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
            env=os.environ | {"PYTHONPATH": str(tmp_path)},
        ).stdout.strip()

    assert [said(step) for step in (1, 1, 2)] == ["True 2 False", "False 2 False", "True 3 False"]


BALANCE = """
from mitsuba_cfs.compiled import must_compile
from tests.thermal.rooms import box, climate, sun
from thermal import kernel
from thermal.balance import simulate
zone = box()
before = must_compile(kernel.advance)
simulate(zone, climate(24), sun(24, zone))
print(before, must_compile(kernel.advance))
"""


@pytest.mark.slow  # quick: the same of small functions, above
def test_the_heat_balance_is_compiled_once(tmp_path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    for said in ("True False", "False False"):
        ran = subprocess.run(
            [sys.executable, "-c", BALANCE], env=environment, cwd=REPOSITORY, capture_output=True, text=True, check=True
        )
        assert ran.stdout.strip() == said


HOLDER = """
import time
from mitsuba_cfs.compiled import alone_in_compiling
from tests.setup.test_compiled import entry_of_a_test
with alone_in_compiling(entry_of_a_test):
    print("holds", flush=True)
    time.sleep(60)
"""
WAITER = """
from mitsuba_cfs.compiled import alone_in_compiling
from tests.setup.test_compiled import entry_of_a_test
print("asks", flush=True)
with alone_in_compiling(entry_of_a_test):
    print("passes", flush=True)
"""


def entry_of_a_test() -> None:
    """Its source file is what two processes lock."""


@pytest.mark.skipif(sys.platform == "win32", reason="locks of files are those of Linux")
def test_who_must_compile_waits_for_a_process_that_is_at_it_as_long_as_this_lives() -> None:
    def start(code: str) -> subprocess.Popen:
        return subprocess.Popen([sys.executable, "-c", code], cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)

    with start(HOLDER) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "holds\n"
        with start(WAITER) as waiter:
            assert waiter.stdout is not None and waiter.stdout.readline() == "asks\n"
            with pytest.raises(subprocess.TimeoutExpired):
                waiter.wait(timeout=1.0)
            holder.kill()
            assert waiter.communicate(timeout=60)[0] == "passes\n"


COMPILED_BESIDE = """
from mitsuba_cfs.compiled import must_compile
from mitsuba_cfs.glare import passes, scan
from thermal.kernel import advance
from thermal.layer_balance import settle
print(*map(must_compile, (advance, settle, passes.gather, scan.search, scan.merge_sources)))
"""


@pytest.mark.slow  # half a minute of compilation
def test_the_process_beside_compiles_what_a_room_needs(tmp_path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}

    def run(code: str) -> str:
        return subprocess.run(
            [sys.executable, "-c", code], env=environment, cwd=REPOSITORY, capture_output=True, text=True, check=True
        ).stdout.strip()

    assert run(COMPILED_BESIDE) == "True True True True True"
    run("from scenes.commands.progress_bar import compile_now; compile_now()")
    assert run(COMPILED_BESIDE) == "False False False False False"
