"""The rows that a picture's pixels share, and what sums over two halves of the pixels make of them.

A row is what the pixels of a tile have in common that show one face of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.trace.kernels.pixel_sharing import Tiles, face_numbers, numbered, smoothing
from mitsuba_cfs.trace.kernels.sampling import column, spread_rays, tables, vectors
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene

SMOOTHED_TILES = 16  # whole ones behind a row that is smoothed, below which its pixels have more
MOST_TIMES = 32  # as many paths


@dataclass(frozen=True, slots=True)
class PictureRows:
    """The pixels that show something, and the row that each shares with those beside it.

    The halves of a row are its pixels on the squares of one colour of a chequerboard.
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
        """The half of its row that each pixel is of [n]: 2 * row or 1 more."""
        row, column = np.divmod(self.pixels, self.tiles.width)
        return 2 * self.row + (row + column) % 2

    @property
    def number(self) -> NDArray[np.int64]:
        """The number of each pixel among those of its half of a row [n]."""
        return numbered(self.half)

    def times(self, *, smoothed: bool) -> NDArray[np.int64]:
        """How often each pixel [n] is to be traced, so that no row has far fewer paths than others.

        A row at the rim, or of a sliver of a face, has few pixels or one, and few to smooth it.

        Args: smoothed: whether its light is; then as many pixels are behind it as stand there.
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

    def of_halves(
        self, share: NDArray[np.float32], least: float
    ) -> tuple[sparse.csr_array, sparse.csr_array]:
        """What sums over the halves [2 m] become: the rows' means, and their noise [m, 2 m].

        Args: share: [n] of each pixel that is behind a sum; least: of a row's, or it is a sliver.
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
        """What the rows' means become when those beside each on its face smooth them [m, m].

        Args: share, least: as of `of_halves`; close: as of `picture_sharing.smoothing`.
        """
        if self.tiles.size == 1:
            return sparse.csr_array(sparse.eye_array(len(self.keys), dtype=np.float32))
        total = np.bincount(self.row, share, minlength=len(self.keys))
        found = smoothing(self.tiles, self.keys, np.maximum(total, least), close)
        return found.astype(np.float32)


def shown_hits(
    tracer: TracedScene, view: View, pixels: NDArray[np.int64], samples: int
) -> tuple[mi.Point3f, mi.Vector3f, Any, mi.Bool]:
    """Rays spread over pixels [n]: eye, directions, first hits [n * samples], which are valid."""
    eye = tracer.place(view.position)
    directions, exists = spread_rays(view, pixels, samples)
    way, exist = vectors(directions), column(exists, mi.Bool)
    ray = mi.Ray3f(eye, way)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True, active=exist)
    return eye, way, hit, exist & hit.is_valid()
