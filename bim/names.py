"""What people call things in a model, and which of them they mean: by number, name or GUID."""

from __future__ import annotations

import difflib
import re
import sys
import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import count
from typing import Protocol, TypeVar

SHOWN = 8  # names that a message lists
# Latin letters that Unicode does not part into a letter and its accent
UNDIVIDED = str.maketrans({"ł": "l", "Ł": "L", "ı": "i", "đ": "d", "Đ": "D", "ø": "o", "Ø": "O"})
JOINT = " + "  # between the names of rooms that are one


class Named(Protocol):
    """What is found by its names: a room of a building, a space of a file."""

    @property
    def guid(self) -> str:
        """The GlobalId."""

    @property
    def name(self) -> str:
        """The number or short name."""

    @property
    def long_name(self) -> str:
        """The name in full."""

    @property
    def label(self) -> str:
        """What a user calls it: both."""


T = TypeVar("T", bound=Named)


def label_of(name: str, long_name: str, guid: str) -> str:
    """Number and name of a room as people use them, each once; its GUID where it has neither."""
    words, long_words = name.split(), long_name.split()
    count = len(long_words)
    if not count or words[-count:] == long_words:  # "1 - Living room" that is a "Living room"
        return name or guid
    if words == long_words[: len(words)]:
        return long_name
    return f"{name} {long_name}"


@lru_cache(maxsize=4096)  # the same words are looked for in every material of a model
def plain_text(text: str) -> str:
    """Small letters without the accents of Latin ones, to look for words in: béton is beton."""
    whole = unicodedata.normalize("NFKC", text).translate(UNDIVIDED)
    plain = (unicodedata.normalize("NFD", c) for c in whole)
    kept = (c[0] if c[0].isascii() else unicodedata.normalize("NFC", c) for c in plain)
    return "".join(kept).casefold()


def nearest(wanted: str, names: Iterable[str]) -> list[str]:
    """The names, each once, those most like the wanted one first; capitals do not count."""
    key = name_key(wanted)

    def likeness(name: str) -> float:
        other = name_key(name)
        part = 1.0 if key and key in other else 0.0
        return part + difflib.SequenceMatcher(None, key, other).ratio()

    return sorted(dict.fromkeys(names), key=lambda name: (-likeness(name), name))


def listed(wanted: str, names: Iterable[str]) -> str:
    """The nearest names in one line, and how many more there are."""
    names = nearest(wanted, names)
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


class UnknownName(KeyError):
    """No item has the name."""


class AmbiguousName(ValueError):
    """Several items have the name."""


def item_named(items: Sequence[T], wanted: str, kind: str) -> T:
    """The one item of that GUID, name, long name, or name and long name; else of such a part.

    Capitals and runs of spaces count only where they make the difference between two.  Parts are
    those of rooms that were joined.

    Args: kind: what a message calls an item, such as "space".
    Raises: `UnknownName` where there is none, `AmbiguousName` where there are several; their texts
        list the nearest.
    """
    matches = [item for item in items if item.guid == wanted]
    matches = matches or [i for i in items if wanted in (i.name, i.long_name, i.label)]
    key = name_key(wanted)
    matches = matches or [
        item for item in items if key and key in map(name_key, (item.name, item.long_name, item.label))
    ]
    matches = matches or [item for item in items if key and key in map(name_key, _names_of_parts(item))]
    if not matches:
        there = listed(wanted, (item.label for item in items))
        raise UnknownName(f"no {kind} {wanted!r}; there are: {there}")
    if len(matches) > 1:
        labels = [item.label for item in matches]
        same = len(set(labels)) < len(labels)
        shown = (f"{item.label} ({item.guid})" if same else item.label for item in matches)
        how = "give the GUID of one" if same else "give the whole name of one, in quotes"
        raise AmbiguousName(f"{len(matches)} {kind}s are named {wanted!r}: {listed(wanted, shown)}; {how}")
    return matches[0]


def has_words(text: str, words: str) -> bool:
    """Whether a text has words in a row, whatever their capitals."""
    return re.search(rf"(?<!\w){re.escape(name_key(words))}(?!\w)", name_key(text)) is not None


def unknown_room(error: UnknownName | AmbiguousName, wanted: str, zones: Iterable[str]) -> str:
    """The message of a room's name that cannot be used, with the nearest zones."""
    zones = list(zones)
    message = str(error.args[0])
    return f"{message}; zones: {listed(wanted, zones)}" if zones else message


def _names_of_parts(item: Named) -> set[str]:
    """Names, long names and labels of the rooms that were joined to this one."""
    names, long_names = item.name.split(JOINT), item.long_name.split(JOINT)
    pairs = zip(names, long_names, strict=False) if len(names) == len(long_names) else ()
    labels = (label_of(name, long_name, "") for name, long_name in pairs)
    return {*names, *long_names, *labels} if len(names) > 1 else set()


def natural_key(name: str) -> list[tuple[int, str]]:
    """For sorting names as people do: their numbers by value, 2 before 10."""
    parts = re.split(r"(\d+)", name.casefold())
    return [(int(part), "") if part.isdecimal() else (sys.maxsize, part) for part in parts if part]


def name_key(name: str) -> str:
    """A name without what makes no difference: capitals and runs of spaces."""
    return " ".join(name.split()).casefold()


def folder_names(items: Sequence[Named]) -> list[str]:
    """A folder name for each item: number and name, with its GUID where others have the same."""
    names = [re.sub(r"[^\w.-]+", "_", item.label).strip("._") for item in items]
    folded = [name.casefold() for name in names]
    return [
        name if name and folded.count(name.casefold()) == 1 else f"{name}_{item.guid}"
        for name, item in zip(names, items, strict=True)
    ]


def numbered(names: Iterable[str]) -> list[str]:
    """Names with a number behind those that come again, so that no two are the same."""
    names = list(names)
    given = set(names)
    numbers: dict[str, Iterator[int]] = defaultdict(lambda: count(2))
    result: dict[str, None] = {}
    for name in names:
        unique = name
        while unique in result or (unique != name and unique in given):
            unique = f"{name} {next(numbers[name])}"
        result[unique] = None
    return list(result)
