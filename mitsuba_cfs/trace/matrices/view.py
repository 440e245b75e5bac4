"""View matrices V: irradiance at sensors, or radiance of pixels, per unit radiance of a patch.

V = direct part + interreflection.  The direct part is integrated over each patch of each window
(`add_window_light`).  The interreflection is sampled for many sensors together: the points that the
rays of one sensor meet serve the others too (`indirect_rows`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    column,
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.kernels.view_paths import add_mirrored, add_view_paths

MOST_SENSORS = 64  # that share hits; more cost more than they save
RAYS_OF_PATH = 4  # shadow rays and bounces, on average
STEEPEST = 1e4  # tangent of the largest polar angle
NEWTON_STEPS = 3  # the integrand is nearly linear within a ring
DIRECT_SHARE = 2  # strata of the direct part for each path of a sensor
LEAST_STRATA = 4  # their error falls with the power 1.5
BLOCK_LANES = 1 << 26


def shares(sensors: int, samples: int) -> tuple[int, int]:
    """Hits of each sensor, and paths from each hit, at about the cost of `samples` paths.

    Each hit costs a shadow ray to every sensor and its paths; the more sensors share a hit, the
    more paths it deserves.
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
    """Part of the view matrix that the gloss of the first surfaces reflects [C, G * K]."""
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


@dr.syntax
def add_window_light(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,  # [rows * G * K], accumulated in place
    row: mi.UInt32,  # row of the matrix that each lane adds to
    position: mi.Point3f,
    normal: mi.Vector3f,  # direction that the irradiance is measured about
    *,
    triangle: mi.UInt32,  # of the windows
    patch: mi.UInt32,
    stratum: mi.UInt32,  # of the patch's azimuths
    strata: mi.UInt32,
    u: mi.Point2f,
) -> None:
    """Add one stratum of d(irradiance at `position`) / d(radiance of the patch in the triangle).

    In a half-plane of constant azimuth the triangle is an interval of polar angles, and so is the
    patch's ring; over both the cosine at `normal` has a closed integral.  Azimuth is stratified,
    and one shadow ray, distributed as the integrand, tests the visibility.  Without
    an obstruction only the azimuth is random, within one patch.
    """
    group, corners = tracer.window_triangle(triangle, position)
    a, b, c = corners
    n = tracer.to_local(group, normal, mi.Bool(True))
    edges = (dr.cross(a, b), dr.cross(b, c), dr.cross(c, a))
    active = dr.dot(a, edges[1]) > 1e-9  # the point is on the room's side of the window

    # ----- Azimuths of the triangle about the point's foot on the window plane -----
    around = active & (edges[0].z >= 0) & (edges[1].z >= 0) & (edges[2].z >= 0)
    middle = dr.atan2(a.y + b.y + c.y, a.x + b.x + c.x)
    turns = [_wrapped(dr.atan2(v.y, v.x) - middle) for v in corners]
    low = dr.minimum(dr.minimum(turns[0], turns[1]), turns[2])
    high = dr.maximum(dr.maximum(turns[0], turns[1]), turns[2])
    middle += 0.5 * (low + high)
    half = dr.select(around, dr.pi, 0.5 * (high - low))

    # ----- The part of them in the patch, and the azimuth of this stratum -----
    centre, width, tangent_low, tangent_high = bins.sector(patch)
    centre = dr.select(around | (width > 6), 0.0, _wrapped(centre - middle))
    start = dr.select(around, -0.5 * width, dr.maximum(centre - 0.5 * width, -half))
    end = dr.select(around, 0.5 * width, dr.minimum(centre + 0.5 * width, half))
    active &= end > start
    origin = dr.select(around, bins.sector(patch)[0], middle)
    step = (end - start) / mi.Float(strata)
    phi = origin + start + (mi.Float(stratum) + u.x) * step
    sine, cosine = dr.sincos(phi)

    # ----- Polar angles of the triangle at this azimuth, above the horizon of the normal -----
    t0, t1 = tangent_low, dr.minimum(tangent_high, STEEPEST)
    n_r = n.x * cosine + n.y * sine
    for edge_z, edge_r in (*((e.z, e.x * cosine + e.y * sine) for e in edges), (n.z, n_r)):
        crossing = -edge_z / edge_r
        t0 = dr.select(edge_r > 0, dr.maximum(t0, crossing), t0)
        t1 = dr.select(edge_r < 0, dr.minimum(t1, crossing), t1)
        active &= (edge_r != 0) | (edge_z > 0)
    active &= t1 > t0

    # ----- Integral of (n_z cos + n_r sin) sin d(theta), and a ray placed as its integrand -----
    theta0, theta1 = dr.atan(t0), dr.atan(t1)
    first = _integral(n.z, n_r, theta0)
    whole = dr.maximum(_integral(n.z, n_r, theta1) - first, 0)
    theta = dr.lerp(theta0, theta1, u.y)
    for _ in range(NEWTON_STEPS):
        s, c = dr.sincos(theta)
        slope = dr.maximum((n.z * c + n_r * s) * s, 1e-9)
        theta -= (_integral(n.z, n_r, theta) - first - u.y * whole) / slope
        theta = dr.clip(theta, theta0, theta1)
    s, c = dr.sincos(theta)
    local = mi.Vector3f(s * cosine, s * sine, c)
    plane = dr.cross(b - a, corners[2] - a)
    distance = dr.dot(plane, a) / dr.dot(plane, local)
    active &= whole > 0
    ray = mi.Ray3f(position, tracer.to_world_any(group, local), distance * (1 - 1e-4), 0.0, [])
    active &= ~tracer.scene.ray_test(ray, coherent=False, active=active)
    slot = (row * opaque(len(tracer.groups), mi.UInt32) + mi.UInt32(group)) * bins.size + patch
    dr.scatter_add(matrix, mi.Float64(whole * step), slot, active)


def _integral(n_z: mi.Float, n_r: mi.Float, theta: mi.Float) -> mi.Float:
    """Integral from 0 to theta of (n_z cos + n_r sin) sin."""
    s, c = dr.sincos(theta)
    return 0.5 * (n_z * s * s + n_r * (theta - s * c))


def _wrapped(angle: mi.Float) -> mi.Float:
    """Angle in [-pi, pi)."""
    return angle - dr.two_pi * dr.floor(angle * dr.inv_two_pi + 0.5)


def view_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 4096,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """View matrices [S, G, K]: irradiance at each sensor per unit radiance of a window patch.

        E[s] = sum over g, k of V[s, g, k] L[g, k],   L = T D s

    Interreflection in the room is included (windows black), so a row sum is pi times the
    share of the sensor's view, direct and reflected, that ends on the windows.

    Args:
        surfaces: of the room, in the band of the radiances (visible or solar).
        points, directions: [S, 3] sensor positions [m] and normals.
        samples: paths for each sensor in each batch.
        max_depth: most bounces of a path; Russian roulette ends most before.
        cache: of traced matrices, `MatrixCache.of_user()`; none by default.

    Returns: an `Estimate` of shape [S, G, K] [sr, projected].

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase method);
    balance heuristic of Veach, Guibas 1995.
    """
    scenes = SceneCache() if scenes is None else scenes
    points, directions = sensors_of(points, directions)
    tracer = scenes.scene(surfaces, groups)
    bins = DirectionBins(basis)
    S, n = len(points), int(samples)
    if S * n >= 2**32:
        raise ValueError(f"{S} sensors x {n} samples: a batch must stay below 2**32 paths")
    place = vectors(points - tracer.centre, mi.Point3f)
    normal = vectors(directions)
    shape = (S, len(groups), bins.size)
    blocks = np.array_split(np.arange(S, dtype=np.uint32), -(-S // MOST_SENSORS))

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(math.prod(shape))
        key = batch_key(seed, number)
        _add_direct(tracer, bins, matrix, place, normal, samples=n, key=key)
        values = sums_of(matrix, (S, len(groups) * bins.size))
        for block, sensors in enumerate(blocks if max_depth > 1 else []):
            chosen = column(sensors, mi.UInt32)
            here = [dr.gather(type(of), of, chosen) for of in (place, normal)]
            block_key = mi.sample_tea_32(key, mi.UInt32(block))[0]
            hits, paths = shares(len(sensors), n)
            values[sensors] += indirect_rows(
                tracer, bins, *here, hits=hits, paths=paths, max_depth=max_depth, key=block_key
            )
            if tracer.gloss is not None:
                values[sensors] += mirrored_rows(
                    tracer, bins, *here, samples=n, max_depth=max_depth, key=block_key
                )
        return values.reshape(shape)

    return accumulate(
        batch,
        stopping=stopping,
        label="view matrix",
        progress=progress,
        entry=cache_entry(
            cache, "view matrix", surfaces, groups, points, directions, basis, n, max_depth,
            seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def _add_direct(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    place: mi.Point3f,
    normal: mi.Vector3f,
    *,
    samples: int,
    key: mi.UInt32,
) -> None:
    """Add the windows that each sensor sees, patch by patch."""
    S, T, K = dr.width(place), tracer.window_triangles, bins.size
    strata = max(LEAST_STRATA, DIRECT_SHARE * samples // (T * K))
    of_sensor = T * K * strata
    block = max(1, BLOCK_LANES // of_sensor)
    for first in range(0, S, block):
        lane = dr.arange(mi.UInt32, min(block, S - first) * of_sensor)
        lane += dr.opaque(mi.UInt32, first * of_sensor)
        cell = lane // dr.opaque(mi.UInt32, strata)
        view = cell // bins.size
        sensor = view // T
        generator = path_generator(lane, key ^ mi.UInt32(0x5BD1E995))
        add_window_light(
            tracer,
            bins,
            matrix,
            sensor,
            dr.gather(mi.Point3f, place, sensor),
            dr.gather(mi.Vector3f, normal, sensor),
            triangle=view - sensor * T,
            patch=cell - view * bins.size,
            stratum=lane - cell * dr.opaque(mi.UInt32, strata),
            strata=dr.opaque(mi.UInt32, strata),
            u=mi.Point2f(generator.next_float32(), generator.next_float32()),
        )
