"""Boxes near one another, against every pair."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from bim.boxes import Boxes


def test_pairs_are_those_of_a_comparison_of_all():
    rng = np.random.default_rng(5)
    low = rng.uniform(0.0, 10.0, (60, 3))
    high = low + rng.uniform(0.1, 3.0, (60, 3))
    margin = 0.4
    close = [
        (i, j)
        for i, j in combinations(range(60), 2)
        if np.all(low[i] <= high[j] + margin) and np.all(low[j] <= high[i] + margin)
    ]
    assert list(Boxes(low, high).pairs(margin)) == close
    assert 30 < len(close) < 1770


def test_of_nothing_there_is_nothing_near():
    nothing = Boxes.of_triangles([])
    assert nothing.near(np.zeros(3), np.ones(3), 1.0) == []
    assert list(nothing.pairs()) == []


def test_boxes_of_meshes():
    mesh = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0.0, 0, 3], [1, 0, 0], [0, 2, 0]]])
    boxes = Boxes.of_triangles([mesh])
    np.testing.assert_array_equal(boxes.low, [[0, 0, 0]])
    np.testing.assert_array_equal(boxes.high, [[1, 2, 3]])
    assert boxes.near(np.array([1.5, 0, 0]), np.array([2.0, 1, 1]), 0.5) == [0]
    assert boxes.near(np.array([1.5, 0, 0]), np.array([2.0, 1, 1]), 0.4) == []
