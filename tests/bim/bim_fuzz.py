"""Spoilt files, the same ones each time: bytes changed, cut out, repeated, put in."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_cfs.errors import DataError

PIECES = (b"-1e999", b"NaN", b"null", b"[]", b"{}", b'""', b"0", b"\xff\xfe", b"<", b"&x;", b"1e300")


def mutations(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """`count` spoilt copies of a file."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        spoilt = bytearray(content)
        for _ in range(int(random.integers(1, 4))):
            at = int(random.integers(len(spoilt)))
            match int(random.integers(5)):
                case 0:
                    spoilt[at] = int(random.integers(256))
                case 1:
                    del spoilt[at : at + int(random.integers(1, 200))]
                case 2:
                    spoilt[at:at] = PIECES[int(random.integers(len(PIECES)))]
                case 3:
                    spoilt = spoilt[: max(at, 1)]
                case _:
                    numbers = [i for i in range(at, min(at + 400, len(spoilt))) if 48 <= spoilt[i] <= 57]
                    if numbers:
                        piece = PIECES[int(random.integers(len(PIECES)))]
                        spoilt[numbers[0] : numbers[0] + 1] = piece
        yield bytes(spoilt)


def refusals(path: Path, contents: Iterable[bytes], read: Callable[[Path], object]) -> int:
    """How many of a file's contents are refused, each by one line; the others are read."""
    refused = 0
    for content in contents:
        path.write_bytes(content)
        try:
            read(path)
        except DataError as error:
            refused += 1
            assert "\n" not in str(error)
    return refused


def changed(content: Any, *path: str | int, value: Any = None) -> Any:
    """A JSON document with one value changed, in place."""
    *above, last = path
    owner = content
    for step in above:
        owner = owner[step]
    owner[last] = value
    return content


ODD = (None, [], {}, "", "x", True, 0, -1, 0.5, 1e12, 1e308, [1], [[1, 2, 3]], {"type": "x"})


def odd_values(content: Any, count: int, seed: int = 0) -> Iterator[Any]:
    """`count` copies of a JSON document in which one or two values are odd or gone."""
    random = np.random.default_rng(seed)
    paths = list(_paths(content))
    for _ in range(count):
        spoilt = copy.deepcopy(content)
        for _ in range(int(random.integers(1, 3))):
            *above, last = paths[int(random.integers(len(paths)))]
            try:
                owner = spoilt
                for step in above:
                    owner = owner[step]
                if random.random() < 0.15:
                    del owner[last]
                else:
                    owner[last] = copy.deepcopy(ODD[int(random.integers(len(ODD)))])
            except (KeyError, IndexError, TypeError):
                continue  # the first one took it away
        yield spoilt


def _paths(content: Any, path: tuple = ()) -> Iterator[tuple]:
    items: Any = ()
    if isinstance(content, dict):
        items = content.items()
    elif isinstance(content, list):
        items = enumerate(content)
    for key, value in items:
        yield (*path, key)
        yield from _paths(value, (*path, key))
