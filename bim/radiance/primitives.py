"""Radiance scene files as primitives: modifier, type, name and arguments, in the files' order.

Source of the format: "The RADIANCE 5.1 Synthetic Imaging System" (`ray.pdf` of the manuals), 2 and
3; `!` lines are commands whose output takes their place.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

VOID = "void"
WORD = re.compile(r'"([^"]*)"|\'([^\']*)\'|(\S+)')
LARGEST_FILE = 512 * 2**20  # of text [bytes]
MOST, LEAST = 1e30, 1e-100  # of a number: products of a few are still numbers; below, it is 0


@dataclass(frozen=True, slots=True)
class Primitive:
    """One object, material or pattern of a scene file."""

    modifier: str
    kind: str  # polygon, plastic, ...
    name: str
    strings: tuple[str, ...]
    numbers: tuple[float, ...]
    file: Path
    line: int

    def fault(self, message: str) -> DataError:
        """An error that names the place of this primitive."""
        return DataError(message, file=f"{self.file}:{self.line}", element=f"{self.kind} {self.name}")


@dataclass(frozen=True, slots=True)
class Definition:
    """A modifier with the transformation of the file that defines it."""

    primitive: Primitive
    frame: NDArray[np.float64]  # [4, 4] world = frame @ (x, y, z, 1) of its functions


@dataclass(frozen=True, slots=True)
class Command:
    """A `!` line: the words of each program of its pipe."""

    programs: tuple[tuple[str, ...], ...]
    file: Path
    line: int

    def fault(self, message: str) -> DataError:
        """An error that names the place of this line."""
        return DataError(message, file=f"{self.file}:{self.line}", element=f"!{self.programs[0][0]}")


def read_statements(path: Path) -> Iterator[Primitive | Command]:
    """Primitives and commands of one file, in its order.

    Raises: `DataError` with file and line for text that is no Radiance scene.
    """
    yield from parsed(_text(path), path)


def parsed(text: str, path: Path) -> Iterator[Primitive | Command]:
    """Primitives and commands of a file's text."""
    words = _Words(text, path)
    while (word := words.next_statement()) is not None:
        if word.startswith("!"):
            yield words.command()
        else:
            yield words.primitive(word)


def number_of(word: str) -> float:
    """The number that a word is; `ValueError` above `MOST`, 0 below `LEAST`."""
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not abs(value) < MOST:
        raise ValueError(f"a number below {MOST:g} is expected, got {word!r:.60}")
    return value if abs(value) >= LEAST else 0.0


def count_of(word: str) -> int:
    """The whole number that a word is; `ValueError` for other words."""
    if not (word.isdecimal() and len(word) < 10):
        raise ValueError(f"a whole number is expected, got {word!r:.60}")
    return int(word)


class _Words:
    """The words of a text with their lines; comments are skipped."""

    def __init__(self, text: str, path: Path) -> None:
        self.lines, self.path = text.splitlines(), path
        self.line = 0  # of the last word, from 1
        self._rest: list[str] = []

    def next_statement(self) -> str | None:
        """First word of the next statement, None at the end."""
        return self._next()

    def _next(self) -> str | None:
        while not self._rest:
            if self.line >= len(self.lines):
                return None
            text = self.lines[self.line].lstrip("\ufeff")
            self.line += 1
            if text.lstrip().startswith("!"):
                return "!"
            words = (next(filter(None, m.groups()), "") for m in WORD.finditer(text))
            for word in words:
                if word.startswith("#"):
                    break
                self._rest.append(word)
        return self._rest.pop(0)

    def _word(self, what: str, start: int) -> str:
        word = self._next()
        if word is None or word == "!":
            self._refuse(start, f"ends before {what}")
        return word

    def command(self) -> Command:
        """The `!` line just met, with the lines that a backslash adds."""
        start, text = self.line, self.lines[self.line - 1].lstrip()[1:]
        while text.endswith("\\") and self.line < len(self.lines):
            text = text[:-1] + " " + self.lines[self.line]
            self.line += 1
        if re.search(r"[`$;&<>]", text):
            self._refuse(start, f"!{text.strip()}: only programs and their pipes are read, no shell")
        programs = tuple(
            tuple(next(filter(None, m.groups()), "") for m in WORD.finditer(part)) for part in text.split("|")
        )
        if not all(programs):
            self._refuse(start, f"!{text.strip()}: a program's name is missing")
        return Command(programs, self.path, start)

    def primitive(self, modifier: str) -> Primitive:
        """The primitive whose first word is the modifier."""
        start = self.line
        kind, name = self._word("the type", start), self._word("the name", start)
        if kind == "alias":
            return Primitive(modifier, kind, name, (self._word("the name", start),), (), self.path, start)
        strings = [self._word("its strings", start) for _ in range(self._count(start, "strings"))]
        for _ in range(self._count(start, "integers")):
            self._word("its integers", start)
        numbers = [self._number(start) for _ in range(self._count(start, "numbers"))]
        return Primitive(modifier, kind, name, tuple(strings), tuple(numbers), self.path, start)

    def _count(self, start: int, of: str) -> int:
        word = self._word(f"the count of {of}", start)
        try:
            return count_of(word)
        except ValueError as error:
            self._refuse(start, f"the count of {of}: {error}")

    def _number(self, start: int) -> float:
        word = self._word("its numbers", start)
        try:
            return number_of(word)
        except ValueError as error:
            self._refuse(start, str(error))

    def _refuse(self, start: int, message: str) -> NoReturn:
        raise DataError(f"no Radiance scene: {message}", file=f"{self.path}:{start}")


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise DataError(f"is bigger than {LARGEST_FILE / 2**20:.0f} MB", file=path)
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    if data.startswith(b"#?RADIANCE") and b"\0" in data:
        raise DataError("is an octree; give the scene files that it was made of", file=path)
    if b"\0" in data:
        raise DataError("is no text", file=path)
    return data.decode("utf-8", errors="replace")
