"""The modules of the product as source: their files, their names, and what each of them imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("mitsuba_cfs", "bim", "thermal", "scenes")
MODULES = sorted(path for package in PACKAGES for path in (REPOSITORY / package).rglob("*.py"))


def file_name(path: Path) -> str:
    """A module's file as the tests name it, such as `bim/ifc/source.py`."""
    return path.relative_to(REPOSITORY).as_posix()


def dotted(name: str) -> str:
    """The module's name for `import` from that of its file."""
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def imports(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Dotted names of all that is imported anywhere in a module, with the line.

    `from a import b` is `a.b`, whatever b is.  Imports inside functions and under TYPE_CHECKING
    count, and so do `import_module("x")` and `find_spec("x")` with a plain text.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = ast.unparse(node.func).rpartition(".")[2]
            if called in {"import_module", "find_spec", "__import__"}:
                yield str(node.args[0].value), node.lineno
