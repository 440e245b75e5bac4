"""A run says how many tests it left out, and what would bring them in."""

from __future__ import annotations

import ast
import subprocess
import sys

from tests.conftest import REPOSITORY
from tests.left_out import UNKNOWN, brings_in, left_out_lines
from tests.twins import TWINS

SHARED = {"real_data", "reference_data"}  # fixtures of ../shared


def skip_reasons() -> set[str]:
    """Every reason with which a test of this suite can be skipped, from the source."""
    found = set()
    for path in (REPOSITORY / "tests").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            called = ast.unparse(node.func)
            if called == "pytest.skip":
                found.add(_text(node.args[0]))
            elif called == "pytest.importorskip":
                found.add(f"could not import {ast.unparse(node.args[0])}: No module named")
            elif called == "pytest.mark.skipif":
                found |= {_text(k.value) for k in node.keywords if k.arg == "reason"}
    return found


def _text(node: ast.expr) -> str:
    """A string as it is written, with a word where a value is put in."""
    if isinstance(node, ast.JoinedStr):
        return "".join(p.value if isinstance(p, ast.Constant) else "x" for p in node.values)
    return str(ast.literal_eval(node))


def test_every_reason_to_skip_says_what_would_help():
    reasons = skip_reasons()
    assert len(reasons) > 10
    assert not [reason for reason in reasons if brings_in(reason) == UNKNOWN]
    assert brings_in("the moon is not full") == UNKNOWN


def test_lines_are_grouped_by_what_would_help():
    lines = left_out_lines(
        ["no folder (../shared/data)", "could not import 'pyradiance'", "no folder (../shared/data)"], deselected=7
    )
    assert [int(line.split()[0]) for line in lines] == [2, 1, 7]
    assert "../shared/data" in lines[0] and "peers" in lines[1] and "test-all" in lines[2]


def test_a_run_ends_with_them(tmp_path):
    """A clean copy of conftest's hook beside three tests, of which one runs."""
    (tmp_path / "conftest.py").write_text("from tests.left_out import pytest_terminal_summary\n", encoding="utf-8")
    (tmp_path / "test_some.py").write_text(
        "import pytest\n"
        "def test_runs(): pass\n"
        "def test_peer(): pytest.importorskip('pyradiance_of_nobody')\n"
        "@pytest.mark.xslow\ndef test_slow(): pass\n",
        encoding="utf-8",
    )
    run = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-m",
            "not xslow",
            "-p",
            "no:cacheprovider",
            "--rootdir",
            str(tmp_path),
            str(tmp_path),
        ],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
    )
    assert "1 left out (could not import 'pyradiance_of_nobody'" in run.stdout, run.stdout
    assert "1 left out by -m or -k" in run.stdout
    assert "1 left out (" in "\n".join(run.stdout.splitlines()[-5:])


def needs_shared() -> dict[str, dict[str, bool]]:
    """By file below tests/: each test, and whether it is skipped without ../shared."""
    found = {}
    for path in (REPOSITORY / "tests").rglob("test_*.py"):
        functions = {
            node.name: node for node in ast.parse(path.read_text("utf-8")).body if isinstance(node, ast.FunctionDef)
        }

        def needs(node: ast.FunctionDef, functions: dict = functions) -> bool:
            names = {argument.arg for argument in node.args.args}
            return bool(names & SHARED) or any(needs(functions[name]) for name in names & set(functions))

        found[path.relative_to(REPOSITORY / "tests").as_posix()] = {
            name: needs(node) for name, node in functions.items() if name.startswith("test_")
        }
    return found


def test_every_test_that_needs_shared_has_a_twin_that_does_not():
    tests = needs_shared()
    named = {(file, name) for file, pairs in TWINS.items() for name in pairs}
    assert named == {(file, name) for file in tests for name, needs in tests[file].items() if needs}
    for file, pairs in TWINS.items():
        for twin in pairs.values():
            place, _, name = twin.rpartition("::")
            assert tests[place or file][name] is False, twin
