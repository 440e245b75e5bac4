"""Daylight matrices: what reaches a window patch, or a sensor outdoors, from each sky patch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.acceptance import AcceptedDirections
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.random_walk import PathStarts, roulette
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import TracedScene, kept_scene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches


@dr.syntax
def add_daylight_paths(
    tracer: TracedScene,
    sky: SkyBins,
    matrix: mi.Float64,  # [rows * P], accumulated in place
    starts: PathStarts,  # on the window or the sensor, outdoors
    weight: mi.Float | None = None,  # of each path, 1 by default
) -> None:
    """Follow each path to the sky, where the patch it meets gains the product of reflectances.

    Where panes stand close before windows (a screen behind them) a path passes those that it meets
    from the room's side; to what comes back from outdoors windows are black.  A path of one segment
    may have one more by a smooth mirror, which shows the sky and the sun.
    """
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    weight = mi.Float(1.0 if weight is None else weight)
    beta = mi.Float(1.0)
    depth = mi.UInt32(0)
    in_series = tracer.panes_in_series
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        free = active & ~hit.is_valid()
        slot = row * mi.UInt32(sky.size) + sky.index(direction)
        dr.scatter_add(matrix, mi.Float64(beta * weight), slot, free)
        active &= hit.is_valid()
        if active:
            passed = mi.Bool(False)
            if dr.hint(in_series, mode="scalar"):
                passed = tracer.leaves(hit, direction, active)
            before, face, _ = tracer.surface_at(hit, position, direction, active)
            beyond = mi.Point3f(before - 2 * tracer.epsilon * face)
            after, away, reflectance, mirrored = tracer.bounce(
                hit, position, direction, generator, active
            )
            position = dr.select(passed, beyond, after)
            direction = dr.select(passed, direction, away)
            depth += dr.select(passed, mi.UInt32(0), mi.UInt32(1))
            alive, onwards = roulette(beta * reflectance, depth, generator)
            beta = dr.select(passed, beta, onwards)
            within = depth < max_depth
            if dr.hint(tracer.gloss is not None, mode="scalar"):
                within |= mirrored & (depth == 1) & (max_depth == 1)
            active &= passed | (alive & within)


def daylight_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    subdivision: int = 4,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 4096,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Daylight matrices [G, K, P]: mean radiance of each window patch per unit sky radiance.

        L_window[g, k] = sum over p of D[g, k, p] s[p]

    The mean is over the area of the group's windows and, weighted by the cosine, over the
    directions of the patch, so the irradiance on the group is the sum of Omega_k L_window[k].
    Sky patch 0 is the ground: a ray that leaves downwards and meets nothing.  A row of a window
    that sees no obstruction sums to 1.

    Args:
        surfaces: what stands outdoors, in the band of the radiances; the windows' own panes and
            whatever lies behind them must not be among it.
        subdivision: Reinhart's MF (1, 2, 4, 6).
        samples: paths for each window patch in each batch.
        cache: where the matrix is kept and found again, `MatrixCache.of_user()`; none by default.

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase method).
    """
    something = len(surfaces.triangles) > 0  # light comes back to the windows
    tracer = kept_scene(surfaces, groups, windows_block=something)
    bins, sky = DirectionBins(basis), SkyBins(ReinhartSky(subdivision))
    n = int(samples)

    def follow(matrix: mi.Float64, paths: WindowPaths) -> None:
        depth = dr.opaque(mi.UInt32, max_depth)
        clear = tracer.outward(opaque(paths.group, mi.Int32), mi.Bool(True)) if something else 0.0
        place = mi.Point3f(paths.position + clear)
        starts = PathStarts(
            paths.patch, place, paths.outward, paths.generator, depth, mi.Bool(True)
        )
        add_daylight_paths(tracer, sky, matrix, starts)

    return accumulate(
        window_batches(tracer, bins, sky.size, n, seed, follow),
        stopping=stopping,
        label="daylight matrix",
        progress=progress,
        entry=cache_entry(
            cache, "daylight matrix", surfaces, groups, subdivision, basis, n, max_depth,
            seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def sky_irradiance_matrix(
    surfaces: Surfaces,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    subdivision: int = 4,
    acceptance: ArrayLike | None = None,
    samples: int = 16384,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Irradiance at sensors outdoors per unit radiance of each sky patch [S, P] [sr, projected].

        E[s] = sum over p of C[s, p] sky[p]

    A row sums to pi where nothing around the sensor absorbs.

    Args:
        points, directions: [S, 3] sensor positions [m] and normals; or [S, K, 3] places of each
            sensor, of which its rows are the mean.
        acceptance: what the sensor takes up of light at even steps from normal to grazing
            incidence, 0 to 90 degrees; all of it by default.
        max_depth: 1 leaves the sky that the sensor sees itself.
        samples: paths for each sensor in each batch.
    """
    points = np.asarray(points, dtype=float)
    places = points if points.ndim == 3 else np.atleast_2d(points)[:, None]
    middles, directions = sensors_of(places.mean(axis=1), directions)
    if max_depth == 1:  # what the sensor sees itself, mirrors are left to the rest
        surfaces = replace(surfaces, gloss=())
    tracer = TracedScene(surfaces, centre=middles.mean(axis=0))
    sky = SkyBins(ReinhartSky(subdivision))
    accepted = AcceptedDirections(acceptance)
    S, P, n = len(places), sky.size, int(samples)
    place = vectors(places.reshape(-1, 3) - tracer.centre, mi.Point3f)
    normal = vectors(directions)

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(S * P)
        K = places.shape[1]
        count, each = dr.opaque(mi.UInt32, n), dr.opaque(mi.UInt32, K)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        turn = dr.opaque(mi.UInt32, number * n % K)  # where the last batch ended
        at = sensor * each + (path - sensor * count + turn) % each
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(sensor, key)[0]
        local = accepted.sample(lattice_2d(path - sensor * count, stream, 0))
        starts = PathStarts(
            sensor,
            mi.Point3f(dr.gather(mi.Point3f, place, at)),
            mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local),
            path_generator(path, key),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        add_daylight_paths(tracer, sky, matrix, starts)
        return sums_of(matrix, (S, P)) * (accepted.total / n)

    return accumulate(
        batch,
        stopping=stopping,
        label="sky irradiance",
        progress=progress,
        entry=cache_entry(
            cache, "sky irradiance", surfaces, points, directions, subdivision,
            () if acceptance is None else np.asarray(acceptance, dtype=float), n, max_depth,
            seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip
