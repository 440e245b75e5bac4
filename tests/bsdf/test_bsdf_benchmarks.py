"""The BSDF benchmarks: their names, and which block's errors they report."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks import bsdf_generate, bsdf_tree, harness


def test_they_take_part():
    names = {"bsdf-klems", "bsdf-klems-default-options", "bsdf-tree", "bsdf-plugin-klems"}
    assert names | {"bsdf-plugin-tree"} <= set(harness.benchmarks())


def test_the_block_that_is_hardest_on_us_is_reported():
    truth = np.ones((4, 10))
    ours = truth + np.array([0.1, 0.1, 0.2, 0.1])[:, None]
    peers = truth + np.array([0.5, 0.3, 0.5, 0.4])[:, None]
    block = bsdf_generate.hardest_block(ours, peers, truth)
    assert block.name == "reflection front"  # ratios 5, 3, 2.5, 4
    assert (block.ours, block.peer) == pytest.approx((0.2, 0.5))


@pytest.mark.parametrize("name", bsdf_generate.BLOCKS)
def test_random_pairs_are_of_their_block(name):
    incident, outgoing = bsdf_tree.random_pairs(name)
    kind, side = name.split("_")
    assert ((incident[:, 2] > 0) == (side == "front")).all()
    assert ((incident[:, 2] * outgoing[:, 2] > 0) == (kind == "reflection")).all()
    # even in projected solid angle: the mean of cos2 is 1/2
    assert (incident[:, 2] ** 2).mean() == pytest.approx(0.5, abs=0.003)
