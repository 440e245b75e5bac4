"""The Mitsuba plugin `tensor_tree_bsdf`: tensor trees that are evaluated and sampled as trees.

    {"type": "tensor_tree_bsdf", "filename": "blind.xml", "band": "Visible", "up": [0, 0, 1]}

Nothing is made dense: a value is found by descent, a direction drawn level by level.  Rank 4 is
sampled exactly in both transport modes.  Rank 3 is when paths start at a light; from the camera
the tree of the way back, f(i -> o) = f(o -> i), is known only by means over its cells: it is drawn
from that and weighted by the true value.  With `peak`, what goes straight on beyond what surrounds
it passes undisturbed.  In variants of colour a file's CIE-X and CIE-Z bands tint its Visible one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.colour import leaf_means, relative_rgb
from mitsuba_cfs.bsdf.evaluate import tree_peak
from mitsuba_cfs.bsdf.plugin_base import window_bsdf
from mitsuba_cfs.bsdf.plugin_data import PREFIXES, read_band
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
    leaves: NDArray[np.float64]  # values of the four forward trees, one after the other
    numbers: NDArray[np.int64]  # [L] which of these each leaf of `valued` has


def plugin_trees(
    bsdf: TensorTreeBsdf, peak: bool, colour: tuple[TensorTreeBsdf, TensorTreeBsdf] | None = None
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
    leaves = np.concatenate([tree.values for tree in forward])
    numbers = _numbers_of_leaves(forward, rank)
    if colour is None:
        return PluginTrees(valued, drawn, beams, None, leaves, numbers)
    bands = [whole, *(forward_trees(band) for band in colour)]
    if rank == 4:
        bands = [trees + backward_trees(trees) for trees in bands]
    colours = [leaf_colours(y, x, z) for y, x, z in zip(*bands, strict=True)]
    return PluginTrees(valued, drawn, beams, np.concatenate(colours), leaves, numbers)


def _numbers_of_leaves(forward: list[TensorTree], rank: int) -> NDArray[np.int64]:
    """Which value of the forward trees each leaf of the trees with values has: trees of numbers."""
    firsts = np.cumsum([0, *(len(tree.values) for tree in forward)])
    counted = [
        TensorTree(tree.rank, tree.depths, first + np.arange(len(tree.values), dtype=float))
        for tree, first in zip(forward, firsts, strict=False)
    ]
    if rank == 4:
        counted += backward_trees(counted)
    return np.rint(joined([sampling_tree(tree) for tree in counted]).values).astype(np.int64)


def _without_peaks(bsdf: TensorTreeBsdf, whole: list[TensorTree]) -> tuple[list[TensorTree], NDArray[np.float64]]:
    """The forward trees without their through peaks, and the beams of `PluginTrees`.

    The way back of rank 3 is known by means only, which would blur a peak: it is taken out first.
    """
    rest, shares = [], []
    for name, tree in zip(BLOCKS, whole, strict=True):
        own, turned = bsdf.lookup(name)
        share = np.zeros((1,) * (tree.rank - 2))
        if own is not None and name.startswith("transmission"):
            if tree.rank == 4:
                tree, share = tree_peak(tree, bsdf.see_through)
            else:  # the beam of the other side is equal
                tree, share = tree_peak(own, bsdf.see_through)
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


PLUGIN = "tensor_tree_bsdf"


def tensor_tree_plugin(
    bsdf: TensorTreeBsdf,
    *,
    colour: tuple[TensorTreeBsdf, TensorTreeBsdf] | None = None,
    up: tuple[float, float, float] | None = None,
    peak: bool = False,
    angular: AngularTable | None = None,
) -> dict:
    """The `load_dict` entry of a system's BSDF, for the active Mitsuba variant.

    Args:
        colour: its CIE-X and CIE-Z bands, for variants of colour.
        up: [3] world vector of the system's up.
        peak: transmit the direct part undisturbed.
        angular: direct transmittance of a specular system by angle, instead of the data's patches.
    """
    variants.activate(vectorised=False)
    import mitsuba as mi

    entry = {"type": PLUGIN, "peak": peak, "see_through": bsdf.see_through}
    for prefix, band in zip(PREFIXES, (bsdf, *(colour or ())), strict=False):
        for name, tree in band.blocks().items():
            entry[f"{prefix}{name}_depths"] = mi.TensorXf(tree.depths.astype(np.float32))
            entry[f"{prefix}{name}_values"] = mi.TensorXf(tree.values.astype(np.float32))
            entry["rank"] = tree.rank
    if up is not None:
        entry["up"] = list(map(float, up))
    if angular is not None:
        table = mi.TensorXf(angular.by_cosine().astype(np.float32))
        entry |= {"peak": True, "angular": table, "see_through": 1.0}
    return entry


def _read(props) -> tuple[TensorTreeBsdf, tuple[TensorTreeBsdf, TensorTreeBsdf] | None]:
    """The trees that the plugin's properties name (a file) or hold (tensors), and their X, Z."""
    if "filename" in props:
        return read_band(props, TensorTreeBsdf)
    bands = []
    for prefix in PREFIXES:
        trees = {}
        for name in BLOCKS:
            if f"{prefix}{name}_depths" in props:
                parts = (props[f"{prefix}{name}_{part}"] for part in ("depths", "values"))
                depths, values = (np.array(part).ravel() for part in parts)
                rank = int(props["rank"])
                trees[name] = TensorTree(rank, depths.astype(np.int64), values.astype(float))
        bands.append(TensorTreeBsdf(**trees, see_through=float(props["see_through"])))
    return bands[0], tuple(bands[1:]) if bands[1].blocks() else None


def _register(variant: str) -> None:
    """Define the plugin on the types of `variant` and make Mitsuba know it."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin_data import TableParameter, TracedColour, sees_colour
    from mitsuba_cfs.bsdf.traced_klems import gather, table
    from mitsuba_cfs.bsdf.traced_tree import TracedTrees, disk_to_square, integers, square_to_disk
    from mitsuba_cfs.bsdf.traced_tree import gather_integer as gather_root

    class TensorTreePlugin(window_bsdf()):
        def __init__(self, props):
            super().__init__(props)
            bsdf, colour = _read(props)
            trees = plugin_trees(bsdf, self.peak, colour if sees_colour() else None)
            self.rank = trees.valued.rank
            self.drawn = TracedTrees(trees.drawn)
            same = trees.valued is trees.drawn
            self.valued = self.drawn if same else TracedTrees(trees.valued)
            self.value_roots, self.draw_roots = map(integers, (trees.valued.roots, trees.drawn.roots))
            if trees.beams is not None:
                self.beams, self.beam_cells = table(trees.beams), trees.beams.shape[-1]
            if trees.colours is not None:
                self.colour = TracedColour(trees.colours)
            self.parameter = TableParameter(trees.leaves, trees.numbers)

        def traverse(self, callback):
            super().traverse(callback)
            self.parameter.traverse(callback, "leaves")

        def parameters_changed(self, keys=()):
            self.parameter.changed()

        def tree(self, ctx, known, through):
            """Number of the tree (see `BLOCKS`) for a known direction, and that of its values."""
            forward = self.forward(known, through)
            if ctx.mode == mi.TransportMode.Importance:
                return forward
            return forward + 4

        def forward(self, incident, through):
            """Number of the forward tree for light from `incident`."""
            number = dr.select(incident.z > 0, mi.UInt32(0), mi.UInt32(1))
            return number + dr.select(through, mi.UInt32(2), mi.UInt32(0))

        def place(self, known):
            """Position of a known direction in the tree, and its azimuth where that is turned."""
            x, y = known.x, -known.y
            if self.rank == 4:
                return disk_to_square(x, y), (1.0, 0.0)
            sine = dr.sqrt(x * x + y * y)
            inverse = dr.select(sine > 0, 1 / dr.maximum(sine, 1e-20), 0.0)
            across = dr.minimum(0.5 - 0.5 * sine, 0.5 - 1e-6)
            return (across,), (dr.select(sine > 0, x * inverse, 1.0), y * inverse)

        def square(self, other, azimuth):
            """Point of the outgoing square of a direction."""
            u, v = -other.x, other.y
            if self.rank == 3:
                c, s = azimuth
                u, v = u * c + v * s, v * c - u * s
            return disk_to_square(u, v)

        def values(self, ctx, known, other, active):
            through = known.z * other.z < 0
            number = self.tree(ctx, known, through)
            position, azimuth = self.place(known)
            root = gather_root(self.draw_roots, number, active)
            density, leaf = self.drawn.value(root, position, self.square(other, azimuth), active)
            if self.rank == 4 or ctx.mode == mi.TransportMode.Importance:
                return self.parameter.value(leaf, density, active), density, leaf
            value, leaf = self.true_value(known, other, active)
            return value, density, leaf

        def true_value(self, known, other, active):
            """Rank 3, from the camera: the value of light that comes from `other`."""
            number = self.forward(other, known.z * other.z < 0)
            position, azimuth = self.place(other)
            root = gather_root(self.value_roots, number, active)
            value, leaf = self.valued.value(root, position, self.square(known, azimuth), active)
            return self.parameter.value(leaf, value, active), leaf

        def totals(self, ctx, known, active):
            position, _ = self.place(known)
            return tuple(
                self.drawn.total(gather_root(self.draw_roots, self.tree(ctx, known, through), active), position, active)
                for through in (mi.Mask(False), mi.Mask(True))
            )

        def through(self, ctx, known, active):
            incident = known if ctx.mode == mi.TransportMode.Importance else -known
            cell = self.forward(incident, mi.Mask(True))
            for coordinate in self.place(incident)[0]:
                step = coordinate * (self.beam_cells if self.rank == 4 else 2 * self.beam_cells)
                step = dr.minimum(mi.UInt32(step), mi.UInt32(self.beam_cells - 1))
                cell = cell * self.beam_cells + step
            return gather(self.beams, cell, active)

        def through_entry(self, ctx, known, active):
            """Leaf that holds the beam: of the drawn trees for rank 4, of the forward ones else."""
            if self.rank == 4:
                number, roots = self.tree(ctx, known, mi.Mask(True)), self.draw_roots
            else:
                number, roots = self.straight_tree(ctx, known), self.value_roots
            root = gather_root(roots, number, active)
            return self.valued.straight(root, self.place(known)[0], active)

        def straight_tree(self, ctx, known):
            """Number of the forward tree of a straight beam that comes from or goes to `known`."""
            incident = known if ctx.mode == mi.TransportMode.Importance else -known
            return self.forward(incident, mi.Mask(True))

        def draw(self, ctx, known, through, u, point, active):
            position, (c, s) = self.place(known)
            root = gather_root(self.draw_roots, self.tree(ctx, known, through), active)
            a, b, density, leaf = self.drawn.sample(root, position, point.x, point.y, active)
            x, y = square_to_disk(a, b)
            if self.rank == 3:
                x, y = x * c - y * s, x * s + y * c
            z = dr.safe_sqrt(1 - x * x - y * y) * dr.sign(known.z)
            other = mi.Vector3f(-x, y, dr.select(through, -z, z))
            if self.rank == 4 or ctx.mode == mi.TransportMode.Importance:
                return other, self.parameter.value(leaf, density, active), density, leaf
            value, leaf = self.true_value(known, other, active)
            return other, value, density, leaf

        def to_string(self):
            return f"TensorTreeBsdf[rank {self.rank}, {self.drawn.levels} levels]"

    mi.register_bsdf(PLUGIN, TensorTreePlugin)


variants.register(_register)
