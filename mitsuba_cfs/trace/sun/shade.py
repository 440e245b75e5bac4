"""Sunlit share of receivers outdoors: the visible part of the sun's disc, hour by hour."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import normalize, sensors_of
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.sampling import lattice, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.specular_paths import on_disc

RAYS = 2**24  # at once


def sunlit_shares(
    surfaces: Surfaces,
    points: ArrayLike,
    directions: ArrayLike,
    suns: ArrayLike,
    *,
    edges: ArrayLike | None = None,
    samples: int = 16,
    seed: int = 0,
    progress: Progress = silent,
) -> NDArray[np.float32]:
    """Sunlit share of each receiver [S, H]; 0 with the sun behind it.

    The mean visibility over the 0.533 degree disc and the receiver's area.
    Standard error: at most 0.5 / sqrt(samples), far less as the samples are stratified.

    Args:
        points, directions: [S, 3] centres of the receivers [m] and their normals.
        suns: [H, 3] unit vectors to the sun.
        edges: [S, 2, 3] sides of each receiver, a parallelogram [m]; points by default.
    """
    points, directions = sensors_of(points, directions)
    suns = normalize(np.atleast_2d(np.asarray(suns, dtype=float)))
    edges = np.zeros((len(points), 2, 3)) if edges is None else np.asarray(edges, dtype=float)
    tracer = TracedScene(surfaces, centre=points.mean(axis=0))
    S, H = len(points), len(suns)
    place = mi.Point3f((points - tracer.centre + tracer.epsilon[0] * directions).T.astype(np.float32))
    normal = vectors(directions)
    sides = [vectors(edges[:, i]) for i in range(2)]
    shares = np.empty((S, H), dtype=np.float32)
    size = max(1, RAYS // (S * samples))
    key = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
    for start in range(0, H, size):
        some = suns[start : start + size]
        towards = vectors(some)
        count, several = dr.opaque(mi.UInt32, len(some)), dr.opaque(mi.UInt32, samples)
        ray_number = dr.arange(mi.UInt32, S * len(some) * samples)
        pair = ray_number // several
        sample = ray_number - pair * several
        sensor = pair // count
        hour = pair - sensor * count
        stream = mi.sample_tea_32(sensor, hour + dr.opaque(mi.UInt32, start) + key)[0]
        origin = dr.gather(mi.Point3f, place, sensor)
        for k in range(2):
            origin += dr.gather(mi.Vector3f, sides[k], sensor) * (lattice(sample, stream, k) - 0.5)
        ray = mi.Ray3f(origin, on_disc(dr.gather(mi.Vector3f, towards, hour), sample, stream))
        before = dr.dot(ray.d, dr.gather(mi.Vector3f, normal, sensor)) > 0
        free = before & ~tracer.scene.ray_test(ray, coherent=False, active=before)
        seen = dr.zeros(mi.Float, S * len(some))
        dr.scatter_add(seen, dr.select(free, mi.Float(1), mi.Float(0)), pair)
        shares[:, start : start + size] = seen.numpy().reshape(S, -1) / samples
        progress("shade", (start + len(some)) / H)
    return shares
