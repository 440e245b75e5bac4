"""Tables of `tensor_tree_bsdf` for evaluation and sampling, by system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.colour import leaf_means, relative_rgb
from mitsuba_cfs.bsdf.tensor_peak import through_peak
from mitsuba_cfs.bsdf.tensor_sampling import SamplingTree, joined, sampling_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf

BLOCKS = ("reflection_front", "reflection_back", "transmission_front", "transmission_back")
FLOOR = 0.02  # share of its mean that the density of a resampled tree never falls below


@dataclass(frozen=True)
class PluginTrees:
    """Tables of the plugin for evaluation and sampling."""

    valued: SamplingTree  # rank 4: the drawn ones; rank 3: the four forward ones
    drawn: SamplingTree  # four forward, then four backward trees
    beams: NDArray[np.float64] | None  # with `peak`, by incident cell [4, N, N], rank 3: [4, N]
    colours: NDArray[np.float64] | None  # [L, 3] of the leaves of `valued`, see `relative_rgb`


def plugin_trees(
    bsdf: TensorTreeBsdf,
    peak: bool,
    colour: tuple[TensorTreeBsdf, TensorTreeBsdf] | None = None,
) -> PluginTrees:
    """The trees of a system; rank 4 draws from those that it finds values in."""
    whole, rank = forward_trees(bsdf), next(iter(bsdf.blocks().values())).rank
    forward, beams = _without_peaks(bsdf, whole) if peak else (whole, None)
    backward = backward_trees(forward)
    if rank == 3:
        backward = [_density_tree(tree) for tree in backward]
    sampled = [sampling_tree(tree) for tree in forward + backward]
    drawn = joined(sampled)
    valued = drawn if rank == 4 else joined(sampled[:4])
    if colour is None:
        return PluginTrees(valued, drawn, beams, None)
    bands = [whole, *(forward_trees(band) for band in colour)]
    if rank == 4:
        bands = [trees + backward_trees(trees) for trees in bands]
    colours = [leaf_colours(y, x, z) for y, x, z in zip(*bands, strict=True)]
    return PluginTrees(valued, drawn, beams, np.concatenate(colours))


def _without_peaks(
    bsdf: TensorTreeBsdf, whole: list[TensorTree]
) -> tuple[list[TensorTree], NDArray[np.float64]]:
    """The forward trees without their through peaks, and the beams of `PluginTrees`.

    The way back of rank 3 is known by means only, which would blur a peak: it is taken out first.
    """
    rest, shares = [], []
    for name, tree in zip(BLOCKS, whole, strict=True):
        own, turned = bsdf.lookup(name)
        share = np.zeros((1,) * (tree.rank - 2))
        if own is not None and name.startswith("transmission"):
            if tree.rank == 4:
                tree, share = through_peak(tree)
            else:  # the beam of the other side is equal
                tree, share = through_peak(own)
                tree = tree.reversed() if turned else tree
        rest.append(tree)
        shares.append(share)
    cells = max(len(share) for share in shares)
    for axis in range(shares[0].ndim):
        shares = [np.repeat(share, cells // share.shape[axis], axis=axis) for share in shares]
    return rest, np.stack(shares)


def leaf_colours(y: TensorTree, x: TensorTree, z: TensorTree) -> NDArray[np.float64]:
    """Linear sRGB over the grey value [L, 3] of the leaves of `y`: X and Z by their means there."""
    colours = relative_rgb(leaf_means(y, x), y.values, leaf_means(y, z))
    # a tree of a single value gets a node with leaves
    return colours if y.depth else np.repeat(colours, 1 << y.rank, axis=0)


def forward_trees(bsdf: TensorTreeBsdf) -> list[TensorTree]:
    """Trees of `BLOCKS` from incident to outgoing light, with absent blocks filled."""
    rank = next(iter(bsdf.blocks().values())).rank
    trees = []
    for name in BLOCKS:
        tree, turned = bsdf.lookup(name)
        if tree is None:
            tree = TensorTree(rank, np.zeros(1, dtype=np.int64), np.zeros(1))
        trees.append(tree.reversed() if turned else tree)
    return trees


def backward_trees(forward: list[TensorTree]) -> list[TensorTree]:
    """Reversed trees, from outgoing to incident light, by outgoing side."""
    reflection_front, reflection_back, front, back = forward
    return [tree.reversed() for tree in (reflection_front, reflection_back, back, front)]


def _density_tree(tree: TensorTree) -> TensorTree:
    """A resampled tree that is nowhere zero where its neighbours are not."""
    floor = FLOOR * tree.values[tree.values > 0].mean() if np.any(tree.values > 0) else 0.0
    return TensorTree(tree.rank, tree.depths, np.maximum(tree.values, floor))
