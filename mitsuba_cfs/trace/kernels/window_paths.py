"""Paths that start on the windows, uniform over a group's area and over each patch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import empty_sums, lattice_2d, path_generator, sums_of
from mitsuba_cfs.trace.kernels.scene import TracedScene


@dataclass
class WindowPaths:
    """The starts of n paths for each patch of a window group."""

    group: int
    patch: mi.UInt32  # [K * n]
    position: mi.Point3f  # on the window
    outward: mi.Vector3f  # world direction in the patch, outdoors
    stream: mi.UInt32  # of stratified samples: of the patch in this batch
    generator: mi.PCG32

    def inward(self, tracer: TracedScene) -> mi.Vector3f:
        """World direction into the room: the patches of the back mirror those of the front."""
        normal = tracer.exterior_normal(self.group)
        return mi.Vector3f(self.outward - normal * (2 * dr.dot(normal, self.outward)))


def window_batches(
    tracer: TracedScene,
    bins: DirectionBins,
    columns: int,
    samples: int,
    seed: int,
    follow: Callable[[mi.Float64, WindowPaths], None],
) -> Callable[[int], NDArray[np.float64]]:
    """Batches [G, K, columns] of means over the paths of each group and patch.

    Args: follow: adds the result of each path to its row of a matrix [K * columns].
    """
    K, G = bins.size, len(tracer.groups)

    def one_group(group: int, key: int) -> NDArray[np.float64]:
        matrix = empty_sums(K * columns)
        count = dr.opaque(mi.UInt32, samples)
        path = dr.arange(mi.UInt32, K * samples)
        patch = path // count
        sample = path - patch * count
        opaque_key = dr.opaque(mi.UInt32, key & 0xFFFFFFFF)
        stream = mi.sample_tea_32(patch, opaque_key)[0]
        local = bins.sample(patch, lattice_2d(sample, stream, 0))
        position = tracer.sample_group(group, lattice_2d(sample, stream, 2))
        outward, generator = tracer.to_world(group, local), path_generator(path, opaque_key)
        follow(matrix, WindowPaths(group, patch, position, outward, stream, generator))
        return sums_of(matrix, (K, columns)) / samples

    def batch(number: int) -> NDArray[np.float64]:
        first = (seed * 1_000_003 + number) * G
        return np.stack([one_group(g, first + g) for g in range(G)])

    return batch
