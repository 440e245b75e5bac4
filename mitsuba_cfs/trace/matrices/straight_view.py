"""View of the outdoors through the windows' straight beam, point by point, at sensors.

The phase methods resolve the outdoors by Klems patches, 10 to 15 degrees wide, and by the mean over
a window.  Behind clear glass a sensor sees the edge of a roof sharply.

The share of a sensor's view that leaves the room through no window shows the leaks of its model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.matrices.stored_parts import MOST_STORED, Arrays, parts_of, stored_or_computed
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, even_numbers, points_on_triangles
from mitsuba_cfs.trace.kernels.bins import SkyBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.random_walk import PathStarts, roulette
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
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.matrices.daylight import add_daylight_paths

SIDES = ("west", "east", "south", "north", "floor", "ceiling")  # of the box round a room
FIGURES = 4  # share, and share times x, y, z
BATCHES = 4


@dataclass(frozen=True, slots=True)
class Escape:
    """Shares of the sensors' view, direct and reflected, that leave the room through leaks."""

    share: NDArray[np.float64]  # [S] of what a sensor sees
    error: NDArray[np.float64]  # [S] standard error
    by_side: NDArray[np.float64]  # [S, 6] by the side (`SIDES`) of the box round the room
    place: NDArray[np.float64]  # [6, 3] mean point of each side where it is left [m]; NaN if never


def escaped_view(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    samples: int = 1024,
    max_depth: int = 16,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Escape:
    """Share of each sensor's view that meets neither a surface nor a window, and its points.

        share[s] = 1/pi integral over the directions that leave, + rho times that of the hits

    A row sum of V over pi, this and what the room absorbs make 1.  These are paths of their own,
    few of them: the view matrix is the same with and without.

    Args:
        surfaces, groups, points, directions: as of `view_matrix`.
        samples: paths of each sensor in each of 4 batches.
    """
    paths = PathOptions(int(samples), max_depth, Stopping(batches=BATCHES), seed, progress, cache)
    points, directions = sensors_of(points, directions)
    tracer = paths.scenes.scene(surfaces, groups)
    corners = np.concatenate([surfaces.triangles, *(w.triangles for group in groups for w in group.windows)]).reshape(
        -1, 3
    )
    box = [tracer.place(f(axis=0)) for f in (corners.min, corners.max)]
    S, n = len(points), paths.samples
    place = vectors(points - tracer.centre, mi.Point3f)
    normal = vectors(directions)
    shape = (S, len(SIDES), FIGURES)

    def batch(number: int) -> NDArray[np.float64]:
        sums = empty_sums(math.prod(shape))
        count = dr.opaque(mi.UInt32, n)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(sensor, key ^ mi.UInt32(0x1F83D9AB))[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(path - sensor * count, stream, 0))
        starts = PathStarts(
            sensor,
            mi.Point3f(dr.gather(mi.Point3f, place, sensor)),
            mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local),
            path_generator(path, key ^ mi.UInt32(0x5BE0CD19)),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        _add_escapes(tracer, *box, sums, starts)
        return sums_of(sums, shape) / n

    estimate = paths.estimate("escape", batch, surfaces, groups, points, directions, by=__name__)
    return _escape(estimate, tracer.centre)


def _escape(estimate: Estimate, centre: NDArray[np.float64]) -> Escape:
    """Shares and points from the sums [S, 6, 4]."""
    by_side = estimate.values[..., 0]
    total = estimate.values.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        place = total[:, 1:] / total[:, :1] + centre
    error = np.sqrt((estimate.standard_error[..., 0] ** 2).sum(axis=1))
    return Escape(by_side.sum(axis=1), error, by_side, place)


@dr.syntax
def _add_escapes(
    tracer: TracedScene,
    low: mi.Point3f,  # corners of the box round the room
    high: mi.Point3f,
    sums: mi.Float64,  # [rows * 6 * 4], accumulated in place
    starts: PathStarts,
) -> None:
    """Follow each path until it meets a window or nothing, is absorbed or too deep."""
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    beta = mi.Float(1.0)  # product of reflectances
    depth = mi.UInt32(0)  # bounces so far
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)

        # ----- It met nothing: where it leaves the box -----
        lost = active & ~hit.is_valid()
        end = dr.select(direction > 0, high, low)
        way = dr.select(dr.abs(direction) > 1e-8, (end - position) / direction, dr.inf)
        t = dr.maximum(dr.minimum(way.x, dr.minimum(way.y, way.z)), 0.0)
        axis = dr.select(
            way.x <= dr.minimum(way.y, way.z), mi.UInt32(0), dr.select(way.y <= way.z, mi.UInt32(1), mi.UInt32(2))
        )
        along = dr.select(axis == 0, direction.x, dr.select(axis == 1, direction.y, direction.z))
        side = 2 * axis + dr.select(along > 0, mi.UInt32(1), mi.UInt32(0))
        slot = (row * 6 + side) * 4
        exit = position + direction * t
        dr.scatter_add(sums, mi.Float64(beta), slot, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.x), slot + 1, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.y), slot + 2, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.z), slot + 3, lost)

        # ----- Bounce off what is no window; Russian roulette -----
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)
        active &= group == OPAQUE
        position, direction, reflectance, _ = tracer.bounce(hit, position, direction, generator, active)
        depth += 1
        alive, beta = roulette(beta * reflectance, depth, generator)
        active &= alive & (depth < max_depth)


FAR = 0.5  # of the root of a group's area, from which all rays are drawn to its area
POINTS = 64  # of a window, for its distance


@dataclass(frozen=True, slots=True)
class OpenView:
    """Rays of sensors straight through an open window group to the sky in one batch, axis r."""

    ray: NDArray[np.uint32]  # [r] numbers: sensor * samples + sample
    weight: NDArray[np.float32]  # [r] [sr, projected] times the reflectances outdoors
    patch: NDArray[np.unsignedinteger]  # [r] of the sky

    @classmethod
    def of(cls, weight: NDArray[np.float64], patch: NDArray[np.uint32], most: int) -> OpenView:
        """From the weights of all rays, 0 where one does not come to the sky, and their patches of so many."""
        ray = np.flatnonzero(weight > 0)
        smallest = np.min_scalar_type(most - 1)
        return cls(ray.astype(np.uint32), weight[ray].astype(np.float32), patch[ray].astype(smallest))

    @property
    def nbytes(self) -> int:
        """Memory."""
        return self.ray.nbytes + self.weight.nbytes + self.patch.nbytes

    def arrays(self) -> Arrays:
        """The arrays of a file."""
        return {"ray": self.ray, "weight": self.weight, "patch": self.patch}


def straight_view_matrix(
    interior: Surfaces,
    exterior: Surfaces,
    groups: Sequence[WindowGroup],
    scattering: Sequence[Scattering | None],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    paths: PathOptions,
    subdivision: int = 4,
) -> Estimate:
    """Illuminance at each sensor per unit luminance of each sky patch [G, S, P] [sr, projected].

        B[g, s, p] = integral over the visible part of g of cosine tau(omega) R(x, omega, p) d omega

    R is the radiance that arrives from outdoors along omega at x per unit of the patch, with all
    reflections outdoors; the room reflects nothing.  Rays are traced through open windows and
    cached for all systems, which add tau.

    Args:
        scattering: of each group's system; None leaves a group out.
        paths: from points on each group to each sensor; a depth of 1 for direct sky light only.
    """
    points, directions = sensors_of(points, directions)
    sky, S, n = SkyBins(ReinhartSky(subdivision)), len(points), paths.samples
    inputs = interior, exterior, groups, points, directions, subdivision
    inside, outside = (paths.scenes.scene(surfaces, groups) for surfaces in (interior, exterior))
    rays = _SensorRays(inside, outside, (points, directions), sky, paths, inputs=inputs)

    def one_group(g: int, system: Scattering, number: int) -> NDArray[np.float64]:
        view = rays.to_sky(g, number)
        if not len(view.ray):  # no sensor sees the sky through it
            return np.zeros((S, sky.size))
        tau = np.broadcast_to(system.through(rays.local(g, number, view.ray)).numpy(), len(view.ray))
        slot = (view.ray // np.uint32(n)).astype(np.int64) * sky.size + view.patch
        light = np.bincount(slot, view.weight * tau.astype(float), S * sky.size)
        return light.reshape(S, sky.size) / n

    def batch(number: int) -> NDArray[np.float64]:
        nothing = np.zeros((S, sky.size))
        return np.stack(
            [nothing if system is None else one_group(g, system, number) for g, system in enumerate(scattering)]
        )

    keys = [None if system is None else system.key for system in scattering]
    return paths.estimate("straight view", batch, *inputs, keys, by=__name__)


class _SensorRays:
    """Rays of sensors straight through open window groups to the sky, from the cache or traced."""

    def __init__(
        self,
        inside: TracedScene,
        outside: TracedScene,
        sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
        sky: SkyBins,
        paths: PathOptions,
        *,
        inputs: tuple[object, ...],  # all else that they depend on
    ) -> None:
        self._inside, self._outside, self._sensors, self._sky = inside, outside, sensors, sky
        self._paths, self._inputs = paths, inputs
        self._stopping = paths.stopping or Stopping()
        self._ready: dict[tuple[int, int], OpenView] = {}  # by group and number of the batch

    def to_sky(self, group: int, number: int) -> OpenView:
        """The rays of a group in a batch that come to the sky."""
        if (group, number) not in self._ready:
            count = self._stopping.ahead(number)
            entry = self._paths.entry("open view", *self._inputs, group, number, count, by=__name__)
            views = stored_or_computed(
                entry,
                _views_of,
                lambda: self._traced(group, number, count),
                lambda traced: [view.arrays() for view in traced],
            )
            self._ready.update({(group, number + i): view for i, view in enumerate(views)})
        return self._ready.pop((group, number))

    def local(self, group: int, number: int, rays: NDArray[np.uint32]) -> mi.Vector3f:
        """Directions of rays of a batch [r, 3] in the group's frame."""
        inside, key = self._inside, _stream(batch_key(self._paths.seed, number), group)
        ray = column(rays, mi.UInt32)
        return inside.to_group(group, _Aims(inside, group, ray, self._sensors, self._paths.samples, key).omega)

    def _traced(self, group: int, first: int, count: int) -> list[OpenView]:
        """Rays of so many batches, or of some where these are as much as a file may hold."""
        views: list[OpenView] = []
        while len(views) < count and sum(view.nbytes for view in views) <= MOST_STORED:
            views.append(self._trace(group, batch_key(self._paths.seed, first + len(views))))
        return views

    def _trace(self, group: int, key: mi.UInt32) -> OpenView:
        rays = len(self._sensors[0]) * self._paths.samples
        light, patches = empty_sums(rays), dr.zeros(mi.UInt32, rays)
        stream = _stream(key, group)
        _, start, omega, weight = straight_rays(self._inside, group, self._sensors, self._paths.samples, stream)
        ray = dr.arange(mi.UInt32, rays)
        depth = dr.opaque(mi.UInt32, self._paths.max_depth)
        starts = PathStarts(ray, start, omega, path_generator(ray, key), depth, weight > 0)
        add_daylight_paths(self._outside, self._sky, light, starts, weight, patches)
        dr.eval(light, patches)
        return OpenView.of(sums_of(light, (rays,)), patches.numpy(), self._sky.size)


def _views_of(data: Arrays) -> list[OpenView] | None:
    return [OpenView(one["ray"], one["weight"], one["patch"]) for one in parts_of(data)] or None


def _stream(key: mi.UInt32, group: int) -> mi.UInt32:
    """Key of the random numbers of a group in a batch."""
    return key ^ opaque(0x510E527F + group, mi.UInt32)


class _Aims:
    """Where rays of sensors [r] to a window group are sent, before anything is traced."""

    def __init__(
        self,
        inside: TracedScene,
        group: int,
        ray: mi.UInt32,  # [r] numbers: sensor * samples + sample
        sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
        samples: int,
        key: mi.UInt32,
    ) -> None:
        place, normal = (np.atleast_2d(v) for v in sensors)
        count = dr.opaque(mi.UInt32, samples)
        self.sensor = ray // count
        number = ray - self.sensor * count
        u = lattice_2d(number, mi.sample_tea_32(self.sensor, key)[0], 0)
        self.start = dr.gather(mi.Point3f, vectors(place - inside.centre, mi.Point3f), self.sensor)
        self.away = dr.gather(mi.Vector3f, vectors(normal), self.sensor)
        by_area = mi.Float(hemisphere_shares(inside.groups[group], place).astype(np.float32))
        self.share = dr.gather(mi.Float, by_area, self.sensor)
        self.by_cosine = mi.Float(number) < self.share * mi.Float(count)
        self.to_target = inside.sample_group(group, u) - self.start
        turned = mi.Frame3f(self.away).to_world(mi.warp.square_to_cosine_hemisphere(u))
        self.omega = mi.Vector3f(dr.select(self.by_cosine, turned, dr.normalize(self.to_target)))


def straight_rays(
    inside: TracedScene,
    group: int,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    samples: int,
    key: mi.UInt32,
) -> tuple[mi.UInt32, mi.Point3f, mi.Vector3f, mi.Float]:
    """Rays of sensors [S * samples] straight through an open window group.

    Some are drawn to points of the group's area, others by the sensor's cosine: the former alone
    are as noisy as the inverse square of the distance near the glass (balance heuristic of Veach,
    Guibas 1995, with `hemisphere_shares`).

    Args: sensors: positions and normals [S, 3].

    Returns: sensor, start just outdoors, direction; the weight [sr, projected] of a
    ray times the samples, 0 where the sensor does not see the window.
    """
    ray = dr.arange(mi.UInt32, len(np.atleast_2d(sensors[0])) * samples)
    aims = _Aims(inside, group, ray, sensors, samples, key)
    start, omega, by_cosine, share = aims.start, aims.omega, aims.by_cosine, aims.share
    reach = dr.select(by_cosine, dr.largest(mi.Float), dr.norm(aims.to_target) * (1 - 1e-4))
    hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(start, omega, reach, 0.0, []), coherent=False, active=True)
    is_window = dr.gather(mi.Int32, inside.group, hit.prim_index, hit.is_valid()) == opaque(group, mi.Int32)
    distance = dr.select(by_cosine, hit.t, dr.norm(aims.to_target))
    local = inside.to_group(group, omega)
    cosine = dr.dot(aims.away, omega)
    seen = (cosine > 0) & (local.z > 1e-4)
    seen &= dr.select(by_cosine, hit.is_valid() & is_window, ~hit.is_valid())
    area = opaque(inside.groups[group].area)
    density = (1 - share) * dr.square(distance) / (area * local.z) + share * cosine * dr.inv_pi
    target = start + omega * dr.select(seen, distance, 0)
    beyond = mi.Point3f(target + inside.outward(opaque(group, mi.Int32), mi.Bool(True)))
    return aims.sensor, beyond, omega, dr.select(seen, cosine / density, 0.0)


def hemisphere_shares(group: WindowGroup, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share [S] of a sensor's rays that are drawn by its cosine: 1/2 at the glass, 0 far from it.

    Far is half the root of the group's area.
    """
    reach = FAR * np.sqrt(group.area)
    nearest = np.full(len(places), np.inf)
    for window in group.windows:
        points = points_on_triangles(window.triangles, even_numbers(POINTS))[0]
        apart = places[:, None] - points
        across = np.linalg.norm(apart, axis=2).min(axis=1)
        normal = np.abs(apart @ window.normal).min(axis=1)
        nearest = np.minimum(nearest, np.where(across < reach, normal, across))
    return np.asarray(0.5 * np.clip(1.0 - nearest / reach, 0.0, 1.0))
