"""Tensor trees as tables that are descended by position, and sampled from the top down.

A node has 2^rank children: nodes, or leaves as -1 - index.  Where the incident position is given,
only the quarter of them (rank 4; the half, rank 3) that holds it counts, and the outgoing point is
drawn by choosing one of the remaining four at every level.  For that each node keeps the four
masses (means of the values over the child's outgoing square) for each incident cell that its
subtree tells apart: a grid 2^r wide, r the node's height.  That is exact, and never more than
4/3 of the leaves of a full tree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.tensor_tree import TensorTree


@dataclass(frozen=True)
class SamplingTree:
    """Tables of one tree, or of several concatenated ones."""

    rank: int
    children: NDArray[np.int32]  # [N 2^rank] node, or -1 - leaf
    values: NDArray[np.float64]  # [L] BSDF of each leaf [1/sr]
    heights: NDArray[np.int32]  # [N] levels below each node
    offsets: NDArray[np.int32]  # [N] where its masses begin, in fours
    masses: NDArray[np.float64]  # [4 x incident cells, all nodes]
    roots: tuple[int, ...]  # node at the top of each tree


def sampling_tree(tree: TensorTree) -> SamplingTree:
    """The tables of one tree."""
    levels, children, values = _nodes(tree)
    heights, masses = _node_masses(tree.rank, levels, children, values)
    sizes = np.array([len(mass) for mass in masses])
    offsets = np.cumsum(sizes) - sizes
    return SamplingTree(
        tree.rank,
        children.ravel().astype(np.int32),
        values,
        heights.astype(np.int32),
        offsets.astype(np.int32),
        np.concatenate(masses).ravel(),
        (0,),
    )


def joined(trees: list[SamplingTree]) -> SamplingTree:
    """The tables of several trees of one rank, one after the other."""
    if len({tree.rank for tree in trees}) != 1:
        raise ValueError("the trees are of different ranks")
    nodes = np.cumsum([0] + [len(tree.heights) for tree in trees])
    leaves = np.cumsum([0] + [len(tree.values) for tree in trees])
    fours = np.cumsum([0] + [len(tree.masses) // 4 for tree in trees])
    children = [
        np.where(tree.children >= 0, tree.children + node, tree.children - leaf)
        for tree, node, leaf in zip(trees, nodes, leaves, strict=False)
    ]
    return SamplingTree(
        trees[0].rank,
        np.concatenate(children),
        np.concatenate([tree.values for tree in trees]),
        np.concatenate([tree.heights for tree in trees]),
        np.concatenate([tree.offsets + four for tree, four in zip(trees, fours, strict=False)]),
        np.concatenate([tree.masses for tree in trees]),
        tuple(int(node) + tree.roots[0] for tree, node in zip(trees, nodes, strict=False)),
    )


def _nodes(tree: TensorTree) -> tuple[NDArray, NDArray, NDArray]:
    """Level of each node [N], its children [N, 2^rank], and the values of the leaves."""
    rank, width = tree.rank, 1 << tree.rank
    depths, values = tree.depths, tree.values
    if tree.depth == 0:  # a single value: give it a node
        depths, values = np.ones(width, dtype=np.int64), np.repeat(values, width)
        tree = TensorTree(rank, depths, values)
    numbers: list[NDArray] = []  # prefix codes of the nodes of each level
    for level in range(tree.depth):
        numbers.append(np.unique(tree.codes[depths > level] >> (rank * (tree.depth - level))))
    first = np.cumsum([0] + [len(codes) for codes in numbers])
    children = np.empty((first[-1], width), dtype=np.int64)
    for level, codes in enumerate(numbers):
        child = (codes[:, None] << rank) + np.arange(width)
        shift = rank * (tree.depth - level - 1)
        leaf = np.searchsorted(tree.codes, child << shift, side="right") - 1
        result = -1 - leaf
        if level + 1 < tree.depth:
            node = np.searchsorted(numbers[level + 1], child)
            node = np.minimum(node, len(numbers[level + 1]) - 1)
            result = np.where(numbers[level + 1][node] == child, first[level + 1] + node, result)
        children[first[level] : first[level + 1]] = result
    levels = np.repeat(np.arange(tree.depth), np.diff(first))
    return levels, children, values


def _node_masses(rank: int, levels, children, values) -> tuple[NDArray, list[NDArray]]:
    """Height of each node [N] and its masses [incident cells, 4], from the lowest nodes up."""
    known = rank - 2
    inner = children >= 0
    heights = np.ones(len(children), dtype=np.int64)
    leaf_value = np.where(inner, 0.0, values[np.where(inner, 0, -1 - children)])
    # nodes above leaves only: [N, outgoing quarter, incident bits] to [N, incident bits, quarter]
    lowest = leaf_value.reshape((-1, 4) + (2,) * known)
    lowest = np.ascontiguousarray(lowest.transpose(0, *range(known + 1, 0, -1)))
    means = list(lowest.mean(axis=-1))
    masses = list(lowest.reshape(len(children), -1, 4))
    for node in np.flatnonzero(inner.any(axis=1))[::-1]:
        below = children[node][inner[node]]
        heights[node] = 1 + heights[below].max()
        grid = _four_masses(known, heights[node], children[node], leaf_value[node], means)
        masses[node] = grid.reshape(-1, 4)
        means[node] = grid.mean(axis=-1)
    return heights, masses


def _four_masses(known: int, height: int, children, leaf_values, means) -> NDArray[np.float64]:
    """Masses [2^height, .., 4] of a node by incident cell and outgoing quarter."""
    half = 1 << (height - 1)
    grid = np.empty((2 * half,) * known + (4,))
    for index, child in enumerate(children):
        corner = [half * ((index >> axis) & 1) for axis in range(known)]
        place = (*(slice(c, c + half) for c in corner), index >> known)
        if child < 0:
            grid[place] = leaf_values[index]
            continue
        mean = means[child]
        for axis in range(known):
            mean = np.repeat(mean, half // len(means[child]), axis=axis)
        grid[place] = mean
    return grid
