"""The head of a result on the terminal, and the notes that come after it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from scenes.head import Head


class PrintedHead:
    """Prints a head once it is known, and afterwards only notes that it does not have."""

    def __init__(self) -> None:
        """Nothing is printed yet."""
        self._lines: dict[str, None] = {}
        self.record: dict[str, list] = {}  # of the head

    def __call__(self, head: Head) -> None:
        """Print the lines of a head that were not printed yet."""
        for line in head.lines:
            if line not in self._lines:
                click.echo(line)
        self.record = head.record
        self._lines |= dict.fromkeys((*head.lines, *head.notes))

    def notes(self, notes: Iterable[str]) -> None:
        """Print the notes of a result that are not in the head."""
        for note in notes:
            if note not in self._lines:
                click.echo(f"note: {note}")
