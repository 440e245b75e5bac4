"""Absorption matrices: where light that enters through a window patch is absorbed."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import opaque
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches


@dr.syntax
def _absorption_kernel(
    tracer: TracedScene,
    matrix: mi.Float64,  # [K * (F + G)], accumulated in place
    starts: PathStarts,  # on the window, into the room; rows are its patches
) -> None:
    """Random walk of a unit of flux; each surface and window absorbs what it does not reflect."""
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    F = opaque(tracer.surface_count, mi.UInt32)
    width = opaque(tracer.surface_count + len(tracer.groups), mi.UInt32)
    beta = mi.Float(1.0)
    depth = mi.UInt32(0)
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)
        surface = dr.gather(mi.UInt32, tracer.surface, hit.prim_index, active)
        origin, towards = position, direction
        position, away, reflectance, _ = tracer.bounce(hit, position, direction, generator, active)
        last = depth + 1 >= max_depth
        slot = row * width + dr.select(group == OPAQUE, surface, F + mi.UInt32(group))
        transmittance, behind = mi.Float(0.0), mi.Bool(False)
        if dr.hint(tracer.panes is not None, mode="scalar"):
            normal = dr.gather(mi.Vector3f, tracer.normal, hit.prim_index, active)
            cosine = dr.dot(normal, towards)
            behind = active & (cosine < 0) & tracer.panes.is_pane(hit.prim_index, active)
            transmittance = tracer.panes.transmittance(hit.prim_index, cosine, active)
            left = reflectance + transmittance
            through = behind | (generator.next_float32() * left < transmittance)
            beyond = origin + towards * hit.t + dr.mulsign(normal, cosine) * tracer.epsilon
            position = dr.select(through, beyond, position)
            away = dr.select(through, towards, away)
        passed = reflectance + transmittance
        absorbed = dr.select(behind, 0.0, dr.select(last, 1.0, 1 - passed))
        dr.scatter_add(matrix, mi.Float64(beta * absorbed), slot, active)
        active &= behind | ~last

        beta *= dr.select(behind, 1.0, passed)
        direction = away
        depth += dr.select(behind, mi.UInt32(0), mi.UInt32(1))
        survival = dr.select(depth > 3, dr.minimum(beta * 4.0, 1.0), 1.0)
        active &= (generator.next_float32() < survival) & (beta > 0)
        beta /= dr.maximum(survival, 1e-6)


def absorption_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    window_reflectance: ArrayLike | None = None,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 2048,
    max_depth: int = 64,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Absorption matrices [G, K, F + G]: where a unit of flux of each window patch is absorbed.

        absorbed[f] = sum over g, k of A[g, k, f] Omega_k L[g, k] area_g,   L = T D s

    The first F columns are the surfaces, the last G the inner sides of the window groups: what
    they do not reflect, which is absorbed there or leaves the room.  Each row sums to 1 in a
    closed room; what is missing has left through a gap.  Surfaces that transmit are panes between
    rooms: a ray along their normal is reflected, absorbed or goes straight on; the pane of the
    room beyond, which it meets against its normal, is the same glass and is passed freely.

    Args:
        surfaces: the room in the solar band; `surfaces.surface` names the F surfaces.
        window_reflectance: [G] diffuse solar reflectance of the windows from the room, 0 if none.
        samples: paths for each window patch in each batch.
        cache: of traced matrices, `MatrixCache.of_user()`; none by default.
    """
    scenes = SceneCache() if scenes is None else scenes
    reflectance = np.zeros(len(groups)) if window_reflectance is None else window_reflectance
    reflectance = np.asarray(reflectance, dtype=float)
    tracer = scenes.scene(surfaces, groups, window_reflectance=reflectance)
    bins = DirectionBins(basis)
    n = int(samples)
    width = tracer.surface_count + len(groups)

    def follow(matrix: mi.Float64, paths: WindowPaths) -> None:
        normal = tracer.exterior_normal(paths.group)
        position = mi.Point3f(paths.position - normal * tracer.epsilon)
        depth = dr.opaque(mi.UInt32, max_depth)
        starts = PathStarts(
            paths.row, position, -paths.outward, paths.generator, depth, mi.Bool(True)
        )
        _absorption_kernel(tracer, matrix, starts)

    return accumulate(
        window_batches(tracer, bins, width, n, seed, follow, stopping=stopping or Stopping()),
        stopping=stopping,
        label="absorption matrix",
        progress=progress,
        entry=cache_entry(
            cache, "absorption matrix", surfaces, groups, reflectance, basis, n,
            max_depth, seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip
