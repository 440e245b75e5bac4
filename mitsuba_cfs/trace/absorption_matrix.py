"""Where the light that enters through a window patch is absorbed in the room."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.bins import DirectionBins
from mitsuba_cfs.trace.estimate import Estimate, Stopping, accumulate
from mitsuba_cfs.trace.sampling import lattice_2d, path_generator
from mitsuba_cfs.trace.scene import OPAQUE, TracedScene


@dr.syntax
def _absorption_kernel(
    tracer: TracedScene,
    matrix: mi.Float64,  # [K * (F + G)], accumulated in place
    row: mi.UInt32,  # patch that each path starts in
    position: mi.Point3f,  # on the window
    direction: mi.Vector3f,  # into the room
    generator: mi.PCG32,
    max_depth: mi.UInt32,
    active: mi.Bool,
) -> None:
    """Random walk of a unit of flux: each surface and window takes what it does not reflect."""
    F = mi.UInt32(tracer.surface_count)
    width = mi.UInt32(tracer.surface_count + len(tracer.groups))
    beta = mi.Float(1.0)
    depth = mi.UInt32(0)
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        active &= hit.is_valid()
        prim = hit.prim_index
        group = dr.gather(mi.Int32, tracer.group, prim, active)
        surface = dr.gather(mi.UInt32, tracer.surface, prim, active)
        reflectance = dr.gather(mi.Float, tracer.reflectance, prim, active)
        last = depth + 1 >= max_depth
        slot = row * width + dr.select(group == OPAQUE, surface, F + mi.UInt32(group))
        absorbed = dr.select(last, 1.0, 1 - reflectance)
        dr.scatter_add(matrix, mi.Float64(beta * absorbed), slot, active)
        active &= ~last

        face = dr.gather(mi.Vector3f, tracer.normal, prim, active)
        face = dr.mulsign(face, -dr.dot(face, direction))
        position = mi.Point3f(position + direction * hit.t + face * tracer.epsilon)
        beta *= reflectance
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        direction = mi.Frame3f(face).to_world(mi.warp.square_to_cosine_hemisphere(u))
        depth += 1
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
) -> Estimate:
    """Absorption matrices [G, K, F + G]: where a unit of flux of each window patch is absorbed.

        absorbed[f] = sum over g, k of A[g, k, f] Omega_k L[g, k] area_g,   L = T D s

    The first F columns are the surfaces, the last G the inner sides of the window groups: what
    they do not reflect, which is absorbed there or leaves the room.  Each row sums to 1 in a
    closed room; what is missing has left through a gap.

    Args:
        surfaces: the room in the solar band; `surfaces.surface` names the F surfaces.
        window_reflectance: [G] diffuse solar reflectance of the windows from the room, 0 if none.
        samples: paths for each window patch in each batch.
    """
    tracer = TracedScene(surfaces, groups, window_reflectance=window_reflectance)
    bins = DirectionBins(basis)
    K, n = bins.size, int(samples)
    width = tracer.surface_count + len(groups)

    def one_group(group: int, key: int) -> NDArray[np.float64]:
        matrix = dr.zeros(mi.Float64, K * width)
        count = dr.opaque(mi.UInt32, n)
        path = dr.arange(mi.UInt32, K * n)
        patch = path // count
        sample = path - patch * count
        opaque_key = dr.opaque(mi.UInt32, key & 0xFFFFFFFF)
        stream = mi.sample_tea_32(patch, opaque_key)[0]
        inward = -tracer.to_world(group, bins.sample(patch, lattice_2d(sample, stream, 0)))
        normal = mi.Vector3f(*map(float, groups[group].frame[2]))
        _absorption_kernel(
            tracer,
            matrix,
            patch,
            mi.Point3f(
                tracer.sample_group(group, lattice_2d(sample, stream, 2)) - normal * tracer.epsilon
            ),
            inward,
            path_generator(path, opaque_key),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        return matrix.numpy().reshape(K, width) / n

    def batch(number: int) -> NDArray[np.float64]:
        first = (seed * 1_000_003 + number) * len(groups)
        return np.stack([one_group(g, first + g) for g in range(len(groups))])

    return accumulate(batch, stopping=stopping, label="absorption matrix", progress=progress)
