"""Processes of our own that are started in a folder with modules of the user's."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mitsuba_cfs.interpreter import own_paths, own_python
from tests.modules import MODULES, REPOSITORY, file_name

# llvm.py reads the file's kind only; processes.py says -P itself
MAY_START = ("mitsuba_cfs/interpreter.py", "mitsuba_cfs/llvm.py", "mitsuba_cfs/processes.py")


@pytest.fixture
def users_folder(tmp_path: Path) -> Path:
    """A folder whose files have the names of modules of Python, of ours and of others."""
    for name in ("json", "pickle", "selectors", "numpy", "scenes", "mitsuba_cfs"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('a module of the user')\n")
    return tmp_path


def _run(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    # -P: the installed command `cfs` has the folder of its script first, never the current one
    return subprocess.run(
        [sys.executable, "-P", "-c", code],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
    )


def test_a_python_of_ours_imports_none_of_the_users_modules(users_folder: Path) -> None:
    done = subprocess.run(
        own_python("-c", "import json, scenes.cli, numpy; print(json.dumps(1))"),
        env=own_paths(),
        cwd=users_folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "1\n", done.stderr


def test_the_self_test_imports_none_of_the_users_modules(users_folder: Path) -> None:
    done = _run("from scenes.cli import main; main(['doctor'])", users_folder)
    assert done.returncode == 0, done.stderr
    assert "passed" in done.stdout.splitlines()[-1]


def test_workers_import_none_of_the_users_modules(users_folder: Path, tmp_path: Path) -> None:
    script = tmp_path / "elsewhere" / "script.py"
    script.parent.mkdir()
    script.write_text(
        "from scenes import cli\n"
        "from mitsuba_cfs.processes import process_pool\n"
        "def work():\n"
        "    with process_pool(1) as pool:\n"
        "        print(pool.submit(abs, -1).result())\n"
        "if __name__ == '__main__':\n"
        "    cli.run = lambda arguments: work()\n"
        "    cli.main([])\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=users_folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
    )
    assert done.stdout == "1\n", done.stderr


def test_pythons_are_started_in_one_way() -> None:
    for path in MODULES:
        name = file_name(path)
        if name in MAY_START:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        named = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
        assert not [n for n in named if ast.unparse(n) == "sys.executable"], name
