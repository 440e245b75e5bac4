"""View matrices V: irradiance at sensors, or radiance of pixels, per unit radiance of a patch.

V = direct part + interreflection.  The direct part is integrated over each patch of each window
(`add_window_light`).  The interreflection is sampled for many sensors together: the points that the
rays of one sensor meet serve the others too (`indirect_rows`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import SurfaceGroups, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.bounce_counts import MOST_BOUNCES, BounceCounts
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.rooms import TracedRoom, of_rooms, surface_counts
from mitsuba_cfs.trace.kernels.sampling import (
    Ranges,
    batch_key,
    column,
    empty_sums,
    lattice_2d,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.kernels.view_paths import add_mirrored, add_view_paths

MOST_SENSORS = 64  # that share hits; more cost more than they save
RAYS_OF_PATH = 4  # shadow rays and bounces, on average
STEEPEST = 1e4  # tangent of the largest polar angle
NEWTON_STEPS = 3  # the integrand is nearly linear within a ring
DIRECT_SHARE = 2  # strata of the direct part for each path of a sensor
LEAST_STRATA = 4  # their error falls with the power 1.5
COARSE = 64  # paths of a sensor for each of these least strata
BLOCK_LANES = 1 << 26
ROW_ENTRIES = 1 << 23  # of the rows of hits that are traced at once


def shares(sensors: int, samples: int) -> tuple[int, int]:
    """Hits of each sensor, and paths from each hit, at about the cost of `samples` paths.

    Each hit costs a shadow ray to every sensor and its paths; the more sensors share a hit, the
    more paths it deserves.
    """
    paths = max(1, sensors // 8)
    hits = max(1, round(RAYS_OF_PATH * samples / (1 + sensors + RAYS_OF_PATH * paths)))
    return hits, paths


@dataclass(frozen=True, slots=True)
class _Sensors:
    """The sensors of the rooms of one scene, and where the matrix has the row of each."""

    tracer: TracedScene
    bins: DirectionBins
    place: mi.Point3f  # [S] those of one room after the other
    normal: mi.Vector3f  # [S]
    entry: mi.UInt32  # [S] of the matrix, as `add_view_paths` takes it
    room: mi.UInt32  # [S]
    counts: NDArray[np.int64]  # [R] sensors of each room
    widths: NDArray[np.int64]  # [R] entries of a row
    entries: NDArray[np.int64]  # [R] where the room's rows begin; as many again at the end
    by_groups: tuple[SurfaceGroups, ...] = ()  # [R] whose reflectances V is derived by; none: by none
    surfaces: tuple[int, ...] = ()  # [R] numbers of surfaces of each room

    @classmethod
    def of(
        cls,
        tracer: TracedScene,
        bins: DirectionBins,
        rooms: Sequence[TracedRoom],
        by_groups: Sequence[SurfaceGroups] = (),
    ) -> _Sensors:
        """The sensors of the rooms of a scene."""
        counts = np.array([len(room.points) for room in rooms])
        widths = bins.size * np.array([len(room.groups) for room in rooms])
        entries = np.cumsum([0, *(counts * widths)])
        number = [np.arange(count) for count in counts]
        firsts = np.cumsum(widths) - widths  # of the patches of each room's first group
        rows = [e - f + n * w for e, f, n, w in zip(entries, firsts, number, widths, strict=False)]
        points = np.concatenate([room.points for room in rooms])
        return cls(
            tracer,
            bins,
            vectors(points - tracer.centre, mi.Point3f),
            vectors(np.concatenate([room.directions for room in rooms])),
            column(np.concatenate(rows) & 0xFFFFFFFF, mi.UInt32),
            column(np.repeat(np.arange(len(rooms)), counts), mi.UInt32),
            counts,
            widths,
            entries,
            tuple(by_groups),
            tuple(surface_counts([room.surfaces for room in rooms])),
        )

    @property
    def layers(self) -> int:
        """Of matrices: V, and its derivatives."""
        return 1 + (len(self.by_groups[0].names) if self.by_groups else 0)

    def bounces(self, stride: int) -> BounceCounts | None:
        """What adds derivatives to layers of so many entries; None without derivatives."""
        return BounceCounts(self.by_groups, self.surfaces, stride) if self.by_groups else None

    @property
    def firsts(self) -> NDArray[np.int64]:
        """The first sensor of each room [R]."""
        return np.cumsum(self.counts) - self.counts

    def blocks(self, samples: int) -> list[_Block]:
        """The sensors that share hits."""
        blocks = []
        for room, (count, first) in enumerate(zip(self.counts, self.firsts, strict=True)):
            parts = np.array_split(np.arange(first, first + count), -(-count // MOST_SENSORS))
            for number, part in enumerate(parts):
                hits, paths = shares(len(part), samples)
                blocks.append(_Block(room, number, int(part[0]), len(part), hits, paths))
        return blocks


@dataclass(frozen=True, slots=True)
class _Block:
    """Sensors of a room that share hits."""

    room: int
    number: int  # among those of its room
    first: int  # sensor
    sensors: int
    hits: int  # of each sensor
    paths: int  # of each hit

    @property
    def points(self) -> int:
        """Hits of all its sensors."""
        return self.sensors * self.hits


def _launches(of: _Sensors, blocks: Sequence[_Block]) -> Iterator[list[_Block]]:
    """Blocks that are traced together: as many as memory allows."""
    launch: list[_Block] = []
    total = 0
    for block in blocks:
        size = block.points * int(of.widths[block.room]) * of.layers
        if launch and total + size > ROW_ENTRIES:
            yield launch
            launch, total = [], 0
        launch.append(block)
        total += size
    yield launch


def indirect_rows(
    of: _Sensors, blocks: Sequence[_Block], *, max_depth: int, key: mi.UInt32
) -> list[NDArray[np.float64]]:
    """Interreflected part of the view matrix of some blocks of sensors [N, C, G * K] each.

    N are the matrix and its derivatives by the reflectances of groups of surfaces.

    Each sensor's cosine-distributed rays meet the room in `hits` points.  At every point x the
    row of its own irradiance, V(x), is estimated by `paths` paths; every sensor s takes all points
    of all sensors of its block with the weight of the balance heuristic over these,

        V[s] += sum over x of rho(x) V(x) G(s, x) / (hits sum over s' of G(s', x)),

    G the cosines over the squared distance where s sees x.  The sum is over what the mixture of
    all sensors' rays would sample x with, so no near wall makes it large.

    Source: Veach, Guibas 1995 (balance heuristic); Bekaert, Sbert, Halton 2002, "Accelerating path
    tracing by re-using paths" (the same among pixels).
    """
    tracer = of.tracer
    points = np.array([block.points for block in blocks])
    hits = column([block.hits for block in blocks], mi.UInt32)
    numbers = column([block.number for block in blocks], mi.UInt32)
    first = column([block.first for block in blocks], mi.UInt32)
    first_point = column(np.cumsum(points) - points, mi.UInt32)

    def key_of(block: mi.UInt32) -> mi.UInt32:
        return mi.sample_tea_32(key, dr.gather(mi.UInt32, numbers, block))[0]

    position, face, weight, triangle = _hits(of, Ranges(points), key_of, first, hits)
    pairs = Ranges(points * [block.sensors for block in blocks])
    exchange, slant, point = _exchange(
        of, pairs, (column(points, mi.UInt32), first_point, first, hits), (position, face)
    )
    exchange, left = exchange.numpy(), None
    if tracer.gloss is not None:  # of the diffuse reflectance, by the angle that a sensor sees
        left = tracer.gloss.diffuse_share(dr.gather(mi.UInt32, triangle, point), slant, True)
        left = left.numpy()

    widths = of.widths[[block.room for block in blocks]]
    entries = np.cumsum([0, *(points * widths)])
    size, counter = int(entries[-1]), of.bounces(int(entries[-1]))
    rows = empty_sums(of.layers * size)
    paths = Ranges(points * [block.paths for block in blocks])
    _add_paths(
        of,
        rows,
        paths,
        blocks,
        entries[:-1],
        (position, face, weight, triangle),
        bounces=counter,
        first_point=first_point,
        max_depth=max_depth,
        key_of=key_of,
    )
    rows, weight = sums_of(rows, (of.layers, size)), weight.numpy()
    estimates, ends = [], np.cumsum(points)
    for i, block in enumerate(blocks):
        shape = block.sensors, block.points
        some = slice(pairs.firsts[i], pairs.firsts[i] + math.prod(shape))
        seen = exchange[some].reshape(shape)
        total = seen.sum(axis=0)
        share = weight[ends[i] - block.points : ends[i]]
        share = share / (block.hits * np.where(total > 0, total, 1.0))
        if left is not None:
            seen = seen * left[some].reshape(shape)
        of_block = rows[:, entries[i] : entries[i + 1]].reshape(of.layers, block.points, -1)
        estimates.append((seen * share) @ of_block)
    return estimates


def _add_paths(
    of: _Sensors,
    rows: mi.Float64,
    paths: Ranges,
    blocks: Sequence[_Block],
    entries: NDArray[np.int64],
    points: tuple[mi.Point3f, mi.Vector3f, mi.Float, mi.UInt32],
    *,
    bounces: BounceCounts | None,
    first_point: mi.UInt32,
    max_depth: int,
    key_of: Callable[[mi.UInt32], mi.UInt32],
) -> None:
    """Add the row of irradiance at each point of some blocks.

    Args: points: position, normal, reflectance and triangle; first_point: of each block.
    """
    room = np.array([block.room for block in blocks])
    count = np.array([block.paths for block in blocks])
    before = np.cumsum(of.widths) - of.widths  # patches of the groups of earlier rooms
    begins = column(entries - before[room] & 0xFFFFFFFF, mi.UInt32)
    tables = (column(values, mi.UInt32) for values in (count, of.widths[room], room))
    path = dr.arange(mi.UInt32, paths.total)
    block, path = paths.of(path)
    each, width, of_room = (dr.gather(mi.UInt32, table, block) for table in tables)
    each = dr.maximum(each, 1)  # where no lane is, too
    hit, key = path // each, key_of(block)
    point = hit + dr.gather(mi.UInt32, first_point, block)
    position, face, weight, triangle = points
    active, counted = dr.gather(mi.Float, weight, point) > 0, None
    if bounces is not None:
        counted = bounces.met(of.tracer, dr.gather(mi.UInt32, triangle, point), active)
    add_view_paths(
        of.tracer,
        of.bins,
        rows,
        dr.gather(mi.UInt32, begins, block) + hit * width,
        dr.gather(mi.Point3f, position, point),
        dr.gather(mi.Vector3f, face, point),
        later=dr.opaque(mi.UInt32, 0),
        beta=dr.gather(mi.Float, column(1 / count), block),
        sample=path - hit * each,
        stream=mi.sample_tea_32(hit, key ^ mi.UInt32(0x3C6EF372))[0],
        generator=path_generator(path, key ^ mi.UInt32(0xA54FF53A)),
        max_depth=dr.opaque(mi.UInt32, max_depth - 1),
        active=active,
        carried=dr.gather(mi.Float, weight, point),
        mirrored=None,
        light=None,
        room=of_room,
        bounces=bounces,
        counted=counted,
    )


def _hits(
    of: _Sensors, points: Ranges, key_of: Callable[[mi.UInt32], mi.UInt32], first: mi.UInt32, hits: mi.UInt32
) -> tuple[mi.Point3f, mi.Vector3f, mi.Float, mi.UInt32]:
    """Points [M], their normals, diffuse reflectances and triangles.

    The reflectance, that at normal incidence, is 0 where a ray met a window or nothing.

    Args: first, hits: first sensor of each block, and hits of each of its sensors.
    """
    tracer = of.tracer
    block, number = points.of(dr.arange(mi.UInt32, points.total))
    count = dr.maximum(dr.gather(mi.UInt32, hits, block), 1)
    local = number // count
    stream = mi.sample_tea_32(local, key_of(block) ^ mi.UInt32(0xBB67AE85))[0]
    away = mi.warp.square_to_cosine_hemisphere(lattice_2d(number - local * count, stream, 0))
    sensor = local + dr.gather(mi.UInt32, first, block)
    direction = mi.Frame3f(dr.gather(mi.Vector3f, of.normal, sensor)).to_world(away)
    start = dr.gather(mi.Point3f, of.place, sensor)
    ray = tracer.ray(start, direction)
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
    of: _Sensors, pairs: Ranges, blocks: tuple[mi.UInt32, ...], points: tuple[mi.Point3f, mi.Vector3f]
) -> tuple[mi.Float, mi.Float, mi.UInt32]:
    """G of the sensors and points of each block: cosines over squared distance where one sees one.

    Args: blocks: their number of points, first point, first sensor, hits of each sensor.

    Returns: G, the point's cosine, and the point.
    """
    block, pair = pairs.of(dr.arange(mi.UInt32, pairs.total))
    count, first, sensor, hits = (dr.gather(mi.UInt32, table, block) for table in blocks)
    count, hits = dr.maximum(count, 1), dr.maximum(hits, 1)
    local = pair // count
    of_block = pair - local * count
    point, sensor = first + of_block, sensor + local
    start = dr.gather(mi.Point3f, of.place, sensor)
    to_point = dr.gather(mi.Point3f, points[0], point) - start
    distance2 = dr.squared_norm(to_point)
    distance = dr.sqrt(distance2)
    omega = to_point / distance
    cosines = dr.maximum(dr.dot(dr.gather(mi.Vector3f, of.normal, sensor), omega), 0)
    slant = -dr.dot(dr.gather(mi.Vector3f, points[1], point), omega)
    cosines *= dr.maximum(slant, 0)
    shadow = mi.Ray3f(start, omega, distance * (1 - 1e-4), 0.0, [])
    own = of_block // hits == local  # seen, whatever rounding says
    seen = cosines > 0  # false for a ray that has left through a seam: its point is nowhere
    seen &= ~of.tracer.scene.ray_test(shadow, coherent=False, active=seen & ~own)
    return dr.select(seen, cosines / distance2, 0.0), slant, point


def _add_mirrored(of: _Sensors, matrix: mi.Float64, *, samples: int, max_depth: int, key: mi.UInt32) -> None:
    """Add what the gloss of the first surfaces reflects to the view matrix."""
    tracer = of.tracer
    lanes = Ranges(of.counts * samples)
    firsts, count = column(of.firsts, mi.UInt32), dr.opaque(mi.UInt32, samples)
    for first in range(0, lanes.total, BLOCK_LANES):
        lane = dr.arange(mi.UInt32, min(BLOCK_LANES, lanes.total - first))
        room, path = lanes.of(lane + dr.opaque(mi.UInt32, first))
        in_room = path // count
        sensor = in_room + dr.gather(mi.UInt32, firsts, room)
        sample = path - in_room * count
        stream = mi.sample_tea_32(in_room, key ^ mi.UInt32(0x510E527F))[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(sample, stream, 0))
        start = dr.gather(mi.Point3f, of.place, sensor)
        away = mi.Frame3f(dr.gather(mi.Vector3f, of.normal, sensor)).to_world(local)
        hit = tracer.scene.ray_intersect_preliminary(tracer.ray(start, away), coherent=False, active=True)
        add_mirrored(
            tracer,
            of.bins,
            matrix,
            hit,
            start,
            away,
            entry=dr.gather(mi.UInt32, of.entry, sensor),
            later=dr.opaque(mi.UInt32, 0),
            beta=dr.opaque(mi.Float, np.pi / samples),
            sample=sample,
            stream=stream,
            generator=path_generator(path, key ^ mi.UInt32(0x9B05688C)),
            max_depth=dr.opaque(mi.UInt32, max_depth - 1),
            active=hit.is_valid(),
            room=room,
            bounces=of.bounces(int(of.entries[-1])),
        )


@dr.syntax
def add_window_light(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,  # rows of G * K entries, accumulated in place
    entry: mi.UInt32,  # of the lane's row, as of `add_view_paths`
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
    slot = entry + mi.UInt32(group) * bins.size + patch
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
    room = TracedRoom(surfaces, tuple(groups), *sensors_of(points, directions))
    (views,) = views_of_rooms(
        [room], PathOptions(int(samples), max_depth, stopping, seed, progress, cache), basis=basis
    )
    return views.whole


class RoomViews(NamedTuple):
    """View matrices of the sensors of a room [S, G, K], from the same rays."""

    whole: Estimate
    direct: Estimate | None  # without interreflection; None: not asked for
    by_reflectance: tuple[Estimate, ...]  # derivative by ln(rho) of each group of surfaces


def views_of_rooms(
    rooms: Sequence[TracedRoom],
    paths: PathOptions,
    *,
    with_direct: bool = False,
    direct: NDArray[np.float64] | None = None,
    by_groups: Sequence[SurfaceGroups] = (),
    basis: KlemsBasis = KLEMS_FULL,
) -> list[RoomViews]:
    """`view_matrix` of several rooms, traced together, and their direct parts from the same rays.

    The random numbers of a room do not depend on the other rooms: each matrix is that of the room
    alone but for the rounding of coordinates.

    Args:
        with_direct: the matrices with a depth of 1 besides, entry by entry a part of the others.
        direct: those [S, G, K] of a single room, where they are known: they are not traced again.
        by_groups: of the surfaces of each room, as many in each: derivatives by their reflectances, from
            the same paths; none by default.
    """
    max_depth = paths.max_depth
    bins, depths = DirectionBins(basis), (max_depth, 1) if with_direct else (max_depth,)
    if by_groups and max_depth > MOST_BOUNCES:
        raise ValueError(f"max_depth: at most {MOST_BOUNCES} with derivatives, got {max_depth}")
    groups = len(by_groups[0].names) if by_groups else 0
    derived = [(f"view matrix by reflectance {i}", max_depth) for i in range(groups)]
    layers = [*(("view matrix", depth) for depth in depths), *derived]
    entries = [
        replace(paths, max_depth=depth).entry(
            label,
            room.surfaces,
            room.groups,
            room.points,
            room.directions,
            basis,
            *(() if label == "view matrix" else (by_groups[number].number,)),
            by=__name__,
        )
        for label, depth in layers
        for number, room in enumerate(rooms)
    ]

    def traced(some: Sequence[int]) -> Callable[[int], NDArray[np.float64]]:
        placed, tracer = paths.scenes.together([rooms[i] for i in some])
        of = _Sensors.of(tracer, bins, placed, [by_groups[i] for i in some] if by_groups else ())
        return _batches(of, paths.samples, depths, paths.seed, direct)

    estimates = of_rooms(
        rooms,
        traced,
        entries,
        shapes=[(len(room.points), len(room.groups), bins.size) for room in rooms],
        stopping=paths.stopping,
        label="view matrix",
        progress=paths.progress,
        layers=len(layers),
    )
    of_layers = [estimates[i : i + len(rooms)] for i in range(0, len(estimates), len(rooms))]
    whole, apart = of_layers[0], of_layers[1] if with_direct else [None] * len(rooms)
    by_reflectance = zip(*of_layers[len(depths) :], strict=True) if groups else [()] * len(rooms)
    return [RoomViews(*views) for views in zip(whole, apart, map(tuple, by_reflectance), strict=True)]


def _batches(
    of: _Sensors, samples: int, depths: Sequence[int], seed: int, known: NDArray[np.float64] | None
) -> Callable[[int], NDArray[np.float64]]:
    """Batches of the rows of all rooms [S * G of each, K], those of each depth.

    Args: depths: most bounces; a second one is 1.  known: those of a depth of 1, which are not traced.
    """
    max_depth = depths[0]
    most = int(of.counts.max())
    if most * samples >= 2**32:
        raise ValueError(f"{most} sensors x {samples} samples: a batch must stay below 2**32 paths")
    blocks = of.blocks(samples) if max_depth > 1 else []

    def batch(number: int) -> NDArray[np.float64]:
        size = int(of.entries[-1])
        matrix = empty_sums(of.layers * size)
        key = batch_key(seed, number)
        if known is None:
            _add_direct(of, matrix, samples=samples, key=key)
        direct = [] if len(depths) == 1 else [np.array(sums_of(matrix, (size,)))]
        if of.tracer.gloss is not None and max_depth > 1:
            _add_mirrored(of, matrix, samples=samples, max_depth=max_depth, key=key)
        values = np.array(sums_of(matrix, (of.layers, size)))
        if known is not None:
            values[0] += known.ravel()
        for launch in _launches(of, blocks) if blocks else ():
            added = indirect_rows(of, launch, max_depth=max_depth, key=key)
            for block, rows in zip(launch, added, strict=True):
                first = of.entries[block.room]
                first += (block.first - of.firsts[block.room]) * of.widths[block.room]
                values[:, first : first + rows[0].size] += rows.reshape(of.layers, -1)
        return np.concatenate([values[0], *direct, *values[1:]]).reshape(-1, of.bins.size)

    return batch


def _add_direct(of: _Sensors, matrix: mi.Float64, *, samples: int, key: mi.UInt32) -> None:
    """Add the windows that each sensor sees, patch by patch."""
    K, triangles = of.bins.size, of.tracer.window_triangles
    least = min(max(samples // COARSE, 1), LEAST_STRATA)
    strata = np.maximum(least, DIRECT_SHARE * samples // (triangles * K))
    lanes = Ranges(of.counts * triangles * K * strata)
    tables = [column(values, mi.UInt32) for values in (strata, triangles, np.cumsum(triangles) - triangles, of.firsts)]
    for first in range(0, lanes.total, BLOCK_LANES):
        lane = dr.arange(mi.UInt32, min(BLOCK_LANES, lanes.total - first))
        room, lane = lanes.of(lane + dr.opaque(mi.UInt32, first))
        count, of_room, before, sensor = (dr.gather(mi.UInt32, table, room) for table in tables)
        count, of_room = dr.maximum(count, 1), dr.maximum(of_room, 1)
        cell = lane // count
        view = cell // K
        local = view // of_room
        sensor += local
        generator = path_generator(lane, key ^ mi.UInt32(0x5BD1E995))
        add_window_light(
            of.tracer,
            of.bins,
            matrix,
            dr.gather(mi.UInt32, of.entry, sensor),
            dr.gather(mi.Point3f, of.place, sensor),
            dr.gather(mi.Vector3f, of.normal, sensor),
            triangle=before + view - local * of_room,
            patch=cell - view * K,
            stratum=lane - cell * count,
            strata=count,
            u=mi.Point2f(generator.next_float32(), generator.next_float32()),
        )
