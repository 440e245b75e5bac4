"""Light that varies slowly over a face of the scene, shared among the pixels that show the face.

A picture is cut into square tiles.  What paths bring to a face in a tile is one mean, which the
tiles round it on the same face smooth; a pixel takes it between the tiles' middles.  Neither an
edge of the scene nor what is sharp (the sun's beam, the sky behind glass) is ever blurred.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, pixel_solid_angles

TILE, LARGEST_TILE = np.radians(0.9), 16  # across; [px]
MARGIN = 8  # [tiles] round the picture, so that no tile's neighbour is another row's end
STEPS = (1, 2)  # [tiles] of the smoothing, one after the other
BALANCINGS = 64  # rounds at most, by which the sums agree to 1e-4
BALANCED = 1e-9  # of its weight: a round that changes none by more is the last
FACE_STEPS = 8  # normals that differ less than 1/16 in each component are one face


def face_numbers(surface: NDArray, normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """The face [N] that each triangle belongs to: of one surface, in one direction [N, 3]."""
    steps = np.round(np.asarray(normal) * FACE_STEPS).astype(np.int64)
    table = np.column_stack([np.asarray(surface).astype(np.int64), steps])
    return np.unique(table, axis=0, return_inverse=True)[1].reshape(-1)


def numbered(row: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of each among those of its row [n]."""
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
        """The number of a face in the tile at a column and row of tiles."""
        across = -(-self.width // self.size) + 2 * MARGIN
        column, row = np.asarray(column) + MARGIN, np.asarray(row) + MARGIN
        return (np.asarray(face, dtype=np.int64) << 40) + row * across + column

    def of_pixels(self, pixel: NDArray[np.int64], face: NDArray) -> NDArray[np.int64]:
        """The numbers of the faces in the tiles of pixels (row * width + column)."""
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
            place, found = _find(key, key + step * (y * down + x))
            row.append(np.flatnonzero(found))
            column.append(place[found])
            weight.append(np.full(len(row[-1]), float((2 - abs(x)) * (2 - abs(y)))))
    entries = np.concatenate(weight), (np.concatenate(row), np.concatenate(column))
    return sparse.csr_array(entries, shape=(len(key), len(key)))


def smoothing(
    tiles: Tiles,
    key: NDArray[np.int64],
    count: NDArray,
    close: NDArray[np.bool_] | None = None,
) -> sparse.csr_array:
    """What means over tiles [m] become when the tiles round each on its face smooth them [m, m].

    An even face stays even, and the sum of count times mean stays what it is: the weights 1 2 1
    are scaled to diag(x) A diag(x) with row and column sums of 1 (Sinkhorn and Knopp 1967).

    Args:
        key: [m] as of `neighbours`; count: [m] how much stands behind each mean.
        close: [m] tiles that another surface is close to, as in a corner: light changes fast there,
            and they are smoothed by the tiles that touch them alone.
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
    """Weights of neighbours [m, m] with some tiles [m] for themselves."""
    others = sparse.diags_array((~close).astype(float))
    return sparse.csr_array(others @ near @ others + sparse.diags_array(close.astype(float)))


def _find(
    table: NDArray[np.int64], key: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Where in a rising table each number stands, and whether it does."""
    place = np.minimum(np.searchsorted(table, key), len(table) - 1)
    return place, table[place] == key


class SharedLight:
    """Means of what paths bring to faces, tile by tile."""

    def __init__(
        self,
        tiles: Tiles,
        key: NDArray[np.int64],
        total: NDArray[np.float64],
        count: NDArray[np.float64],
    ) -> None:
        """From the numbers [n] of faces in tiles, sums over their paths and how many these are."""
        self.tiles = tiles
        self._key, place = np.unique(key, return_inverse=True)
        self._total = np.bincount(place, total, minlength=len(self._key))
        self._count = np.bincount(place, count, minlength=len(self._key))

    def smoothed(self, step: int, mine: NDArray[np.bool_] | None = None) -> SharedLight:
        """Weighted 1 2 1 with the tiles `step` away in both directions, on the same face.

        Args: mine: which tiles [n] (in the order of `faces`) to smooth, all by default.
        """
        near = neighbours(self.tiles, self._key, step)
        if mine is not None:
            own = sparse.diags_array(np.where(mine, 0.0, 4.0))
            near = sparse.diags_array(mine.astype(float)) @ near + own
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
                place, found = _find(self._key, self.tiles.key(across, along, face))
                weight = found * np.abs((1 - i - x + left) * (1 - j - y + top))
                value += weight * mean[place]
                share += weight
        return value / np.maximum(share, 1e-300)
