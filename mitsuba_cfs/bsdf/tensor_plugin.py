"""The Mitsuba plugin `tensor_tree_bsdf`: tensor trees that are evaluated and sampled as trees.

    {"type": "tensor_tree_bsdf", "filename": "blind.xml", "band": "Visible", "up": [0, 0, 1]}

Nothing is made dense: a value is found by descent, a direction drawn level by level.  Rank 4 is
sampled exactly in both transport modes.  Rank 3 is when paths start at a light; from the camera
the tree of the way back, f(i -> o) = f(o -> i), is known only by means over its cells: it is drawn
from that and weighted by the true value.  With `peak`, what goes straight on beyond what surrounds
it passes undisturbed.  In variants of colour a file's CIE-X and CIE-Z bands tint its Visible one.
"""

from __future__ import annotations

import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.plugin_base import window_bsdf
from mitsuba_cfs.bsdf.plugin_data import PREFIXES, read_band
from mitsuba_cfs.bsdf.plugin_trees import BLOCKS, plugin_trees
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf

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

    entry = {"type": PLUGIN, "peak": peak}
    for prefix, band in zip(PREFIXES, (bsdf, *(colour or ())), strict=False):
        for name, tree in band.blocks().items():
            entry[f"{prefix}{name}_depths"] = mi.TensorXf(tree.depths.astype(np.float32))
            entry[f"{prefix}{name}_values"] = mi.TensorXf(tree.values.astype(np.float32))
            entry["rank"] = tree.rank
    if up is not None:
        entry["up"] = list(map(float, up))
    if angular is not None:
        entry |= {"peak": True, "angular": mi.TensorXf(angular.by_cosine().astype(np.float32))}
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
        bands.append(TensorTreeBsdf(**trees))
    return bands[0], tuple(bands[1:]) if bands[1].blocks() else None


def _register(variant: str) -> None:
    """Define the plugin on the types of `variant` and make Mitsuba know it."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin_data import TracedColour, sees_colour
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
            self.value_roots, self.draw_roots = map(
                integers, (trees.valued.roots, trees.drawn.roots)
            )
            if trees.beams is not None:
                self.beams, self.beam_cells = table(trees.beams), trees.beams.shape[-1]
            if trees.colours is not None:
                self.colour = TracedColour(trees.colours)

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
                return density, density, leaf
            value, leaf = self.true_value(known, other, active)
            return value, density, leaf

        def true_value(self, known, other, active):
            """Rank 3, from the camera: the value of light that comes from `other`."""
            number = self.forward(other, known.z * other.z < 0)
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
                return other, density, density, leaf
            value, leaf = self.true_value(known, other, active)
            return other, value, density, leaf

        def to_string(self):
            return f"TensorTreeBsdf[rank {self.rank}, {self.drawn.levels} levels]"

    mi.register_bsdf(PLUGIN, TensorTreePlugin)


variants.register(_register)
