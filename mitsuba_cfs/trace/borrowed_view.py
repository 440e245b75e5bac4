"""What sensors see straight through glass between rooms of the windows of the room beyond."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import normalize
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.bins import DirectionBins
from mitsuba_cfs.trace.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.image import add_picture_paths
from mitsuba_cfs.trace.sampling import (
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.scene import kept_scene

Room = tuple[Surfaces, Sequence[WindowGroup]]


def borrowed_view(
    room: Room,
    group: int,
    beam: NDArray[np.float64],
    beyond: Room,
    luminance: NDArray[np.float64],
    sensors: tuple[ArrayLike, ArrayLike],
    *,
    samples: int = 4096,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Irradiance at sensors straight through a window group [S, P], per unit sky radiance.

    Rays of the sensors that meet the group go on into the room beyond, a share of them by `beam`.

    Args:
        room: surfaces and window groups of the sensors' room.
        group: which of its window groups the room beyond lies behind.
        beam: [K] what goes straight on in each patch of the group.
        beyond: the room beyond and its windows.
        luminance: T D of these [G, K, P], towards that room.
        sensors: positions [S, 3] [m] and normals [S, 3].
        samples: paths of a sensor in each batch.
    """
    points, normals = (np.atleast_2d(np.asarray(one, dtype=float)) for one in sensors)
    directions = normalize(normals)
    here, bins, n, S = kept_scene(*room), DirectionBins(KLEMS_FULL), int(samples), len(points)
    there = kept_scene(*beyond, centre=here.centre)
    flat = luminance.reshape(-1, luminance.shape[-1])
    place, normal = vectors(points - here.centre, mi.Point3f), vectors(directions)
    passed = mi.Float(np.asarray(beam, dtype=np.float32))

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(S * len(flat))
        count, key = dr.opaque(mi.UInt32, n), dr.opaque(mi.UInt32, seed * 1_000_003 + number)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        sample, stream = path - sensor * count, mi.sample_tea_32(sensor, key)[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(sample, stream, 0))
        away = mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local)
        start, generator = dr.gather(mi.Point3f, place, sensor), path_generator(path, key)
        hit = here.scene.ray_intersect_preliminary(mi.Ray3f(start, away), coherent=False)
        active = here.leaves(hit, away, mi.Bool(True))
        active &= dr.gather(mi.Int32, here.group, hit.prim_index, active) == opaque(group, mi.Int32)
        patch = bins.index(here.to_group(group, away))
        active &= generator.next_float32() < dr.gather(mi.Float, passed, patch, active)
        add_picture_paths(
            there,
            bins,
            matrix,
            start + away * hit.t + here.exterior_normal(group) * there.epsilon,
            mi.Vector3f(away),
            active,
            row=sensor,
            apart=opaque(0, mi.UInt32),
            stream=stream,
            sample=sample,
            generator=generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )
        return sums_of(matrix, (S, len(flat))) * (np.pi / n) @ flat

    return accumulate(
        batch,
        stopping=stopping,
        label="borrowed view",
        entry=cache_entry(
            cache, "borrowed view", room, group, beam, beyond, flat, points, directions, n,
            max_depth, seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip
