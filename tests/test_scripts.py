"""The runner of validation and benchmarks: options by signature, and the commands of the docs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated

import pytest

from tests.benchmarks import harness
from tests.conftest import REPOSITORY
from tests.scripts import called, parser_of, run_script, scripts

PACKAGES = ("tests.validation", "tests.benchmarks")
SCRIPTS = [(package, name) for package in PACKAGES for name in scripts(package)]
COMMAND = re.compile(r"python -m (tests\.(?:validation|benchmarks))[ \t]+([\w-]+)((?:[^`\n]|\\\n)*)")


def commands() -> list[tuple[str, str, str, str]]:
    """File, package, name and options of each command of the documentation."""
    files = [*(REPOSITORY / "docs").rglob("*.md"), *(REPOSITORY / "docs").rglob("*.toml")]
    files += (REPOSITORY / "tests").rglob("SOURCE.md")
    return [(file.name, *parts) for file in sorted(files) for parts in COMMAND.findall(file.read_text("utf-8"))]


def main(
    folder: Path,
    numbers: Sequence[int] = (1, 2),
    *,
    size: Annotated[int, "pixels"] = 3,
    only: Sequence[str] = (),
    kind: Annotated[str, ("one", "two")] = "one",
    json_: Path | None = None,
    every: bool = False,
) -> tuple[object, ...]:
    """A script."""
    return folder, numbers, size, only, kind, json_, every


def test_a_signature_is_a_command_line():
    parser = parser_of(main, "x", "text")
    assert called(main, parser.parse_args(["a"])) == (Path("a"), (1, 2), 3, [], "one", None, False)
    words = ["a", "5", "--size", "7", "--only", "b", "c", "--only", "d", "--kind", "two"]
    found = called(main, parser.parse_args([*words, "--json", "f", "--every"]))
    assert found == (Path("a"), [5], 7, ["b", "c", "d"], "two", Path("f"), True)
    for wrong in ([], ["a", "b"], ["a", "--kind", "three"], ["a", "--json_", "f"]):
        with pytest.raises(SystemExit):
            parser.parse_args(wrong)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script[1])
def test_each_script_has_a_command_line_and_says_what_it_shows(script):
    package, name = script
    module = import_module(f"{package}.{name}")
    assert parser_of(module.main, name, module.__doc__).format_help()
    assert scripts(package)[name].endswith(".")


@pytest.mark.parametrize("command", commands(), ids=lambda command: " ".join(command[::2]))
def test_commands_of_the_documentation_exist(command):
    _, package, name, options = command
    if name in scripts(package):
        known = parser_of(import_module(f"{package}.{name}").main, name, "")._option_string_actions
        assert set(re.findall(r"(?<!\S)\[?(--[\w-]+)", options)) <= set(known)
    else:
        assert name in {*harness.benchmarks(), "--list", "NAME"}


def test_the_list_names_all_and_an_unknown_name_is_refused(capsys):
    assert run_script("tests.validation", []) == 0
    assert "geneva" in capsys.readouterr().out
    assert run_script("tests.validation", ["nothing"]) == 2
    assert "there is no 'nothing'" in capsys.readouterr().err


def test_every_runner_of_the_comparison_of_devices_runs_by_its_name_alone():
    from tests.validation.devices import RUNNERS, runners_without_options

    every = runners_without_options()
    assert set(RUNNERS) <= set(every) and "method_errors" in every
    assert not {"devices", "mutants", "energyplus_twin"} & set(every)  # the last needs a study
