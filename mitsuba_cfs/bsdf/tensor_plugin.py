"""The Mitsuba plugin `tensor_tree_bsdf`: tensor trees that are evaluated and sampled as trees.

    {"type": "tensor_tree_bsdf", "filename": "blind.xml", "band": "Visible", "up": [0, 0, 1]}

Nothing is made dense: a value is found by descent, a direction drawn level by level.  Rank 4 is
sampled exactly in both transport modes.  Rank 3 is when paths start at a light; from the camera
the tree of the way back, f(i -> o) = f(o -> i), is known only by means over its cells: it is drawn
from that and weighted by the true value.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.plugin_base import window_bsdf
from mitsuba_cfs.bsdf.tensor_peak import through_peak
from mitsuba_cfs.bsdf.tensor_sampling import SamplingTree, joined, sampling_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError

PLUGIN = "tensor_tree_bsdf"
BLOCKS = ("reflection_front", "reflection_back", "transmission_front", "transmission_back")
FLOOR = 0.02  # share of its mean that the density of a resampled tree never falls below


def tensor_tree_plugin(
    bsdf: TensorTreeBsdf, *, up: tuple[float, float, float] | None = None, peak: bool = False
) -> dict:
    """The `load_dict` entry of a system's BSDF; `up` [3] is the world vector of its up."""
    import mitsuba as mi

    entry = {"type": PLUGIN, "peak": peak}
    for name, tree in bsdf.blocks().items():
        entry[f"{name}_depths"] = mi.TensorXf(tree.depths.astype(np.float32))
        entry[f"{name}_values"] = mi.TensorXf(tree.values.astype(np.float32))
        entry["rank"] = tree.rank
    if up is not None:
        entry["up"] = list(map(float, up))
    return entry


def forward_trees(bsdf: TensorTreeBsdf) -> list[TensorTree]:
    """The trees of `BLOCKS`, light to where it goes, what is absent filled in."""
    rank = next(iter(bsdf.blocks().values())).rank
    trees = []
    for name in BLOCKS:
        tree, turned = bsdf.lookup(name)
        if tree is None:
            tree = TensorTree(rank, np.zeros(1, dtype=np.int64), np.zeros(1))
        trees.append(tree.reversed() if turned else tree)
    return trees


def backward_trees(bsdf: TensorTreeBsdf) -> list[TensorTree]:
    """The trees read from where the light goes to where it came from, by the side it leaves on."""
    forward = dict(zip(BLOCKS, forward_trees(bsdf), strict=True))
    forward["transmission_front"], forward["transmission_back"] = (
        forward["transmission_back"],
        forward["transmission_front"],
    )
    return [tree.reversed() for tree in forward.values()]


def _density_tree(tree: TensorTree) -> TensorTree:
    """A resampled tree that is nowhere zero where its neighbours are not."""
    floor = FLOOR * tree.values[tree.values > 0].mean() if np.any(tree.values > 0) else 0.0
    return TensorTree(tree.rank, tree.depths, np.maximum(tree.values, floor))


def tables(
    bsdf: TensorTreeBsdf, peak: bool
) -> tuple[SamplingTree, SamplingTree, NDArray[np.float64] | None]:
    """Trees to find values in, trees to draw from, and with `peak` the beams of these [L].

    Four forward ones, then four backward ones; rank 4 draws from those that it finds values in.
    """
    forward, backward = forward_trees(bsdf), backward_trees(bsdf)
    if forward[0].rank == 4:
        trees, beams = forward + backward, None
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
    if peak:
        raise ValueError("tensor_tree_bsdf: peak needs trees of rank 4")
    drawn = [sampling_tree(tree) for tree in forward + [_density_tree(t) for t in backward]]
    return joined(drawn[:4]), joined(drawn), None


def _read(props) -> TensorTreeBsdf:
    """The trees that the plugin's properties name (a file) or hold (tensors)."""
    if "filename" in props:
        path, band = props["filename"], props.get("band", "Visible")
        file = read_bsdf_xml(path)
        bsdf = file.bands.get(band)
        if not isinstance(bsdf, TensorTreeBsdf):
            held = "Klems matrices" if bsdf else ", ".join(file.bands)
            raise DataError(
                f"expected tensor trees, the file holds {held}", file=path, element=band
            )
        return bsdf
    trees = {}
    for name in BLOCKS:
        if f"{name}_depths" in props:
            depths, values = (np.array(props[f"{name}_{part}"]) for part in ("depths", "values"))
            depths, values = depths.ravel().astype(np.int64), values.ravel().astype(float)
            trees[name] = TensorTree(int(props["rank"]), depths, values)
    return TensorTreeBsdf(**trees)


def _register(variant: str) -> None:
    """Define the plugin on the types of `variant` and make Mitsuba know it."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.traced_tree import TracedTrees, disk_to_square, integers, square_to_disk
    from mitsuba_cfs.bsdf.traced_tree import gather_integer as gather_root

    class TensorTreePlugin(window_bsdf()):
        def __init__(self, props):
            super().__init__(props)
            valued, drawn, beams = tables(_read(props), self.peak)
            self.rank = valued.rank
            self.drawn = TracedTrees(drawn, beams)
            self.valued = self.drawn if valued is drawn else TracedTrees(valued)
            self.value_roots, self.draw_roots = integers(valued.roots), integers(drawn.roots)

        def tree(self, ctx, known, through):
            """Number of the tree (see `BLOCKS`) for a known direction, and that of its values."""
            forward = dr.select(known.z > 0, mi.UInt32(0), mi.UInt32(1))
            forward += dr.select(through, mi.UInt32(2), mi.UInt32(0))
            if ctx.mode == mi.TransportMode.Importance:
                return forward
            return forward + 4

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
            density = self.drawn.value(root, position, self.square(other, azimuth), active)
            if self.rank == 4 or ctx.mode == mi.TransportMode.Importance:
                return density, density
            return self.true_value(known, other, active), density

        def true_value(self, known, other, active):
            """Rank 3, from the camera: the value of light that comes from `other`."""
            through = known.z * other.z < 0
            number = dr.select(other.z > 0, mi.UInt32(0), mi.UInt32(1))
            number += dr.select(through, mi.UInt32(2), mi.UInt32(0))
            position, azimuth = self.place(other)
            root = gather_root(self.value_roots, number, active)
            return self.valued.value(root, position, self.square(known, azimuth), active)

        def totals(self, ctx, known, active):
            position, _ = self.place(known)
            return tuple(
                self.drawn.total(
                    gather_root(self.draw_roots, self.tree(ctx, known, through), active),
                    position,
                    active,
                )
                for through in (mi.Mask(False), mi.Mask(True))
            )

        def through(self, ctx, known, active):
            root = gather_root(self.draw_roots, self.tree(ctx, known, mi.Mask(True)), active)
            return self.drawn.straight(root, self.place(known)[0], active)

        def draw(self, ctx, known, through, u, point, active):
            position, (c, s) = self.place(known)
            root = gather_root(self.draw_roots, self.tree(ctx, known, through), active)
            a, b, density = self.drawn.sample(root, position, point.x, point.y, active)
            x, y = square_to_disk(a, b)
            if self.rank == 3:
                x, y = x * c - y * s, x * s + y * c
            z = dr.safe_sqrt(1 - x * x - y * y) * dr.sign(known.z)
            other = mi.Vector3f(-x, y, dr.select(through, -z, z))
            if self.rank == 4 or ctx.mode == mi.TransportMode.Importance:
                return other, density, density
            return other, self.true_value(known, other, active), density

        def to_string(self):
            return f"TensorTreeBsdf[rank {self.rank}, {self.drawn.levels} levels]"

    mi.register_bsdf(PLUGIN, TensorTreePlugin)


variants.register(_register)
