"""The sparse system of coupled zones against NumPy's dense one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numba import njit

from thermal.elimination import BLOCK, Elimination, eliminate, elimination
from thermal.records import ENTRY


@njit(**ENTRY)
def solve(system, diagonal, below, right):
    """`eliminate` as the time loop calls it."""
    eliminate(system, diagonal, below, right)


def rooms(count: int, faces: int) -> list[tuple[int, int]]:
    """Faces in a clique for each room, the last tied to the next room's first."""
    pairs = [(faces * room + i, faces * room + j) for room in range(count) for i in range(faces) for j in range(i)]
    return pairs + [(faces * room - 1, faces * room) for room in range(1, count)]


def random_pairs(unknowns: int, density: float) -> list[tuple[int, int]]:
    rng = np.random.default_rng(unknowns)
    return np.argwhere(np.tril(rng.random((unknowns, unknowns)) < density, -1)).tolist()


def columns_of(system: Elimination) -> list[list[int]]:
    return [system.rows[first:last].tolist() for first, last in pairwise(system.start)]


@pytest.mark.parametrize(
    ("unknowns", "pairs"),
    [
        (1, []),
        (2, [(1, 0)]),
        *((size, random_pairs(size, density)) for size, density in ((12, 0.3), (60, 0.05), (60, 0.3))),
        *((size, rooms(1, size)) for size in range(3, 11)),
        (60, rooms(5, 12)),
    ],
)
def test_solution_is_that_of_the_dense_system(unknowns, pairs):
    rng, pairs = np.random.default_rng(unknowns), np.array(pairs, dtype=np.int64).reshape(-1, 2)
    values = -rng.random(len(pairs))
    dense = np.zeros((unknowns, unknowns))
    dense[tuple(pairs.T)] = dense[tuple(pairs[:, ::-1].T)] = values
    np.fill_diagonal(dense, 0.1 - dense.sum(axis=1))
    right = rng.random(unknowns)
    system = elimination(unknowns, pairs.tolist())
    below = np.zeros(system.rows.size)
    below[system.entries(pairs)] = values
    diagonal, solution = np.empty(unknowns), np.empty(unknowns)
    diagonal[system.place], solution[system.place] = np.diag(dense), right
    solve(system, diagonal, below, solution)
    np.testing.assert_allclose(solution[system.place], np.linalg.solve(dense, right), rtol=1e-9)


def test_a_chain_of_rooms_fills_in_next_to_nothing():
    pairs = rooms(50, 12)
    assert len(elimination(600, pairs).rows) == len(pairs)


@pytest.mark.parametrize("pairs", [rooms(5, 12), random_pairs(60, 0.1), random_pairs(60, 0.5)])
def test_columns_of_a_block_have_the_same_rows_below_it(pairs):
    system = elimination(60, pairs)
    columns, sizes = columns_of(system), np.diff(system.block)
    assert sizes.sum() == 60 and sizes.min() >= 1 and sizes.max() == BLOCK
    for first, last in pairwise(system.block):
        for k in range(first, last):
            assert columns[k] == [*range(k + 1, last), *columns[last - 1]]


@pytest.mark.parametrize("density", [0.02, 0.1, 0.4])
def test_the_unknown_with_the_fewest_neighbours_left_goes_first(density):
    """And the lowest of equals."""
    rng, near = np.random.default_rng(7), np.zeros((50, 50), dtype=bool)
    near |= np.tril(rng.random(near.shape) < density, -1)
    pairs = np.argwhere(near)
    near |= near.T
    left, order = list(range(50)), []
    while left:
        first = min(left, key=lambda u: (near[u][left].sum(), u))
        near |= np.outer(near[first], near[first])
        np.fill_diagonal(near, False)
        left.remove(first)
        order.append(first)
    assert np.argsort(elimination(50, pairs.tolist()).place).tolist() == order
