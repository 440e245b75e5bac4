"""Share of planted faults that the quick tests of their own module notice, by module.

    python -m tests.validation mutants [--only sky] [--number 16] [--seed 0] [--json FILE]

A fault replaces one operator, comparison, constant, sign or function: the kinds of `_faults`.
pytest collects the tests of a module once; each fault is planted in the loaded module of a forked
process, which then runs them until the first one fails. A fault that changes no result counts as
one that was not noticed.
"""

from __future__ import annotations

import ast
import copy
import inspect
import json
import logging
import os
import random
import resource
import signal
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Annotated, Any

import pytest
from _pytest import main as pytest_main

from mitsuba_cfs.source_code import OWN
from tests.conftest import REPOSITORY

# Files, and their quick tests: none that numba compiles, whose code is cached on disk, and no test
# that traces in this process, whose threads a fork does not have
MODULES = {
    "thermal/comfort": ["thermal/test_comfort"],
    "thermal/conduction": ["thermal/test_conduction"],
    "thermal/climate": ["thermal/test_climate"],
    "thermal/ratings": ["thermal/test_ratings"],
    "thermal/moisture": ["thermal/test_moisture"],
    "thermal/network": ["thermal/test_network"],
    "thermal/ground": ["thermal/test_ground"],
    "thermal/blackbox": ["thermal/test_blackbox"],
    "thermal/ventilation": ["thermal/test_ventilation"],
    "mitsuba_cfs/glare/indices": ["glare/test_indices"],
    "mitsuba_cfs/glare/position_index": ["glare/test_indices"],
    "mitsuba_cfs/glare/classes": ["glare/test_indices"],
    "mitsuba_cfs/sky/sun": ["sky/test_sun"],
    "mitsuba_cfs/sky/perez": ["sky/test_perez"],
    "mitsuba_cfs/sky/cie": ["sky/test_cie"],
    "mitsuba_cfs/sky/patches": ["sky/test_patches"],
    "mitsuba_cfs/sky/annual": ["sky/test_annual_sky", "sky/test_albedo"],
    "mitsuba_cfs/sky/weather_table": ["sky/test_weather_table", "sky/test_weather"],
    "mitsuba_cfs/sky/epw": ["sky/test_weather"],
    "mitsuba_cfs/sky/weather": ["sky/test_weather", "sky/test_heat_island"],
    "mitsuba_cfs/spectra/detectors": ["spectra/test_detectors"],
    "mitsuba_cfs/metrics/room": ["metrics/test_metrics"],
    "mitsuba_cfs/metrics/autonomy": ["metrics/test_autonomy_error", "metrics/test_metrics"],
    "mitsuba_cfs/metrics/lm83": ["metrics/test_autonomy_error", "metrics/test_metrics"],
    "mitsuba_cfs/bsdf/en410": ["bsdf/test_en410"],
    "mitsuba_cfs/bsdf/klems": ["bsdf/test_klems"],
    "mitsuba_cfs/bsdf/evaluate": ["bsdf/test_evaluate", "bsdf/test_peak_kind"],
    "mitsuba_cfs/bsdf/xml": ["bsdf/test_xml"],
    "mitsuba_cfs/bsdf/layers": ["bsdf/test_layers"],
    "mitsuba_cfs/bsdf/angular": ["bsdf/test_angular"],
    "mitsuba_cfs/bsdf/glazing": ["bsdf/test_glazing", "bsdf/test_layers"],
    "mitsuba_cfs/bsdf/shade_file": ["bsdf/test_shade_file"],
    "mitsuba_cfs/images/hdr": ["images/test_hdr"],
    "mitsuba_cfs/images/view": ["images/test_view"],
    "mitsuba_cfs/matrices/mtx_io": ["sky/test_mtx_io"],
    "bim/gbxml/building": ["bim/test_read_gbxml", "bim/test_stated_use"],
    "bim/gbxml/document": ["bim/test_read_gbxml"],
    "mitsuba_cfs/files": ["scenes/test_result_folder", "scenes/test_csv_text", "test_finite", "test_files"],
    "scenes/result_folder": ["scenes/test_result_folder"],
    "scenes/toml_file": ["scenes/test_toml_file"],
}
SWAPPED = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
RENAMED = {
    "sin": "cos",
    "cos": "sin",
    "arcsin": "arccos",
    "arccos": "arcsin",
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "any": "all",
    "all": "any",
    "floor": "ceil",
    "ceil": "floor",
    "degrees": "radians",
    "radians": "degrees",
}
LONGEST_S = 600  # of the same by the clock
LIMIT_S = 60  # processor time of the tests of one fault: longer is a loop without an end
# No fault: without an effect at run time, or only on what a type checker refuses
NO_FAULT = {"annotation", "returns", "type_params"}
NO_FAULT_KEYWORDS = {"strict", "frozen", "slots", "kw_only", "eq", "stacklevel"}


@dataclass(frozen=True, slots=True)
class Mutant:
    """A fault in a module."""

    module: str
    line: int
    before: str
    after: str
    noticed: bool | None = None  # by a test


def _nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Every node below that is computed when the program runs."""
    for name, value in ast.iter_fields(node):
        if name in NO_FAULT or (isinstance(node, ast.keyword) and node.arg in NO_FAULT_KEYWORDS):
            continue
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, ast.AST):
                yield one
                yield from _nodes(one)


def mutants(module: str, number: int, seed: int) -> list[tuple[Mutant, str]]:
    """A sample of the faults of a module, with the source of each."""
    tree = ast.parse((REPOSITORY / f"{module}.py").read_text(encoding="utf-8"))
    places = [(n, k) for n, node in enumerate(_nodes(tree)) for k in range(len([*_faults(node)]))]
    chosen = random.Random(f"{seed} {module}").sample(places, min(number, len(places)))
    result = []
    for place, kind in sorted(chosen):
        other = copy.deepcopy(tree)
        node = next(one for n, one in enumerate(_nodes(other)) if n == place)
        before = _shown(node)
        [*_faults(node)][kind]()
        mutant = Mutant(module, getattr(node, "lineno", 0), before, _shown(node))
        result.append((mutant, ast.unparse(other)))
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
        yield lambda: setattr(node, "value", value + 1 if type(value) is int else value * 1.1 + 0.01)
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


class _Trials:
    """A plugin of pytest that plants each fault in a process of its own after the collection."""

    def __init__(self, module: str, sources: list[str], results: Path) -> None:
        self._name, self._sources, self._results = module.replace("/", "."), sources, results

    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        module = sys.modules.get(self._name)
        if module is None or not session.items:
            raise RuntimeError(f"{self._name}: no test of these imports it")
        pytest_main.pytest_runtestloop(session)  # without a fault: compiled code is then loaded
        codes = []
        for source in self._sources:
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
                signal.alarm(LONGEST_S)
                plant(module, source)
                try:
                    pytest_main.pytest_runtestloop(session)
                except BaseException:  # the first failure ends the loop by an exception
                    os._exit(1)
                os._exit(0)
            codes.append(os.waitpid(child, 0)[1])
            self._results.write_text(json.dumps(codes))
        os._exit(0)


def plant(module: ModuleType, source: str) -> None:
    """Give a loaded module, and all that hold its functions and constants, another source."""
    old = dict(vars(module))
    exec(compile(source, module.__file__ or "", "exec"), vars(module))
    for name, new in list(vars(module).items()):
        before = old.get(name)
        if before is new or name.startswith("__"):
            continue
        if _changed(before, new):
            setattr(module, name, before)
            continue
        for other in list(sys.modules.values()):
            if vars(other).get(name) is before:
                setattr(other, name, new)
    for other in list(sys.modules.values()):
        if other.__name__.partition(".")[0] in OWN:
            for value in list(vars(other).values()):
                if hasattr(value, "cache_clear"):
                    value.cache_clear()


def _changed(old: Any, new: Any) -> bool:
    """Give a function or class of a module the code of another one; whether that can be done."""
    if isinstance(old, property) and isinstance(new, property):
        return old.fget is None or _changed(old.fget, new.fget)
    if isinstance(old, classmethod | staticmethod):
        return _changed(old.__func__, new.__func__)
    if isinstance(old, type) and isinstance(new, type) and not hasattr(old, "model_fields"):
        for name, value in vars(new).items():
            before = vars(old).get(name)
            plain = isinstance(value, bool | int | float | str | tuple)
            if not _changed(before, value) and plain and not name.startswith("__"):
                setattr(old, name, value)
        return True
    if hasattr(old, "py_func"):  # compiled by numba
        return False
    inner, other = (inspect.unwrap(one) if callable(one) else one for one in (old, new))
    if not (isinstance(inner, FunctionType) and isinstance(other, FunctionType)):
        return False
    if len(inner.__code__.co_freevars) != len(other.__code__.co_freevars):
        return False
    inner.__code__, inner.__defaults__ = other.__code__, other.__defaults__
    inner.__kwdefaults__ = other.__kwdefaults__
    return True


def noticed(module: str, sources: list[str], tests: list[str]) -> list[bool]:
    """Whether a test fails with each source of the module."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "codes.json"
        child = os.fork()
        if child == 0:
            code = 1
            logging.getLogger().setLevel(logging.WARNING)  # as in a run of pytest alone
            try:
                sink = os.open(Path(folder) / "output", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
                os.dup2(sink, 1)
                os.dup2(sink, 2)
                options = ["-x", "-q", "-m", "not slow", "-p", "no:cacheprovider"]
                options += ["-p", "no:xdist", f"--basetemp={folder}/tests"]
                files = [f"tests/{one}.py" for one in tests]
                plugin = _Trials(module, sources, results)
                code = int(pytest.main([*options, *files], plugins=[plugin]))
            finally:
                os._exit(code)
        if os.waitpid(child, 0)[1]:
            raise RuntimeError(f"{module}: {(Path(folder) / 'output').read_text()[-2000:]}")
        return [bool(code) for code in json.loads(results.read_text())]


def main(
    *,
    only: Annotated[str, "modules with this in their name"] = "",
    number: Annotated[int, "faults of each module"] = 16,
    seed: Annotated[int, "of the sample"] = 0,
    json_: Annotated[Path | None, "every fault, as JSON; modules that it holds stay"] = None,
) -> None:
    """Table by module, and a line for each fault that no test noticed."""
    os.chdir(REPOSITORY)
    results: list[Mutant] = []
    if json_ is not None and json_.exists():
        results = [Mutant(**one) for one in json.loads(json_.read_text())]
    for module, tests in MODULES.items():
        if only not in module or any(one.module == module for one in results):
            continue
        sample = mutants(module, number, seed)
        unchanged = (REPOSITORY / f"{module}.py").read_text(encoding="utf-8")
        fails, *kinds = noticed(module, [unchanged, *(source for _, source in sample)], tests)
        if fails:
            raise RuntimeError(f"{module}: its tests fail without a fault")
        results += [replace(one, noticed=kind) for (one, _), kind in zip(sample, kinds, strict=True)]
        print(f"{module}: {sum(kinds)} of {len(kinds)}", file=sys.stderr, flush=True)
        if json_ is not None:
            json_.write_text(json.dumps([asdict(one) for one in results], indent=1))
    print("| module | faults | noticed |\n|---|---|---|")
    for module in dict.fromkeys(one.module for one in results):
        kinds = [bool(one.noticed) for one in results if one.module == module]
        print(f"| {module} | {len(kinds)} | {sum(kinds)} |")
    print(f"| all | {len(results)} | {sum(bool(one.noticed) for one in results)} |\n")
    for one in results:
        if not one.noticed:
            print(f"{one.module}.py:{one.line}: {one.before} -> {one.after}")
