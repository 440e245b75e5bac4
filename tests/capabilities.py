"""What the program can do, derived from its code, each with a test that mentions it.

    python -m tests.capabilities > now.tsv
    python -m tests.capabilities --repository OTHER_CHECKOUT > before.tsv

A line is `kind`, `name`, `test`, separated by tabs.  Kinds: `command`, `option` and `value` of the
command line, `argument` by its number; `key` and `key value` of TOML files (study, operation,
thermal data ...), from the pydantic models; `python`, the public names of the packages; `rule` and
its criteria; `ending`, the file name endings that the code names; `file`, the names of files that
it reads or writes.  A test that mentions a name may still test little.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import json
import pkgutil
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

REPOSITORY = Path(__file__).parent.parent
STORED = REPOSITORY / "tests" / "reference" / "capabilities"
PACKAGES = ("scenes", "bim", "mitsuba_cfs", "thermal")
NO_PRODUCT = ("scenes/evidence/",)  # in older checkouts
ENDING = re.compile(r"\*?\.([a-z][a-z0-9]{1,7})")
FILE = re.compile(r"[a-z][\w-]*\.(csv|json|parquet|nc|html|png|hdr|exr|xml|rad|pts|vf|sh|svg|epw)")
Capability = tuple[str, str]  # kind and name


def capabilities(repository: Path = REPOSITORY) -> list[Capability]:
    """All capabilities of the packages that `import scenes` finds, sorted."""
    gathered = {*_commands(), *_keys(), *_python(), *_rules(repository), *_names(repository)}
    return sorted(gathered)


def _commands() -> Iterator[Capability]:
    import click

    from scenes.cli import cfs

    def walk(command: click.Command, path: tuple[str, ...]) -> Iterator[Capability]:
        name = " ".join(path)
        if path:
            yield "command", name
        arguments = [one for one in command.params if isinstance(one, click.Argument)]
        yield from (("argument", f"{name} {i + 1}") for i in range(len(arguments)))
        for parameter in command.params:
            words = (*parameter.opts, *parameter.secondary_opts)
            if isinstance(parameter, click.Option):
                yield from (("option", f"{name} {word}".strip()) for word in words)
            for value in getattr(parameter.type, "choices", ()):
                yield "value", f"{name} {max(words, key=len)} {value}"
        if isinstance(command, click.Group):
            context = click.Context(command)
            for inner in command.list_commands(context):
                found = command.get_command(context, inner)
                if found is not None:
                    yield from walk(found, (*path, inner))

    yield from walk(cfs, ())


def _keys() -> Iterator[Capability]:
    """Keys of TOML files: from models that no other model holds, down to each key."""
    from pydantic import BaseModel

    for found in pkgutil.walk_packages(importlib.import_module("scenes").__path__, "scenes."):
        if ".evidence" not in found.name:
            importlib.import_module(found.name)
    models = {one for one in _subclasses(BaseModel) if one.__module__.startswith("scenes.")}
    models = {one for one in models if "[" not in one.__name__}
    face = set(importlib.import_module("scenes").__all__)  # `Study`, which `Design` extends
    leaves = {one for one in models if all("[" in sub.__name__ for sub in one.__subclasses__())}
    models = leaves | {one for one in models if one.__name__ in face}
    inner = {
        held
        for one in models
        for field in one.model_fields.values()
        for held in _types(field.annotation)
        if isinstance(held, type) and issubclass(held, BaseModel)
    }

    def walk(model: Any, path: str, above: frozenset[Any]) -> Iterator[Capability]:
        for key, field in model.model_fields.items():
            name = f"{path}.{field.alias or key}"
            yield "key", name
            for held in _types(field.annotation):
                if get_origin(held) is Literal:
                    yield from (("key value", f"{name} = {value!r}") for value in get_args(held))
                elif isinstance(held, type) and issubclass(held, BaseModel) and held not in above:
                    yield from walk(held, name, above | {held})

    for root in models - inner:
        yield from walk(root, root.__name__, frozenset({root}))


def _subclasses(base: type) -> Iterator[type]:
    for one in base.__subclasses__():
        yield one
        yield from _subclasses(one)


def _types(annotation: Any) -> Iterator[Any]:
    """A type and all types inside it."""
    yield annotation
    if get_origin(annotation) is not Literal:
        for inner in get_args(annotation):
            yield from _types(inner)


def _python() -> Iterator[Capability]:
    for package in PACKAGES:
        module = importlib.import_module(package)
        yield from (("python", f"{package}.{name}") for name in getattr(module, "__all__", ()))


def _rules(repository: Path) -> Iterator[Capability]:
    for file in sorted((repository / "scenes" / "comply" / "rules").glob("*.toml")):
        yield "rule", file.stem
        for criterion in tomllib.loads(file.read_text("utf-8")).get("criterion", ()):
            yield "rule", f"{file.stem}: {criterion.get('key') or criterion.get('name')}"


def _names(repository: Path) -> Iterator[Capability]:
    """File name endings and file names among the texts of the code, docstrings left out."""
    for package in PACKAGES:
        for path in (repository / package).rglob("*.py"):
            if path.relative_to(repository).as_posix().startswith(NO_PRODUCT):
                continue
            for text in _texts(path.read_text("utf-8")):
                if match := ENDING.fullmatch(text):
                    yield "ending", f".{match[1]}"
                elif FILE.fullmatch(text):
                    yield "file", text


def _texts(source: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


# ---- tests that mention a capability


@cache
def _tests(repository: Path) -> dict[str, str]:
    """Text of each file of tests, the runners and this one left out."""
    found = {}
    for path in sorted((repository / "tests").rglob("*.py")):
        name = path.relative_to(repository).as_posix()
        script = name.startswith(("tests/validation/", "tests/benchmarks/"))
        if (path.name.startswith("test_") or not script) and "capabilities" not in path.name:
            found[name] = path.read_text("utf-8")
    return found


def _patterns(kind: str, name: str) -> list[str]:
    """Regular expressions of which a test that mentions the capability has all."""
    word = re.escape(name.rpartition(" ")[2])
    if kind == "command":
        parts = [re.escape(part) for part in name.split()]
        between = r"[\"', ]+"
        return [rf"[\"' ]{between.join(parts)}[\"' ]"]
    if kind == "argument":
        return _patterns("command", name.rpartition(" ")[0])
    if kind in ("option", "value"):
        command = name.split(" --")[0].split()
        near = rf"[\"' _]{re.escape(command[-1] if command else name)}\b"
        option = name.rpartition(" ")[2]
        python = option.strip("-").replace("-", "_") if option.startswith("--") else word
        return [rf"(?<![\w-])({word}|{python})(?![\w-])", near]
    if kind == "key":
        *_, table, key = name.split(".")
        return [rf"\b{re.escape(key)}\b", rf"\b{re.escape(table)}\b"]
    if kind == "key value":
        return [rf"\b{re.escape(str(ast.literal_eval(name.partition(' = ')[2])))}\b"]
    if kind == "python":
        return [rf"\b{re.escape(name.rpartition('.')[2])}\b"]
    if kind == "rule":
        return [re.escape(name.rpartition(": ")[2])]
    return [re.escape(name)]


def mentioned(kind: str, name: str, repository: Path = REPOSITORY) -> str:
    """A test file that mentions the capability, the one that does so most often; or nothing."""
    patterns = [re.compile(pattern) for pattern in _patterns(kind, name)]
    counts = {
        file: len(patterns[0].findall(text))
        for file, text in _tests(repository).items()
        if all(pattern.search(text) for pattern in patterns)
    }
    if counts:
        return max(counts, key=lambda file: (counts[file], file))
    shared = kind == "option" and len(patterns) > 1  # an option that other commands have too
    texts = _tests(repository).items() if shared else ()
    alike = [file for file, text in texts if patterns[0].search(text)]
    return f"{alike[0]} (with another command)" if alike else ""


# ---- comparison with a stored list


def read_stored(path: Path) -> dict[Capability, str]:
    """Capabilities and their tests of a stored list."""
    lines = path.read_text("utf-8").splitlines()
    rows = [(*line.split("\t"), "", "")[:3] for line in lines if line and not line.startswith("#")]
    return {(kind, name): test for kind, name, test in rows}


def renamed(capability: Capability, renames: dict[str, str]) -> Capability | None:
    """The capability under its name of today; nothing where it has gone for a reason.

    `renames` has `kind: name` or the beginning of names that end with ` *`, and what is now there;
    an empty text where the capability has gone.
    """
    kind, name = capability
    for old, new in renames.items():
        start = old.removesuffix("*")
        whole = f"{kind}: {name}"
        if whole == old or (old.endswith("*") and whole.startswith(start)):
            if not new:
                return None
            now = new.removesuffix("*") + whole.removeprefix(start) if old != whole else new
            kind, _, name = now.partition(": ")
            return kind, name
    return capability


def missing(before: Iterable[Capability], now: Iterable[Capability], renames: dict[str, str]) -> list[Capability]:
    """Capabilities of a stored list that are there neither by name nor by a rename."""
    there = set(now)
    expected = ((one, renamed(one, renames)) for one in before)
    return [one for one, other in expected if other is not None and other not in there]


def read_renames() -> dict[str, str]:
    """What has another name than at the stored commit."""
    return json.loads((STORED / "renames.json").read_text("utf-8"))


def compared(before: dict[Capability, str], now: dict[Capability, str]) -> str:
    """A table by kind: how many there were and are, and how many of them a test mentions."""
    lines = ["| kind | before | mentioned by a test | now | mentioned by a test |", "|---|---|---|---|---|"]
    for kind in sorted({kind for kind, _ in {*before, *now}}):
        counts = []
        for listed in (before, now):
            tests = [test for (one, _), test in listed.items() if one == kind]
            counts += [len(tests), sum(map(bool, tests))]
        lines.append(f"| {kind} | {' | '.join(map(str, counts))} |")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Print the list of a checkout, of this one by default."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--repository", type=Path, default=REPOSITORY)
    parser.add_argument("--compare", type=Path, metavar="BEFORE.tsv", help="print a table instead")
    options = parser.parse_args(arguments)
    if options.compare:
        now = {one: mentioned(*one) for one in capabilities()}
        before = read_stored(options.compare)
        print(compared(before, now))
        gone = missing(before, now, read_renames())
        print("\n".join(f"missing: {kind}: {name}" for kind, name in gone))
        return bool(gone)
    repository = options.repository.resolve()
    if repository != REPOSITORY:  # its own packages, in a Python of its own
        code = (
            "import runpy, sys; sys.path.insert(0, sys.argv[1]); "
            "m = runpy.run_path(sys.argv[2]); m['show'](m['Path'](sys.argv[1]))"
        )
        command = [sys.executable, "-P", "-c", code, str(repository), __file__]
        return subprocess.run(command, check=False, cwd=repository).returncode
    show(repository)
    return 0


def show(repository: Path) -> None:
    """Print the capabilities of a checkout."""
    for kind, name in capabilities(repository):
        print(kind, name, mentioned(kind, name, repository), sep="\t")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
