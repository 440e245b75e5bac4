"""The sparse linear system of coupled zones: its entries, the order of elimination, its fill.

Unknowns (axis U) are the inside faces of all zones, then their air.  The system is symmetric and
its pattern does not change, so order and fill are found once.
"""

from __future__ import annotations

from collections.abc import Iterable
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.records import inlined


class Elimination(NamedTuple):
    """Columns below the diagonal in the order of elimination; E entries, fill included.

    What the compiled elimination looks up is unsigned: a signed index would be asked each time
    whether it counts from the end.
    """

    place: NDArray[np.int64]  # [U] position of each unknown in the order
    start: NDArray[np.int64]  # [U + 1] first entry of each column
    rows: NDArray[np.uint64]  # [E] positions of the rows, ascending in each column
    # [M] entry that each product of two entries of a column is taken from, in the order of their
    # making: column by column, the first of the two, the second after it
    target: NDArray[np.uint64]
    # [E] entry that the first product of each entry is taken from, where its others are the next
    # ones: in rooms, whose faces all exchange; else -1
    run: NDArray[np.int64]
    # [B + 1] first column of each block: of columns that follow each other and have the same rows below the
    # block's last, as a room's faces mostly have
    block: NDArray[np.int64]

    def entries(self, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
        """Entry of each pair of unknowns [P, 2]: [P]."""
        low, high = np.sort(self.place[pairs], axis=1).T
        rows = self.rows.astype(np.int64)
        found = [
            start + np.searchsorted(rows[start:end], row)
            for start, end, row in zip(self.start[low], self.start[low + 1], high, strict=True)
        ]
        return np.array(found, dtype=np.int64)


def elimination(unknowns: int, pairs: Iterable[tuple[int, int]]) -> Elimination:
    """The elimination of a symmetric system whose entries couple these pairs of unknowns.

    The unknown with the fewest neighbours left goes first, the lowest of equals.  Source: minimum
    degree, Tinney and Walker 1967, doi:10.1109/PROC.1967.6011.
    """
    near: list[set[int]] = [set() for _ in range(unknowns)]
    for i, j in pairs:
        near[i].add(j)
        near[j].add(i)
    waiting = [(len(beside), u) for u, beside in enumerate(near)]
    heapify(waiting)
    below: dict[int, set[int]] = {}  # in the order of elimination
    while waiting:
        count, first = heappop(waiting)
        if first in below or count != len(near[first]):
            continue  # it has gone, or waits with its new number too
        below[first] = near[first]
        for other in near[first]:
            near[other] = (near[other] | near[first]) - {first, other}
            heappush(waiting, (len(near[other]), other))
    order = list(below)
    place = np.empty(unknowns, dtype=np.int64)
    place[order] = np.arange(unknowns)
    columns = [np.sort(place[list(below[u])]) for u in order]
    start = np.concatenate([[0], np.cumsum([len(column) for column in columns])])
    rows = np.concatenate([np.empty(0, dtype=np.int64), *columns])
    target, run = [np.empty(0, dtype=np.int64)], []
    for column in columns:
        for number, row in enumerate(column):
            products = start[row] + np.searchsorted(columns[row], column[number + 1 :])
            target.append(products)
            run.append(products[0] if len(products) and (np.diff(products) == 1).all() else -1)
    return Elimination(
        place=place,
        start=start,
        rows=rows.astype(np.uint64),
        target=np.concatenate(target).astype(np.uint64),
        run=np.array(run, dtype=np.int64),
        block=_blocks(columns),
    )


BLOCK = 4  # columns at most whose products are taken from the entries to their right in one go


def _blocks(columns: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    """The first column of each block, and their number."""
    first: list[int] = []
    for number, column in enumerate(columns):
        before = columns[number - 1] if first and number - first[-1] < BLOCK else ()
        follows = len(before) == len(column) + 1 and before[0] == number
        if not follows:
            first.append(number)
    return np.array([*first, len(columns)], dtype=np.int64)


@inlined
def eliminate(
    system: Elimination, diagonal: NDArray[np.float64], below: NDArray[np.float64], right: NDArray[np.float64]
) -> None:
    """Solve the system in place: L D L' column by column; `right` becomes the solution.

    Symmetric and diagonally dominant: no pivoting.  The diagonal becomes the inverse pivots.
    Source: the right-looking sparse Cholesky, Davis 2006, doi:10.1137/1.9780898718881, 4, with
    where each product goes looked up.
    """
    d, e, b, at = diagonal, below, right, 0
    for c in range(system.block.size - 1):
        first, last = system.block[c], system.block[c + 1] - 1
        for k in range(first, last):
            _within_block(system, d, e, b, k, last)
            count = system.start[k + 1] - system.start[k]
            at += count * (count - 1) // 2
        d[last] = 1.0 / d[last]
        at = _below_block(system, d, e, b, first, last, at)
    for j in range(d.size - 1, -1, -1):
        s = b[j]
        for m in range(system.start[j], system.start[j + 1]):
            s -= e[m] * b[system.rows[m]]
        b[j] = s * d[j]


@inlined
def _within_block(
    system: Elimination, d: NDArray[np.float64], e: NDArray[np.float64], b: NDArray[np.float64], k: int, last: int
) -> None:
    """Eliminate a column from those after it in its block, whose rows are all its own."""
    d[k] = 1.0 / d[k]
    m, end = system.start[k], system.start[k + 1]
    for i in range(k + 1, last + 1):
        f = e[m] * d[k]
        d[i] -= f * e[m]
        b[i] -= f * b[k]
        m += 1
        taken, products = e[system.start[i] : system.start[i + 1]], e[m:end]
        for q in range(taken.size):
            taken[q] -= f * products[q]


@inlined
def _below_block(
    system: Elimination,
    d: NDArray[np.float64],
    e: NDArray[np.float64],
    b: NDArray[np.float64],
    first: int,
    last: int,
    at: int,
) -> int:
    """Eliminate the columns of a block from those after it; returns where the targets of the next begin.

    Each entry loses the products of `BLOCK` columns in their order; those that a block lacks are 0 times its last.
    """
    start, rest = system.start[last], system.start[last + 1] - system.start[last]
    k0, k1, k2, lacks = max(last - 3, first), max(last - 2, first), max(last - 1, first), BLOCK - 1 - (last - first)
    w0, w1, w2 = d[k0] if lacks < 1 else 0.0, d[k1] if lacks < 2 else 0.0, d[k2] if lacks < 3 else 0.0
    end0, end1, end2 = system.start[k0 + 1], system.start[k1 + 1], system.start[k2 + 1]
    c0, c1, c2, c3 = e[end0 - rest : end0], e[end1 - rest : end1], e[end2 - rest : end2], e[start : start + rest]
    for m in range(rest):
        i, count = system.rows[start + m], rest - m - 1
        f0, f1, f2, f3 = c0[m] * w0, c1[m] * w1, c2[m] * w2, c3[m] * d[last]
        d[i] = d[i] - f0 * c0[m] - f1 * c1[m] - f2 * c2[m] - f3 * c3[m]
        b[i] = b[i] - f0 * b[k0] - f1 * b[k1] - f2 * b[k2] - f3 * b[last]
        run = system.run[start + m]
        p0, p1, p2, p3 = c0[m + 1 :], c1[m + 1 :], c2[m + 1 :], c3[m + 1 :]
        if run >= 0:
            taken = e[run : run + count]
            for q in range(count):
                taken[q] = taken[q] - f0 * p0[q] - f1 * p1[q] - f2 * p2[q] - f3 * p3[q]
        else:
            for q in range(count):
                t = system.target[at + q]
                e[t] = e[t] - f0 * p0[q] - f1 * p1[q] - f2 * p2[q] - f3 * p3[q]
        at += count
    return at
