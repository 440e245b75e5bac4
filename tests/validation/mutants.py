"""Share of planted faults that the quick tests of a module notice, by group of modules.

    python -m tests.validation mutants [--group sky] [--number 20] [--seed 0]

A fault replaces one operator, comparison, constant, sign or function: the kinds of `_faults`. The
tests of a group run on a copy of the repository with that fault, in a process forked after the
libraries are loaded; the first test that fails ends it. A fault that changes no result counts as
one that was not noticed.
"""

from __future__ import annotations

import ast
import copy
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tests.conftest import REPOSITORY

GROUPS = {  # files, and their quick tests
    "glare": (
        ["mitsuba_cfs/glare/indices.py", "mitsuba_cfs/glare/position_index.py",
         "mitsuba_cfs/glare/classes.py", "mitsuba_cfs/glare/areas.py"],
        [f"tests/glare/test_{name}.py" for name in ("indices", "evaluation", "annual")],
    ),
    "sky": (
        [f"mitsuba_cfs/sky/{name}.py" for name in
         ("sun", "perez", "plausible", "albedo", "weather", "epw", "ground", "cie", "patches")],
        [f"tests/sky/test_{name}.py" for name in
         ("sun", "perez", "plausible", "albedo", "weather", "ground", "cie", "patches")],
    ),
    "gbxml": (
        [f"bim/gbxml/{name}.py" for name in
         ("building", "constructions", "document", "use", "write")],
        ["tests/bim/test_read_gbxml.py", "tests/bim/test_write_gbxml.py"],
    ),
    "comfort": (["thermal/comfort.py"], ["tests/thermal/test_comfort.py"]),
    "folders": (
        ["scenes/result_folder.py"],
        ["tests/scenes/test_result_folder.py", "tests/scenes/test_folders_of_results.py"],
    ),
}  # fmt: skip
SWAPPED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE,
    ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
RENAMED = {"sin": "cos", "cos": "sin", "arcsin": "arccos", "arccos": "arcsin", "min": "max",
           "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any",
           "floor": "ceil", "ceil": "floor", "degrees": "radians",
           "radians": "degrees"}  # fmt: skip
LIMIT_S = 400.0  # of the tests of one fault: longer is a loop without an end


@dataclass(frozen=True, slots=True)
class Mutant:
    """A fault in a file."""

    file: str
    line: int
    before: str
    after: str
    source: str


def mutants(file: str, source: str) -> list[Mutant]:
    """Every fault of a source that `_faults` knows."""
    tree = ast.parse(source)
    result = []
    for number, node in enumerate(ast.walk(tree)):
        for kind in range(sum(1 for _ in _faults(node))):
            other = copy.deepcopy(tree)
            place = next(one for n, one in enumerate(ast.walk(other)) if n == number)
            before = _shown(place)
            for index, plant in enumerate(_faults(place)):
                if index == kind:
                    plant()
                    break
            text = ast.unparse(other)
            if text != ast.unparse(tree):
                line = getattr(node, "lineno", 0)
                result.append(Mutant(file, line, before, _shown(place), text))
    return result


def _faults(node: ast.AST) -> Iterator:
    """Functions that each plant one fault in a node."""
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPPED:
        yield lambda: setattr(node, "op", SWAPPED[type(node.op)]())
    if isinstance(node, ast.AugAssign) and type(node.op) in SWAPPED:
        yield lambda: setattr(node, "op", SWAPPED[type(node.op)]())
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED:
        yield lambda: node.ops.__setitem__(0, SWAPPED[type(node.ops[0])]())
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield lambda: setattr(node, "op", ast.UAdd())
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield lambda: setattr(node, "operand", ast.UnaryOp(ast.Not(), node.operand))
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        value = node.value
        yield lambda: setattr(
            node, "value", value + 1 if type(value) is int else value * 1.1 + 0.01
        )
    if isinstance(node, ast.Constant) and type(node.value) is bool:
        yield lambda: setattr(node, "value", not node.value)
    if isinstance(node, ast.Call):
        function = node.func
        if isinstance(function, ast.Attribute) and function.attr in RENAMED:
            yield lambda: setattr(function, "attr", RENAMED[function.attr])
        if isinstance(function, ast.Name) and function.id in RENAMED:
            yield lambda: setattr(function, "id", RENAMED[function.id])


def _shown(node: ast.AST) -> str:
    return " ".join(ast.unparse(node).split())[:70]


def noticed(mutant: Mutant, tests: list[str], folder: Path) -> bool:
    """Whether a test fails on the copy of the repository with the fault."""
    path = folder / mutant.file
    original = path.read_bytes()
    path.write_text(mutant.source, encoding="utf-8")
    try:
        child = os.fork()
        if child == 0:
            _tested(tests, folder)
        end = time.monotonic() + LIMIT_S
        while True:
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                return status != 0
            if time.monotonic() > end:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return True
            time.sleep(0.1)
    finally:
        path.write_bytes(original)


def _tested(tests: list[str], folder: Path) -> None:
    """Run tests in this process, which ends with 0 if all pass."""
    import pytest

    code = 1
    try:
        os.chdir(folder)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        options = ["-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:randomly"]
        code = int(pytest.main([*options, *tests]))
    finally:
        os._exit(code)


def main(
    *,
    group: Annotated[str, ("", *GROUPS), "only this one"] = "",
    number: Annotated[int, "faults of each group"] = 20,
    seed: Annotated[int, "of the sample"] = 0,
) -> None:
    """Table by group, and a line for each fault that no test noticed."""
    import matplotlib  # noqa: F401  before the forks: they load nothing again
    import numba  # noqa: F401
    import pandas  # noqa: F401
    import pvlib  # noqa: F401
    import scipy.optimize  # noqa: F401

    rows, survivors = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "repository"
        ignored = shutil.ignore_patterns(".venv", ".git", "__pycache__", "site")
        shutil.copytree(REPOSITORY, folder, ignore=ignored, symlinks=True)
        shared = REPOSITORY.parent / "shared"
        if shared.is_dir():
            (Path(name) / "shared").symlink_to(shared)
        sys.path[:] = [
            str(folder),
            *(p for p in sys.path if Path(p or ".").resolve() != REPOSITORY),
        ]
        sys.dont_write_bytecode = True
        for module in [one for one in sys.modules if one.partition(".")[0] == "tests"]:
            del sys.modules[module]
        for title, (files, tests) in GROUPS.items():
            if group in ("", title):
                every = [m for f in files for m in mutants(f, (folder / f).read_text("utf-8"))]
                sample = random.Random(seed).sample(every, min(number, len(every)))
                unchanged = Mutant(files[0], 0, "", "", (folder / files[0]).read_text("utf-8"))
                if noticed(unchanged, tests, folder):
                    raise RuntimeError(f"{title}: its tests fail without a fault")
                killed = 0
                for one in sample:
                    found = noticed(one, tests, folder)
                    killed += found
                    line = f"{one.file}:{one.line}: {one.before} -> {one.after}"
                    print("noticed " if found else "SURVIVED", line, file=sys.stderr, flush=True)
                    survivors += [] if found else [line]
                rows.append(f"| {title} | {len(every)} | {len(sample)} | {killed} |")
    print("| group | faults | of these tried | noticed |\n|---|---|---|---|")
    print("\n".join([*rows, "", *survivors]))
