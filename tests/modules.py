"""The modules of the product as source: their files, their names, and what each of them imports.

    python -m tests.modules

prints the measures of docs/architecture.md: modules, lines, single importers, lines of imports and
the longest chain of imports, lines without code, and exceptions from the format.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from graphlib import TopologicalSorter
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


def measures() -> dict[str, int]:
    """Size of the product and of its imports."""
    sources = {dotted(file_name(path)): path.read_text(encoding="utf-8") for path in MODULES}
    imported: dict[str, set[str]] = {}
    statements = docstrings = 0
    for name, source in sources.items():
        tree = ast.parse(source)
        docstrings += sum(map(_docstring_lines, ast.walk(tree)))
        either = {t if t in sources else t.rpartition(".")[0] for t, _ in imports(tree)}
        imported[name] = either & set(sources) - {name}
        nodes = (n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom))
        statements += sum(node.end_lineno - node.lineno + 1 for node in nodes)
    importers: dict[str, set[str]] = defaultdict(set)
    for name, others in imported.items():
        for other in others:
            importers[other].add(name)
    depth: dict[str, int] = {}
    for name in TopologicalSorter(imported).static_order():
        depth[name] = 1 + max((depth[other] for other in imported[name]), default=0)
    packages = {dotted(file_name(path)) for path in MODULES if path.name == "__init__.py"}
    lines = [line.strip() for source in sources.values() for line in source.splitlines()]
    return {
        "modules": len(sources),
        "lines": len(lines),
        "lines that are empty": lines.count(""),
        "lines of docstrings": docstrings,
        "lines with `# fmt: skip`": sum("# fmt: skip" in line for line in lines),
        "modules with a single importer": sum(len(of) == 1 for name, of in importers.items() if name not in packages),
        "lines of imports": statements,
        "modules in the longest chain of imports": max(depth.values()),
    }


def _docstring_lines(node: ast.AST) -> int:
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    if not isinstance(node, kinds) or ast.get_docstring(node) is None:
        return 0
    return node.body[0].end_lineno - node.body[0].lineno + 1


if __name__ == "__main__":
    for name, value in measures().items():
        print(f"{value:8,}  {name}")
