"""The options of all commands, from the tree of commands: one noun, one spelling, one meaning."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import click
import pytest

from scenes.cli import cfs

# Spellings whose kind differs from command to command, and why
KINDS_DIFFER = {
    "--out": "a folder of results, or a file where a command writes one",
    "--g": "cfs ifc attach takes a table by angle as well",
    "--band": "a BSDF file may have more than the two of the exports",
}


def commands(command: click.Command, path: str = "") -> Iterator[tuple[str, click.Command]]:
    """Every command that does something, by its name."""
    if not isinstance(command, click.Group):
        yield path, command
        return
    context = click.Context(command)
    for name in command.list_commands(context):
        yield from commands(command.get_command(context, name), f"{path} {name}".strip())


def options() -> Iterator[tuple[str, str, click.Option]]:
    """Spelling, command and option; the long spelling of those that have a short one too."""
    for name, command in commands(cfs):
        for option in command.params:
            if isinstance(option, click.Option):
                yield max(option.opts, key=len), name, option


def kind(option: click.Option) -> object:
    """What an option takes: choices are one kind, whichever of them a command has."""
    found = option.type
    if isinstance(found, click.Choice):
        return "choice"
    if isinstance(found, click.types.IntRange | click.types.FloatRange):
        return type(found), found.min, found.max
    if isinstance(found, click.Path):
        return "path", found.exists, found.file_okay, found.dir_okay
    return type(found), option.is_flag


def meaning(option: click.Option) -> tuple[str, str]:
    """What an option means in all commands, and what this one says of it behind the semicolon."""
    text, _, own = (option.help or "").rstrip(".").partition(";")
    return text.strip(), own.strip()


SHARED: dict[str, dict[str, click.Option]] = defaultdict(dict)
for spelling, name, option in options():
    SHARED[spelling][name] = option
SEVERAL = sorted(s for s, found in SHARED.items() if len(found) > 1)


def test_the_commands_were_found() -> None:
    assert {"run", "dgp", "picture", "study"} <= {n for n, _ in commands(cfs)}
    assert {"--space", "--size", "--samples", "--seed", "--weather", "--method"} <= set(SEVERAL)


@pytest.mark.parametrize("spelling", SEVERAL)
def test_a_spelling_means_one_thing(spelling: str) -> None:
    found = SHARED[spelling]
    if spelling not in KINDS_DIFFER:
        assert len({kind(option) for option in found.values()}) == 1
    if spelling != "--out":
        assert len({meaning(option)[0] for option in found.values()}) == 1
    assert all(meaning(option)[0] for option in found.values()), "its help says nothing"


@pytest.mark.parametrize("spelling", SEVERAL)
def test_another_default_has_its_reason_in_the_help(spelling: str) -> None:
    found = SHARED[spelling]
    if len({repr((o.default, o.required)) for o in found.values()}) > 1 and spelling != "--out":
        silent = [name for name, o in found.items() if not (meaning(o)[1] or o.required)]
        assert not silent


def test_one_thing_has_one_spelling() -> None:
    """By the parameter that an option goes into: the room, the size, the samples, ..."""
    by_parameter: dict[str, set[str]] = defaultdict(set)
    for spelling, _, option in options():
        by_parameter[option.name].add(spelling)
    of_one_command = {"part"}  # gendaymtx's -s and -d are --part sky and --part sun
    twice = {n: s for n, s in by_parameter.items() if len(s) > 1 and n not in of_one_command}
    assert not twice


def test_no_two_spellings_say_the_same() -> None:
    """As `--size` and `--picture-size` did, which went into parameters of two names."""
    by_meaning: dict[str, set[str]] = defaultdict(set)
    for spelling, _, option in options():
        by_meaning[meaning(option)[0]].add(spelling)
    by_meaning.pop("", None)
    assert not {text: found for text, found in by_meaning.items() if len(found) > 1}


def test_the_kinds_that_differ_still_do() -> None:
    for spelling in KINDS_DIFFER:
        assert len({kind(option) for option in SHARED[spelling].values()}) > 1


STARTS_WITHOUT_SUBJECT = ("Of ", "To ", "From ", "By ", "At ", "On ", "In ", "What ", "How ", "As ")


def test_every_help_names_what_the_option_gives() -> None:
    """A noun or a verb first, no preposition that refers to the option's name."""
    riddles = [
        f"{name} {spelling}: {option.help}"
        for spelling, name, option in options()
        if (option.help or "").startswith(STARTS_WITHOUT_SUBJECT)
    ]
    assert not riddles
    assert not {s for s, _, option in options() if not option.help and not option.hidden}
