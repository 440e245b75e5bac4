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
    targets = np.concatenate(target).astype(np.uint64)
    return Elimination(
        place=place, start=start, rows=rows.astype(np.uint64), target=targets, run=np.array(run, dtype=np.int64)
    )


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
    for k in range(d.size):
        d[k] = 1.0 / d[k]
        end = system.start[k + 1]
        for m in range(system.start[k], end):
            i, f = system.rows[m], e[m] * d[k]
            d[i] -= f * e[m]
            b[i] -= f * b[k]
            first, count = system.run[m], end - m - 1
            if first >= 0:
                taken, products = e[first : first + count], e[m + 1 : end]
                for q in range(count):
                    taken[q] -= f * products[q]
            else:
                for q in range(count):
                    e[system.target[at + q]] -= f * e[m + 1 + q]
            at += count
    for j in range(d.size - 1, -1, -1):
        s = b[j]
        for m in range(system.start[j], system.start[j + 1]):
            s -= e[m] * b[system.rows[m]]
        b[j] = s * d[j]
