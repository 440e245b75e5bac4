"""Daylight matrices of glass between rooms: what the windows of the room beyond send to it."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.scene import kept_scene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.matrices.pixel_view import add_seen_and_reflected


def borrowed_daylight(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    luminance: NDArray[np.float64],
    inner: Sequence[WindowGroup],
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 512,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Daylight matrices [I, K, P] of glass to a lit room: radiance per unit sky radiance.

        D[i, k, p] = sum over g, k' of V[i, k, g k'] (T D)[g k', p]

    V is the radiance that meets the glass from patch k, a mean over its area, per unit radiance of
    a patch of the room's own windows; light that the room reflects is in it.

    Args:
        surfaces: what the room beyond is made of.
        groups: its windows, black to what comes back.
        luminance: T D of these [G, K, P], towards that room.
        inner: the glass, with normals into that room.
        samples: paths of a patch of each piece of glass in each batch.
    """
    tracer, bins, n = kept_scene(surfaces, groups), DirectionBins(basis), int(samples)
    starts = kept_scene(Surfaces.none(), inner, windows_block=False, centre=tracer.centre)
    flat = luminance.reshape(-1, luminance.shape[-1])

    def follow(matrix: mi.Float64, paths: WindowPaths) -> None:
        path = dr.arange(mi.UInt32, dr.width(paths.patch))
        add_seen_and_reflected(
            tracer,
            bins,
            matrix,
            mi.Point3f(paths.position + starts.exterior_normal(paths.group) * tracer.epsilon),
            paths.outward,
            mi.Bool(True),
            row=paths.patch,
            beta=mi.Float(1),
            stream=paths.patch,
            sample=path - paths.patch * dr.opaque(mi.UInt32, n),
            generator=paths.generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )

    view = window_batches(starts, bins, len(flat), n, seed, follow)
    return accumulate(
        lambda number: view(number) @ flat,
        stopping=stopping,
        label="borrowed daylight",
        entry=cache_entry(
            cache, "borrowed daylight", surfaces, groups, flat, inner, basis, n, max_depth, seed,
            by=__name__, stopping=stopping,
        ),
    )  # fmt: skip
