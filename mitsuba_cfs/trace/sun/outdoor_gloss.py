"""What glossy surfaces show in a view's pixels: rays that go on by them, and the sun on rough ones.

L[pixel] = sum over the rough faces it shows, tau f(view, sun) cos E_sun
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.sampling import column, path_generator, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import Places, place_and_hour
from mitsuba_cfs.trace.sun.picture_sun import LANES

MOST_MIRRORS = 4  # that a ray of a pixel goes by, one after the other


@dataclass(frozen=True)
class Lanes:
    """Rays of a block's pixels."""

    row: NDArray[np.int64]  # [r] of the pixel in its block
    origin: NDArray[np.float32]  # [3, r]
    way: NDArray[np.float32]  # [3, r]
    weight: NDArray[np.float64]  # [r] share of what the pixel shows

    def some(self, chosen: NDArray) -> Lanes:
        """Some of them."""
        return Lanes(
            self.row[chosen], self.origin[:, chosen], self.way[:, chosen], self.weight[chosen]
        )

    @staticmethod
    def joined(parts: list[Lanes]) -> Lanes:
        """All of several."""
        if len(parts) == 1:
            return parts[0]
        none, nowhere = np.empty(0, dtype=np.int64), np.empty((3, 0), dtype=np.float32)
        return Lanes(
            np.concatenate([none, *(p.row for p in parts)]),
            np.concatenate([nowhere, *(p.origin for p in parts)], axis=1),
            np.concatenate([nowhere, *(p.way for p in parts)], axis=1),
            np.concatenate([none.astype(float), *(p.weight for p in parts)]),
        )


def mirrored(
    tracer: TracedScene, lanes: Lanes, hit: mi.PreliminaryIntersection3f, bounce: int
) -> Lanes:
    """The rays that go on by the gloss of what rays met; none without any gloss."""
    none = np.empty(0, dtype=np.int64)
    if tracer.gloss is None or bounce >= MOST_MIRRORS or not len(lanes.row):
        return lanes.some(none)
    way, found = vectors(lanes.way.T), hit.is_valid()
    position, face, _ = tracer.surface_at(hit, vectors(lanes.origin.T, mi.Point3f), way, found)
    lane = dr.arange(mi.UInt32, len(lanes.row))
    glossy, towards, weight = tracer.gloss.leave(
        hit.prim_index, face, way, mi.Float(0), path_generator(lane, mi.UInt32(bounce)), found
    )
    kept = np.flatnonzero((glossy & (weight > 0)).numpy())
    return Lanes(
        lanes.row[kept],
        position.numpy()[:, kept],
        towards.numpy()[:, kept],
        lanes.weight[kept] * weight.numpy()[kept],
    )


@dataclass(frozen=True)
class RoughFaces:
    """The rough faces that rays meet; axis r."""

    pixel: NDArray[np.int64]  # [r] row of the pixel
    weight: NDArray[np.float64]  # [r] share of the pixel
    triangle: NDArray[np.int64]  # [r]
    way: NDArray[np.float32]  # [3, r] of the rays
    places: Places  # [r]

    @staticmethod
    def joined(parts: list[RoughFaces]) -> RoughFaces:
        """All of several."""
        none = np.empty(0, dtype=np.int64)
        return RoughFaces(
            np.concatenate([none, *(p.pixel for p in parts)]),
            np.concatenate([none.astype(float), *(p.weight for p in parts)]),
            np.concatenate([none, *(p.triangle for p in parts)]),
            np.concatenate([np.empty((3, 0), np.float32), *(p.way for p in parts)], axis=1),
            Places.joined([p.places for p in parts]),
        )

    def some(self, chosen: NDArray) -> RoughFaces:
        """Some of them."""
        return RoughFaces(
            self.pixel[chosen], self.weight[chosen], self.triangle[chosen], self.way[:, chosen],
            self.places.some(chosen),
        )  # fmt: skip

    def lobes(self, outside: TracedScene, suns: NDArray[np.float64]) -> NDArray[np.float32]:
        """f cos where the sun shines, else 0 [r, h]."""
        point, normal, to_sun = place_and_hour(self.places, suns)
        face = dr.arange(mi.UInt32, self.places.size * len(suns)) // dr.opaque(mi.UInt32, len(suns))
        cosine = dr.dot(normal, to_sun)
        lit = cosine > 0
        lit &= ~outside.scene.ray_test(mi.Ray3f(point, to_sun), coherent=False, active=lit)
        triangle = dr.gather(mi.UInt32, column(self.triangle, mi.UInt32), face)
        way = dr.gather(mi.Vector3f, vectors(self.way.T), face)
        value = outside.gloss.lobe(triangle, normal, way, to_sun, lit) * cosine
        return dr.select(lit, value, 0.0).numpy().reshape(self.places.size, len(suns))


class RoughSun:
    """The sun in the lobes of rough surfaces outdoors, hour by hour."""

    def __init__(self, outside: TracedScene, faces: RoughFaces) -> None:
        """Of what the pixels show; each pixel takes one place of each triangle."""
        self._outside = outside
        pair = faces.pixel * (int(faces.triangle.max(initial=0)) + 1) + faces.triangle
        _, first, place = np.unique(pair, return_index=True, return_inverse=True)
        self._weight = np.bincount(place, faces.weight, minlength=len(first)).astype(np.float32)
        self._faces = faces.some(first)

    def add_to(self, values: NDArray, suns: NDArray, illuminance: NDArray) -> None:
        """Add the luminance [cd/m2] to the pixels' values [h, n]."""
        if not len(self._weight):
            return
        lit = np.flatnonzero((illuminance > 0) & (suns[:, 2] > 0))
        step = max(1, LANES // len(self._weight))
        for start in range(0, len(lit), step):
            hours = lit[start : start + step]
            found = self._faces.lobes(self._outside, suns[hours]) * self._weight[:, None]
            for hour, light in zip(hours, found.T, strict=True):
                np.add.at(values[hour], self._faces.pixel, light * illuminance[hour])
