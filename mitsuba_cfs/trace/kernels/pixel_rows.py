"""Rows of a view matrix that the pixels of a tile share, their smoothing, and their noise.

Light that varies slowly over a face of the scene is shared among the pixels that show the face.
The picture is cut into square tiles.  One row, the mean over a tile's pixels that show one face,
stands for these pixels; the tiles around it on the same face smooth it, and a pixel interpolates
between the centres of tiles.  Edges of the scene and sharp light (the sun's beam, the sky through
glass) are never blurred.  Half the difference of the means over two halves of the pixels is the
noise of the row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, pixel_directions, pixel_solid_angles
from mitsuba_cfs.trace.kernels.sampling import column, spread_rays, tables, vectors
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene

TILE, LARGEST_TILE = np.radians(0.9), 16  # across; [px]
MARGIN = 8  # [tiles] round the picture, so that no tile's neighbour is another row's end
STEPS = (1, 2)  # [tiles] of the smoothing, one after the other
BALANCINGS = 64  # rounds at most, by which the sums agree to 1e-4
BALANCED = 1e-9  # of its weight: a round that changes none by more is the last
FACE_STEPS = 8  # normals that differ less than 1/16 in each component are one face
SMOOTHED_TILES = 16  # whole ones behind a row that is smoothed, below which its pixels have more
MOST_TIMES = 32  # as many paths


def face_numbers(surface: NDArray, normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """The face [N] that each triangle belongs to: of one surface, in one direction [N, 3]."""
    steps = np.round(np.asarray(normal) * FACE_STEPS).astype(np.int64)
    table = np.column_stack([np.asarray(surface).astype(np.int64), steps])
    low = table.min(axis=0, initial=0)
    number = np.ravel_multi_index(tuple((table - low).T), tuple(table.max(axis=0, initial=0) - low + 1))
    return np.unique(number, return_inverse=True)[1]  # a tenth of the time that whole rows take


def numbered(row: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of each entry among those of its row [n]."""
    order = np.argsort(row, kind="stable")
    _, first, place = np.unique(row[order], return_index=True, return_inverse=True)
    number = np.empty(len(row), dtype=np.int64)
    number[order] = np.arange(len(row)) - first[place]
    return number


def tile_size(view: View) -> int:
    """Pixels across of a view's tiles: 0.9 degrees, 2 pixels at least."""
    size = float(np.sqrt(pixel_solid_angles(view).max()))
    return int(np.clip(round(TILE / size), 2, LARGEST_TILE))


@dataclass(frozen=True)
class Tiles:
    """Squares of `size` pixels of a picture `width` pixels wide."""

    size: int
    width: int

    def key(self, column: ArrayLike, row: ArrayLike, face: ArrayLike) -> NDArray[np.int64]:
        """Number of a face in the tile at a column and row of tiles."""
        across = -(-self.width // self.size) + 2 * MARGIN
        column, row = np.asarray(column) + MARGIN, np.asarray(row) + MARGIN
        return (np.asarray(face, dtype=np.int64) << 40) + row * across + column

    def of_pixels(self, pixel: NDArray[np.int64], face: NDArray) -> NDArray[np.int64]:
        """Numbers of the faces in the tiles of pixels (row * width + column)."""
        row, column = np.divmod(pixel, self.width)
        return self.key(column // self.size, row // self.size, face)


def neighbours(tiles: Tiles, key: NDArray[np.int64], step: int) -> sparse.csr_array:
    """Weights 1 2 1 of the tiles `step` away in both directions on the same face [m, m].

    Args: key: [m] numbers of faces in tiles, rising.
    """
    if step > MARGIN:
        raise ValueError(f"a step of {step} tiles: at most {MARGIN}")
    if not len(key):
        return sparse.csr_array((0, 0))
    down = tiles.key(0, 1, 0) - tiles.key(0, 0, 0)
    row, column, weight = [], [], []
    for y in (-1, 0, 1):
        for x in (-1, 0, 1):
            place, is_known = _find(key, key + step * (y * down + x))
            row.append(np.flatnonzero(is_known))
            column.append(place[is_known])
            weight.append(np.full(len(row[-1]), float((2 - abs(x)) * (2 - abs(y)))))
    entries = np.concatenate(weight), (np.concatenate(row), np.concatenate(column))
    return sparse.csr_array(entries, shape=(len(key), len(key)))


def smoothing(
    tiles: Tiles, key: NDArray[np.int64], count: NDArray, close: NDArray[np.bool_] | None = None
) -> sparse.csr_array:
    """Smoothing of means over tiles by the tiles around each on its face [m, m].

    A uniform face stays uniform, and the sum of count times mean is conserved: the weights 1 2 1
    are scaled to diag(x) A diag(x) with row and column sums of 1 (Sinkhorn and Knopp 1967).

    Args:
        key: [m] as of `neighbours`; count: [m] weight of each mean.
        close: [m] tiles that another surface is close to, as in a corner, where light changes fast:
            only the tiles that touch them smooth them.
    """
    count = np.maximum(np.asarray(count, dtype=float), 1e-12)
    whole = sparse.csr_array(sparse.eye_array(len(key)))
    for step in STEPS:
        near, x = neighbours(tiles, key, step), np.ones(len(key))
        if close is not None and step > 1:
            near = _apart(near, close)
        for _ in range(BALANCINGS):
            before, x = x, np.sqrt(x / (near @ (count * x)))
            if np.all(np.abs(x - before) <= BALANCED * x):
                break
        weights = sparse.diags_array(x) @ near @ sparse.diags_array(x * count)
        rows = sparse.diags_array(1 / np.maximum(weights.sum(axis=1), 1e-300))
        whole = sparse.csr_array(rows @ weights @ whole)
    return whole


def _apart(near: sparse.csr_array, close: NDArray[np.bool_]) -> sparse.csr_array:
    """Weights of neighbours [m, m] without those of some tiles [m]."""
    others = sparse.diags_array((~close).astype(float))
    return sparse.csr_array(others @ near @ others + sparse.diags_array(close.astype(float)))


def _find(table: NDArray[np.int64], key: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Position of each number in a sorted table, and whether it is in the table."""
    place = np.minimum(np.searchsorted(table, key), len(table) - 1)
    return place, table[place] == key


class SharedLight:
    """Means of the light on faces, tile by tile."""

    def __init__(
        self, tiles: Tiles, key: NDArray[np.int64], total: NDArray[np.float64], count: NDArray[np.float64]
    ) -> None:
        """From the numbers [n] of faces in tiles, sums over their paths and how many these are."""
        self.tiles = tiles
        self._key, place = np.unique(key, return_inverse=True)
        self._total = np.bincount(place, total, minlength=len(self._key))
        self._count = np.bincount(place, count, minlength=len(self._key))

    def smoothed(self, step: int, chosen: NDArray[np.bool_] | None = None) -> SharedLight:
        """Weighted 1 2 1 with the tiles `step` away in both directions, on the same face.

        Args: chosen: which tiles [n] (in the order of `faces`) to smooth, all by default.
        """
        near = neighbours(self.tiles, self._key, step)
        if chosen is not None:
            others = sparse.diags_array(np.where(chosen, 0.0, 4.0))
            near = sparse.diags_array(chosen.astype(float)) @ near + others
        return SharedLight(self.tiles, self._key, near @ self._total, near @ self._count)

    @property
    def faces(self) -> NDArray[np.int64]:
        """The face [n] of each mean."""
        return self._key >> 40

    def at(self, pixel: NDArray[np.int64], face: NDArray) -> NDArray[np.float64]:
        """The light [n] of faces at pixels, between the middles of the tiles that show the face."""
        mean = self._total / np.maximum(self._count, 1e-300)
        if self.tiles.size == 1:
            return mean[_find(self._key, self.tiles.of_pixels(pixel, face))[0]]
        row, column = np.divmod(pixel, self.tiles.width)
        x, y = ((a + 0.5) / self.tiles.size - 0.5 for a in (column, row))
        left, top = np.floor(x), np.floor(y)
        value, share = np.zeros(len(pixel)), np.zeros(len(pixel))
        for j in (0, 1):
            for i in (0, 1):
                across, along = (left + i).astype(np.int64), (top + j).astype(np.int64)
                place, is_known = _find(self._key, self.tiles.key(across, along, face))
                weight = is_known * np.abs((1 - i - x + left) * (1 - j - y + top))
                value += weight * mean[place]
                share += weight
        return value / np.maximum(share, 1e-300)


@dataclass(frozen=True, slots=True)
class PictureRows:
    """The pixels that show something, and the row that each belongs to.

    The halves of a row are its pixels on the two colours of a chequerboard.
    """

    tiles: Tiles
    pixels: NDArray[np.int64]  # [n] row * width + column
    row: NDArray[np.int64]  # [n]
    group: NDArray[np.int64]  # [n] window that the pixel's middle shows, OPAQUE where none
    keys: NDArray[np.int64]  # [m] numbers of the rows' faces in tiles

    @classmethod
    def of_view(cls, tracer: TracedScene, view: View, tile: int) -> PictureRows:
        """A row for each square of pixels and each face in it: surface and normal.

        Args: tile: pixels across of the squares; 1: every pixel has its own row.
        """
        directions, counts = pixel_directions(view)
        pixels = np.flatnonzero(counts.reshape(-1))
        way = vectors(directions.reshape(-1, 3)[pixels])
        eye = tracer.place(view.position)
        hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(eye, way), coherent=True)
        valid = hit.is_valid()
        group = dr.select(valid, dr.gather(mi.Int32, tracer.group, hit.prim_index, valid), OPAQUE)
        group = group.numpy().astype(np.int64)
        tiles = Tiles(tile, view.width)
        if tile == 1:
            return cls(tiles, pixels, np.arange(len(pixels)), group, np.arange(len(pixels)))
        faces = 1 + face_numbers(tracer.surface.numpy(), tables(tracer.normal)[0])
        windows = faces.max() + 1 + group  # apart from surfaces in their plane
        face = faces[np.where(valid.numpy(), hit.prim_index.numpy().astype(np.int64), 0)]
        face = np.where(valid.numpy(), np.where(group == OPAQUE, face, windows), 0)
        keys, row = np.unique(tiles.of_pixels(pixels, face), return_inverse=True)
        return cls(tiles, pixels, row, group, keys)

    @property
    def half(self) -> NDArray[np.int64]:
        """Half of a row that each pixel belongs to [n]: 2 * row or 2 * row + 1."""
        row, column = np.divmod(self.pixels, self.tiles.width)
        return 2 * self.row + (row + column) % 2

    @property
    def number(self) -> NDArray[np.int64]:
        """Number of each pixel among those of its half [n]."""
        return numbered(self.half)

    def times(self, *, smoothed: bool) -> NDArray[np.int64]:
        """How often to trace each pixel [n], so that no row has far fewer paths than others.

        A row at the rim, or of a sliver of a face, has few pixels, and few neighbours.

        Args: smoothed: whether neighbours smooth its light, so that their pixels count too.
        """
        if self.tiles.size == 1:
            return np.ones(len(self.row), dtype=np.int64)
        count = np.bincount(self.row, minlength=len(self.keys)).astype(float)
        wanted = float(self.tiles.size**2)
        if smoothed:
            weights = self.smoothing(np.ones(len(self.row), dtype=np.float32), 1.0)
            count = 1 / np.maximum(weights.power(2) @ (1 / np.maximum(count, 1)), 1e-12)
            wanted *= SMOOTHED_TILES
        return np.clip(np.ceil(wanted / count), 1, MOST_TIMES).astype(np.int64)[self.row]

    def of_halves(self, share: NDArray[np.float32], least: float) -> tuple[sparse.csr_array, sparse.csr_array]:
        """From sums over the halves [2 m] to the means of the rows and their noise [m, 2 m].

        Args: share: [n] weight of each pixel in its sum; least: weight of a row that counts.
        """
        m = len(self.keys)
        first, second = np.bincount(self.half, share, minlength=2 * m).reshape(-1, 2).T
        place = np.repeat(np.arange(m), 2), np.arange(2 * m)
        mean = np.repeat(1 / np.maximum(first + second, least), 2)
        both = np.minimum(first, second) > least
        unlike = 0.5 / np.maximum(np.where(both, (first, second), np.inf), least) * [[1], [-1]]
        parts = ((mean, place), (unlike.T.ravel(), place))
        mean, noise = (sparse.csr_array(p, shape=(m, 2 * m)).astype(np.float32) for p in parts)
        return mean, noise

    def smoothing(
        self, share: NDArray[np.float32], least: float, close: NDArray[np.bool_] | None = None
    ) -> sparse.csr_array:
        """Smoothing of the rows' means by their neighbours on the same face [m, m].

        Args: share, least: as in `of_halves`; close: as in `smoothing`.
        """
        if self.tiles.size == 1:
            return sparse.csr_array(sparse.eye_array(len(self.keys), dtype=np.float32))
        total = np.bincount(self.row, share, minlength=len(self.keys))
        matrix = smoothing(self.tiles, self.keys, np.maximum(total, least), close)
        return matrix.astype(np.float32)


def pixel_hits(
    tracer: TracedScene, view: View, pixels: NDArray[np.int64], samples: int
) -> tuple[mi.Point3f, mi.Vector3f, Any, mi.Bool]:
    """Rays spread over pixels [n]: eye, directions, first hits [n * samples], validity."""
    eye = tracer.place(view.position)
    directions, exists = spread_rays(view, pixels, samples)
    way, exist = vectors(directions), column(exists, mi.Bool)
    ray = mi.Ray3f(eye, way)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True, active=exist)
    return eye, way, hit, exist & hit.is_valid()
