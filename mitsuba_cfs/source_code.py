"""The version of a computation: a hash of the source that computes it, found by its imports.

What is kept on disk (matrices, finished cases of a study) is served again only to the code that
made it.  That code is the module that computes, and every module of this program that it imports,
directly or not, inside functions too; imports for type checkers alone compute nothing.  Packages
of others count by their version.
"""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]  # the folder of this program's packages
OWN = ("mitsuba_cfs", "bim", "thermal", "scenes")  # packages that are read, not taken by version


@cache
def code_version(*modules: str) -> str:
    """A hash of the modules, of all of this program's that they import, and of other packages.

    Args: modules: dotted names, such as `__name__`.
    """
    return source_hash(import_closure(modules))


def source_hash(names: frozenset[str], root: Path = ROOT) -> str:
    """A hash of the sources of own modules and the versions of the other packages."""
    state = hashlib.sha256()
    for name in sorted(names):
        file = _file(name, root)
        content = _installed(name).encode() if file is None else file.read_bytes()
        state.update(f"{name} {len(content)};".encode() + content)
    return state.hexdigest()


def import_closure(modules: tuple[str, ...], root: Path = ROOT) -> frozenset[str]:
    """Dotted names of the modules, of all own ones that they import, and top-level others.

    Raises: `ValueError` for a module that is not there.
    """
    found: set[str] = set()
    waiting = list(modules)
    for name in modules:
        if _file(name, root) is None:
            raise ValueError(f"no module {name} in {root}")
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        file = _file(name, root)
        if file is not None:
            waiting += _imported(_tree(file), root)
    return frozenset(found)


def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_bytes(), str(file))


def _imported(tree: ast.AST, root: Path) -> Iterator[str]:
    """What a module imports: own modules whole, of other packages the first name."""
    for node in _computing(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _modules(alias.name, root)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                own = node.module.partition(".")[0] in OWN
                is_module = own and _file(whole, root) is not None
                yield from _modules(whole if is_module else node.module, root)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            if ast.unparse(node.func).rpartition(".")[2] == "import_module":
                yield from _modules(str(node.args[0].value), root)


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a module without what stands under `if TYPE_CHECKING`."""
    yield node
    children: Iterable[ast.AST]
    if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
        children = node.orelse
    else:
        children = ast.iter_child_nodes(node)
    for child in children:
        yield from _computing(child)


def _modules(name: str, root: Path) -> Iterator[str]:
    """An own module with the packages around it, whose `__init__` runs too; or a package's name."""
    parts = name.split(".")
    if parts[0] not in OWN:
        if parts[0] not in sys.stdlib_module_names:
            yield parts[0]
        return
    for length in range(1, len(parts) + 1):
        if _file(".".join(parts[:length]), root) is not None:
            yield ".".join(parts[:length])


def _file(name: str, root: Path) -> Path | None:
    """The source of an own module; None for what is not one."""
    if name.partition(".")[0] not in OWN:
        return None
    stem = root.joinpath(*name.split("."))
    return next((f for f in (stem / "__init__.py", stem.with_suffix(".py")) if f.is_file()), None)


@cache
def _installed(package: str) -> str:
    """The version of another package, by the name it is imported as."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        pass
    names = metadata.packages_distributions().get(package, ())
    return " ".join(f"{name} {metadata.version(name)}" for name in sorted(set(names)))
