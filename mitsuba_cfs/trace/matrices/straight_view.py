"""View of the outdoors through the windows' straight beam, point by point, at sensors.

The phase methods resolve the outdoors by Klems patches, 10 to 15 degrees wide, and by the mean over
a window.  Behind clear glass a sensor sees the edge of a roof sharply.
"""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import SkyBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import SceneCache, TracedScene
from mitsuba_cfs.trace.matrices.daylight import add_daylight_paths


def straight_view_matrix(
    interior: Surfaces,
    exterior: Surfaces,
    groups: Sequence[WindowGroup],
    scattering: Sequence[Scattering | None],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    subdivision: int = 4,
    samples: int = 1024,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Illuminance at each sensor per unit luminance of each sky patch [G, S, P] [sr, projected].

        B[g, s, p] = integral over the visible part of g of cosine tau(omega) R(x, omega, p) d omega

    R is the radiance that arrives from outdoors along omega at x per unit of the patch, with all
    reflections outdoors; the room reflects nothing.

    Args:
        scattering: of each group's system; None leaves a group out.
        samples: points on each group for each sensor in each batch.
        max_depth: 1 for direct sky light only.
    """
    scenes = SceneCache() if scenes is None else scenes
    points, directions = sensors_of(points, directions)
    inside, outside = scenes.scene(interior, groups), scenes.scene(exterior, groups)
    sky, S, n = SkyBins(ReinhartSky(subdivision)), len(points), int(samples)

    def one_group(g: int, way: Scattering, key: mi.UInt32) -> NDArray[np.float64]:
        matrix = empty_sums(S * sky.size)
        stream = key ^ opaque(0x510E527F + g, mi.UInt32)
        sensor, start, omega, weight = straight_rays(
            inside, g, way, (points, directions), n, stream
        )
        starts = PathStarts(
            sensor,
            start,
            omega,
            path_generator(dr.arange(mi.UInt32, S * n), key),
            dr.opaque(mi.UInt32, max_depth),
            weight > 0,
        )
        add_daylight_paths(outside, sky, matrix, starts, weight)
        return sums_of(matrix, (S, sky.size)) / n

    def batch(number: int) -> NDArray[np.float64]:
        key = batch_key(seed, number)
        nothing = np.zeros((S, sky.size))
        return np.stack(
            [nothing if way is None else one_group(g, way, key) for g, way in enumerate(scattering)]
        )

    keys = [None if way is None else way.key for way in scattering]
    return accumulate(
        batch,
        stopping=stopping,
        label="straight view",
        entry=cache_entry(
            cache, "straight view", interior, exterior, groups, keys, points, directions,
            subdivision, n, max_depth, seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def straight_rays(
    inside: TracedScene,
    group: int,
    way: Scattering,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    samples: int,
    key: mi.UInt32,
) -> tuple[mi.UInt32, mi.Point3f, mi.Vector3f, mi.Float]:
    """Rays of sensors [S * samples] straight through a window group.

    Args: sensors: positions and normals [S, 3].

    Returns: sensor, start just outdoors, direction; the weight [sr, projected] of a
    ray times the samples, 0 where the sensor does not see the window.
    """
    place, normal = (np.atleast_2d(v) for v in sensors)
    count = dr.opaque(mi.UInt32, samples)
    lane = dr.arange(mi.UInt32, len(place) * samples)
    sensor = lane // count
    stream = mi.sample_tea_32(sensor, key)[0]
    target = inside.sample_group(group, lattice_2d(lane - sensor * count, stream, 0))
    start = dr.gather(mi.Point3f, vectors(place - inside.centre, mi.Point3f), sensor)
    to_target = target - start
    distance = dr.norm(to_target)
    omega = mi.Vector3f(to_target / distance)
    local = inside.to_group(group, omega)
    cosine = dr.dot(dr.gather(mi.Vector3f, vectors(normal), sensor), omega)
    seen = (cosine > 0) & (local.z > 1e-4)
    shadow = mi.Ray3f(start, omega, distance * (1 - 1e-4), 0.0, [])
    seen &= ~inside.scene.ray_test(shadow, coherent=False, active=seen)
    weight = cosine * local.z / dr.square(distance) * way.through(local)
    weight *= opaque(inside.groups[group].area)
    beyond = mi.Point3f(target + inside.outward(opaque(group, mi.Int32), mi.Bool(True)))
    return sensor, beyond, omega, dr.select(seen, weight, 0.0)
