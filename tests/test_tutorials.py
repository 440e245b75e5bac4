"""Tutorials and how-to: their commands have options, values and files that exist, and (slow) run."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import click
import pytest

from scenes.cli import run as main
from tests.conftest import REPOSITORY
from tests.scenes.test_help_examples import ALL

DOCS = REPOSITORY / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
HOW_TO = re.compile(r"`(cfs [^`]+)`")


def steps(page: Path) -> list[tuple[str, str]]:
    """A page's steps in order: a command of cfs, or a file with its text."""
    found = []
    for language, text in FENCE.findall(page.read_text("utf-8")):
        if language == "toml":
            found.append((text.partition("\n")[0].removeprefix("# "), text))
        else:
            lines = text.replace("\\\n", " ").splitlines()
            found += [("cfs", line) for line in lines if line.startswith("cfs ")]
    return found


def copied(page: Path) -> list[tuple[Path, str]]:
    """The files that a page's `cp` lines copy, with their names in its folder."""
    found = []
    for line in re.findall(r"^cp ~/mitsuba-cfs/(.+)$", page.read_text("utf-8"), re.MULTILINE):
        pattern, target = line.split()
        folder, _, name = pattern.rpartition("/")
        names = re.fullmatch(r"(.*)\{(.*)\}(.*)", name)
        patterns = [names[1] + part + names[3] for part in names[2].split(",")] if names else [name]
        for glob in patterns:
            files = sorted((REPOSITORY / folder).glob(glob))
            assert files, f"{page.name}: {glob}"
            found += [(file, file.name if target == "." else target) for file in files]
    return found


def results(page: Path) -> list[str]:
    """The files in the first column of a page's tables."""
    rows = re.findall(r"^\| (`[^|]*`) \|", page.read_text("utf-8"), re.MULTILINE)
    return [name for row in rows for name in re.findall("`([^`]+)`", row)]


def parsed(line: str) -> tuple[click.Command, dict]:
    """The command of a line and its options, by the program's own parser."""
    words = shlex.split(line)
    name = next(name for name in (" ".join(words[1:3]), words[1]) if name in ALL)
    command = ALL[name]
    context = click.Context(command, info_name=name)
    context.ignore_unknown_options = name == "glare"
    values, rest, _ = command.make_parser(context).parse_args(words[1 + len(name.split()) :])
    assert not rest, line
    return command, values


def checked(line: str, have: set[str] | None) -> set[str]:
    """The files that a line writes; the files that it reads are among those that there are."""
    command, values = parsed(line)
    written = set()
    for parameter in command.params:
        value = values.get(parameter.name)
        entries = value if isinstance(value, tuple | list) else [value]
        entries = [entry for entry in entries if isinstance(entry, str) and entry]
        if parameter.required and "--list" not in line:
            assert entries, f"{line}: {parameter.name}"
        for entry in entries:
            if isinstance(parameter.type, (click.Choice, click.IntRange, click.FloatRange)):
                parameter.type_cast_value(click.Context(command), entry)
            if isinstance(parameter.type, click.Path):
                if not parameter.type.exists:
                    written.add(entry)
                elif have is not None:
                    assert entry in have, f"{line}: {entry} is not there yet"
    return written


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_uses_options_and_files_that_exist(page: Path) -> None:
    have = {name for _, name in copied(page)}
    assert have
    for name, text in steps(page):
        have |= checked(text, have) if name == "cfs" else {name}
    for name in results(page):
        assert any(name == made or name.startswith(made + "/") for made in have), name


@pytest.mark.parametrize("line", sorted(set(HOW_TO.findall((DOCS / "howto.md").read_text("utf-8")))))
def test_an_answer_of_the_how_to_is_a_command(line: str) -> None:
    if line != "cfs app":
        checked(line, None)


def test_a_wrong_command_is_found() -> None:
    for line in (
        "cfs study blinds.toml --out blinds --fast",
        "cfs study blinds.toml",
        "cfs bsdf generate --basis third --out a.xml",
    ):
        with pytest.raises((AssertionError, click.UsageError)):
            checked(line, None)
    with pytest.raises(AssertionError):
        checked("cfs check house.ifc", {"office.ifc"})


def test_every_tutorial_is_linked() -> None:
    for page in ("../README.md", "quickstart.md", "howto.md", "../mkdocs.yml"):
        text = (DOCS / page).read_text("utf-8")
        assert not [t.name for t in TUTORIALS if f"tutorials/{t.name}" not in text], page


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for source, name in copied(page):
        shutil.copy(source, tmp_path / name)
    for name, text in steps(page):
        if name == "cfs":
            assert main(shlex.split(text)[1:]) == 0, text
        else:
            (tmp_path / name).write_text(text, "utf-8")
    missing = [name for name in results(page) if not (tmp_path / name).is_file()]
    assert not missing
