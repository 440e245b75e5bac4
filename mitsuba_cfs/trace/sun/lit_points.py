"""The sun at points on surfaces, and the points whose reflected light reaches a point.

The light that reaches a point x by reflection is the mean over cosine-sampled paths from it,

    E(x) = mean of sum over the points y that a path meets, product of rho up to y, E_sun(y)

and a shadow ray to the sun's disc gives E_sun(y) (`sunlight`).  Gloss counts as diffuse here, so
that no light is lost.  Where E_sun includes the sun in smooth mirrors, the mirrors' own reflection
of the sun does not count.

Source: Kajiya 1986, "The rendering equation", with next-event estimation of the sun.

`sunlight_of_many` is for the thousands of suns of a year, whose neighbours mostly reach the same
points.  Each point has rays to the nodes of a grid fixed on the sphere.  Where the three nodes
about a sun agree, the sun has their visibility; where they do not, it gets a ray of its own.  One
in `CHECKED` of the pairs whose nodes agree gets a ray too, which corrects for all of them:

    share = s                       nodes agree; s = sum over them of a_i v(n_i)
            s + CHECKED (v - s)     nodes agree, and the pair of point and sun is checked
            v                       nodes do not agree

Obstacles thinner than the grid so have the right mean, with noise in place of a bias.  Grid and
checks depend on the sun's direction alone: the light of an hour does not depend on other hours.

Source: control variates, Hammersley and Handscomb 1964, "Monte Carlo Methods", section 5.5; the
grid is even in Lambert's azimuthal equal-area projection (Snyder 1987, "Map projections", 24).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, path_generator, tables, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.specular_paths import SPREAD, SpecularPath, SpecularPaths, specular_sun_paths

BOUNCES = 5  # surfaces that a path meets at most
ROULETTE = 0.5  # share of light below which paths are thinned out
STEP = float(np.radians(4.0))  # between nodes, about the zenith
CHECKED = 8  # of places whose nodes agree, one in so many has a ray to the sun itself
MIRRORED = 32  # the same of the sun in a mirror, which few places have
ROUNDING = 1e-5  # of a cosine in a kernel beside NumPy's, at most
LANES = 2**22  # rays to nodes at once
KEY = 2**32  # of a node's number along one axis, to hold both


@dataclass(frozen=True)
class SurfacePoints:
    """Points on surfaces, each with the normal of the side that is meant."""

    point: NDArray[np.float32]  # [m, 3] in the tracer's coordinates, clear of the surface
    normal: NDArray[np.float32]  # [m, 3] unit

    @property
    def size(self) -> int:
        """Number of points."""
        return len(self.point)

    def some(self, chosen: NDArray) -> SurfacePoints:
        """Some of the points, by number or mask."""
        number = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return SurfacePoints(self.point.take(number, axis=0), self.normal.take(number, axis=0))

    def points(self) -> mi.Point3f:
        """The points as a kernel takes them."""
        return vectors(self.point, mi.Point3f)

    def normals(self) -> mi.Vector3f:
        """The normals as a kernel takes them."""
        return vectors(self.normal)

    @staticmethod
    def joined(parts: list[SurfacePoints]) -> SurfacePoints:
        """The points of all parts."""
        nowhere = np.empty((0, 3), dtype=np.float32)
        return SurfacePoints(
            np.concatenate([nowhere, *(p.point for p in parts)]), np.concatenate([nowhere, *(p.normal for p in parts)])
        )


@dataclass(frozen=True)
class ReflectingPoints:
    """Points that paths meet; axis q."""

    path: NDArray[np.int64]  # [q] number of the path
    weight: NDArray[np.float64]  # [q] product of reflectances, the point's own included
    places: SurfacePoints  # [q]
    first: int  # number of points that the paths meet first; the others follow these


def reflecting_points(
    tracer: TracedScene,
    start: SurfacePoints,
    seed: int | Sequence[tuple[int, int]],
    bounces: int = BOUNCES,
    *,
    mirrored: bool = False,
) -> ReflectingPoints:
    """The points that one path from each start meets, one after the other.

    Args:
        seed: or the seed and the number of starts of several runs, one after the other, each of
            which has the points that it has alone.
        mirrored: whether E_sun includes the sun in smooth mirrors.
    """
    path, weight, places = np.arange(start.size), np.ones(start.size), start
    paths, weights, met = [np.empty(0, dtype=np.int64)], [np.empty(0)], []
    runs = [(seed, start.size)] if isinstance(seed, int) else seed
    within = np.concatenate([path[:0], *(np.arange(count) for _, count in runs)])
    keys = [(one ^ 0x2545F491) & 0xFFFFFFFF for one, _ in runs]
    key_of = np.repeat(np.array(keys, dtype=np.uint32), [count for _, count in runs])
    for bounce in range(bounces):
        if not len(path):
            break
        number = column(within[path] * bounces + bounce, mi.UInt32)
        generator = path_generator(number, column(key_of[path], mi.UInt32))
        kept, places, (rho, own), luck = _next(tracer, places, generator)
        path, before = path[kept], weight[kept]
        weight, own = before * rho, before * (own if mirrored else rho)
        paths.append(path[own > 0])
        weights.append(own[own > 0])
        met.append(places.some(own > 0))
        survival = np.minimum(weight / ROULETTE, 1.0)
        on = luck < survival
        path, places, weight = path[on], places.some(on), weight[on] / survival[on]
    first = met[0].size if met else 0
    path, weight = np.concatenate(paths), np.concatenate(weights)
    return ReflectingPoints(path, weight, SurfacePoints.joined(met), first)


def _next(
    tracer: TracedScene, places: SurfacePoints, generator: mi.PCG32
) -> tuple[NDArray[np.bool_], SurfacePoints, NDArray[np.float32], NDArray[np.float32]]:
    """Which paths meet a reflecting surface, the points, reflectances, random numbers for roulette.

    The reflectances [2, m] are the total one, and that without smooth mirrors.
    """
    point, normal = places.points(), places.normals()
    u = mi.Point2f(generator.next_float32(), generator.next_float32())
    way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
    hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(point, way), coherent=False)
    is_hit, luck = hit.is_valid(), generator.next_float32()
    rho = tracer.whole(hit.prim_index, way, is_hit)
    own = tracer.without_mirrors(hit.prim_index, way, is_hit)
    others = is_hit, rho, own, luck
    after, is_hit, rho, own, luck = hit_points(tracer, point, way, hit, is_hit, *others)
    kept = is_hit & (rho > 0)
    return kept, after.some(kept), np.stack([rho, own])[:, kept], luck[kept]


def hit_points(
    tracer: TracedScene,
    origin: mi.Point3f,
    way: mi.Vector3f,
    hit: mi.PreliminaryIntersection3f,
    valid: mi.Bool,
    *others: Any,
) -> tuple[Any, ...]:
    """Points where rays meet surfaces, on the side that they come from.

    Args: others: values of the same kernel, which one launch computes together with the points.

    Returns: the `SurfacePoints`, then the others as arrays.
    """
    point, face, *others = tables(*hit_faces(tracer, origin, way, hit, valid), *others)
    return SurfacePoints(point, face), *others


def hit_faces(
    tracer: TracedScene, origin: mi.Point3f, way: mi.Vector3f, hit: mi.PreliminaryIntersection3f, valid: mi.Bool
) -> tuple[mi.Point3f, mi.Vector3f]:
    """Points and normals where rays meet surfaces, offset to the side that they come from."""
    face = dr.gather(mi.Vector3f, tracer.normal, hit.prim_index, valid)
    face = dr.mulsign(face, -dr.dot(face, way))
    return mi.Point3f(origin + way * hit.t + face * tracer.epsilon), face


def on_disc_of(centre: mi.Vector3f, number: mi.UInt32) -> mi.Vector3f:
    """A direction on the sun's disc for each number, so that the edges of shadows are soft."""
    u = lattice_2d(number, mi.UInt32(0x5BD1E995), 2)
    local = mi.warp.square_to_uniform_cone(u, float(np.cos(SUN_RADIUS)))
    return mi.Frame3f(centre).to_world(local)


def points_and_suns(
    places: SurfacePoints, suns: NDArray[np.float64], pair: mi.UInt32 | None = None, number: mi.UInt32 | None = None
) -> tuple[mi.Point3f, mi.Vector3f, mi.Vector3f]:
    """Point, normal and direction to the sun of pairs of points and hours, of all [m * h].

    Args: number: [m] by which a point's direction on the disc is drawn; by default its place.
    """
    lane = dr.arange(mi.UInt32, places.size * len(suns)) if pair is None else pair
    count = dr.opaque(mi.UInt32, len(suns))
    place = lane // count
    towards = dr.gather(mi.Vector3f, vectors(suns), lane - place * count)
    point = dr.gather(mi.Point3f, places.points(), place)
    normal = dr.gather(mi.Vector3f, places.normals(), place)
    drawn = place if number is None else dr.gather(mi.UInt32, number, place)
    return point, normal, on_disc_of(towards, drawn)


def sunlight(outside: TracedScene, places: SurfacePoints, suns: NDArray[np.float64]) -> NDArray[np.float32]:
    """Irradiance of points outdoors per unit normal to the sun, mirrored sun included [m, h]."""
    light = mi.Float(0)
    for way in specular_sun_paths(outside):
        turned = way.apparent(suns)
        point, normal, to_sun = points_and_suns(places, turned)
        middle = column((places.normal @ turned.T).ravel())
        slant = dr.dot(normal, to_sun)
        light += _shone(way.transmittance(mi.Ray3f(point, to_sun), slant > 0), middle, slant)
        dr.eval(light)  # one kernel for all paths by as many mirrors
    return light.numpy().reshape(places.size, len(suns))


def sunlight_of_each(outside: TracedScene, places: SurfacePoints, suns: NDArray[np.float64]) -> NDArray[np.float32]:
    """The same of each point by a sun of its own [m, 3]: [m]."""
    light, number = mi.Float(0), dr.arange(mi.UInt32, places.size)
    for way in specular_sun_paths(outside):
        turned = way.apparent(suns)
        to_sun = on_disc_of(vectors(turned), number)
        middle = column((places.normal * turned).sum(axis=1))
        slant = dr.dot(places.normals(), to_sun)
        light += _shone(way.transmittance(mi.Ray3f(places.points(), to_sun), slant > 0), middle, slant)
        dr.eval(light)
    return light.numpy()


def _shone(share: mi.Float, middle: mi.Float, slant: mi.Float) -> mi.Float:
    """Cosine times transmittance of a direction on the sun's disc; 0 where it is hidden.

    Args:
        middle: cosine of the disc's centre, which is the disc's mean where all of it is above the
            point's horizon, without the noise of one direction.
        slant: that of the direction.
    """
    cosine = dr.select(middle > SUN_RADIUS, middle, slant)
    return dr.select(cosine > 0, cosine * share, 0.0)


@dataclass(frozen=True)
class SunGrid:
    """Nodes of the grid about some suns; axis h of the suns."""

    suns: NDArray[np.float64]  # [h, 3]
    nodes: NDArray[np.float64]  # [n, 3] unit
    corner: NDArray[np.int64]  # [h, 3] number of the nodes about each sun
    weight: NDArray[np.float64]  # [h, 3] of each, 1 in sum
    first: NDArray[np.int64]  # [h] of `MIRRORED` places in a row, one that is checked

    @classmethod
    def about(cls, suns: NDArray[np.float64]) -> SunGrid:
        """The triangles of the grid that directions [h, 3] are in."""
        place = suns[:, :2] * np.sqrt(2 / np.maximum(1 + suns[:, 2:], 1e-9)) / STEP
        low = np.floor(place).astype(np.int64)
        x, y = (place - low).T
        second = low + np.where((y > x)[:, None], [0, 1], [1, 0])
        key = np.stack([low, second, low + 1], axis=1) @ np.array([KEY, 1])
        keys, corner = np.unique(key, return_inverse=True)
        along = (keys + KEY // 2) // KEY
        flat = np.stack([along, keys - along * KEY], axis=1) * STEP
        square = np.minimum((flat**2).sum(axis=1), 4.0)
        nodes = np.column_stack([flat * np.sqrt(1 - square / 4)[:, None], 1 - square / 2])
        nodes /= np.linalg.norm(nodes, axis=1)[:, None]
        more, less = np.maximum(x, y), np.minimum(x, y)
        weight = np.column_stack([1 - more, more - less, less])
        bits = suns.astype(np.float32).view(np.uint32).astype(np.uint64)
        mixed = (bits @ np.array([0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D], dtype=np.uint64)) >> 12
        return cls(suns, nodes, corner.reshape(-1, 3), weight, mixed.astype(np.int64) % MIRRORED)


class _GridLight:
    """Irradiance of places [m] per unit normal to the suns [h] of a grid by specular paths [N].

    Several paths share a launch.  A pair is a path, a place and a sun, numbered in this order, and a
    row a path and a place.
    """

    def __init__(
        self,
        outside: TracedScene,
        paths: Sequence[SpecularPath],
        grid: SunGrid,
        places: SurfacePoints,
        number: NDArray[np.int64],
    ) -> None:
        """Upload what the launches share; number: [m] as of `sunlight_of_many`."""
        self._grid, self._number = grid, number
        self._shape = len(paths), places.size, len(grid.suns)
        self._ways = SpecularPaths(outside, [path.planes for path in paths])
        self._suns = np.concatenate([path.apparent(grid.suns) for path in paths])
        self._towards = vectors(self._suns)
        self._nodes = vectors(np.concatenate([path.apparent(grid.nodes) for path in paths]))
        self._each = np.array([MIRRORED if path.mirrors else CHECKED for path in paths])
        self._points, self._normals = places.points(), places.normals()
        self._drawn, self._first = column(number, mi.UInt32), column(grid.first, mi.UInt32)
        self._mirrored = column([path.mirrors for path in paths], mi.Bool)
        self._corners = [(column(c, mi.UInt32), column(w)) for c, w in zip(grid.corner.T, grid.weight.T, strict=True)]
        self._kinds, kind_of = np.unique(places.normal, axis=0, return_inverse=True)
        self._kind_of = kind_of.reshape(-1)

    def whole(self) -> NDArray[np.float32]:
        """The light by all paths together [m, h]."""
        N, m, h = self._shape
        total = np.zeros((m, h), dtype=np.float32)
        step = max(1, LANES // max(m * len(self._grid.nodes), 1))
        for start in range(0, N, step):
            self._add(total, range(start, min(start + step, N)))
        return total

    def _add(self, total: NDArray[np.float32], paths: range) -> None:
        """Add the light by some paths, one after the other."""
        _, m, h = self._shape
        at = self._at_nodes(paths)
        reached = at.numpy().reshape(len(paths), m, -1).any(axis=2)
        reached[2 * np.count_nonzero(reached, axis=1) > m] = True  # all of them take no longer than most
        rows = np.flatnonzero(reached) + paths.start * m
        light, own, differ = self._between_nodes(at, rows, paths.start)
        lane = np.flatnonzero(own)
        pair = rows[lane // h] * h + lane % h
        agreed = [self._pairs_with_rays(path, np.flatnonzero(~one)) for path, one in zip(paths, reached, strict=True)]
        others = np.concatenate(agreed)
        before = np.append(light[lane], np.zeros(len(others), dtype=np.float32))
        unlike = np.append(differ[lane], np.zeros(len(others), dtype=bool))
        exact = self._by_rays(np.append(pair, others), unlike, before)
        light[lane], exact = exact[: len(lane)], exact[len(lane) :]
        light, flat = light.reshape(len(rows), h), total.reshape(-1)
        for path, one, pairs in zip(paths, reached, agreed, strict=True):
            count = np.count_nonzero(one)
            total[slice(None) if count == m else one] += light[:count]
            flat[pairs - path * m * h] += exact[: len(pairs)]
            light, exact = light[count:], exact[len(pairs) :]

    def _at_nodes(self, paths: range) -> mi.Float:
        """Transmittance of the rows of some paths to the nodes [r * n]."""
        _, m, _ = self._shape
        nodes = dr.opaque(mi.UInt32, len(self._grid.nodes))
        lane = dr.arange(mi.UInt32, len(paths) * m * len(self._grid.nodes))
        row = lane // nodes
        path, place = self._path_and_rest(row + dr.opaque(mi.UInt32, paths.start * m), m)
        towards = dr.gather(mi.Vector3f, self._nodes, path * nodes + lane - row * nodes)
        to_node = on_disc_of(towards, dr.gather(mi.UInt32, self._drawn, place))
        ray = mi.Ray3f(dr.gather(mi.Point3f, self._points, place), to_node)
        facing = dr.dot(dr.gather(mi.Vector3f, self._normals, place), to_node) > 0
        return self._ways.transmittance(ray, path, facing)

    @staticmethod
    def _path_and_rest(number: mi.UInt32, size: int) -> tuple[mi.UInt32, mi.UInt32]:
        count = dr.opaque(mi.UInt32, size)
        path = number // count
        return path, number - path * count

    def _between_nodes(
        self, at: mi.Float, rows: NDArray[np.int64], start: int
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
        """Light of some rows by what the nodes about each sun have [r * h].

        And which pairs get a ray of their own, and whose nodes differ.

        Args: at: of the rows of all places from the path `start` on.
        """
        if not len(rows):
            return np.empty(0, dtype=np.float32), np.empty(0, dtype=bool), np.empty(0, dtype=bool)
        _, m, h = self._shape
        lane = dr.arange(mi.UInt32, len(rows) * h)
        number, hour = self._path_and_rest(lane, h)
        row = dr.gather(mi.UInt32, column(rows, mi.UInt32), number)
        path, place = self._path_and_rest(row, m)
        begin = (row - dr.opaque(mi.UInt32, start * m)) * dr.opaque(mi.UInt32, len(self._grid.nodes))
        share, lit = mi.Float(0), mi.UInt32(0)
        for corner, weight in self._corners:
            value = dr.gather(mi.Float, at, begin + dr.gather(mi.UInt32, corner, hour))
            share += dr.gather(mi.Float, weight, hour) * value
            lit += dr.select(value > 0, mi.UInt32(1), mi.UInt32(0))
        towards = dr.gather(mi.Vector3f, self._towards, path * dr.opaque(mi.UInt32, h) + hour)
        cosine = dr.dot(dr.gather(mi.Vector3f, self._normals, place), towards)
        differ, level = (lit > 0) & (lit < 3), dr.abs(cosine) <= SPREAD
        own = self._has_ray((path, place, hour), cosine, differ)
        light, own, differ = tables(dr.select((cosine > 0) & ~level, cosine * share, 0.0), own, differ)
        return light, own, differ

    def _has_ray(self, pair: tuple[mi.UInt32, mi.UInt32, mi.UInt32], cosine: mi.Float, differ: mi.Bool) -> mi.Bool:
        """Whether pairs get a ray of their own: level with the sun, their nodes unlike, or checked."""
        path, place, hour = pair
        drawn, first = dr.gather(mi.UInt32, self._drawn, place), dr.gather(mi.UInt32, self._first, hour)
        number, mirrored = drawn + first, dr.gather(mi.Bool, self._mirrored, path)
        checked = dr.select(mirrored, number % MIRRORED == 0, number % CHECKED == 0)
        return (dr.abs(cosine) <= SPREAD) | ((cosine > 0) & (differ | checked))

    def _pairs_with_rays(self, path: int, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """Numbers of the pairs of a path and some places that have a ray though their nodes agree.

        And a few others.
        """
        (_, m, h), each = self._shape, self._each[path]
        first, rows = self._grid.first % each, path * m + places
        cosine = self._kinds.astype(float) @ self._suns[path * h : (path + 1) * h].T
        reach = SPREAD + ROUNDING
        before, level = cosine >= -reach, np.abs(cosine) <= reach
        number, kind = -self._number[places] % each, self._kind_of[places]
        order = np.argsort(first.astype(np.uint8), kind="stable")
        row, hour = _listed(np.bincount(first, minlength=each), order, number)
        facing = before[kind[row], hour]
        checked = rows[row[facing]] * h + hour[facing]
        row, hour = _listed(np.count_nonzero(level, axis=1), np.nonzero(level)[1], kind)
        other = first[hour] != number[row]
        return np.concatenate([checked, rows[row[other]] * h + hour[other]])

    def _by_rays(
        self, pair: NDArray[np.int64], differ: NDArray[np.bool_], before: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Light of some pairs [k] by rays, from that by the nodes; 0 of those that have no ray."""
        if not len(pair):
            return before
        _, m, h = self._shape
        unlike, light = column(differ, mi.Bool), column(before)
        row, hour = self._path_and_rest(column(pair, mi.UInt32), h)
        path, place = self._path_and_rest(row, m)
        towards = dr.gather(mi.Vector3f, self._towards, path * dr.opaque(mi.UInt32, h) + hour)
        point, normal = (dr.gather(type(a), a, place) for a in (self._points, self._normals))
        middle = dr.dot(normal, towards)
        has_ray = self._has_ray((path, place, hour), middle, unlike)
        to_sun = on_disc_of(towards, dr.gather(mi.UInt32, self._drawn, place))
        slant = dr.dot(normal, to_sun)
        share = self._ways.transmittance(mi.Ray3f(point, to_sun), path, has_ray & (slant > 0))
        exact = _shone(share, middle, slant)
        each = dr.select(dr.gather(mi.Bool, self._mirrored, path), mi.Float(MIRRORED), mi.Float(CHECKED))
        more = dr.select(unlike | (dr.abs(middle) <= SPREAD), mi.Float(1), each)
        found: NDArray[np.float32] = dr.select(has_ray, light + more * (exact - light), 0.0).numpy()
        return found


def _listed(
    sizes: NDArray[np.int64], entries: NDArray[np.int64], number: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The entries of some lists [n], by the lists' numbers: the place of each entry's number in [n], and the entry.

    Args: sizes: of all lists; entries: of one list after the other.
    """
    counts = sizes[number]
    which, ends = np.repeat(np.arange(len(number)), counts), np.cumsum(counts)
    shift = (np.cumsum(sizes) - sizes)[number] - (ends - counts)
    return which, entries[np.arange(len(which)) + shift[which]]


def sunlight_of_many(
    outside: TracedScene, places: SurfacePoints, suns: NDArray[np.float64], number: NDArray[np.int64] | None = None
) -> NDArray[np.float32]:
    """`sunlight` of many points [m, h] by the grid, unbiased in the sum over the points.

    Args: number: [m] of each point among those of its sum, by default of all points: a point has
        the light that it has with these alone.
    """
    number = np.arange(places.size) if number is None else number
    return _GridLight(outside, specular_sun_paths(outside), SunGrid.about(suns), places, number).whole()
