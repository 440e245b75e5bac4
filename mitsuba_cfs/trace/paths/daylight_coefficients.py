"""The two-phase method: daylight coefficients of sensors straight through the real BSDF."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.paths.point_in_time import sensor_batches
from mitsuba_cfs.trace.paths.scene import PatchSky, PathTracingScene


def daylight_coefficients(
    room: PathTracingScene,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    subdivision: int = 4,
    samples: int = 16384,
    max_depth: int = 24,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    key: object = None,
) -> Estimate:
    """Illuminance per unit luminance of each sky patch [S, P], straight through the real BSDF.

        E[s] = sum over p of C[s, p] sky[p]

    The two-phase method: the paths of `point_in_time` from the sensors through whatever fills the
    windows to the patches; one matrix for one state, without the angular patches of V T D.

    Args:
        points, directions: [S, 3] sensor positions [m] and normals.
        subdivision: Reinhart's MF (1, 2, 4, 6).
        samples: paths for each sensor in each batch.
        cache, key: where the matrix is kept, and what the room was made from (surfaces, window
            groups, BSDF data), which tells it from others there.

    Source: Tregenza and Waters 1983, "Daylight coefficients", Lighting Research & Technology 15.
    """
    if cache is not None and key is None:
        raise ValueError("a room needs a `key` before its matrix can be kept in a cache")
    sky = PatchSky(subdivision)
    return accumulate(
        sensor_batches(room, sky, points, directions, samples=samples, max_depth=max_depth, seed=seed),
        stopping=stopping,
        label="daylight coefficients",
        progress=progress,
        entry=cache_entry(
            cache,
            "daylight coefficients",
            key,
            np.asarray(points),
            np.asarray(directions),
            subdivision,
            samples,
            max_depth,
            seed,
            by=__name__,
            stopping=stopping,
        ),
    )
