"""The sun on surfaces outdoors that the pixels of a view show, on diffuse and on glossy ones.

    L[pixel] = sum over the faces it shows, tau rho / pi (E_sun at the face + E of its tile)
             + sum over the rough faces it shows, tau f(view, sun) cos E_sun

E_sun is the direct sun at the point that the pixel shows, the mean over several points where the
edge of a shadow crosses the pixel.  E, the sun that other surfaces outdoors reflect to the face,
varies slowly: it is the mean over a tile of pixels, by shadow rays from the points that paths of
the tile meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.trace.kernels.sampling import column, path_generator, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import (
    SurfacePoints,
    points_and_suns,
    reflecting_points,
    sunlight,
    sunlight_of_each,
)
from mitsuba_cfs.trace.sun.picture_sun import LANES
from mitsuba_cfs.trace.sun.pixels import edge_pixels

MOST_MIRRORS = 4  # specular reflections of a pixel's ray
GATHERED = 16  # points at most that reflect the sun to a tile


@dataclass(frozen=True)
class PixelRays:
    """Rays of the pixels of a block; axis r."""

    row: NDArray[np.int64]  # [r] of the pixel in its block
    origin: NDArray[np.float32]  # [3, r]
    way: NDArray[np.float32]  # [3, r]
    weight: NDArray[np.float64]  # [r] share of what the pixel shows

    def some(self, chosen: NDArray) -> PixelRays:
        """Some of the rays."""
        return PixelRays(self.row[chosen], self.origin[:, chosen], self.way[:, chosen], self.weight[chosen])

    @staticmethod
    def joined(parts: list[PixelRays]) -> PixelRays:
        """All of several."""
        if len(parts) == 1:
            return parts[0]
        none, nowhere = np.empty(0, dtype=np.int64), np.empty((3, 0), dtype=np.float32)
        return PixelRays(
            np.concatenate([none, *(p.row for p in parts)]),
            np.concatenate([nowhere, *(p.origin for p in parts)], axis=1),
            np.concatenate([nowhere, *(p.way for p in parts)], axis=1),
            np.concatenate([none.astype(float), *(p.weight for p in parts)]),
        )


def mirrored(tracer: TracedScene, lanes: PixelRays, hit: mi.PreliminaryIntersection3f, bounce: int) -> PixelRays:
    """The rays after a specular reflection at the surfaces that rays met; none without gloss."""
    none = np.empty(0, dtype=np.int64)
    if tracer.gloss is None or bounce >= MOST_MIRRORS or not len(lanes.row):
        return lanes.some(none)
    way, is_hit = vectors(lanes.way.T), hit.is_valid()
    position, face, _ = tracer.surface_at(hit, vectors(lanes.origin.T, mi.Point3f), way, is_hit)
    lane = dr.arange(mi.UInt32, len(lanes.row))
    glossy, towards, weight = tracer.gloss.leave(
        hit.prim_index, face, way, mi.Float(0), path_generator(lane, mi.UInt32(bounce)), is_hit
    )
    kept = np.flatnonzero((glossy & (weight > 0)).numpy())
    return PixelRays(
        lanes.row[kept], position.numpy()[:, kept], towards.numpy()[:, kept], lanes.weight[kept] * weight.numpy()[kept]
    )


@dataclass(frozen=True)
class RoughFaces:
    """Faces with rough gloss that rays meet; axis r."""

    pixel: NDArray[np.int64]  # [r] row of the pixel
    weight: NDArray[np.float64]  # [r] share of the pixel
    triangle: NDArray[np.int64]  # [r]
    way: NDArray[np.float32]  # [3, r] of the rays
    places: SurfacePoints  # [r]

    @staticmethod
    def joined(parts: list[RoughFaces]) -> RoughFaces:
        """All of several."""
        none = np.empty(0, dtype=np.int64)
        return RoughFaces(
            np.concatenate([none, *(p.pixel for p in parts)]),
            np.concatenate([none.astype(float), *(p.weight for p in parts)]),
            np.concatenate([none, *(p.triangle for p in parts)]),
            np.concatenate([np.empty((3, 0), np.float32), *(p.way for p in parts)], axis=1),
            SurfacePoints.joined([p.places for p in parts]),
        )

    def some(self, chosen: NDArray) -> RoughFaces:
        """Some of the rays."""
        return RoughFaces(
            self.pixel[chosen],
            self.weight[chosen],
            self.triangle[chosen],
            self.way[:, chosen],
            self.places.some(chosen),
        )

    def lobes(self, outside: TracedScene, suns: NDArray[np.float64]) -> NDArray[np.float32]:
        """f cos of the sun at each face, 0 where it is hidden [r, h]."""
        point, normal, to_sun = points_and_suns(self.places, suns)
        face = dr.arange(mi.UInt32, self.places.size * len(suns)) // dr.opaque(mi.UInt32, len(suns))
        cosine = dr.dot(normal, to_sun)
        lit = cosine > 0
        lit &= ~outside.scene.ray_test(mi.Ray3f(point, to_sun), coherent=False, active=lit)
        triangle = dr.gather(mi.UInt32, column(self.triangle, mi.UInt32), face)
        way = dr.gather(mi.Vector3f, vectors(self.way.T), face)
        value = outside.gloss.lobe(triangle, normal, way, to_sun, lit) * cosine
        return dr.select(lit, value, 0.0).numpy().reshape(self.places.size, len(suns))


class RoughSun:
    """The sun in the gloss lobes of rough surfaces outdoors, hour by hour."""

    def __init__(self, outside: TracedScene, faces: RoughFaces) -> None:
        """From the faces that the pixels show; one point for each pixel and triangle."""
        self._outside = outside
        pair = faces.pixel * (int(faces.triangle.max(initial=0)) + 1) + faces.triangle
        _, first, place = np.unique(pair, return_index=True, return_inverse=True)
        self._weight = np.bincount(place, faces.weight, minlength=len(first)).astype(np.float32)
        self._faces = faces.some(first)

    def add_to(self, values: NDArray, suns: NDArray, illuminance: NDArray) -> None:
        """Add their luminance [cd/m2] to the pixels' values [h, n]."""
        if not len(self._weight):
            return
        lit = np.flatnonzero((illuminance > 0) & (suns[:, 2] > 0))
        step = max(1, LANES // len(self._weight))
        for start in range(0, len(lit), step):
            hours = lit[start : start + step]
            luminance = self._faces.lobes(self._outside, suns[hours]) * self._weight[:, None]
            for hour, light in zip(hours, luminance.T, strict=True):
                np.add.at(values[hour], self._faces.pixel, light * illuminance[hour])


@dataclass(frozen=True)
class ShownFaces:
    """Faces outdoors that rays of a view's pixels meet; axis r of the rays."""

    pixel: NDArray[np.int64]  # [r] row of the pixel
    tile: NDArray[np.int64]  # [r] number of the face in a tile of pixels
    value: NDArray[np.float64]  # [r] tau rho / pi over the number of the pixel's rays
    places: SurfacePoints  # [r]


class OutdoorSun:
    """The sun on the diffuse surfaces outdoors in a view, hour by hour."""

    def __init__(
        self, outside: TracedScene, shown: ShownFaces, smooth: sparse.csr_array, view: View, seed: int
    ) -> None:
        """Trace the reflecting points; `smooth`: [C, C] smoothing of the means over tiles."""
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
        self, values: NDArray, suns: NDArray[np.float64], illuminance: NDArray[np.float64], sky: NDArray[np.float32]
    ) -> None:
        """Add the luminance of surfaces outdoors [cd/m2] to the pixels' values [h, n].

        Args: suns: [h, 3] directions to the disc; illuminance: [h] normal to it [lx]; sky: [C, h]
            irradiance of the faces in tiles by the sky without the sun.
        """
        if not self._places.size:
            return
        lit = np.flatnonzero((illuminance > 0) & (suns[:, 2] > 0))
        radiance, irradiance = np.zeros((len(self._shown), len(suns)), dtype=np.float32), sky.copy()
        step = max(1, LANES // (self._places.size + self._reflecting.size))
        for start in range(0, len(lit), step):
            hours = lit[start : start + step]
            strength = illuminance[hours].astype(np.float32)
            light = sunlight(self._outside, self._places, suns[hours])
            self._resample_edges(light, suns[hours])
            radiance[:, hours] = self._pixels @ (light * strength)
            if self._reflecting.size:
                light = sunlight(self._outside, self._reflecting, suns[hours]) * strength
                irradiance[:, hours] += self._gather @ light
        radiance += self._tiles @ irradiance
        for hour, luminance in zip(values, radiance.T, strict=True):
            hour[self._shown] += luminance

    def _resample_edges(self, light: NDArray[np.float32], suns: NDArray[np.float64]) -> None:
        """Set the mean over all points of a pixel where the edge of a shadow crosses it [.., h]."""
        hour, pixel = edge_pixels((self._pixels @ light).T > 0, self._number, self._view)
        one, pair = _each(self._first[pixel], self._first[pixel + 1])
        part, place = _each(self._ends[pair], self._ends[pair + 1])
        hour, mean = hour[one], np.zeros(len(pair))
        for start in range(0, len(part), LANES):
            some = slice(start, start + LANES)
            places, own = self._all.some(place[some]), suns[hour[part[some]]]
            mean += np.bincount(part[some], sunlight_of_each(self._outside, places, own), len(pair))
        light[pair, hour] = mean / np.maximum(np.bincount(part, minlength=len(pair)), 1)


def _each(first: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The range of each number, and all numbers of some ranges [n]."""
    count = end - first
    of = np.repeat(np.arange(len(count)), count)
    return of, np.arange(len(of)) - (np.cumsum(count) - count - first)[of]


def _reflecting(
    outside: TracedScene, shown: ShownFaces, count: int, seed: int
) -> tuple[SurfacePoints, sparse.csr_array]:
    """Points [q] that reflect the sun to the tiles, and each tile's share of their light [C, q]."""
    if not shown.places.size:
        return shown.places, sparse.csr_array((count, 0))
    met = reflecting_points(outside, shown.places, seed, mirrored=True)
    tile = shown.tile[met.path]
    chosen, share = _thinned(tile, met.weight, np.random.default_rng(seed))
    share /= np.maximum(np.bincount(shown.tile, minlength=count), 1)[tile[chosen]]
    entries = share.astype(np.float32), (tile[chosen], np.arange(len(chosen)))
    gather = sparse.csr_array(entries, shape=(count, len(chosen)))
    return met.places.some(chosen), gather


def _thinned(
    tile: NDArray[np.int64], weight: NDArray[np.float64], random: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """At most `GATHERED` points of each tile, and the weight of each.

    Systematic sampling: the sum over the sample has the expected value of that over all.
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
