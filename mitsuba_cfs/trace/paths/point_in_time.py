"""Point-in-time path tracing: sensors of a room under one sky, through the real BSDF."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import batch_key, path_generator, vectors
from mitsuba_cfs.trace.kernels.scene import OPAQUE
from mitsuba_cfs.trace.paths.scene import PatchSky, PathTracingScene, Sky
from mitsuba_cfs.trace.paths.sun import Vertex, leave_by_gloss, on_disc, sun_at, sun_images, surface_sun


def daylight_coefficients(
    room: PathTracingScene,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    subdivision: int = 4,
    samples: int = 16384,
    max_depth: int = 24,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    key: object = None,
) -> Estimate:
    """Illuminance per unit luminance of each sky patch [S, P], straight through the real BSDF.

        E[s] = sum over p of C[s, p] sky[p]

    The two-phase method: the paths of `point_in_time` from the sensors through whatever fills the
    windows to the patches; one matrix for one state, without the angular patches of V T D.

    Args:
        points, directions: [S, 3] sensor positions [m] and normals.
        subdivision: Reinhart's MF (1, 2, 4, 6).
        samples: paths for each sensor in each batch.
        cache, key: where the matrix is kept, and what the room was made from (surfaces, window
            groups, BSDF data), which tells it from others there.

    Source: Tregenza and Waters 1983, "Daylight coefficients", Lighting Research & Technology 15.
    """
    if cache is not None and key is None:
        raise ValueError("a room needs a `key` before its matrix can be kept in a cache")
    sky, paths = PatchSky(subdivision), PathOptions(samples, max_depth, stopping, seed, progress, cache)
    batch = sensor_batches(room, sky, points, directions, samples=samples, max_depth=max_depth, seed=seed)
    inputs = key, np.asarray(points), np.asarray(directions), subdivision
    return paths.estimate("daylight coefficients", batch, *inputs, by=__name__)


CONE_COSINE = float(np.cos(np.radians(6.0)))  # directions round the sun that paths prefer
# Shares of a room path's directions that aim at windows and near the sun; the rest follows the
# cosine.  After a reflection they must be few: weights grow by 1 / rest each time, and their mean
# square stays finite only where rest > reflectance^2
MAX_DEPTH = 24
NEAR = 1e-4  # of its distance, within which a path has met the point that it aims at
TO_WINDOW, TO_SUN = (0.5, 0.2), (0.15, 0.05)  # (first, later)


def _interaction(room: PathTracingScene, group: int, direction: mi.Vector3f) -> mi.SurfaceInteraction3f:
    """Interaction record, in a window's frame, of a ray along `direction` that meets the window."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(direction))
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    si.wi = -room.inside.to_group(group, direction)
    return si


def leave(
    room: PathTracingScene,
    sky: Sky,
    vertex: Vertex,
    u: mi.Point2f,
    choice: mi.Float,
    active: mi.Bool,
    *,
    later: bool = False,
) -> tuple[mi.Vector3f, mi.Float]:
    """A direction from a diffuse vertex, and the distance of the window point that it aims at.

    The distance is 0 where it aims at none.  Cosine-distributed; in the room some directions aim at
    the windows and some near the sun, fewer from `later` vertices of a path.
    """
    window_share, sun_share = TO_WINDOW[later], TO_SUN[later]
    choice = dr.select(vertex.outdoors, 1.0, choice)
    cosine = mi.Frame3f(vertex.normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
    point, _ = room.inside.sample_window(u, active & ~vertex.outdoors)
    to_window = mi.Vector3f(point - vertex.position)
    distance = dr.norm(to_window)
    to_sun = mi.Frame3f(sky.sun).to_world(mi.warp.square_to_uniform_cone(u, CONE_COSINE))
    aimed = choice < window_share
    direction = dr.select(aimed, to_window / distance, cosine)
    near_sun = ~aimed & (choice < window_share + sun_share)
    return dr.select(near_sun, to_sun, direction), dr.select(aimed, distance, 0.0)


def _density(
    room: PathTracingScene,
    sky: Sky,
    cosine: mi.Float,
    direction: mi.Vector3f,
    distance: mi.Float,
    *,
    glass_cosine: mi.Float,  # of the window that was met, 0 for none
    later: mi.Bool,
) -> mi.Float:
    """Density [1/sr] of the directions of `leave` in the room.

    A path that aims at a window and meets something else first, such as a fabric behind it, is
    dropped, so only directions that meet a window have that part of the density, for that window.
    """
    window = dr.select(
        glass_cosine > 1e-4, distance * distance / (room.inside.window_area() * dr.maximum(glass_cosine, 1e-4)), 0.0
    )
    cone = dr.select(dr.dot(direction, sky.sun) > CONE_COSINE, 1 / (2 * np.pi * (1 - CONE_COSINE)), 0.0)
    window_share, sun_share = (dr.select(later, s[1], s[0]) for s in (TO_WINDOW, TO_SUN))
    rest = 1 - window_share - sun_share
    return rest * cosine * dr.inv_pi + window_share * window + sun_share * cone


def window_parts(
    room: PathTracingScene,
    group: mi.Int32,
    direction: mi.Vector3f,
    towards: mi.Vector3f,
    *,
    u: mi.Point2f,
    choice: mi.Float,
    glazed: mi.Bool,
) -> tuple[mi.Float, mi.Float, mi.Float, mi.Vector3f, mi.Float, mi.Vector3f]:
    """Optics of a window for a ray along `direction` from either side.

    Returns: light scattered from the sun `towards` [1/sr, cosine included]; the straight beam's
    transmittance; the mirror's reflectance and direction; weight and direction of scattered light.
    """
    straight, mirrored, rest = (mi.Float(0) for _ in range(3))
    mirror, away = mi.Vector3f(direction), mi.Vector3f(direction)
    scattered = scattered_at(room, group, direction, towards, glazed)
    for g, system in enumerate(room.systems):
        of_group = glazed & (group == g)
        local = room.inside.to_group(g, direction)
        straight = dr.select(of_group, system.straight(local), straight)
        mirrored = dr.select(of_group, system.mirrored(local), mirrored)
        back = room.inside.to_world(g, local * mi.Vector3f(1, 1, -1))
        mirror = dr.select(of_group, back, mirror)
        if system.bsdf is not None:
            si, context = _interaction(room, g, direction), mi.BSDFContext()
            sample, weight = system.bsdf.sample(context, si, choice, u, of_group)
            rest = dr.select(of_group, weight[0], rest)
            away = dr.select(of_group, room.inside.to_world(g, sample.wo), away)
    return scattered, straight, mirrored, mirror, rest, away


def scattered_at(
    room: PathTracingScene, group: mi.Int32, direction: mi.Vector3f, towards: mi.Vector3f, glazed: mi.Bool
) -> mi.Float:
    """Light of the sun at `towards` that windows scatter to -`direction`, cosine included."""
    scattered = mi.Float(0)
    for g, system in enumerate(room.systems):
        if system.bsdf is not None:
            local = room.inside.to_group(g, towards)
            sunny = glazed & (group == g) & (local.z > 0)
            si = _interaction(room, g, direction)
            value = system.bsdf.eval(mi.BSDFContext(), si, local, sunny)
            scattered = dr.select(sunny, value[0], scattered)
    return scattered


def window_sun(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    place: mi.Point3f,  # outdoors of the window
    group: mi.Int32,
    direction: mi.Vector3f,
    *,
    generator: mi.PCG32,
    glazed: mi.Bool,
) -> mi.Float:
    """Radiance of the sun in smooth mirrors outdoors that windows scatter."""
    light = mi.Float(0)
    if all(system.bsdf is None for system in room.systems) or room.outside.gloss is None:
        return light
    outward = room.inside.outward(group, glazed) / room.inside.epsilon
    vertex = Vertex(place, outward, glazed)
    for image in sun_images(room, sky, vertex, generator, glazed, rough=False):
        seen = glazed & (image.strength > 0)
        light += scattered_at(room, group, direction, image.towards, seen) * image.strength
    return light


def _at_window(
    room: PathTracingScene,
    group: mi.Int32,
    direction: mi.Vector3f,
    towards: mi.Vector3f,
    generator: mi.PCG32,
    glazed: mi.Bool,
) -> tuple[mi.Float, mi.Vector3f, mi.Float, mi.Bool]:
    """Light scattered from the sun, see `window_parts`; new direction and weight of a path.

    The path takes the beam, the specular reflection or the rest in proportion to their weights; the
    last value is whether it takes the beam.
    """
    u = mi.Point2f(generator.next_float32(), generator.next_float32())
    scattered, straight, mirrored, mirror, rest, away = window_parts(
        room, group, direction, towards, u=u, choice=generator.next_float32(), glazed=glazed
    )
    whole = straight + mirrored + rest
    mark = generator.next_float32() * whole
    away = dr.select(mark < straight + mirrored, mirror, away)
    away = dr.select(mark < straight, direction, away)
    return scattered, away, whole, mark < straight


@dr.syntax
def add_paths(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    result: mi.Float64,  # [rows], or [rows * P] of a `PatchSky`, accumulated in place
    starts: PathStarts,
    *,
    cosine: mi.Float,  # at the diffuse vertex in the room that the path starts on; 0 for none
    came: mi.Float,  # cosine over pi at a diffuse vertex anywhere; 0 for none
    aimed: mi.Float,  # distance of the point of a window that the first direction aims at, or 0
    beta: mi.Float,  # initial weight of the path
    outdoors: mi.Bool,  # where the path starts
) -> None:
    """Follow each path and add the light of sun, sky and ground to its row.

    A path never meets the sun's disc: next-event estimation has the sun at surfaces and windows.
    """
    row, origin, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    diffuse = cosine > 0  # the ray left a diffuse vertex in the room: its density is to be applied
    depth = mi.UInt32(0)
    while active:
        # ----- What the ray meets: the sky, a surface, a window -----
        ray = mi.Ray3f(origin, direction)
        within = active & ~outdoors
        hit_in = room.inside.scene.ray_intersect_preliminary(ray, coherent=False, active=within)
        beyond = active & outdoors
        hit_out, before_hit = room.outside.met_outdoors(origin, direction, beyond)
        origin = dr.select(beyond, before_hit, origin)
        to_sky = beyond & ~hit_out.is_valid()
        sky.add(result, row, direction, beta, to_sky)
        active &= dr.select(outdoors, hit_out.is_valid(), hit_in.is_valid())
        t = dr.select(outdoors, hit_out.t, hit_in.t)

        group_in = dr.gather(mi.Int32, room.inside.group, hit_in.prim_index, active & ~outdoors)
        group_out = dr.gather(mi.Int32, room.outside.group, hit_out.prim_index, active & outdoors)
        group = dr.select(outdoors, group_out, group_in)
        glazed = active & (group != OPAQUE)
        there = glazed & (dr.abs(t - aimed) < NEAR * aimed)
        active &= there | ~((aimed > 0) & diffuse)
        local = room.inside.to_local(group, direction, glazed)
        facing = dr.select(outdoors, -local.z, local.z) > 1e-4  # windows are one-sided
        active &= ~glazed | facing
        glazed &= active
        glass_cosine = dr.select(glazed & ~outdoors, local.z, 0.0)
        density = _density(room, sky, cosine, direction, t, glass_cosine=glass_cosine, later=depth > 0)
        beta *= dr.select(diffuse & ~outdoors, cosine / dr.maximum(density, 1e-12), 1.0)
        point = mi.Point3f(origin + direction * t)

        # ----- Windows: the sun scattered in them, and where the path goes on -----
        u_sun = mi.Point2f(generator.next_float32(), generator.next_float32())
        towards = on_disc(sky, u_sun)
        scattered, next_direction, next_beta, straight = _at_window(room, group, direction, towards, generator, glazed)
        sunlit = glazed & (scattered > 0) & (sky.sun_radiance > 0)
        before = mi.Point3f(point + room.inside.outward(group, glazed))
        sun_ray = mi.Ray3f(before, towards)
        sunlit &= ~room.outside.hides(sun_ray, sunlit)
        from_sun = scattered * float(SUN_SOLID_ANGLE) * sky.sun_radiance
        dr.scatter_add(result, mi.Float64(beta * from_sun), row, sunlit)
        if dr.hint(room.glossy, mode="scalar"):
            by_mirrors = window_sun(room, sky, before, group, direction, generator=generator, glazed=glazed)
            dr.scatter_add(result, mi.Float64(beta * by_mirrors), row, glazed)

        # ----- Surfaces: the sun on them, and a new direction -----
        opaque = active & ~glazed
        prim = dr.select(outdoors, hit_out.prim_index, hit_in.prim_index)
        normal_in = dr.gather(mi.Vector3f, room.inside.normal, prim, opaque & ~outdoors)
        normal_out = dr.gather(mi.Vector3f, room.outside.normal, prim, opaque & outdoors)
        face = dr.select(outdoors, normal_out, normal_in)
        face = dr.mulsign(face, -dr.dot(face, direction))
        slant = -dr.dot(face, direction)
        rho_in = room.inside.diffuse(prim, slant, opaque & ~outdoors)
        rho_out = room.outside.diffuse(prim, slant, opaque & outdoors)
        rho = dr.select(outdoors, rho_out, rho_in)
        vertex = Vertex(mi.Point3f(point + face * room.inside.epsilon), face, outdoors)
        sun = surface_sun(
            room, sky, vertex, prim, direction, rho=rho, came=came, u=u_sun, generator=generator, active=opaque
        )
        dr.scatter_add(result, mi.Float64(beta * sun), row, opaque)
        u_away = mi.Point2f(generator.next_float32(), generator.next_float32())
        away, aimed = leave(room, sky, vertex, u_away, generator.next_float32(), opaque, later=True)
        glossy, beta_face = mi.Bool(False), beta * rho
        if dr.hint(room.glossy, mode="scalar"):
            glossy, mirrored, weight = leave_by_gloss(
                room, vertex, prim, direction, rho=rho, generator=generator, active=opaque
            )
            away, beta_face = dr.select(glossy, mirrored, away), beta * weight
            aimed = dr.select(glossy, 0.0, aimed)
        cosine = dr.select(opaque, dr.dot(away, face), 0.0)
        came = dr.select(opaque & ~glossy, cosine * dr.inv_pi, dr.select(straight, came, 0.0))
        # outdoors the cosine of a diffuse vertex cancels at once
        beta_face *= dr.select(outdoors | glossy, 1.0, dr.inv_pi)

        # ----- Next ray -----
        crossing = room.inside.to_local(group, next_direction, glazed).z
        outward = glazed & (crossing > 0)
        offset = room.inside.outward(group, glazed)
        leaving = mi.Point3f(point + dr.select(outward, offset, -offset))
        origin = dr.select(opaque, vertex.position, leaving)
        direction = dr.select(opaque, away, next_direction)
        beta = dr.select(opaque, beta_face, beta * next_beta)
        diffuse = opaque & ~outdoors & ~glossy
        active &= ~opaque | (cosine > 0)
        outdoors = dr.select(glazed, outward, outdoors)
        depth += 1
        survival = dr.select(depth > 4, dr.clip(beta * 3.0, 0.05, 0.95), 1.0)
        active &= (generator.next_float32() < survival) & (depth < max_depth) & (beta > 0)
        beta /= survival


def point_in_time(
    room: PathTracingScene,
    sky: Sky,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    samples: int = 4096,
    max_depth: int = MAX_DEPTH,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Estimate:
    """Illuminance (irradiance) at sensors [S] under one sky.

    Paths from the sensors meet windows, whose BSDF sends them outdoors or back, and end in the sky;
    every vertex and window gets a shadow ray to the sun's disc.

    Args:
        points, directions: [S, 3] sensor positions [m] and normals.
        samples: paths for each sensor in each batch.
    """
    batch = sensor_batches(room, sky, points, directions, samples=samples, max_depth=max_depth, seed=seed)
    return accumulate(lambda number: batch(number)[:, 0], stopping=stopping, label="point in time", progress=progress)


def sensor_batches(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    samples: int,
    max_depth: int,
    seed: int,
) -> Callable[[int], NDArray[np.float64]]:
    """Batches [S, columns of the sky] of paths from sensors."""
    points, directions = sensors_of(points, directions)
    S, n = len(points), int(samples)
    place = vectors(points - room.inside.centre, mi.Point3f)
    normals = vectors(directions)

    def batch(number: int) -> NDArray[np.float64]:
        result = dr.zeros(mi.Float64, S * sky.columns)
        count = dr.opaque(mi.UInt32, n)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        key = batch_key(seed, number)
        generator = path_generator(path, key)
        origin = mi.Point3f(dr.gather(mi.Point3f, place, sensor))
        normal = dr.gather(mi.Vector3f, normals, sensor)
        vertex = Vertex(origin, normal, mi.Bool(False))
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        sun = sun_at(room, sky, vertex, u, mi.Bool(True))
        for image in sun_images(room, sky, vertex, generator, mi.Bool(True)):
            sun += dr.maximum(dr.dot(normal, image.towards), 0.0) * image.strength
        dr.scatter_add(result, mi.Float64(sun), sensor)
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        away, aimed = leave(room, sky, vertex, u, generator.next_float32(), mi.Bool(True))
        cosine = dr.dot(away, normal)
        depth = dr.opaque(mi.UInt32, max_depth)
        starts = PathStarts(sensor, origin, away, generator, depth, cosine > 0)
        add_paths(
            room,
            sky,
            result,
            starts,
            cosine=cosine,
            came=dr.maximum(cosine, 0) * dr.inv_pi,
            aimed=aimed,
            beta=mi.Float(1),
            outdoors=vertex.outdoors,
        )
        return result.numpy().reshape(S, sky.columns) / n

    return batch
