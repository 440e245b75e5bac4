"""What changes from pixel to pixel on a surface in a picture: the sun on it, and its gloss."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.paths.path_scene import LitRoom, Sky
from mitsuba_cfs.trace.paths.point_in_time import add_paths
from mitsuba_cfs.trace.paths.sun import Vertex, surface_sun


def shown_sharp(
    room: LitRoom,
    sky: Sky,
    vertex: Vertex,
    triangle: mi.UInt32,
    direction: mi.Vector3f,
    *,
    rho: mi.Float,  # diffuse reflectance
    u_sun: mi.Point2f,
    generator: mi.PCG32,
    depth: mi.UInt32,
    active: mi.Bool,
) -> mi.Float64:
    """Radiance of surfaces by the sun itself, and by what their gloss shows, for each ray."""
    sun = surface_sun(
        room, sky, vertex, triangle, direction,
        rho=rho, came=mi.Float(0), u=u_sun, generator=generator, active=active,
    )  # fmt: skip
    sharp = dr.select(active, mi.Float64(sun), 0.0)
    for tracer, here in ((room.inside, ~vertex.outdoors), (room.outside, vertex.outdoors)):
        if tracer.gloss is None:
            continue
        glossy, towards, weight = tracer.gloss.leave(
            triangle, vertex.normal, direction, mi.Float(0), generator, active & here
        )
        lane = dr.arange(mi.UInt32, dr.width(direction))
        seen = dr.zeros(mi.Float64, dr.width(direction))
        starts = PathStarts(
            lane, mi.Point3f(vertex.position), mi.Vector3f(towards), mi.PCG32(generator), depth,
            glossy & (weight > 0),
        )  # fmt: skip
        add_paths(
            room, sky, seen, starts,
            cosine=mi.Float(0), came=mi.Float(0), aimed=mi.Bool(False),
            beta=dr.select(glossy, weight, 0.0), outdoors=mi.Bool(vertex.outdoors),
        )  # fmt: skip
        sharp += seen
    return sharp
