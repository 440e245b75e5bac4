"""Tensor trees on Mitsuba's types: values by descent, and outgoing points drawn from the top."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_cfs.bsdf.plugin_base import ONE_BELOW, TINY
from mitsuba_cfs.bsdf.tensor_sampling import SamplingTree
from mitsuba_cfs.bsdf.traced_klems import cell, gather, table

QUARTER = np.pi / 4


def integers(values):
    """A table of whole numbers for `gather_integer`."""
    values = np.ascontiguousarray(values, dtype=np.int32)
    return values if mi.variant().startswith("scalar") else mi.Int32(values)


def gather_integer(values, index, active=True):
    """Entry of an `integers` table; zero where not active."""
    if isinstance(values, np.ndarray):
        return int(values[index]) if active else 0
    return dr.gather(mi.Int32, values, index, active)


def gather_four(values, index, active=True):
    """Four neighbouring entries of a `table` [4 x index ...]."""
    if isinstance(values, np.ndarray):
        return [float(v) for v in values[4 * index : 4 * index + 4]] if active else [0.0] * 4
    return dr.gather(mi.Vector4f, values, index, active)


def gather_two(values, index, active=True):
    """Two neighbouring entries of an `integers` table [2 x index ...]."""
    if isinstance(values, np.ndarray):
        return [int(v) for v in values[2 * index : 2 * index + 2]] if active else [1, 0]
    return dr.gather(mi.Vector2i, values, index, active)


def disk_to_square(x, y):
    """Point of the unit square for a point of the unit disk (Shirley and Chiu)."""
    radius = dr.sqrt(x * x + y * y)
    wide = dr.abs(x) > dr.abs(y)
    # the angle from the nearer axis, as a share of its wedge of 45 degrees to either side
    along = dr.select(wide, y, x)
    across = dr.select(wide, x, y)
    share = dr.atan(along / dr.select(across == 0, 1.0, across)) / QUARTER
    signed = dr.copysign(radius, across)
    a = dr.select(wide, signed, share * signed)
    b = dr.select(wide, share * signed, signed)
    return dr.clip(0.5 * (a + 1), 0.0, 1.0), dr.clip(0.5 * (b + 1), 0.0, 1.0)


def square_to_disk(u, v):
    """Point of the unit disk for a point of the unit square."""
    a, b = 2 * u - 1, 2 * v - 1
    wide = dr.abs(a) > dr.abs(b)
    across, along = dr.select(wide, a, b), dr.select(wide, b, a)
    s, c = dr.sincos(QUARTER * along / dr.select(across == 0, 1.0, across))
    return across * dr.select(wide, c, s), across * dr.select(wide, s, c)


class TracedTrees:
    """Several trees of one rank, each begun at its root node."""

    def __init__(self, tree: SamplingTree) -> None:
        self.known = tree.rank - 2  # coordinates of the incident position
        self.width = 1 << tree.rank
        self.levels = int(tree.heights.max())
        self.children = integers(tree.children)
        grids = np.stack([1 << tree.heights, tree.offsets], axis=1)  # [N, width and begin]
        self.grids = integers(grids.ravel())
        self.values = table(tree.values)
        self.masses = table(tree.masses)

    def value(self, root, incident, outgoing, active=True):
        """BSDF [1/sr] at an incident position and a point of the outgoing square, and its leaf."""
        leaf = self.leaf(root, incident, outgoing, active)
        return gather(self.values, leaf, active), leaf

    def straight(self, root, incident, active=True):
        """Leaf of the straight direction: rank 4 the same point, rank 3 opposite."""
        outgoing = incident if self.known == 2 else (1 - incident[0], mi.Float(0.5))
        return self.leaf(root, incident, outgoing, active)

    def leaf(self, root, incident, outgoing, active=True):
        """Number of the leaf at an incident position and a point of the outgoing square."""
        position, node = [*incident, *outgoing], mi.Int32(root)
        leaf, inside = mi.Int32(0), mi.Mask(active)
        for _ in range(self.levels):
            child, position = self._halve(position)
            result = gather_integer(self.children, node * self.width + child, inside)
            is_leaf = inside & (result < 0)
            leaf = dr.select(is_leaf, -1 - result, leaf)
            inside = inside & (result >= 0)
            node = dr.select(inside, result, node)
        return leaf

    def _halve(self, position):
        """Which half of each axis holds the position, as bits; the position within it."""
        child, inner = mi.Int32(0), []
        for axis, coordinate in enumerate(position):
            upper = coordinate >= 0.5
            child += dr.select(upper, mi.Int32(1 << axis), mi.Int32(0))
            inner.append(2 * coordinate - dr.select(upper, 1.0, 0.0))
        return child, inner

    def four_masses(self, node, incident, active=True):
        """Masses of the node's four outgoing quarters at the incident position."""
        width, begin = gather_two(self.grids, node, active)
        cell = mi.Int32(0)
        for coordinate in incident:
            step = mi.Int32(coordinate * mi.Float(width))
            cell = cell * width + dr.clip(step, 0, width - 1)
        return gather_four(self.masses, begin + cell, active)

    def total(self, root, incident, active=True):
        """Share of the light at the incident position that a tree scatters."""
        m = self.four_masses(mi.Int32(root), incident, active)
        return dr.pi / 4 * (m[0] + m[1] + m[2] + m[3])

    def sample(self, root, incident, u, v, active=True):
        """Point of the outgoing square in proportion to the values there, the value and its leaf.

        At each level one coordinate's half is chosen by `u`, then the other's by `v`; their
        remainders place the point in the leaf.
        """
        node, inside = mi.Int32(root), mi.Mask(active)
        leaf, size = mi.Int32(0), mi.Float(1.0)
        low_u, low_v = mi.Float(0.0), mi.Float(0.0)
        for _ in range(self.levels):
            m = self.four_masses(node, incident, inside)
            right, u = self._choose(u, m[0] + m[2], m[1] + m[3], inside)
            below, above = dr.select(right, m[1], m[0]), dr.select(right, m[3], m[2])
            upper, v = self._choose(v, below, above, inside)
            size = dr.select(inside, 0.5 * size, size)
            low_u += dr.select(right, size, 0.0)
            low_v += dr.select(upper, size, 0.0)
            child, incident = self._halve(incident)
            child += dr.select(right, mi.Int32(1 << self.known), mi.Int32(0))
            child += dr.select(upper, mi.Int32(2 << self.known), mi.Int32(0))
            result = gather_integer(self.children, node * self.width + child, inside)
            is_leaf = inside & (result < 0)
            leaf = dr.select(is_leaf, -1 - result, leaf)
            inside = inside & (result >= 0)
            node = dr.select(inside, result, node)
        value = gather(self.values, leaf, active)
        return low_u + u * size, low_v + v * size, value, leaf

    def _choose(self, u, first, second, inside):
        """Whether `u` chooses the second of two masses, and its remainder."""
        total = first + second
        share = dr.select(total > 0, first / dr.maximum(total, TINY), 0.5)
        second_half = u >= share
        rest = dr.select(second_half, (u - share) / dr.maximum(1 - share, TINY), u / dr.maximum(share, TINY))
        rest = dr.clip(rest, 0.0, ONE_BELOW)
        return inside & second_half, dr.select(inside, rest, u)


class TracedSquares:
    """The square in 2^levels x 2^levels cells, numbered row by row."""

    def __init__(self, levels: int) -> None:
        self.width = 1 << levels

    def patch(self, x, y, z):
        """Cell of the direction with cosines (x, y); z does not matter."""
        u, v = (cell(p * self.width, self.width - 1) for p in disk_to_square(x, y))
        return u * self.width + v

    def direction(self, patch, u, v):
        """(x, y, |z|) of the point (u, v) of a cell."""
        row = patch // self.width
        column = patch - row * self.width
        x, y = square_to_disk((mi.Float(row) + u) / self.width, (mi.Float(column) + v) / self.width)
        return x, y, dr.safe_sqrt(1.0 - x * x - y * y)


class TracedRings:
    """Incident cells of rank 3: (1 - sin(theta)) / 2 below 0.5, in 2^(levels - 1) steps."""

    def __init__(self, levels: int) -> None:
        self.width = 1 << (levels - 1)

    def direction(self, patch, u, v):
        """(x, y, |z|) of the point `u` of a step, at azimuth 2 pi `v`; uniform in u."""
        sine = 1.0 - (mi.Float(patch) + u) / self.width
        s, c = dr.sincos(2 * dr.pi * v)
        return sine * c, sine * s, dr.safe_sqrt(1.0 - sine * sine)
