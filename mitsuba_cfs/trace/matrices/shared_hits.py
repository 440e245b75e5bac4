"""Interreflection at many sensors at once: what one of them sees serves the others too."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import empty_sums, lattice_2d, path_generator, sums_of
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.kernels.view_paths import add_mirrored, add_view_paths

MOST_SENSORS = 64  # that share their hits; more would cost more than they help
RAYS_OF_PATH = 4  # shadow rays and bounces, on average


def shares(sensors: int, samples: int) -> tuple[int, int]:
    """Hits of each sensor, and paths from each hit, at about the cost of `samples` paths.

    Each hit costs a shadow ray to every sensor and its paths; the more sensors take part in a
    hit, the more is its row of the matrix worth.
    """
    paths = max(1, sensors // 8)
    hits = max(1, round(RAYS_OF_PATH * samples / (1 + sensors + RAYS_OF_PATH * paths)))
    return hits, paths


def indirect_rows(
    tracer: TracedScene,
    bins: DirectionBins,
    place: mi.Point3f,  # [C]
    normal: mi.Vector3f,  # [C]
    *,
    hits: int,
    paths: int,
    max_depth: int,
    key: mi.UInt32,
) -> NDArray[np.float64]:
    """Interreflected part of the view matrix of a few sensors [C, G * K].

    Each sensor's cosine-distributed rays meet the room in `hits` points.  At every point x the
    row of its own irradiance, V(x), is estimated by `paths` paths; every sensor s takes all points
    of all sensors with the weight of the balance heuristic over the sensors,

        V[s] += sum over x of rho(x) V(x) G(s, x) / (hits sum over s' of G(s', x)),

    G the cosines over the squared distance where s sees x.  The sum is over what the mixture of
    all sensors' rays would sample x with, so no near wall makes it large.

    Source: Veach, Guibas 1995 (balance heuristic); Bekaert, Sbert, Halton 2002, "Accelerating path
    tracing by re-using paths" (the same among pixels).
    """
    C = dr.width(place)
    position, face, weight, triangle = _hits(tracer, place, normal, hits, key)
    M = dr.width(weight)
    exchange, slant = _exchange(tracer, place, normal, position, face, hits)
    exchange = exchange.numpy().reshape(C, M)
    total = exchange.sum(axis=0)
    share = weight.numpy() / (hits * np.where(total > 0, total, 1.0))
    if tracer.gloss is not None:  # of the diffuse reflectance, by the angle that a sensor sees
        point = dr.arange(mi.UInt32, C * M) % dr.opaque(mi.UInt32, M)
        left = tracer.gloss.diffuse_share(dr.gather(mi.UInt32, triangle, point), slant, True)
        exchange = exchange * left.numpy().reshape(C, M)

    columns = len(tracer.groups) * bins.size
    rows = empty_sums(M * columns)
    count = dr.opaque(mi.UInt32, paths)
    path = dr.arange(mi.UInt32, M * paths)
    hit = path // count
    add_view_paths(
        tracer,
        bins,
        rows,
        hit,
        dr.gather(mi.Point3f, position, hit),
        dr.gather(mi.Vector3f, face, hit),
        later=dr.opaque(mi.UInt32, 0),
        beta=dr.opaque(mi.Float, 1 / paths),
        sample=path - hit * count,
        stream=mi.sample_tea_32(hit, key ^ mi.UInt32(0x3C6EF372))[0],
        generator=path_generator(path, key ^ mi.UInt32(0xA54FF53A)),
        max_depth=dr.opaque(mi.UInt32, max_depth - 1),
        active=dr.gather(mi.Float, weight, hit) > 0,
        carried=dr.gather(mi.Float, weight, hit),
        mirrored=None,
        light=None,
    )
    return (exchange * share) @ sums_of(rows, (M, columns))


def _hits(
    tracer: TracedScene, place: mi.Point3f, normal: mi.Vector3f, hits: int, key: mi.UInt32
) -> tuple[mi.Point3f, mi.Vector3f, mi.Float, mi.UInt32]:
    """Points [M], their normals, diffuse reflectances and triangles.

    The reflectance, that at normal incidence, is 0 where a ray met a window or nothing.
    """
    count = dr.opaque(mi.UInt32, hits)
    ray_number = dr.arange(mi.UInt32, dr.width(place) * hits)
    sensor = ray_number // count
    stream = mi.sample_tea_32(sensor, key ^ mi.UInt32(0xBB67AE85))[0]
    local = mi.warp.square_to_cosine_hemisphere(lattice_2d(ray_number - sensor * count, stream, 0))
    direction = mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local)
    start = dr.gather(mi.Point3f, place, sensor)
    ray = mi.Ray3f(start, direction)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=True)
    opaque = hit.is_valid()
    opaque &= dr.gather(mi.Int32, tracer.group, hit.prim_index, opaque) == OPAQUE
    position, face, weight = tracer.surface_at(hit, start, direction, opaque)
    if tracer.gloss is not None:
        weight = dr.gather(mi.Float, tracer.reflectance, hit.prim_index, opaque)
    triangle = dr.select(opaque, hit.prim_index, 0)
    dr.eval(position, face, weight, triangle)
    return position, face, weight, triangle


def _exchange(
    tracer: TracedScene,
    place: mi.Point3f,
    normal: mi.Vector3f,
    position: mi.Point3f,
    face: mi.Vector3f,
    hits: int,
) -> tuple[mi.Float, mi.Float]:
    """G [C * M]: cosines over squared distance where a sensor sees a point; the point's cosine."""
    C, M = dr.width(place), dr.width(position)
    pair = dr.arange(mi.UInt32, C * M)
    sensor = pair // dr.opaque(mi.UInt32, M)
    point = pair - sensor * dr.opaque(mi.UInt32, M)
    start = dr.gather(mi.Point3f, place, sensor)
    to_point = dr.gather(mi.Point3f, position, point) - start
    distance2 = dr.squared_norm(to_point)
    distance = dr.sqrt(distance2)
    omega = to_point / distance
    cosines = dr.maximum(dr.dot(dr.gather(mi.Vector3f, normal, sensor), omega), 0)
    slant = -dr.dot(dr.gather(mi.Vector3f, face, point), omega)
    cosines *= dr.maximum(slant, 0)
    shadow = mi.Ray3f(start, omega, distance * (1 - 1e-4), 0.0, [])
    own = point // dr.opaque(mi.UInt32, hits) == sensor  # seen, whatever rounding says
    seen = cosines > 0  # false for a ray that has left through a seam: its point is nowhere
    seen &= ~tracer.scene.ray_test(shadow, coherent=False, active=seen & ~own)
    return dr.select(seen, cosines / distance2, 0.0), slant


def mirrored_rows(
    tracer: TracedScene,
    bins: DirectionBins,
    place: mi.Point3f,  # [C]
    normal: mi.Vector3f,  # [C]
    *,
    samples: int,
    max_depth: int,
    key: mi.UInt32,
) -> NDArray[np.float64]:
    """What sensors see by the gloss of what their rays meet first [C, G * K], each for itself."""
    C = dr.width(place)
    columns = len(tracer.groups) * bins.size
    rows = empty_sums(C * columns)
    count = dr.opaque(mi.UInt32, samples)
    path = dr.arange(mi.UInt32, C * samples)
    sensor = path // count
    sample = path - sensor * count
    stream = mi.sample_tea_32(sensor, key ^ mi.UInt32(0x510E527F))[0]
    local = mi.warp.square_to_cosine_hemisphere(lattice_2d(sample, stream, 0))
    start = dr.gather(mi.Point3f, place, sensor)
    away = mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local)
    ray = mi.Ray3f(start, away)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=True)
    generator = path_generator(path, key ^ mi.UInt32(0x9B05688C))
    add_mirrored(
        tracer, bins, rows, hit, start, away,
        row=sensor, later=dr.opaque(mi.UInt32, 0), beta=dr.opaque(mi.Float, np.pi / samples),
        sample=sample, stream=stream, generator=generator,
        max_depth=dr.opaque(mi.UInt32, max_depth - 1), active=hit.is_valid(),
    )  # fmt: skip
    return sums_of(rows, (C, columns))
