"""The sun at the vertices of a path: straight, and by surfaces that reflect it like a mirror.

A mirror shows the sun at one direction, its image; a rough one about it.  To each vertex every
mirror plane sends what a ray towards its image finds, for a rough plane towards the image in a
facet drawn from its lobe.  The path itself may meet the rough surface and find the sun from there:
both are joined by the balance heuristic.

Source: Veach, Guibas 1995, "Optimally combining sampling techniques for Monte Carlo rendering".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_cfs.sky.sun import SUN_RADIUS, SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.gloss import TracedGloss, facet_density, facets
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.paths.scene import PatchSky, PathTracingScene, Sky
from mitsuba_cfs.trace.sun.specular_paths import SpecularPath

MOST_IMAGES = 8  # mirror planes asked at a vertex; of more, so many are drawn


class Vertex(NamedTuple):
    """A point of a surface that a path goes on from."""

    position: mi.Point3f
    normal: mi.Vector3f  # towards where the path came from
    outdoors: mi.Bool


class SunImage(NamedTuple):
    """The sun as a mirror plane shows it to a vertex."""

    towards: mi.Vector3f
    strength: mi.Float  # irradiance normal to it, with its weight against the path's own finding
    sharp: mi.Bool  # of a smooth mirror, which no path finds


def on_disc(sky: Sky | PatchSky, u: mi.Point2f) -> mi.Vector3f:
    """A direction uniform on the sun's disc."""
    local = mi.warp.square_to_uniform_cone(u, float(np.cos(SUN_RADIUS)))
    return mi.Frame3f(sky.sun).to_world(local)


def through_window(
    room: PathTracingScene, position: mi.Point3f, towards: mi.Vector3f, outdoors: mi.Bool, active: mi.Bool
) -> tuple[mi.Float, mi.Point3f]:
    """Transmittance of the straight way outdoors, and where it starts there.

    1 and the place itself outdoors, a window's beam in the room, 0 where no window is met.
    """
    indoors = active & ~outdoors
    ray = mi.Ray3f(position, towards)
    hit = room.inside.scene.ray_intersect_preliminary(ray, coherent=False, active=indoors)
    group = dr.gather(mi.Int32, room.inside.group, hit.prim_index, indoors & hit.is_valid())
    glazed = indoors & hit.is_valid() & (group != OPAQUE)
    straight = mi.Float(0)
    for g, system in enumerate(room.systems):
        beam = system.straight(room.inside.to_group(g, towards))
        straight = dr.select(glazed & (group == g), beam, straight)
    beyond = position + towards * hit.t + room.inside.outward(group, glazed)
    start = dr.select(outdoors, position, mi.Point3f(beyond))
    return dr.select(outdoors, 1.0, straight), start


def straight_to_sky(
    room: PathTracingScene, position: mi.Point3f, towards: mi.Vector3f, outdoors: mi.Bool, active: mi.Bool
) -> mi.Float:
    """Transmittance straight to the sky: 1 outdoors, a window's beam indoors; 0 if hidden."""
    tau, start = mi.Float(1), position
    if any(system.beam is not None for system in room.systems):
        tau, start = through_window(room, position, towards, outdoors, active)
        active &= tau > 0
    else:
        active &= outdoors
    ray = mi.Ray3f(start, towards)
    free = active & ~room.outside.hides(ray, active)
    return dr.select(free, tau, 0.0)


def sun_at(room: PathTracingScene, sky: Sky | PatchSky, vertex: Vertex, u: mi.Point2f, active: mi.Bool) -> mi.Float:
    """Irradiance directly from the sun, outdoors or through a window's straight beam."""
    towards = on_disc(sky, u)
    cosine = dr.dot(vertex.normal, towards)
    active = active & (cosine > 0) & (sky.sun_radiance > 0)
    tau = straight_to_sky(room, vertex.position, towards, vertex.outdoors, active)
    return dr.select(active, cosine * tau * sky.sun_radiance * float(SUN_SOLID_ANGLE), 0.0)


def sun_images(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    vertex: Vertex,
    generator: mi.PCG32,
    active: mi.Bool,
    *,
    rough: bool = True,
) -> Iterator[SunImage]:
    """Images of the sun in mirror planes, one after the other.

    Args: rough: include rough planes, whose strength is for a diffuse vertex.
    """
    for tracer in () if isinstance(sky, PatchSky) else (room.inside, room.outside):
        gloss = tracer.gloss
        if gloss is None or not (rough or len(gloss.mirrors)):
            continue
        draws = min(gloss.plane_count, MOST_IMAGES)
        for draw in range(draws):
            number = mi.UInt32(draw)
            if gloss.plane_count > draws:
                place = (draw + generator.next_float32()) * (gloss.plane_count / draws)
                number = dr.minimum(mi.UInt32(place), gloss.plane_count - 1)
            u = mi.Point2f(generator.next_float32(), generator.next_float32())
            v = mi.Point2f(generator.next_float32(), generator.next_float32())
            image = _image(room, sky, tracer, number, vertex, u=(u, v), active=active)
            if not rough:
                image = image._replace(strength=dr.select(image.sharp, image.strength, 0.0))
            yield image
    for path in () if isinstance(sky, PatchSky) else room.mirror_paths:
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        yield _image_by_mirrors(room, sky, path, vertex, u, active)


def _image_by_mirrors(
    room: PathTracingScene, sky: Sky, path: SpecularPath, vertex: Vertex, u: mi.Point2f, active: mi.Bool
) -> SunImage:
    """The image of the sun by several smooth mirrors outdoors."""
    towards = path.apparent_rays(on_disc(sky, u))
    active = active & (dr.dot(vertex.normal, towards) > 0) & (sky.sun_radiance > 0)
    beam, start = through_window(room, vertex.position, towards, vertex.outdoors, active)
    active &= beam > 0
    shown = beam * path.transmittance(mi.Ray3f(start, towards), active)
    strength = shown * sky.sun_radiance * float(SUN_SOLID_ANGLE)
    return SunImage(towards, dr.select(active, strength, 0.0), mi.Bool(True))


def _image(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    tracer: TracedScene,
    number: mi.UInt32,
    vertex: Vertex,
    *,
    u: tuple[mi.Point2f, mi.Point2f],
    active: mi.Bool,
) -> SunImage:
    """The image of the sun in one mirror plane."""
    gloss = tracer.gloss
    sun = on_disc(sky, u[0])
    normal, alpha = gloss.plane(number)
    normal = dr.mulsign(normal, dr.dot(normal, sun))
    facet, slope = facets(normal, alpha, u[1])
    sharp, along = alpha <= 0, dr.dot(sun, facet)
    towards = sun - facet * (2 * along)
    sun_cosine, seen_cosine = dr.dot(sun, normal), -dr.dot(towards, normal)
    cosine = dr.dot(vertex.normal, towards)
    active = active & (cosine > 0) & (along > 0) & (sun_cosine > 0) & (seen_cosine > 0)
    active &= sky.sun_radiance > 0

    shown = by_plane(
        room, tracer, mi.Int32(number), vertex.position, towards, onwards=sun, outdoors=vertex.outdoors, active=active
    )
    density = _image_density(gloss, slope, along, alpha)
    own = cosine * dr.inv_pi  # of a path from the vertex, about
    weight = dr.select(sharp, 1.0, density / dr.maximum(density + own, 1e-12))
    value = shown * sun_cosine / (dr.maximum(along, 1e-6) * slope) * weight * _drawn(gloss)
    strength = value * sky.sun_radiance * float(SUN_SOLID_ANGLE)
    return SunImage(towards, dr.select(active & (shown > 0), strength, 0.0), sharp)


def by_plane(
    room: PathTracingScene,
    tracer: TracedScene,  # the room's inside or outside
    number: mi.Int32,
    position: mi.Point3f,
    towards: mi.Vector3f,
    *,
    onwards: mi.Vector3f,
    outdoors: mi.Bool,
    active: mi.Bool,
) -> mi.Float:
    """Transmittance by a mirror plane to the sky, with its reflectance."""
    outside = tracer is room.outside
    active, tau, origin = mi.Bool(active), mi.Float(1), position
    if outside:
        tau, origin = through_window(room, origin, towards, outdoors, active)
        active &= tau > 0
    else:
        active &= ~outdoors
    rho, position, _ = by_mirror(tracer, number, origin, towards, active)
    beyond = straight_to_sky(room, position, onwards, mi.Bool(outside), active & (rho > 0))
    return dr.select(beyond > 0, rho * tau * beyond, 0.0)


def by_mirror(
    tracer: TracedScene, number: mi.Int32, position: mi.Point3f, towards: mi.Vector3f, active: mi.Bool
) -> tuple[mi.Float, mi.Point3f, mi.Vector3f]:
    """Reflectance of a mirror plane that rays meet first, else 0; where they continue, and how."""
    gloss = tracer.gloss
    ray = mi.Ray3f(position, towards)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
    active = active & hit.is_valid()
    active &= gloss.plane_of(hit.prim_index, active) == number
    normal, _ = gloss.plane(mi.UInt32(number))
    normal = dr.mulsign(normal, -dr.dot(normal, towards))
    cosine = -dr.dot(normal, towards)
    rho = gloss.specular(hit.prim_index, cosine, active)
    start = mi.Point3f(position + towards * hit.t + normal * tracer.epsilon)
    return dr.select(active, rho, 0.0), start, mi.Vector3f(towards + normal * (2 * cosine))


def _drawn(gloss: TracedGloss) -> float:
    """Number of planes that each sampled plane represents."""
    return max(gloss.plane_count / MOST_IMAGES, 1.0)


def _image_density(gloss: TracedGloss, slope: mi.Float, along: mi.Float, alpha: mi.Float) -> mi.Float:
    """Density [1/sr] of the directions to a rough plane's images."""
    return facet_density(slope, alpha) / (4 * dr.maximum(along, 1e-6) * _drawn(gloss))


def surface_sun(
    room: PathTracingScene,
    sky: Sky | PatchSky,
    vertex: Vertex,
    triangle: mi.UInt32,
    direction: mi.Vector3f,  # of the path that meets it
    *,
    rho: mi.Float,  # diffuse reflectance
    came: mi.Float,  # cosine over pi at the diffuse vertex that the path comes from, 0 for none
    u: mi.Point2f,
    generator: mi.PCG32,
    active: mi.Bool,
) -> mi.Float:
    """Radiance of the sun that a surface reflects back along a path."""
    light = rho * dr.inv_pi * sun_at(room, sky, vertex, u, active)
    if not room.glossy:
        return light
    sun = on_disc(sky, u)
    share = diffuse_share(room, vertex, triangle, sun, active)
    lobe = _by_side(
        room,
        vertex.outdoors,
        active,
        lambda gloss, here: (
            gloss.lobe(triangle, vertex.normal, direction, sun, here)
            * _own_weight(gloss, triangle, vertex.normal, direction, sun, came=came, active=here)
        ),
    )
    bright = active & ((lobe > 0) | (rho > 0))
    light = (rho * dr.inv_pi * share + lobe) * sun_at(room, sky, vertex, u, bright)
    for image in sun_images(room, sky, vertex, generator, active):
        share = diffuse_share(room, vertex, triangle, image.towards, active)
        lobe = _by_side(
            room,
            vertex.outdoors,
            active & image.sharp,
            lambda gloss, here, towards=image.towards: gloss.lobe(triangle, vertex.normal, direction, towards, here),
        )
        cosine = dr.maximum(dr.dot(vertex.normal, image.towards), 0.0)
        light += (rho * dr.inv_pi * share + lobe) * cosine * image.strength
    return light


def diffuse_share(
    room: PathTracingScene, vertex: Vertex, triangle: mi.UInt32, towards: mi.Vector3f, active: mi.Bool
) -> mi.Float:
    """Diffuse reflectance for light from a direction over that at normal incidence."""
    cosine = dr.dot(vertex.normal, towards)
    rest = _by_side(room, vertex.outdoors, active, lambda gloss, here: 1 - gloss.diffuse_share(triangle, cosine, here))
    return 1 - rest


def leave_by_gloss(
    room: PathTracingScene,
    vertex: Vertex,
    triangle: mi.UInt32,
    direction: mi.Vector3f,
    *,
    rho: mi.Float,  # diffuse reflectance for the path's direction
    generator: mi.PCG32,
    active: mi.Bool,
) -> tuple[mi.Bool, mi.Vector3f, mi.Float]:
    """Whether a path continues by the gloss, its direction then, the weight of the chosen part."""
    glossy, towards, weight = mi.Bool(False), mi.Vector3f(direction), mi.Float(rho)
    for tracer, here in ((room.inside, ~vertex.outdoors), (room.outside, vertex.outdoors)):
        if tracer.gloss is not None:
            leaves = active & here
            one, way, factor = tracer.gloss.leave(triangle, vertex.normal, direction, rho, generator, leaves)
            glossy |= one
            towards = dr.select(one, way, towards)
            weight = dr.select(leaves, factor, weight)
    return glossy, towards, weight


def _own_weight(
    gloss: TracedGloss,
    triangle: mi.UInt32,
    normal: mi.Vector3f,
    direction: mi.Vector3f,
    sun: mi.Vector3f,
    *,
    came: mi.Float,
    active: mi.Bool,
) -> mi.Float:
    """MIS weight of the sun that a path meets at a rough surface, against the vertex's images."""
    plane, alpha = gloss.plane(mi.UInt32(dr.maximum(gloss.plane_of(triangle, active), 0)))
    half = dr.normalize(sun - direction)
    slope, along = dr.abs(dr.dot(half, plane)), dr.dot(half, sun)
    density = _image_density(gloss, slope, along, alpha)
    return dr.select(came > 0, came / dr.maximum(came + density, 1e-12), 1.0)


def _by_side(
    room: PathTracingScene, outdoors: mi.Bool, active: mi.Bool, value: Callable[[TracedGloss, mi.Bool], mi.Float]
) -> mi.Float:
    """A value of the gloss on each lane's side of the windows, 0 where there is none."""
    light = mi.Float(0)
    for tracer, here in ((room.inside, ~outdoors), (room.outside, outdoors)):
        if tracer.gloss is not None:
            on_side = active & here
            light = dr.select(on_side, value(tracer.gloss, on_side), light)
    return light
