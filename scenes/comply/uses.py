"""The use of each room: from a mapping file, else from what the IFC file says, else assumed."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from pathlib import Path

from pydantic import Field

from bim.model import Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.language.catalogue import N_
from scenes.toml_file import TomlTable, read_table, validated

UNKNOWN = "unknown"
WORDS = Path(str(files(__package__) / "uses.toml"))
GERMAN = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})
BEGINNING = 5  # letters from which on a word may also begin a longer one


class UseTable(TomlTable):
    """A use of rooms, and the words by which it is known."""

    key: str
    occupied: bool
    words: tuple[str, ...] = ()


class UsesFile(TomlTable):
    """A mapping file: uses by words, and rooms by name, number or GUID."""

    use: tuple[UseTable, ...] = ()
    rooms: dict[str, str] = Field({})  # name, number, label or GUID: key of a use
    dwellings: dict[str, tuple[str, ...]] = Field({})  # their rooms, "A1*" for all that begin so


@dataclass(frozen=True, slots=True)
class RoomUse:
    """What a room is used for, and how that is known."""

    key: str
    occupied: bool  # people are there regularly and for long
    source: str  # in words
    assumed: bool = False
    dwelling: str = ""  # that the room is in


@dataclass(frozen=True, slots=True)
class RoomUses:
    """How rooms get their use."""

    uses: tuple[UseTable, ...]  # those of the user's file first
    rooms: Mapping[str, str]
    file: str = ""  # that names rooms
    dwellings: Mapping[str, Sequence[str]] = field(default_factory=dict)  # patterns of their rooms

    def of(self, space: Space, texts: Sequence[tuple[str, str]] = ()) -> RoomUse:
        """The use of a room, and its dwelling.

        Args: texts: what the IFC file says beside names and type, see `bim.ifc.room_uses`.
        """
        names = [n for n in (space.guid, space.label, space.name, space.long_name) if n]
        dwelling = next(
            (
                name
                for name, patterns in self.dwellings.items()
                if any(fnmatchcase(one, pattern) for one in names for pattern in patterns)
            ),
            "",
        )
        return replace(self._use(space, names, texts), dwelling=dwelling)

    def _use(self, space: Space, names: Sequence[str], texts: Sequence[tuple[str, str]]) -> RoomUse:
        for name in names:
            if name in self.rooms:
                return self._named(self.rooms[name])
        for where, text in self._texts(space, texts):
            for use in self.uses:
                word = next((word for word in use.words if _holds(text, word)), None)
                if word is not None:
                    source = Note("{where} '{text}' contains '{word}'", where=Note(where), text=text, word=word)
                    return RoomUse(use.key, use.occupied, source, where in ("name", "long name"))
        source = Note("no information on its use, taken as regularly occupied")
        return RoomUse(UNKNOWN, True, source, True)

    def _named(self, text: str) -> RoomUse:
        """The use that a mapping file states: a key, else a text with one of its words."""
        use = _use_stated(text, self.uses)
        if use is None:
            keys = ", ".join(dict.fromkeys(one.key for one in self.uses))
            message = f"expected a use, one of {keys}, or one of a [[use]], got {text!r}"
            raise DataError(message, file=self.file, field="rooms")
        return RoomUse(use.key, use.occupied, Note("named in {file}", file=self.file))

    @staticmethod
    def _texts(space: Space, texts: Sequence[tuple[str, str]]) -> Iterator[tuple[str, str]]:
        yield from texts
        names = ((N_("type"), space.type_name), (N_("long name"), space.long_name), (N_("name"), space.name))
        yield from ((where, text) for where, text in names if text)


def read_uses(path: Path | None = None) -> RoomUses:
    """The words that come with the program, after those of a user's file where there is one.

    Raises: `DataError` that names file and key.
    """
    shipped = validated(UsesFile, read_table(WORDS), WORDS)
    if path is None:
        return RoomUses(shipped.use, {})
    own = validated(UsesFile, read_table(path), path)
    uses = RoomUses((*own.use, *shipped.use), own.rooms, path.name, own.dwellings)
    for text in own.rooms.values():
        uses._named(text)
    return uses


def _use_stated(text: str, uses: Sequence[UseTable]) -> UseTable | None:
    of_key = (use for use in uses if use.key == text)
    of_word = (use for use in uses if any(_holds(text, word) for word in use.words))
    return next(of_key, next(of_word, None))


def _holds(text: str, word: str) -> bool:
    """Whether a text has a word, or a longer word that begins with it."""
    word = _plain(word)
    end = "" if len(word) >= BEGINNING else r"(?![a-z])"
    return re.search(rf"(?<![a-z]){re.escape(word)}{end}", _plain(text)) is not None


@cache
def _plain(text: str) -> str:
    """Small letters without accents; German umlauts as two letters."""
    text = text.casefold().translate(GERMAN)
    apart = unicodedata.normalize("NFKD", text)
    return "".join(letter for letter in apart if not unicodedata.combining(letter))
