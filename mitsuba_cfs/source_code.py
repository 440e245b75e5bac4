"""The version of a computation: a hash of its source and of all modules that it imports.

What is kept on disk (matrices, finished cases of a study) is served again only to the code that
made it.  That code is the module that computes, and every module of this program that it imports,
directly or not, inside functions too; imports for type checkers alone compute nothing.  Packages
of others count by their version.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]  # the folder of this program's packages
OWN = ("mitsuba_cfs", "bim", "thermal", "scenes")  # packages that are read, not taken by version


@cache
def code_version(*modules: str) -> str:
    """A hash of modules, of all own modules that they import, and of versions of other packages.

    Args: modules: dotted names, such as `__name__`.
    """
    return source_hash(import_closure(modules))


def source_hash(names: frozenset[str], root: Path = ROOT) -> str:
    """A hash of the sources of own modules and the versions of the other packages."""
    state = hashlib.sha256()
    for name in sorted(names):
        file = _file(name, root)
        content = _installed(name).encode() if file is None else file.read_bytes()
        for suffix in (".toml", ".csv"):  # the data of the module of that name
            if file is not None and (data := file.with_suffix(suffix)).is_file():
                content += data.read_bytes()
        state.update(f"{name} {len(content)};".encode() + content)
    return state.hexdigest()


def import_closure(modules: tuple[str, ...], root: Path = ROOT) -> frozenset[str]:
    """Dotted names of the modules, of all own ones that they import, and top-level others.

    Raises: `ValueError` for a module that is not there.
    """
    result: set[str] = set()
    waiting = list(modules)
    for name in modules:
        if _file(name, root) is None:
            raise ValueError(f"no module {name} in {root}")
    while waiting:
        name = waiting.pop()
        if name in result:
            continue
        result.add(name)
        file = _file(name, root)
        if file is not None:
            waiting += _imported(file.read_bytes(), root)
    return frozenset(result)


def _imported(source: bytes, root: Path) -> Iterator[str]:
    """Imports of a source: own modules in full, other packages by their first name."""
    for module, name in _import_statements(source):
        whole = f"{module}.{name}"
        own = bool(name) and module.partition(".")[0] in OWN
        yield from _modules(whole if own and _file(whole, root) is not None else module, root)


# Statements are matched, as parsing 300 modules takes 0.7 s; a block for type checkers is left out
_FOR_TYPES = re.compile(rb"^([ \t]*)if (?:typing\.)?TYPE_CHECKING:\n(?:\1[ \t]+.*\n|[ \t]*\n)*", re.M)
_IMPORT = re.compile(rb"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n(]+)|import[ \t]+([^\n]+))", re.M)
_CALLED = re.compile(rb"\bimport_module\(\s*[\"']([\w.]+)[\"']")
_COMMENT = re.compile(rb"#[^\n]*")


@cache
def _import_statements(source: bytes) -> tuple[tuple[str, str], ...]:
    """Imports of a source as (module, name in it); no name for `import module`."""
    source = _FOR_TYPES.sub(b"", source)
    result = [(module.decode(), "") for module in _CALLED.findall(source)]
    for module, names, modules in _IMPORT.findall(source):
        listed = _COMMENT.sub(b"", names or modules).strip(b"() \t\r\n").split(b",")
        first = [one.split()[0].decode() for one in listed if one.strip()]
        result += [(module.decode(), name) if module else (name, "") for name in first]
    return tuple(dict.fromkeys(result))


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


@cache
def _file(name: str, root: Path) -> Path | None:
    """The source of an own module; None for others."""
    if name.partition(".")[0] not in OWN:
        return None
    stem = root.joinpath(*name.split("."))
    return next((f for f in (stem / "__init__.py", stem.with_suffix(".py")) if f.is_file()), None)


# Packages that are imported by another name than they are installed by; `metadata.packages_distributions`
# knows all, but reads the file lists of all installed packages for it
_DISTRIBUTIONS = {"PIL": "pillow", "colour": "colour-science", "sklearn": "scikit-learn"}


@cache
def _installed(package: str) -> str:
    """The version of another package, by the name it is imported as; empty if it is not installed."""
    try:
        return metadata.version(_DISTRIBUTIONS.get(package, package))
    except metadata.PackageNotFoundError:
        return ""
