"""pyproject.toml asks for what is used, and for nothing else."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable
from functools import cache
from importlib import metadata
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("mitsuba_cfs", "bim", "thermal", "scenes")
PEERS = {"pyradiance", "pyenergyplus-lbnl", "pywincalc"}
# The Makefile's and mkdocs.yml's
RUN_BY_NAME = {"ruff", "mypy", "pytest-cov", "pytest-xdist", "mkdocs", "mkdocs-material", "mkdocstrings-python"}
# Loaded by another package, where our source has this attribute
LOADED_BY = {"pyarrow": "to_parquet"}  # pandas
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]


def _name(requirement: str) -> str:
    return re.match(r"[\w.-]+", requirement)[0].lower().replace("_", "-")


@cache
def _modules() -> dict[str, set[str]]:
    """Top-level modules of each installed distribution."""
    found: dict[str, set[str]] = {}
    for module, distributions in metadata.packages_distributions().items():
        for distribution in distributions:
            found.setdefault(_name(distribution), set()).add(module)
    for distribution in metadata.distributions():  # compiled modules without a folder
        for file in distribution.files or ():
            if len(file.parts) == 1 and file.suffix in {".so", ".pyd"}:
                found.setdefault(_name(distribution.name), set()).add(file.name.split(".")[0])
    return found


def _used(folders: Iterable[str]) -> set[str]:
    """Modules imported or looked for, and with a dot all attributes, in all Python files."""
    return set().union(*map(_used_in, folders))


@cache
def _used_in(folder: str) -> set[str]:
    used: set[str] = set()
    for path in (REPOSITORY / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                used |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                used.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Attribute):
                used.add(f".{node.attr}")
            elif isinstance(node, ast.Call):
                called = ast.unparse(node.func).rpartition(".")[2]
                looked_for = called in {"find_spec", "importorskip"} and node.args
                if looked_for and isinstance(node.args[0], ast.Constant):
                    used.add(str(node.args[0].value).partition(".")[0])
    return used


def unused(requirements: Iterable[str], used: set[str]) -> list[str]:
    """The requirements that nothing imports."""
    modules, found = _modules(), []
    for name in map(_name, requirements):
        own = modules.get(name, {name.replace("-", "_")})
        loaded = name in LOADED_BY and f".{LOADED_BY[name]}" in used
        if not own & used and not loaded:
            found.append(name)
    return found


def test_every_dependency_is_imported_by_the_program() -> None:
    assert not unused(PROJECT["dependencies"], _used(PACKAGES))


def test_every_extra_is_imported_by_program_or_tests() -> None:
    extras = [line for lines in PROJECT["optional-dependencies"].values() for line in lines]
    extras = [line.replace("dask[distributed]", "distributed") for line in extras]
    wanted = [line for line in extras if _name(line) not in RUN_BY_NAME]
    assert not unused(wanted, _used((*PACKAGES, "tests")))


def test_everything_imported_is_asked_for() -> None:
    """The modules of other packages that the program imports belong to a dependency or extra."""
    import sys

    modules = _modules()
    asked = [*PROJECT["dependencies"]]
    asked += [line for lines in PROJECT["optional-dependencies"].values() for line in lines]
    known = {module for line in asked for module in modules.get(_name(line), {_name(line)})}
    known |= {"distributed", "pydantic_core"}  # an extra of dask; pydantic's own core
    known |= {"bpy", "bonsai"}  # Blender, in which the panel of bim/bonsai runs
    imported = {name for name in _used(PACKAGES) if not name.startswith(".")}
    foreign = imported - set(sys.stdlib_module_names) - set(PACKAGES)
    assert not foreign - known


def test_peers_are_extras() -> None:
    needed = {_name(line) for line in PROJECT["dependencies"]}
    assert not needed & PEERS
    assert {_name(line) for line in PROJECT["optional-dependencies"]["peers"]} == PEERS


@pytest.mark.parametrize("name", ["plotly", "hypothesis", "frads"])
def test_an_unused_dependency_is_found(name: str) -> None:
    used = _used((*PACKAGES, "tests"))
    assert unused([f"{name}>=1"], used) == [name]


def test_locked_versions_are_of_what_is_asked_for() -> None:
    """Each dependency has a line in constraints.txt, and each line belongs to one of them."""
    locked = {_name(line) for line in (REPOSITORY / "constraints.txt").read_text().splitlines() if "==" in line}
    asked = [*PROJECT["dependencies"]]
    asked += [line for lines in PROJECT["optional-dependencies"].values() for line in lines]
    todo, closure = [_name(line) for line in asked] + ["distributed"], {"setuptools"}
    installed = True
    while todo:
        name = todo.pop()
        if name in closure:
            continue
        closure.add(name)
        try:
            lines = metadata.requires(name) or []
        except metadata.PackageNotFoundError:
            installed = False
            continue
        todo += [_name(line) for line in lines if "extra ==" not in line]
    assert {_name(line) for line in asked} - locked == set()
    if installed:  # else lines may be of what a missing one asks for
        assert locked - closure == set()
