"""Run a module of `tests.validation` or `tests.benchmarks` by its name."""

from __future__ import annotations

import ast
import runpy
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

USAGE = 2  # exit code for a wrong command line
STARTED = 'if __name__ == "__main__":'


def scripts(package: str) -> dict[str, str]:
    """The modules of a package that can be run, each with the first line of its docstring."""
    spec = find_spec(package)
    assert spec is not None and spec.submodule_search_locations
    sources = {
        path.stem: path.read_text("utf-8")
        for folder in spec.submodule_search_locations
        for path in sorted(Path(folder).glob("[!_]*.py"))
    }
    return {
        name: (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]
        for name, source in sources.items()
        if f"\n{STARTED}" in source
    }


def run_script(package: str, arguments: Sequence[str]) -> int:
    """Run `NAME [options]` of the package, or print the list of names; the exit code."""
    known = scripts(package)
    name, *options = arguments or ["--list"]
    if name == "--list":
        print("\n".join(f"{name:28} {line}" for name, line in known.items()))
        return 0
    if name not in known:
        there = ", ".join(known)
        print(f"{package}: there is no {name!r}; the names are {there}", file=sys.stderr)
        return USAGE
    sys.argv = [f"python -m {package} {name}", *options]
    runpy.run_module(f"{package}.{name}", run_name="__main__")
    return 0
