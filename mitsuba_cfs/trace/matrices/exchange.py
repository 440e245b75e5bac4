"""Exchange matrices between windows, by the room or the outdoors, for windows that reflect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.matrices.pixel_view import add_seen_and_reflected


def window_exchange(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 128,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Radiance that meets the windows from the room, per unit radiance of a patch [G, K, G * K].

        I[g, k] = sum over g', k' of W[g, k, g' k'] L[g', k']

    the mean over a group and over its back's incident patch k, the windows black.  A row sums to
    the share of a patch's view, direct and reflected, that ends on the windows.

    Args:
        surfaces: what the room is made of, in the band of the radiances.
        samples: paths for each patch in each batch.
    """
    scenes = SceneCache() if scenes is None else scenes
    tracer, bins, n = scenes.scene(surfaces, groups), DirectionBins(basis), int(samples)
    columns = len(groups) * bins.size

    def follow(matrix: mi.Float64, paths: WindowPaths) -> None:
        normal = tracer.exterior_normal(paths.group)
        add_seen_and_reflected(
            tracer,
            bins,
            matrix,
            mi.Point3f(paths.position - normal * tracer.epsilon),
            paths.inward(tracer),
            mi.Bool(True),
            row=paths.row,
            beta=mi.Float(1),
            stream=paths.stream,
            sample=paths.sample,
            generator=paths.generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )

    return accumulate(
        window_batches(tracer, bins, columns, n, seed, follow, stopping=stopping or Stopping()),
        stopping=stopping,
        label="window exchange",
        entry=cache_entry(
            cache, "window exchange", surfaces, groups, basis, n, max_depth, seed,
            by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def outdoor_exchange(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    samples: int = 128,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Radiance that meets the windows from outdoors, per unit that they send there [G, K, G * K].

        I[g, k] = sum over g', k' of X[g, k, g' k'] L[g', k']

    for incident and outgoing patches of the front; arguments as for `window_exchange`.
    """
    found = window_exchange(
        surfaces, [_turned(group) for group in groups], samples=samples, max_depth=max_depth,
        stopping=stopping, seed=seed, cache=cache, scenes=scenes,
    )  # fmt: skip
    theta, phi = KLEMS_FULL.centres()
    patch = KLEMS_FULL.index(theta, np.pi - phi)  # x of the turned windows is that of the others, -
    columns = (np.arange(len(groups))[:, None] * KLEMS_FULL.size + patch).ravel()
    return replace(
        found,
        values=found.values[:, patch][:, :, columns],
        standard_error=found.standard_error[:, patch][:, :, columns],
        covariance=found.sum_error[:, patch, None, None] ** 2,  # in one block: columns are moved
    )


def _turned(group: WindowGroup) -> WindowGroup:
    """The same windows facing the other way: their exterior side is the room."""
    turned = (replace(w, triangles=w.triangles[:, ::-1]) for w in group.windows)
    return replace(group, windows=tuple(turned))
