"""View matrices V: irradiance at sensors, or radiance of pixels, per unit radiance of a patch."""

from __future__ import annotations

import math
from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    column,
    empty_sums,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import TracedScene, kept_scene
from mitsuba_cfs.trace.matrices.shared_hits import (
    MOST_SENSORS,
    indirect_rows,
    mirrored_rows,
    shares,
)
from mitsuba_cfs.trace.matrices.window_integral import add_window_light

DIRECT_SHARE = 2  # strata of the direct part for each path of a sensor
LEAST_STRATA = 4  # their error falls with the power 1.5
BLOCK_LANES = 1 << 26


def view_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 4096,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Estimate:
    """View matrices [S, G, K]: irradiance at each sensor per unit radiance of a window patch.

        E[s] = sum over g, k of V[s, g, k] L[g, k],   L = T D s

    Interreflection in the room is included (windows black), so a row sum is pi times the
    share of the sensor's view, direct and reflected, that ends on the windows.

    Args:
        surfaces: what the room is made of, in the band of the radiances (visible or solar).
        points, directions: [S, 3] sensor positions [m] and normals.
        samples: paths for each sensor in each batch.
        max_depth: most bounces of a path; Russian roulette ends most before.
        cache: where the matrix is kept and found again, `MatrixCache.of_user()`; none by default.

    Returns: an `Estimate` of shape [S, G, K] [sr, projected].

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase method);
    balance heuristic of Veach, Guibas 1995.
    """
    points, directions = sensors_of(points, directions)
    tracer = kept_scene(surfaces, groups)
    bins = DirectionBins(basis)
    S, n = len(points), int(samples)
    if S * n >= 2**32:
        raise ValueError(f"{S} sensors x {n} samples: a batch must stay below 2**32 paths")
    place = vectors(points - tracer.centre, mi.Point3f)
    normal = vectors(directions)
    shape = (S, len(groups), bins.size)
    blocks = np.array_split(np.arange(S, dtype=np.uint32), -(-S // MOST_SENSORS))

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(math.prod(shape))
        key = batch_key(seed, number)
        _add_direct(tracer, bins, matrix, place, normal, samples=n, key=key)
        values = sums_of(matrix, (S, len(groups) * bins.size))
        for block, sensors in enumerate(blocks if max_depth > 1 else []):
            chosen = column(sensors, mi.UInt32)
            here = [dr.gather(type(of), of, chosen) for of in (place, normal)]
            block_key = mi.sample_tea_32(key, mi.UInt32(block))[0]
            hits, paths = shares(len(sensors), n)
            values[sensors] += indirect_rows(
                tracer, bins, *here, hits=hits, paths=paths, max_depth=max_depth, key=block_key
            )
            if tracer.gloss is not None:
                values[sensors] += mirrored_rows(
                    tracer, bins, *here, samples=n, max_depth=max_depth, key=block_key
                )
        return values.reshape(shape)

    return accumulate(
        batch,
        stopping=stopping,
        label="view matrix",
        progress=progress,
        entry=cache_entry(
            cache, "view matrix", surfaces, groups, points, directions, basis, n, max_depth,
            seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def _add_direct(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    place: mi.Point3f,
    normal: mi.Vector3f,
    *,
    samples: int,
    key: mi.UInt32,
) -> None:
    """Add the windows that each sensor sees, patch by patch."""
    S, T, K = dr.width(place), tracer.window_triangles, bins.size
    strata = max(LEAST_STRATA, DIRECT_SHARE * samples // (T * K))
    of_sensor = T * K * strata
    block = max(1, BLOCK_LANES // of_sensor)
    for first in range(0, S, block):
        lane = dr.arange(mi.UInt32, min(block, S - first) * of_sensor)
        lane += dr.opaque(mi.UInt32, first * of_sensor)
        cell = lane // dr.opaque(mi.UInt32, strata)
        view = cell // bins.size
        sensor = view // T
        generator = path_generator(lane, key ^ mi.UInt32(0x5BD1E995))
        add_window_light(
            tracer,
            bins,
            matrix,
            sensor,
            dr.gather(mi.Point3f, place, sensor),
            dr.gather(mi.Vector3f, normal, sensor),
            triangle=view - sensor * T,
            patch=cell - view * bins.size,
            stratum=lane - cell * dr.opaque(mi.UInt32, strata),
            strata=dr.opaque(mi.UInt32, strata),
            u=mi.Point2f(generator.next_float32(), generator.next_float32()),
        )
