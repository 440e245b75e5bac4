"""The examples at the end of each command's help have options and values that exist."""

from __future__ import annotations

import shlex
from collections.abc import Iterator

import click
import pytest

from scenes.cli import COMMANDS, LazyGroup
from scenes.commands.examples import EXAMPLES

RENAMED = {"ifc check", "ifc export"}


def _commands(group: click.Group, prefix: str = "") -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from _commands(command, f"{prefix}{name} ")
        else:
            yield prefix + name, command


ALL = dict(_commands(LazyGroup()))
LINES = [(name, line) for name, lines in EXAMPLES.items() for line in lines]


def test_every_command_has_an_example() -> None:
    assert set(ALL) - RENAMED == set(EXAMPLES)


@pytest.mark.parametrize(("name", "line"), LINES)
def test_an_example_has_the_commands_own_options(name: str, line: str) -> None:
    command, words = ALL[name], shlex.split(line)
    path = ["cfs", *name.split()]
    assert words[: len(path)] == path
    context = click.Context(command, info_name=name)
    context.ignore_unknown_options = name == "glare"  # whose words are evalglare's
    values, rest, _ = command.make_parser(context).parse_args(words[len(path) :])
    assert not rest
    for parameter in command.params:
        given = values.get(parameter.name)
        is_given = isinstance(given, str | tuple | list) and bool(given)
        if is_given and isinstance(parameter.type, (click.Choice, click.IntRange, click.FloatRange)):
            parameter.type_cast_value(context, given)
        if parameter.required and "--list" not in words:
            assert is_given, parameter.name


@pytest.mark.parametrize("name", ["run", "bsdf generate", "glare"])
def test_the_help_ends_with_examples(name: str) -> None:
    command = ALL[name]
    text = command.get_help(click.Context(command, info_name=name))
    assert text.rstrip().endswith(EXAMPLES[name][-1])


def test_a_near_command_is_proposed() -> None:
    group = LazyGroup()
    with pytest.raises(click.UsageError, match="Did you mean 'study'"):
        group.resolve_command(click.Context(group), ["studdy"])
    with pytest.raises(click.UsageError, match="No such command 'frobnicate'") as error:
        group.resolve_command(click.Context(group), ["frobnicate"])
    assert "mean" not in str(error.value)
    assert "study" in COMMANDS
    inner = LazyGroup().get_command(click.Context(group), "ifc")
    assert isinstance(inner, click.Group)
    with pytest.raises(click.UsageError, match="Did you mean 'info'"):
        inner.resolve_command(click.Context(inner), ["inf"])
