"""The sparse system of coupled zones against NumPy's dense one."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.elimination import eliminate, elimination


@pytest.mark.parametrize(("unknowns", "density"), [(1, 0.0), (2, 1.0), (12, 0.3), (60, 0.05)])
def test_solution_is_that_of_the_dense_system(unknowns, density):
    rng = np.random.default_rng(unknowns)
    pairs = np.argwhere(np.tril(rng.random((unknowns, unknowns)) < density, -1))
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
    eliminate.py_func(system, diagonal, below, solution)
    np.testing.assert_allclose(solution[system.place], np.linalg.solve(dense, right), rtol=1e-9)


def test_a_chain_of_rooms_fills_in_next_to_nothing():
    """Twelve faces in a clique for each of 50 rooms, one face tied to the next room's."""
    pairs = [(12 * room + i, 12 * room + j) for room in range(50) for i in range(12) for j in range(i)]
    pairs += [(12 * room + 11, 12 * room + 12) for room in range(49)]
    assert len(elimination(600, pairs).rows) == len(pairs)


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
