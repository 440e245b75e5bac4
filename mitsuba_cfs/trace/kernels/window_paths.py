"""Paths that start on the windows, uniform over a group's area and over each patch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.kernels.sampling import empty_sums, lattice_2d, path_generator, sums_of
from mitsuba_cfs.trace.kernels.scene import TracedScene

LANES = 1 << 23  # paths traced at once, but all those of a group
ENTRIES = 1 << 21  # of the matrix of the groups that are traced at once


@dataclass
class WindowPaths:
    """The starts of n paths for each patch of some window groups, one group after the other."""

    group: mi.UInt32  # of the scene [G * K * n]
    row: mi.UInt32  # of the matrix: the patches of the traced groups
    patch: mi.UInt32
    sample: mi.UInt32  # number of the path among those of its patch
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
    *,
    stopping: Stopping | None = None,
) -> Callable[[int], NDArray[np.float64]]:
    """Batches [G, K, columns] of means over the paths of each group and patch.

    One launch traces all groups, and as many batches as memory and `stopping` allow: the random
    numbers of a group in a batch do not depend on what is traced together.

    Args: follow: adds the result of each path to its row of a matrix [rows * columns].
    """
    K, G = bins.size, len(tracer.groups)
    together = max(1, min(LANES // (K * samples), ENTRIES // (K * columns)))
    ready: dict[int, NDArray[np.float64]] = {}

    def launched(first: int, count: int) -> NDArray[np.float64]:
        """Of the groups of one batch after the other, those from number `first` on."""
        matrix = empty_sums(count * K * columns)
        lane, each = dr.arange(mi.UInt32, count * K * samples), dr.opaque(mi.UInt32, samples)
        row = lane // each
        number, sample = row // K, lane - row * each
        patch = row - number * K
        turn = number + dr.opaque(mi.UInt32, first % G)
        batch = turn // dr.opaque(mi.UInt32, G)
        group = turn - batch * dr.opaque(mi.UInt32, G)
        _, local, count_of_room = tracer.group_in_room(group)
        batch += dr.opaque(mi.UInt32, seed * 1_000_003 + first // G & 0xFFFFFFFF)
        key = batch * count_of_room + local
        stream = mi.sample_tea_32(patch, key)[0]
        local = bins.sample(patch, lattice_2d(sample, stream, 0))
        position = tracer.sample_group(group, lattice_2d(sample, stream, 2))
        outward, generator = (tracer.to_world_any(group, local), path_generator(patch * each + sample, key))
        follow(matrix, WindowPaths(group, row, patch, sample, position, outward, stream, generator))
        return sums_of(matrix, (count, K, columns)) / samples

    def batch(number: int) -> NDArray[np.float64]:
        if number not in ready:
            left = 1 if stopping is None else stopping.ahead(number)
            end = (number + max(1, min(left, together // G))) * G
            firsts = range(number * G, end, together)
            parts = [launched(i, min(together, end - i)) for i in firsts]
            joined = parts[0] if len(parts) == 1 else np.concatenate(parts)
            ready.update(enumerate(joined.reshape(-1, G, K, columns), number))
        return ready.pop(number)

    return batch
