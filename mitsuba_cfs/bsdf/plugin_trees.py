"""What `tensor_tree_bsdf` looks values up in and draws directions from, by system."""

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
    """What the plugin looks values up in and draws directions from."""

    valued: SamplingTree  # rank 4: the drawn ones; rank 3: the four forward ones
    drawn: SamplingTree  # four forward, then four backward trees
    beams: NDArray[np.float64] | None  # with `peak`; rank 4: by leaf, rank 3: [4, incident cells]
    colours: NDArray[np.float64] | None  # [L, 3] of the leaves of `valued`, see `relative_rgb`


def plugin_trees(
    bsdf: TensorTreeBsdf,
    peak: bool,
    colour: tuple[TensorTreeBsdf, TensorTreeBsdf] | None = None,
) -> PluginTrees:
    """The trees of a system; rank 4 draws from those that it finds values in."""
    whole = forward_trees(bsdf)
    make = _rank_4_trees if whole[0].rank == 4 else _rank_3_trees
    valued, drawn, beams = make(bsdf, peak)
    if colour is None:
        return PluginTrees(valued, drawn, beams, None)
    bands = [whole, *(forward_trees(band) for band in colour)]
    if whole[0].rank == 4:
        bands = [trees + backward_trees(trees) for trees in bands]
    colours = [leaf_colours(y, x, z) for y, x, z in zip(*bands, strict=True)]
    return PluginTrees(valued, drawn, beams, np.concatenate(colours))


def _rank_4_trees(bsdf: TensorTreeBsdf, peak: bool):
    forward = forward_trees(bsdf)
    trees, beams = forward + backward_trees(forward), None
    if peak:
        parts = [
            through_peak(tree) if number % 4 >= 2 else (tree, np.zeros(len(tree.values)))
            for number, tree in enumerate(trees)
        ]
        trees = [tree for tree, _ in parts]
        # a tree of a single value gets a node with 16 leaves
        beams = np.concatenate([beam if t.depth else np.zeros(16) for t, beam in parts])
    both = joined([sampling_tree(tree) for tree in trees])
    return both, both, beams


def _rank_3_trees(bsdf: TensorTreeBsdf, peak: bool):
    """Peaks are taken out first: the way back is known by means only, which would blur them."""
    forward = forward_trees(bsdf, without_peak=peak)
    drawn = [
        sampling_tree(t) for t in forward + [_density_tree(t) for t in backward_trees(forward)]
    ]
    beams = None
    if peak:
        shares = []
        for name in BLOCKS:
            tree, _ = bsdf.lookup(name)  # of the other side's, too: the way back is alike
            some = tree is not None and name.startswith("transmission")
            shares.append(through_peak(tree)[1] if some else np.zeros(1))
        cells = max(len(share) for share in shares)
        beams = np.stack([np.repeat(share, cells // len(share)) for share in shares])
    return joined(drawn[:4]), joined(drawn), beams


def leaf_colours(y: TensorTree, x: TensorTree, z: TensorTree) -> NDArray[np.float64]:
    """Linear sRGB over the grey value [L, 3] of the leaves of `y`: X and Z by their means there."""
    colours = relative_rgb(leaf_means(y, x), y.values, leaf_means(y, z))
    # a tree of a single value gets a node with leaves
    return colours if y.depth else np.repeat(colours, 1 << y.rank, axis=0)


def forward_trees(bsdf: TensorTreeBsdf, *, without_peak: bool = False) -> list[TensorTree]:
    """The trees of `BLOCKS`, light to where it goes, what is absent filled in."""
    rank = next(iter(bsdf.blocks().values())).rank
    trees = []
    for name in BLOCKS:
        tree, turned = bsdf.lookup(name)
        if tree is None:
            tree = TensorTree(rank, np.zeros(1, dtype=np.int64), np.zeros(1))
        if without_peak and name.startswith("transmission"):
            tree, _ = through_peak(tree)
        trees.append(tree.reversed() if turned else tree)
    return trees


def backward_trees(forward: list[TensorTree]) -> list[TensorTree]:
    """The trees read from where the light goes to where it came from, by the side it leaves on."""
    reflection_front, reflection_back, front, back = forward
    return [tree.reversed() for tree in (reflection_front, reflection_back, back, front)]


def _density_tree(tree: TensorTree) -> TensorTree:
    """A resampled tree that is nowhere zero where its neighbours are not."""
    floor = FLOOR * tree.values[tree.values > 0].mean() if np.any(tree.values > 0) else 0.0
    return TensorTree(tree.rank, tree.depths, np.maximum(tree.values, floor))
