"""Run a script of `tests.validation` or `tests.benchmarks` by its name.

A script is a module with a function `main`, whose parameters are its options: those before `*` are
arguments, those after it options, required where they have no default.
The first line of the module's docstring is its help.  What `main` returns is printed.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import logging
import sys
import typing
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

USAGE = 2  # exit code for a wrong command line


def scripts(package: str) -> dict[str, str]:
    """The modules of a package that define `main`, each with the first line of its docstring."""
    spec = find_spec(package)
    assert spec is not None and spec.submodule_search_locations
    found = {}
    for path in sorted(Path(spec.submodule_search_locations[0]).glob("[!_]*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body):
            found[path.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return found


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
    module = import_module(f"{package}.{name}")
    parser = parser_of(module.main, f"python -m {package} {name}", module.__doc__ or "")
    show(called(module.main, parser.parse_args(options)))
    return 0


def parser_of(main: Callable[..., Any], prog: str, text: str) -> argparse.ArgumentParser:
    """The command line of a function, from its signature.

    `Annotated[T, choices, "help"]` adds what is allowed and a line of help; a `_` at a name's end,
    which keeps it apart from a module's name, is left out.
    """
    kind = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog=prog, description=text, formatter_class=kind)
    types = typing.get_type_hints(main, include_extras=True)
    for name, parameter in inspect.signature(main).parameters.items():
        settings, word = _settings(types[name]), name.rstrip("_").replace("_", "-")
        required = parameter.default is parameter.empty
        if "action" not in settings and not required:
            settings["default"] = parameter.default
        if parameter.kind is parameter.KEYWORD_ONLY:
            if settings.get("nargs") == "+" and parameter.default == ():
                settings |= {"action": "extend", "default": []}  # may be repeated
            parser.add_argument(f"--{word}", dest=name, required=required, **settings)
        else:
            if not required:
                settings["nargs"] = "*" if settings.get("nargs") == "+" else "?"
            parser.add_argument(name, metavar=word.upper(), **settings)
    return parser


def _settings(annotation: Any) -> dict[str, Any]:
    """The settings of `add_argument` for a type."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        notes = {"help" if isinstance(one, str) else "choices": one for one in inner[1:]}
        if "choices" in notes:
            notes["choices"] = list(notes["choices"])
        return _settings(inner[0]) | notes
    if annotation is bool:
        return {"action": "store_true"}
    if origin is Sequence:
        return {**_settings(inner[0]), "nargs": "+"}
    if type(None) in inner:
        return _settings(next(one for one in inner if one is not type(None)))
    return {"type": annotation}


def called(main: Callable[..., Any], options: argparse.Namespace) -> Any:
    """What `main` returns for parsed options."""
    logging.basicConfig(level=logging.ERROR)
    arguments, named = [], {}
    for name, parameter in inspect.signature(main).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY:
            named[name] = getattr(options, name)
        else:
            arguments.append(getattr(options, name))
    return main(*arguments, **named)


def show(result: Any) -> None:
    """Print a table with four decimals, several with their titles, or a text."""
    import pandas as pd

    if isinstance(result, dict):
        for title, table in result.items():
            print(title)
            show(table)
    elif isinstance(result, pd.DataFrame):
        named = result.index.names != [None] or result.index.dtype == object
        print(result.round(4).to_string(index=named))
    elif result is not None:
        print(result)
