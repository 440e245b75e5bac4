"""Points on the windows, the sensors that see them, the suns that reach them, and the light scattered there.

    C[s, q] = sum over points j of cosine(s, j) cosine(g, j) / distance^2 area[j] sunlit[j, q] f(q, j, s) cosine(g, q)

Whether a sensor sees a point, and how much of a sun reaches it, is traced; the BSDF f and the
cosines follow without rays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.packed import PackedArray
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, vectors
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering, Scattering, scattered_by_patches
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.specular_paths import SpecularPath, on_disc
from mitsuba_cfs.trace.sun.sun_discs import pairs


@dataclass(frozen=True)
class WindowPoints:
    """Points on the windows of one group, the same for all sensors and suns of a batch.

    Axis J of those of batch 0, 1, ...
    """

    inside: TracedScene
    group: int
    position: mi.Point3f  # [J]
    number: mi.UInt32  # [J] within their batch
    stream: mi.UInt32  # [J] of random numbers of their batch
    batches: int

    @classmethod
    def of(cls, inside: TracedScene, group: int, count: int, keys: mi.UInt32) -> WindowPoints:
        """Points on a group.

        Args: count: of each batch; keys: of the batches.
        """
        each = dr.opaque(mi.UInt32, count)
        j = dr.arange(mi.UInt32, count * dr.width(keys))
        batch = j // each
        number, key = j - batch * each, dr.gather(mi.UInt32, keys, batch)
        stream = mi.sample_tea_32(opaque(group, mi.UInt32), key)[0]
        position = inside.sample_group(group, lattice_2d(number, stream, 0))
        dr.eval(position, number, stream)
        return cls(inside, group, position, number, stream, dr.width(keys))

    @property
    def size(self) -> int:
        """J."""
        return dr.width(self.position)

    def visible(self, place: mi.Point3f, normal: mi.Vector3f) -> PackedArray:
        """Whether sensors at places with normals see the points [S, J]."""
        omega, distance, cosine, outward = self._towards(place, normal)
        sensor, _ = pairs(dr.width(place), self.size)
        seen = (cosine > 0) & (outward.z > 1e-4)
        shadow = mi.Ray3f(dr.gather(mi.Point3f, place, sensor), omega, distance * (1 - 1e-4), 0.0, [])
        seen &= ~self.inside.scene.ray_test(shadow, coherent=False, active=seen)
        return PackedArray.of(seen.numpy().reshape(dr.width(place), self.size))

    def sunlit(self, way: SpecularPath, towards: mi.Vector3f) -> PackedArray:
        """Share of each sun that reaches the points by a specular path [J, Q].

        Args: towards: apparent directions to the suns [Q].
        """
        point, sun = pairs(self.size, dr.width(towards))
        drawn, of_batch = (dr.gather(mi.UInt32, values, point) for values in (self.number, self.stream))
        direction = on_disc(dr.gather(mi.Vector3f, towards, sun), drawn, of_batch)
        ray = mi.Ray3f(dr.gather(mi.Point3f, self.position, point), direction)
        before = dr.dot(ray.d, self.inside.exterior_normal(self.group)) > 0
        share = way.transmittance(ray, before).numpy()
        return PackedArray.of(share.reshape(self.size, dr.width(towards)))

    def to_sensors(self, place: mi.Point3f, normal: mi.Vector3f, visible: PackedArray) -> SeenPoints:
        """The points as sensors see them.

        Args: visible: of the same sensors [S, J].
        """
        _, distance, cosine, outward = self._towards(place, normal)
        area = opaque(self.inside.groups[self.group].area * self.batches / max(self.size, 1))
        weight = cosine * outward.z / dr.square(distance) * area
        weight = dr.select(column(visible.whole().ravel() > 0, mi.Bool), weight, 0.0)
        dr.eval(weight, outward)
        return SeenPoints(self, dr.width(place), weight, outward)

    def _towards(self, place: mi.Point3f, normal: mi.Vector3f) -> tuple[mi.Vector3f, mi.Float, mi.Float, mi.Vector3f]:
        """Of all pairs [S * J]: direction, distance, cosine at the sensor, local direction."""
        sensor, point = pairs(dr.width(place), self.size)
        to_point = dr.gather(mi.Point3f, self.position, point) - dr.gather(mi.Point3f, place, sensor)
        distance = dr.norm(to_point)
        omega = to_point / distance
        outward = self.inside.to_local(opaque(self.group, mi.Int32), omega, mi.Bool(True))
        cosine = dr.dot(dr.gather(mi.Vector3f, normal, sensor), omega)
        return omega, distance, cosine, outward


@dataclass(frozen=True)
class SeenPoints:
    """Points on the windows of one group as sensors see them."""

    points: WindowPoints
    sensors: int
    weight: mi.Float  # [S * J] G V area / points of a batch; 0 where hidden
    outward: mi.Vector3f  # [S * J] local direction from the sensor through the point

    def scattered(
        self, scattering: Scattering, suns: NDArray[np.float64], sunlit: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Scattered light of the sensors by a system in the windows [B, S, Q], per illuminance normal to the sun.

        Args: suns: apparent directions [Q, 3]; sunlit: share of them that reaches the points [J, Q].
        """
        inside, group, batches = self.points.inside, self.points.group, self.points.batches
        klems = scattered_by_patches(scattering)
        if klems is not None:
            return self._by_patches(klems, suns @ inside.groups[group].frame.T, sunlit)
        towards, lit = vectors(suns), column(sunlit.ravel())
        points = self.weight, self.outward, self.points.size // batches
        light = _scattered(inside, group, scattering, points, (lit, towards), (batches, self.sensors)).numpy()
        shape = batches, self.sensors, len(suns)
        return np.broadcast_to(light, math.prod(shape)).reshape(shape)

    def _by_patches(
        self, klems: KlemsScattering, local: NDArray[np.float64], sunlit: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """The same by a product of matrices for each patch of the sun, within which f does not change.

        Args: local: directions to the suns in the group's frame [Q, 3].
        """
        batches, each = self.points.batches, self.points.size // self.points.batches
        shape = self.sensors, batches, each
        weight, outward = self.weight.numpy().reshape(shape), klems.bins.index(self.outward).numpy().reshape(shape)
        before = local[:, 2] > 0
        patch = np.where(before, klems.bins.index(vectors(local)).numpy().astype(np.int64), -1)
        lit = sunlit.reshape(batches, each, -1)
        light = np.zeros((batches, self.sensors, len(local)), dtype=np.float32)
        for k in np.unique(patch[before]):
            values = klems.table[:, k]
            if values.any():
                hours = np.flatnonzero(patch == k)
                of_patch = (weight * values[outward]).swapaxes(0, 1)
                light[:, :, hours] = of_patch @ lit[:, :, hours]
        return light * np.maximum(local[:, 2], 0).astype(np.float32)


@dr.syntax
def _scattered(
    inside: TracedScene,
    group: int,
    scattering: Scattering,
    points: tuple[mi.Float, mi.Vector3f, int],  # weights and directions [S * J], points of a batch
    suns: tuple[mi.Float, mi.Vector3f],  # share that reaches the points [J * Q], directions [Q]
    shape: tuple[int, int],  # batches, sensors
) -> mi.Float:
    """Sum over the points of f cos(sun) G, for each batch, sensor and sun [B * S * Q]."""
    weights, outwards, each = points
    sunlit, towards = suns
    batches, sensors = shape
    count, every = dr.opaque(mi.UInt32, each), dr.opaque(mi.UInt32, batches * each)
    sun_count = dr.opaque(mi.UInt32, dr.width(towards))
    row, sun = pairs(batches * sensors, dr.width(towards))
    batch = row // dr.opaque(mi.UInt32, sensors)
    sensor = row - batch * dr.opaque(mi.UInt32, sensors)
    to_sun = dr.gather(mi.Vector3f, towards, sun)
    local = inside.to_local(opaque(group, mi.Int32), to_sun, mi.Bool(True))
    j, end = batch * count, (batch + 1) * count
    total = mi.Float(0)
    while (j < end) & (local.z > 0):
        lit = dr.gather(mi.Float, sunlit, j * sun_count + sun)
        weight = lit * dr.gather(mi.Float, weights, sensor * every + j)
        if weight > 0:
            outward = dr.gather(mi.Vector3f, outwards, sensor * every + j)
            total += weight * scattering.scattered(local, outward)
        j += 1
    return total * dr.maximum(local.z, 0)
