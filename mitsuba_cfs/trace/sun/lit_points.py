"""Where light that surfaces reflect comes from: places that paths meet, for shadow rays to the sun.

What reaches a place x by reflection is the mean over cosine-sampled paths from it,

    E(x) = mean of sum over the surfaces y that a path meets, product of rho up to y, E_sun(y)

A gloss counts here as if it were diffuse: no light is lost, its direction is.  Where E_sun has the
sun out of smooth mirrors as well (`sunlight`), what such a mirror itself has of it does not count.

Source: Kajiya 1986, "The rendering equation", with next-event estimation of the sun.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, path_generator, tables, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.specular_paths import SunWay, sun_ways

BOUNCES = 5  # surfaces that a path meets at most
ROULETTE = 0.5  # share of light below which paths are thinned out


@dataclass(frozen=True)
class Places:
    """Points on surfaces and the sides of them that are meant."""

    point: NDArray[np.float32]  # [m, 3] in the tracer's coordinates, clear of the surface
    normal: NDArray[np.float32]  # [m, 3] unit

    @property
    def size(self) -> int:
        """How many there are."""
        return len(self.point)

    def some(self, chosen: NDArray) -> Places:
        """Some of them, by number or where a mask holds."""
        number = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return Places(self.point.take(number, axis=0), self.normal.take(number, axis=0))

    def points(self) -> mi.Point3f:
        """The points as a kernel takes them."""
        return vectors(self.point, mi.Point3f)

    def normals(self) -> mi.Vector3f:
        """The normals as a kernel takes them."""
        return vectors(self.normal)

    @staticmethod
    def joined(parts: list[Places]) -> Places:
        """All of several."""
        nowhere = np.empty((0, 3), dtype=np.float32)
        return Places(
            np.concatenate([nowhere, *(p.point for p in parts)]),
            np.concatenate([nowhere, *(p.normal for p in parts)]),
        )


@dataclass(frozen=True)
class ReflectingPlaces:
    """What paths meet; axis q."""

    path: NDArray[np.int64]  # [q] number of the path
    weight: NDArray[np.float64]  # [q] product of reflectances, that of the place itself the last
    places: Places  # [q]
    first: int  # of these, how many the paths meet first; the others come after them


def reflecting_places(
    tracer: TracedScene,
    start: Places,
    seed: int,
    bounces: int = BOUNCES,
    *,
    mirrored: bool = False,
) -> ReflectingPlaces:
    """The surfaces that one path from each place meets, one after the other.

    Args: mirrored: whether smooth mirrors send the sun on to the places otherwise.
    """
    path, weight, places = np.arange(start.size), np.ones(start.size), start
    paths, weights, met = [np.empty(0, dtype=np.int64)], [np.empty(0)], []
    key = dr.opaque(mi.UInt32, (seed ^ 0x2545F491) & 0xFFFFFFFF)
    for bounce in range(bounces):
        if not len(path):
            break
        number = column(path * bounces + bounce, mi.UInt32)
        kept, places, (rho, own), luck = _next(tracer, places, path_generator(number, key))
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
    return ReflectingPlaces(path, weight, Places.joined(met), first)


def _next(
    tracer: TracedScene, places: Places, generator: mi.PCG32
) -> tuple[NDArray[np.bool_], Places, NDArray[np.float32], NDArray[np.float32]]:
    """Which paths meet a surface that reflects; where, its reflectances, a number for roulette.

    The reflectances [2, m] are the whole one, and that without smooth mirrors.
    """
    point, normal = places.points(), places.normals()
    u = mi.Point2f(generator.next_float32(), generator.next_float32())
    way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
    hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(point, way), coherent=False)
    found, luck = hit.is_valid(), generator.next_float32()
    rho = tracer.whole(hit.prim_index, way, found)
    own = tracer.without_mirrors(hit.prim_index, way, found)
    others = found, rho, own, luck
    after, found, rho, own, luck = face_places(tracer, point, way, hit, found, *others)
    kept = found & (rho > 0)
    return kept, after.some(kept), np.stack([rho, own])[:, kept], luck[kept]


def face_places(
    tracer: TracedScene,
    origin: mi.Point3f,
    way: mi.Vector3f,
    hit: mi.PreliminaryIntersection3f,
    found: mi.Bool,
    *others: Any,
) -> tuple[Any, ...]:
    """Where rays meet surfaces, on the side that they come from, and other things from one launch.

    Returns: the `Places`, then the others as arrays.
    """
    point, face, *others = tables(*met_faces(tracer, origin, way, hit, found), *others)
    return Places(point, face), *others


def met_faces(
    tracer: TracedScene,
    origin: mi.Point3f,
    way: mi.Vector3f,
    hit: mi.PreliminaryIntersection3f,
    found: mi.Bool,
) -> tuple[mi.Point3f, mi.Vector3f]:
    """Where rays meet surfaces, clear of them on the side that they come from, and its normal."""
    face = dr.gather(mi.Vector3f, tracer.normal, hit.prim_index, found)
    face = dr.mulsign(face, -dr.dot(face, way))
    return mi.Point3f(origin + way * hit.t + face * tracer.epsilon), face


def on_disc_of(centre: mi.Vector3f, number: mi.UInt32) -> mi.Vector3f:
    """A direction on the sun's disc, another one for each number: the edges of shadows are soft."""
    u = lattice_2d(number, mi.UInt32(0x5BD1E995), 2)
    local = mi.warp.square_to_uniform_cone(u, float(np.cos(SUN_RADIUS)))
    return mi.Frame3f(centre).to_world(local)


def place_and_hour(
    places: Places, suns: NDArray[np.float64], pair: mi.UInt32 | None = None
) -> tuple[mi.Point3f, mi.Vector3f, mi.Vector3f]:
    """Point, normal and a direction to the sun of pairs of places and hours, of all [m * h]."""
    lane = dr.arange(mi.UInt32, places.size * len(suns)) if pair is None else pair
    count = dr.opaque(mi.UInt32, len(suns))
    place = lane // count
    towards = dr.gather(mi.Vector3f, vectors(suns), lane - place * count)
    point = dr.gather(mi.Point3f, places.points(), place)
    return point, dr.gather(mi.Vector3f, places.normals(), place), on_disc_of(towards, place)


def sunlight(
    outside: TracedScene, places: Places, suns: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Cosine of the sun at places outdoors where it shines, also out of mirrors, else 0 [m, h]."""
    light = mi.Float(0)
    for way in sun_ways(outside):
        turned = way.turned(suns)
        point, normal, to_sun = place_and_hour(places, turned)
        middle = column((places.normal @ turned.T).ravel())
        light += _shone(way, point, normal, to_sun, middle)
    return light.numpy().reshape(places.size, len(suns))


def sunlight_of_pairs(
    way: SunWay, places: Places, suns: NDArray[np.float64], pair: mi.UInt32
) -> mi.Float:
    """The same of some pairs by one way, from whose end the suns are seen."""
    point, normal, to_sun = place_and_hour(places, suns, pair)
    middle = dr.gather(mi.Vector3f, vectors(suns), pair % dr.opaque(mi.UInt32, len(suns)))
    return _shone(way, point, normal, to_sun, dr.dot(normal, middle))


def sunlight_of_each(
    outside: TracedScene, places: Places, suns: NDArray[np.float64]
) -> NDArray[np.float32]:
    """The same of each place by a sun of its own [m, 3]: [m]."""
    light, number = mi.Float(0), dr.arange(mi.UInt32, places.size)
    for way in sun_ways(outside):
        turned = way.turned(suns)
        to_sun = on_disc_of(vectors(turned), number)
        middle = column((places.normal * turned).sum(axis=1))
        light += _shone(way, places.points(), places.normals(), to_sun, middle)
    return light.numpy()


def _shone(
    way: SunWay, point: mi.Point3f, normal: mi.Vector3f, to_sun: mi.Vector3f, middle: mi.Float
) -> mi.Float:
    """Cosine of the sun at places where a direction on its disc reaches them; 0 elsewhere.

    Args: middle: the cosine of the disc's middle, its own mean where all of it is above the
        place's horizon: one direction has noise.
    """
    slant = dr.dot(normal, to_sun)
    cosine = dr.select(middle > SUN_RADIUS, middle, slant)
    share = way.reaching(mi.Ray3f(point, to_sun), slant > 0)
    return dr.select(cosine > 0, cosine * share, 0.0)
