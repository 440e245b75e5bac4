"""Daylight matrices of the cells of a window, from few paths that all cells share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.estimate import Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.daylight import add_daylight_paths
from mitsuba_cfs.window_parts import Cells

BATCHES = 2


def cell_daylight(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    cells: Sequence[Cells],
    *,
    subdivision: int = 1,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 8,
    max_depth: int = 16,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> list[NDArray[np.float64]]:
    """Daylight matrices [C, K, P] of the cells of each window group, as `daylight_matrix`.

    Every cell sends out the same directions with the same random numbers: what two cells see alike
    is alike to the last digit, and their difference has far less noise than either.

    Args: samples: paths of each cell and patch in each of 2 batches.
    """
    scenes = SceneCache() if scenes is None else scenes
    tracer = scenes.scene(surfaces, groups)
    bins, sky = DirectionBins(basis), SkyBins(ReinhartSky(subdivision))
    frames, corner, across, up = _places(groups, cells, tracer.centre)
    C, K, P, n = len(corner), bins.size, sky.size, int(samples)
    tables = [vectors(v) for v in (corner, across, up)]
    axes = [vectors(frames[:, i]) for i in range(3)]

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(C * K * P)
        count = dr.opaque(mi.UInt32, n)
        lane = dr.arange(mi.UInt32, C * K * n)
        row = lane // count  # cell and patch
        cell = row // K
        patch, sample = row - cell * K, lane - row * count
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(patch, key)[0]
        place, first, second = (dr.gather(mi.Vector3f, table, cell) for table in tables)
        x, y, z = (dr.gather(mi.Vector3f, axis, cell) for axis in axes)
        local = bins.sample(patch, lattice_2d(sample, stream, 0))
        u = lattice_2d(sample, stream, 2)
        starts = PathStarts(
            row,
            mi.Point3f(place + first * u.x + second * u.y + z * tracer.epsilon),
            x * local.x + y * local.y + z * local.z,
            path_generator(patch * count + sample, key),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        add_daylight_paths(tracer, sky, matrix, starts)
        return sums_of(matrix, (C, K, P)) / n

    stopping = Stopping(batches=BATCHES)
    found = accumulate(
        batch,
        stopping=stopping,
        label="cell daylight",
        entry=cache_entry(
            cache, "cell daylight", surfaces, groups, corner, across, up, subdivision, basis, n,
            max_depth, seed, by=__name__, stopping=stopping,
        ),
    ).values  # fmt: skip
    return np.split(found, np.cumsum([len(c.area) for c in cells])[:-1])


def _places(
    groups: Sequence[WindowGroup], cells: Sequence[Cells], centre: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    """Frames [C, 3, 3], corners from the centre and both sides [C, 3] of all cells."""
    pairs = list(zip(groups, cells, strict=True))
    for values in (
        [np.tile(g.frame, (len(c.area), 1, 1)) for g, c in pairs],
        [c.corner @ g.frame - centre for g, c in pairs],
        [c.sides[:, :1] * g.frame[0] for g, c in pairs],
        [c.sides[:, 1:] * g.frame[1] for g, c in pairs],
    ):
        yield np.concatenate(values)
