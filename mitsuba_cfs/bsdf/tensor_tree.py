"""Tensor trees: BSDF values on a hypercube that is divided as finely as each region needs.

A direction is a point of the unit square, by Shirley and Chiu's map of the disk of direction
cosines (sin(theta) cos(phi), sin(theta) sin(phi)), so that equal areas of the square are equal
projected solid angles: the whole square is pi.  Rank 4 has the incident square and the outgoing
square; rank 3, for what looks the same turned about its normal, has (1 - sin(theta_in)) / 2, of
which only the half below 0.5 is used, and the outgoing square turned back by the incident azimuth.

A tree is kept as its leaves in the order of their Morton codes.

Source: Shirley and Chiu 1997, "A low distortion map between disk and square", Journal of Graphics
Tools 2(3); Ward, Kurt and Bonneel 2012, "A practical framework for sharing and rendering
real-world bidirectional scattering distribution functions" (the tree); format as in Radiance's
`bsdf_t.c`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import DUMMY_HEMISPHERICAL, with_sides_exchanged

MAX_CODE_BITS = 60
QUARTER = np.pi / 4


def square_to_disk(square: ArrayLike) -> NDArray[np.float64]:
    """Point of the unit disk [.., 2] for a point of the unit square [.., 2], equal areas kept."""
    a, b = np.moveaxis(2.0 * np.asarray(square, dtype=float) - 1.0, -1, 0)
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        phi = np.where(wide, QUARTER * (b / a), 2 * QUARTER - QUARTER * (a / b))
    phi = np.where(radius == 0, 0.0, phi)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)


def disk_to_square(disk: ArrayLike) -> NDArray[np.float64]:
    """Point of the unit square [.., 2] for a point of the unit disk [.., 2]."""
    x, y = np.moveaxis(np.asarray(disk, dtype=float), -1, 0)
    radius, phi = np.hypot(x, y), np.arctan2(y, x)
    phi = np.where(phi < -QUARTER, phi + 2 * np.pi, phi)  # from -pi/4 to 7 pi/4: four wedges
    wedge = np.floor(phi / (2 * QUARTER) + 0.5)
    along = (phi - wedge * 2 * QUARTER) * radius / QUARTER
    wedge = wedge.astype(int) % 4
    a = np.choose(wedge, [radius, -along, -radius, along])
    b = np.choose(wedge, [along, radius, -along, -radius])
    return np.stack([0.5 * (a + 1), 0.5 * (b + 1)], axis=-1)


@dataclass(frozen=True)
class TensorTree:
    """BSDF values [1/sr] of one scattering direction, on 2^-depth wide cells of the hypercube."""

    rank: int  # 3 or 4
    depths: NDArray[np.int64]  # [L] level of each leaf, 0 where the tree is one value
    values: NDArray[np.float64]  # [L] BSDF value of each leaf [1/sr], in Morton order

    def __post_init__(self) -> None:
        if self.rank not in (3, 4):
            raise ValueError(f"tensor tree: expected rank 3 or 4, got {self.rank}")
        if self.rank * int(self.depths.max(initial=0)) > MAX_CODE_BITS:
            raise ValueError("tensor tree: is nested too deeply")
        if len(self.values) != len(self.depths) or self._starts()[-1] != self._volume(0):
            raise ValueError("tensor tree: the leaves do not fill the hypercube")

    @cached_property
    def depth(self) -> int:
        """Depth of the deepest leaf D: the tree resolves 2^D cells an axis."""
        return int(self.depths.max())

    @cached_property
    def codes(self) -> NDArray[np.int64]:
        """Morton code of each leaf's lower corner [L], at `depth`."""
        return self._starts()[:-1]

    def _volume(self, depths: ArrayLike) -> NDArray[np.int64]:
        return np.left_shift(1, self.rank * (self.depth - np.asarray(depths)))

    def _starts(self) -> NDArray[np.int64]:
        return np.concatenate([[0], np.cumsum(self._volume(self.depths))])

    def corners(self, axes: int | None = None) -> NDArray[np.int64]:
        """Lower corner of each leaf [L, axes], in cells of the deepest level; of all axes."""
        axes = self.rank if axes is None else axes
        corner = np.zeros((len(self.codes), axes), dtype=np.int64)
        for level in range(self.depth):
            digit = self.codes >> (self.rank * level)
            for axis in range(axes):
                corner[:, axis] |= ((digit >> axis) & 1) << level
        return corner

    def leaf(self, position: ArrayLike) -> NDArray[np.int64]:
        """Index of the leaf that holds each position [.., rank] of the unit hypercube."""
        cell = _cell(np.asarray(position), 1 << self.depth)
        return np.searchsorted(self.codes, morton(cell, self.depth), side="right") - 1

    def sample_grid(self) -> NDArray[np.float64]:
        """Values on the dense grid [2^D, ...] of the deepest level (memory: 2^(rank D))."""
        axis = np.arange(1 << self.depth)
        cell = np.stack(np.meshgrid(*[axis] * self.rank, indexing="ij"), axis=-1)
        leaf = np.searchsorted(self.codes, morton(cell, self.depth), side="right") - 1
        return self.values[leaf]

    def hemispherical(self) -> NDArray[np.float64]:
        """Share of the light scattered from each incident cell: [2^D, 2^D], rank 3 [2^(D-1)]."""
        return self._hemispherical

    @cached_property
    def _hemispherical(self) -> NDArray[np.float64]:
        """`hemispherical`, cached for each tree, because every check of a file needs it.

        Every leaf adds value x outgoing projected solid angle to the block of incident cells that
        it spans; the blocks are summed through their corners.
        """
        cells, width = 1 << self.depth, np.left_shift(1, self.depth - self.depths)
        amount = np.pi * self.values * (width / cells) ** 2
        incident = self.rank - 2
        low = self.corners(incident)
        edges = np.zeros((cells + 1,) * incident)
        for upper in np.ndindex(*(2,) * incident):
            corner = low + np.asarray(upper) * width[:, None]
            np.add.at(edges, tuple(corner.T), amount * (-1) ** sum(upper))
        for axis in range(incident):
            edges = np.cumsum(edges, axis=axis)
        used = edges[(slice(0, cells),) * incident]
        return np.maximum(used if self.rank == 4 else used[: max(cells // 2, 1)], 0.0)

    def mirrored(self) -> TensorTree:
        """The tree of the system's image in the plane of its up and its normal.

        The first axis of both squares is reversed; of rank 3, turned back by the incident azimuth,
        the second one of the outgoing square.
        """
        cells, width = 1 << self.depth, np.left_shift(1, self.depth - self.depths)
        corner = self.corners()
        for axis in (2,) if self.rank == 3 else (0, 2):
            corner[:, axis] = cells - width - corner[:, axis]
        order = np.argsort(morton(corner, self.depth))
        return TensorTree(self.rank, self.depths[order], self.values[order])

    def reversed(self) -> TensorTree:
        """The tree of the way back, f(i -> o) = f(o -> i).

        Rank 4: squares exchanged and turned by pi, exact.  Rank 3: means over the cells of a dense
        grid of the same depth, of 64 points each.
        """
        return self._reversed

    @cached_property
    def _reversed(self) -> TensorTree:
        if self.rank == 3:
            return self._reversed_isotropic()
        cells, width = 1 << self.depth, np.left_shift(1, self.depth - self.depths)
        corner = (cells - width[:, None] - self.corners())[:, [2, 3, 0, 1]]
        order = np.argsort(morton(corner, self.depth))
        return TensorTree(4, self.depths[order], self.values[order])

    def _reversed_isotropic(self, subdivision: int = 4) -> TensorTree:
        from mitsuba_cfs.bsdf.tensor_text import row_major_order

        cells, used = 1 << self.depth, max((1 << self.depth) // 2, 1)
        known, grid = self.sample_grid(), np.zeros((cells, cells, cells))
        for part in np.ndindex(*(subdivision,) * 3):
            axes = [(np.arange(cells) + (step + 0.5) / subdivision) / cells for step in part]
            sine_in = np.maximum(1 - 2 * axes[0][:used, None, None], 0.0)
            square = np.stack(np.meshgrid(*axes[1:], indexing="ij"), axis=-1)
            u, v = np.moveaxis(square_to_disk(square), -1, 0)
            sine_out = np.maximum(np.hypot(u, v), 1e-12)
            turned = disk_to_square(np.stack([sine_in * u, -sine_in * v], -1) / sine_out[..., None])
            across = _cell(0.5 - 0.5 * sine_out, cells)
            grid[:used] += known[across, *np.moveaxis(_cell(turned, cells), -1, 0)]
        grid /= subdivision**3
        grid[cells // 2 :] = 0.0  # the half that is not used
        values = grid.ravel()[row_major_order(3, self.depth)]
        return TensorTree(3, np.full(values.size, self.depth), values)

    @classmethod
    def from_text(cls, text: str, rank: int) -> TensorTree:
        """The tree of a file's nested braces; `ValueError` where they do not nest."""
        from mitsuba_cfs.bsdf.tensor_text import parse_tree

        return cls(rank, *parse_tree(text, rank))


def _cell(position: NDArray[np.float64], cells: int) -> NDArray[np.int64]:
    """Cell [..] of `cells` along an axis that each position from 0 to 1 lies in."""
    return np.clip((position * cells).astype(np.int64), 0, cells - 1)


def morton(cell: NDArray[np.int64], depth: int) -> NDArray[np.int64]:
    """Morton code [..] of integer cells [.., rank] of a tree `depth` levels deep."""
    rank = cell.shape[-1]
    code = np.zeros(cell.shape[:-1], dtype=np.int64)
    for level in range(depth):
        for axis in range(rank):
            code |= ((cell[..., axis] >> level) & 1) << (rank * level + axis)
    return code


@dataclass(frozen=True)
class TensorTreeBsdf:
    """BSDF values [1/sr] of one spectral band as tensor trees; "front" is the exterior."""

    transmission_front: TensorTree | None = None
    transmission_back: TensorTree | None = None
    reflection_front: TensorTree | None = None
    reflection_back: TensorTree | None = None
    see_through: float = 1.0  # share of its peak that passes straight on

    def blocks(self) -> dict[str, TensorTree]:
        """The trees that are there, by name."""
        names = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
        return {name: block for name in names if (block := getattr(self, name)) is not None}

    def turned_round(self) -> TensorTreeBsdf:
        """The same system with its back outdoors, turned by pi about its up."""
        return with_sides_exchanged(self, TensorTree.mirrored)

    def direct_hemispherical(self, block: TensorTree) -> NDArray[np.float64]:
        """Share of each incident cell's light that `block` sends on [2^2D] or [2^(D-1)]."""
        return block.hemispherical().ravel()

    def scattered(self, side: str) -> NDArray[np.float64]:
        """Share of each incident cell's light from `side` that all trees send on [cells].

        The cells are those of the finest tree of that side.
        """
        trees = [tree for name, tree in self.blocks().items() if name.endswith(side)]
        shares = [tree.hemispherical() for tree in trees]
        finest = max((len(share) for share in shares), default=1)
        total = np.zeros(1)
        for share in shares:
            for axis in range(share.ndim):
                share = np.repeat(share, finest // share.shape[axis], axis=axis)
            total = total + share.ravel()
        return total

    def incident_weights(self, count: int) -> NDArray[np.float64]:
        """Share of the incident hemisphere's projected solid angle of each of `count` cells."""
        if any(tree.rank == 4 for tree in self.blocks().values()):
            return np.full(count, 1 / count)
        sine = 1 - np.arange(count + 1) / count  # at the edges, see the module's head
        return sine[:-1] ** 2 - sine[1:] ** 2

    def is_dummy(self, block: TensorTree | None) -> bool:
        """Whether a tree transmits nothing and is treated as absent, as in Radiance."""
        return block is None or self.direct_hemispherical(block).max() <= DUMMY_HEMISPHERICAL

    def lookup(self, name: str) -> tuple[TensorTree | None, bool]:
        """Tree used for block `name`, and whether it is read in reverse.

        A transmission that is absent or a placeholder is replaced by the other side's by
        reciprocity.
        """
        own = getattr(self, name)
        kind, side = name.split("_")
        if kind == "reflection" or not self.is_dummy(own):
            return own, False
        other = getattr(self, "transmission_" + ("back" if side == "front" else "front"))
        return (own, False) if self.is_dummy(other) else (other, True)
