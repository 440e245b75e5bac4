"""Tensor trees as the nested braces of BSDF XML files.

A group of braces holds either 2^rank groups, the first axis in the lowest bit, or 2^(rank n)
values: a dense grid, the last axis running fastest.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

OPEN, CLOSE = ord("{"), ord("}")
SEPARATORS = np.zeros(256, dtype=bool)
SEPARATORS[list(b" \t\r\n\v\f,{}")] = True


def parse_tree(text: str, rank: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Depths [L] and values [L] of the leaves in Morton order; `ValueError` for a broken tree."""
    letters = np.frombuffer(text.encode("ascii", "replace"), dtype=np.uint8)
    braces = np.flatnonzero((letters == OPEN) | (letters == CLOSE))
    opening = letters[braces] == OPEN
    if not len(braces) or not opening[0]:
        raise ValueError("tensor tree: does not begin with a brace")
    nesting = np.cumsum(np.where(opening, 1, -1))
    if nesting[-1] != 0 or nesting.min() < 0 or np.any(nesting[:-1] == 0):
        raise ValueError("tensor tree: the braces do not match")
    if rank * nesting.max() > 60:
        raise ValueError("tensor tree: is nested too deeply")

    words = np.flatnonzero(~SEPARATORS[letters] & np.append(True, SEPARATORS[letters[:-1]]))
    group = np.searchsorted(braces, words) - 1  # the brace before each number
    count = np.bincount(group[group >= 0], minlength=len(braces))
    is_grid = opening & np.append(~opening[1:], False)
    if np.any(group < 0) or np.any(count[~is_grid]):
        raise ValueError("tensor tree: numbers between the groups")
    levels = _grid_levels(count[is_grid], rank)
    depths = nesting[is_grid] - 1
    _check_nesting(opening, nesting, is_grid, depths, rank)
    return np.repeat(depths + levels, count[is_grid]), _morton_values(text, levels, rank)


def _grid_levels(counts: NDArray[np.int64], rank: int) -> NDArray[np.int64]:
    """How many levels each dense grid spans [G], from its number of values."""
    levels = np.full(len(counts), -1)
    for level in range(60 // rank + 1):
        levels[counts == 1 << (rank * level)] = level
    if np.any(levels < 0):
        bad = int(counts[levels < 0][0])
        raise ValueError(f"tensor tree: a group of {bad} values, not a power of {1 << rank}")
    return levels


def _check_nesting(
    opening: NDArray[Any], nesting: NDArray[Any], is_grid: NDArray[Any], depths: NDArray[Any], rank: int
) -> None:
    """Every branch has 2^rank children: the volumes of what is inside it add up to its own."""
    deepest = int(nesting.max())
    volume = np.zeros(len(opening), dtype=np.int64)
    volume[is_grid] = np.left_shift(1, rank * (deepest - depths))
    filled = np.cumsum(volume)
    before = filled - volume
    for level in range(deepest):
        first = before[opening & (nesting == level + 1)]
        last = filled[~opening & (nesting == level)]
        if np.any(last - first != 1 << (rank * (deepest - level))):
            raise ValueError(f"tensor tree: a branch does not have {1 << rank} children")


def _morton_values(text: str, levels: NDArray[np.int64], rank: int) -> NDArray[np.float64]:
    """The values, those of each grid brought from row-major into Morton order."""
    words = text.replace("{", " ").replace("}", " ").replace(",", " ").split()
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"tensor tree: {error}") from None
    if not np.isfinite(values).all():
        raise ValueError("tensor tree: a value is not finite")
    counts = np.left_shift(1, rank * levels)
    starts = np.cumsum(counts) - counts
    for level in np.unique(levels[levels > 0]):
        chosen = starts[levels == level]
        slots = chosen[:, None] + np.arange(1 << (rank * level))
        values[slots] = values[slots[:, row_major_order(rank, int(level))]]
    return values


def row_major_order(rank: int, level: int) -> NDArray[np.int64]:
    """Row-major index [2^(rank level)] of each Morton code of a grid `level` levels deep."""
    code = np.arange(1 << (rank * level))
    index = np.zeros_like(code)
    for axis in range(rank):
        coordinate = np.zeros_like(code)
        for bit in range(level):
            coordinate |= ((code >> (rank * bit + axis)) & 1) << bit
        index = (index << level) + coordinate
    return index


def format_tree(rank: int, depths: NDArray[np.int64], values: NDArray[np.float64], digits: int) -> Iterator[str]:
    """The braces of a tree's leaves (Morton order); siblings that are all leaves make one grid."""
    siblings = 1 << rank
    to_row_major = np.argsort(row_major_order(rank, 1))
    pattern = f"%.{digits}g"
    written = [0]  # how many children of the open branch at each level are written
    leaf = 0
    while leaf < len(depths):
        while len(written) <= depths[leaf]:  # open the branches around this leaf
            written.append(0)
            yield "{\n"
        group = slice(leaf, leaf + siblings)
        if written[-1] == 0 and depths[leaf] > 0 and _all_leaves(depths[group], siblings):
            yield " ".join(pattern % value for value in values[group][to_row_major]) + "\n"
            leaf, written[-1] = leaf + siblings, siblings
        else:
            yield "{ " + pattern % values[leaf] + " }\n"
            leaf, written[-1] = leaf + 1, written[-1] + 1
        while len(written) > 1 and written[-1] == siblings:  # close what is complete
            written.pop()
            written[-1] += 1
            yield "}\n"


def _all_leaves(depths: NDArray[np.int64], siblings: int) -> bool:
    """Whether leaves that begin a branch are all of its children."""
    return len(depths) == siblings and bool(np.all(depths == depths[0]))
