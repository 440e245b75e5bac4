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
from mitsuba_cfs.trace.sun.specular_paths import SPREAD, SpecularPath, specular_sun_paths

BOUNCES = 5  # surfaces that a path meets at most
ROULETTE = 0.5  # share of light below which paths are thinned out
STEP = float(np.radians(4.0))  # between nodes, about the zenith
CHECKED = 8  # of places whose nodes agree, one in so many has a ray to the sun itself
MIRRORED = 32  # the same of the sun in a mirror, which few places have
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
        light += _shone(way, point, normal, to_sun, middle)
        dr.eval(light)  # one kernel for all paths by as many mirrors
    return light.numpy().reshape(places.size, len(suns))


def sunlight_of_pairs(
    way: SpecularPath, places: SurfacePoints, suns: NDArray[np.float64], pair: mi.UInt32, number: mi.UInt32
) -> mi.Float:
    """The same of some pairs by one specular path; suns: [h, 3] apparent directions."""
    point, normal, to_sun = points_and_suns(places, suns, pair, number)
    middle = dr.gather(mi.Vector3f, vectors(suns), pair % dr.opaque(mi.UInt32, len(suns)))
    return _shone(way, point, normal, to_sun, dr.dot(normal, middle))


def sunlight_of_each(outside: TracedScene, places: SurfacePoints, suns: NDArray[np.float64]) -> NDArray[np.float32]:
    """The same of each point by a sun of its own [m, 3]: [m]."""
    light, number = mi.Float(0), dr.arange(mi.UInt32, places.size)
    for way in specular_sun_paths(outside):
        turned = way.apparent(suns)
        to_sun = on_disc_of(vectors(turned), number)
        middle = column((places.normal * turned).sum(axis=1))
        light += _shone(way, places.points(), places.normals(), to_sun, middle)
        dr.eval(light)
    return light.numpy()


def _shone(
    way: SpecularPath, point: mi.Point3f, normal: mi.Vector3f, to_sun: mi.Vector3f, middle: mi.Float
) -> mi.Float:
    """Cosine times transmittance of a direction on the sun's disc; 0 where it is hidden.

    Args: middle: cosine of the disc's centre, which is the disc's mean where all of it is above the
        point's horizon, without the noise of one direction.
    """
    slant = dr.dot(normal, to_sun)
    cosine = dr.select(middle > SUN_RADIUS, middle, slant)
    share = way.transmittance(mi.Ray3f(point, to_sun), slant > 0)
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

    def light(self, way: SpecularPath, places: SurfacePoints, number: mi.UInt32) -> mi.Float:
        """Irradiance of points by a specular path per unit normal to the suns [m * h].

        Args: number: [m] as of `sunlight_of_many`.
        """
        nodes, suns = way.apparent(self.nodes), way.apparent(self.suns)
        point, normal, to_node = points_and_suns(places, nodes, number=number)
        at = way.transmittance(mi.Ray3f(point, to_node), dr.dot(normal, to_node) > 0)
        dr.eval(at)
        count = dr.opaque(mi.UInt32, len(suns))
        place = dr.arange(mi.UInt32, places.size * len(suns))
        place, hour = place // count, place % count
        each = MIRRORED if way.mirrors else CHECKED
        start, share, lit = place * dr.opaque(mi.UInt32, len(nodes)), mi.Float(0), mi.UInt32(0)
        for corner, weight in zip(self.corner.T, self.weight.T, strict=True):
            node = dr.gather(mi.UInt32, column(corner, mi.UInt32), hour)
            value = dr.gather(mi.Float, at, start + node)
            share += dr.gather(mi.Float, column(weight), hour) * value
            lit += dr.select(value > 0, mi.UInt32(1), mi.UInt32(0))
        cosine = dr.dot(dr.gather(mi.Vector3f, places.normals(), place), dr.gather(mi.Vector3f, vectors(suns), hour))
        differ, level = (lit > 0) & (lit < 3), dr.abs(cosine) <= SPREAD
        first = dr.gather(mi.UInt32, column(self.first, mi.UInt32), hour)
        checked = (dr.gather(mi.UInt32, number, place) + first) % each == 0
        own = level | ((cosine > 0) & (differ | checked))
        light = dr.select((cosine > 0) & ~level, cosine * share, 0.0)
        times = dr.select(differ | level, mi.Float(1), mi.Float(each))
        dr.eval(light, own, times)
        pair = dr.compress(own)
        if dr.width(pair):
            before, more = (dr.gather(mi.Float, of, pair) for of in (light, times))
            exact = sunlight_of_pairs(way, places, suns, pair, number)
            dr.scatter(light, before + more * (exact - before), pair)
        return light


def sunlight_of_many(
    outside: TracedScene, places: SurfacePoints, suns: NDArray[np.float64], number: NDArray[np.int64] | None = None
) -> NDArray[np.float32]:
    """`sunlight` of many points [m, h] by the grid, unbiased in the sum over the points.

    Args: number: [m] of each point among those of its sum, by default of all points: a point has
        the light that it has with these alone.
    """
    grid = SunGrid.about(suns)
    drawn = column(np.arange(places.size) if number is None else number, mi.UInt32)
    light = sum(grid.light(way, places, drawn) for way in specular_sun_paths(outside))
    return light.numpy().reshape(places.size, len(suns))
