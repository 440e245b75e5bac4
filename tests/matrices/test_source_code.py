"""The version of a computation: a change in what computes it counts, one elsewhere does not."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

import pytest

from mitsuba_cfs.source_code import OWN, ROOT, import_closure, source_hash

CASE = ("scenes.study.one_case",)
YEAR = ("scenes.year_of_glare.year",)


def write(root: Path, name: str, text: str) -> None:
    file = root.joinpath(*name.split(".")).with_suffix(".py")
    file.parent.mkdir(parents=True, exist_ok=True)
    for folder in file.parents:
        if folder == root:
            break
        (folder / "__init__.py").touch()
    file.write_text(text)


def test_imports_are_followed_wherever_they_stand(tmp_path):
    write(tmp_path, "scenes.a", "from scenes.b import x\nfrom thermal import d\nimport numpy")
    write(tmp_path, "scenes.b", "def f():\n    import bim.c.e\n    import_module('scenes.g')")
    guarded = "if TYPE_CHECKING:\n    from scenes.unused import Only\nelse:\n    import scenes.h"
    write(tmp_path, "bim.c.e", f"from typing import TYPE_CHECKING\n{guarded}")
    for name in ("thermal.d", "scenes.g", "scenes.h", "scenes.unused"):
        write(tmp_path, name, "import os")
    assert import_closure(("scenes.a",), tmp_path) == {
        "scenes",
        "scenes.a",
        "scenes.b",
        "scenes.g",
        "scenes.h",
        "thermal",
        "thermal.d",
        "bim",
        "bim.c",
        "bim.c.e",
        "numpy",
    }
    with pytest.raises(ValueError, match=r"no module scenes\.nowhere"):
        import_closure(("scenes.nowhere",), tmp_path)


def parsed_imports(file: Path) -> set[str]:
    """Own modules that a file imports by its syntax tree, those for type checkers left out."""
    tree = ast.parse(file.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            node.body = [ast.Pass()]
    result = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            result |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            result |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in result if name.partition(".")[0] in OWN and source_of(name)}


def source_of(name: str) -> bool:
    stem = ROOT.joinpath(*name.split("."))
    return stem.with_suffix(".py").is_file() or (stem / "__init__.py").is_file()


def test_imports_are_those_of_the_syntax_tree():
    for package in OWN:
        for file in (ROOT / package).rglob("*.py"):
            name = ".".join(file.relative_to(ROOT).with_suffix("").parts)
            closure = import_closure((name.removesuffix(".__init__"),))
            assert parsed_imports(file) <= closure, name


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Path:
    """The program's sources, to plant changes in."""
    root = tmp_path_factory.mktemp("copy")
    for package in OWN:
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("*.pyc"))
    return root


def hash_after_a_change_of(copy: Path, file: str, modules: tuple[str, ...]) -> str:
    """The hash with a line more in a file, which is then as it was."""
    path = copy / file
    before = path.read_bytes()
    path.write_bytes(before + b"\nPLANTED = 1\n")
    try:
        return source_hash(import_closure(modules, copy), copy)
    finally:
        path.write_bytes(before)


@pytest.fixture(scope="module")
def unchanged(copy) -> dict[tuple[str, ...], str]:
    """The hash of both computations before anything is planted."""
    return {modules: source_hash(import_closure(modules, copy), copy) for modules in (CASE, YEAR)}


@pytest.mark.parametrize(
    "file",
    [
        "scenes/heat/box.py",
        "mitsuba_cfs/methods/phase_light.py",
        "scenes/room/heat.py",
        "thermal/step.py",
        "bim/ifc/shapes.py",
        "mitsuba_cfs/bsdf/tensor_tree.py",
    ],
)
def test_a_case_hangs_on_what_was_forgotten_once(copy, unchanged, file):
    assert hash_after_a_change_of(copy, file, CASE) != unchanged[CASE]


@pytest.mark.parametrize("modules", [CASE, YEAR])
@pytest.mark.parametrize("file", ["scenes/report/page.py", "scenes/study_report/page.py", "scenes/commands/run.py"])
def test_reports_and_commands_do_not_count(copy, unchanged, modules, file):
    assert hash_after_a_change_of(copy, file, modules) == unchanged[modules]


DATA = (".toml", ".csv")


def test_what_computes_is_source_alone():
    """Of data files the hash sees those with the name of a module; texts compute nothing."""
    for package in ("mitsuba_cfs", "bim", "thermal"):
        files = {p for p in (ROOT / package).rglob("*") if p.is_file()}
        files.discard(ROOT / "bim" / "report" / "catalogue.toml")
        files -= {p for p in files if p.suffix in DATA and p.with_suffix(".py") in files}
        assert {p.suffix for p in files} <= {".py", ".pyi", ".typed", ".pyc", ".nbi", ".nbc"}
