"""The sun on surfaces outdoors that a view shows: a shadow ray to its disc from each place.

    L[pixel] = sum over the faces it shows, tau rho / pi (E_sun at the face + E of its tile)

E_sun is the sun's own light on the place that the pixel shows, on all of its places where the edge
of a shadow crosses it; what other surfaces outdoors reflect
to it varies slowly and is the mean over a tile of pixels, by shadow rays from where paths of the
tile meet those surfaces.  No path has to find the sun by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import Places, reflecting_places, sunlight, sunlight_of_each
from mitsuba_cfs.trace.sun.picture_edges import edge_pixels
from mitsuba_cfs.trace.sun.picture_sun import LANES

GATHERED = 16  # places at most in each tile that what other surfaces reflect is taken from


@dataclass(frozen=True)
class ShownFaces:
    """The outdoor faces that rays of a view's pixels meet; axis r of the rays."""

    pixel: NDArray[np.int64]  # [r] row of the pixel
    tile: NDArray[np.int64]  # [r] number of the face in a tile of pixels
    value: NDArray[np.float64]  # [r] tau rho / pi over the number of the pixel's rays
    places: Places  # [r]


class OutdoorSun:
    """The direct sun on the outdoors of a view, hour by hour."""

    def __init__(
        self,
        outside: TracedScene,
        shown: ShownFaces,
        smooth: sparse.csr_array,
        view: View,
        seed: int,
    ) -> None:
        """Find what is lit; `smooth`: [C, C] of means over tiles."""
        self._outside, self._view, count = outside, view, smooth.shape[0]
        pair = shown.pixel * max(count, 1) + shown.tile
        _, first, place = np.unique(pair, return_index=True, return_inverse=True)
        values = np.bincount(place, shown.value, minlength=len(first)).astype(np.float32)
        self._places, column = shown.places.some(first), np.arange(len(first))
        self._shown, row = np.unique(shown.pixel[first], return_inverse=True)
        every = np.flatnonzero(pixel_directions(view)[1].reshape(-1))
        self._number = every[self._shown]
        self._first = np.searchsorted(row, np.arange(row.max(initial=-1) + 2))
        self._all = shown.places.some(np.argsort(place, kind="stable"))
        self._ends = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=len(first)))])
        shape = len(self._shown), len(first)
        self._pixels = sparse.csr_array((values, (row, column)), shape=shape)
        # what a pixel shows of unit irradiance on the faces in tiles, tau rho / pi
        entries = values, (row, shown.tile[first])
        self._tiles = sparse.csr_array(entries, shape=(len(self._shown), count))
        self._reflecting, gather = _reflecting(outside, shown, count, seed)
        self._gather = sparse.csr_array((smooth @ gather).astype(np.float32))

    def add_to(
        self,
        values: NDArray,
        suns: NDArray[np.float64],
        illuminance: NDArray[np.float64],
        sky: NDArray[np.float32],
    ) -> None:
        """Add the luminance of surfaces outdoors [cd/m2] to the pixels' values [h, n].

        Args: suns: [h, 3] directions to the disc; illuminance: [h] normal to it [lx]; sky: [C, h]
            irradiance of the faces in tiles by the sky without the sun.
        """
        if not self._places.size:
            return
        lit = np.flatnonzero((illuminance > 0) & (suns[:, 2] > 0))
        found, irradiance = np.zeros((len(self._shown), len(suns)), dtype=np.float32), sky.copy()
        step = max(1, LANES // (self._places.size + self._reflecting.size))
        for start in range(0, len(lit), step):
            hours = lit[start : start + step]
            strength = illuminance[hours].astype(np.float32)
            light = sunlight(self._outside, self._places, suns[hours])
            self._look_again(light, suns[hours])
            found[:, hours] = self._pixels @ (light * strength)
            if self._reflecting.size:
                light = sunlight(self._outside, self._reflecting, suns[hours]) * strength
                irradiance[:, hours] += self._gather @ light
        found += self._tiles @ irradiance
        for hour, luminance in zip(values, found.T, strict=True):
            hour[self._shown] += luminance

    def _look_again(self, light: NDArray[np.float32], suns: NDArray[np.float64]) -> None:
        """Put the mean over all places of a pixel where the edge of a shadow crosses it [.., h]."""
        hour, pixel = edge_pixels((self._pixels @ light).T > 0, self._number, self._view)
        one, pair = _each(self._first[pixel], self._first[pixel + 1])
        part, place = _each(self._ends[pair], self._ends[pair + 1])
        hour, mean = hour[one], np.zeros(len(pair))
        for start in range(0, len(part), LANES):
            some = slice(start, start + LANES)
            places, own = self._all.some(place[some]), suns[hour[part[some]]]
            mean += np.bincount(part[some], sunlight_of_each(self._outside, places, own), len(pair))
        light[pair, hour] = mean / np.maximum(np.bincount(part, minlength=len(pair)), 1)


def _each(
    first: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All numbers of some ranges [n], and before them the range that each is of."""
    count = end - first
    of = np.repeat(np.arange(len(count)), count)
    return of, np.arange(len(of)) - (np.cumsum(count) - count - first)[of]


def _reflecting(
    outside: TracedScene, shown: ShownFaces, count: int, seed: int
) -> tuple[Places, sparse.csr_array]:
    """Places [q] that reflect the sun to the tiles, and each tile's irradiance by theirs [C, q]."""
    if not shown.places.size:
        return shown.places, sparse.csr_array((count, 0))
    met = reflecting_places(outside, shown.places, seed, mirrored=True)
    tile = shown.tile[met.path]
    chosen, share = _thinned(tile, met.weight, np.random.default_rng(seed))
    share /= np.maximum(np.bincount(shown.tile, minlength=count), 1)[tile[chosen]]
    entries = share.astype(np.float32), (tile[chosen], np.arange(len(chosen)))
    gather = sparse.csr_array(entries, shape=(count, len(chosen)))
    return met.places.some(chosen), gather


def _thinned(
    tile: NDArray[np.int64], weight: NDArray[np.float64], random: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """At most `GATHERED` of each tile's places, even in weight, and the weight that each gets.

    Systematic sampling: the expected sum over what is kept is that over all.
    """
    order = np.argsort(tile, kind="stable")
    tile, weight = tile[order], weight[order]
    total = np.bincount(tile, weight)[tile]
    number = np.bincount(tile)[tile]
    scale = np.where(number > GATHERED, GATHERED / np.maximum(total, 1e-30), 0.0)
    climbed = np.cumsum(weight * scale) + random.random()
    steps = np.floor(climbed) - np.floor(climbed - weight * scale)
    few = number <= GATHERED
    kept = np.flatnonzero(few | (steps > 0))
    share = np.where(few, weight, steps / np.maximum(scale, 1e-30))
    return order[kept], share[kept]
