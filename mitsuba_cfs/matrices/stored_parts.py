"""Several groups of arrays in one file of the cache, unless they are too large."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import CacheEntry

MOST_STORED = 1 << 25  # bytes of an entry: larger ones are computed again
Arrays = Mapping[str, NDArray[Any]]
T = TypeVar("T")


def stored_or_computed(
    entry: CacheEntry | None,
    read: Callable[[Arrays], T | None],
    compute: Callable[[], T],
    parts: Callable[[T], Sequence[Arrays]],
) -> T:
    """What an entry of the cache holds, else what `compute` gives, which is written to it.

    Args: read: from the arrays of a file, None where these are of no use; parts: for `write_parts`.
    """
    stored = None if entry is None else entry.read(read)
    if stored is None:
        stored = compute()
        write_parts(entry, parts(stored))
    return stored


def write_parts(entry: CacheEntry | None, parts: Sequence[Arrays]) -> None:
    """Write the arrays of each part, their names numbered; nothing where they are too large."""
    arrays = {f"{i} {name}": value for i, part in enumerate(parts) for name, value in part.items()}
    if entry is not None and sum(value.nbytes for value in arrays.values()) <= MOST_STORED:
        entry.write({"parts": np.int64(len(parts)), **arrays})


def parts_of(data: Arrays) -> list[dict[str, NDArray[Any]]]:
    """The arrays of each part, as `write_parts` has them."""
    parts: list[dict[str, NDArray[Any]]] = [{} for _ in range(int(data["parts"]))]
    for name in data:
        number, _, field = name.partition(" ")
        if field:
            parts[int(number)][field] = data[name]
    return parts
