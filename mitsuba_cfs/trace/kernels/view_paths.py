"""Random walks of view rays through a room, scored at the window patches that they meet."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.bounce_counts import BounceCounts
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.kernels.sampling import lattice_2d, opaque
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene

ROULETTE = 1.0  # a path survives a bounce with so many times the share of light it carries


@dr.syntax
def add_view_paths(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,  # rows of G * K entries, accumulated in place
    entry: mi.UInt32,  # where the row that each path adds to has the first patch of group 0
    position: mi.Point3f,  # where the path starts
    normal: mi.Vector3f,  # direction that the irradiance is measured about
    *,
    later: mi.UInt32,  # entries further on that what comes after the first bounce is added to
    beta: mi.Float,  # weight of the irradiance at the start
    sample: mi.UInt32,  # number of the path in its stream
    stream: mi.UInt32,  # key of the stratified stream
    generator: mi.PCG32,
    max_depth: mi.UInt32,
    active: mi.Bool,
    carried: mi.Float | None,  # no default: `dr.syntax` loses those of keywords
    mirrored: mi.Vector3f | None,  # where paths go that start by a surface's gloss
    light: PatchLight | None,  # rows of the hours' luminance, not of the patches
    room: mi.UInt32 | None,  # of each path, in a scene of several
    bounces: BounceCounts | None,  # adds the derivatives by reflectance to layers behind the matrix
    counted: mi.UInt32 | None,  # bounces before the start
) -> None:
    """Add beta * d(irradiance at the start) / d(radiance of each patch) to the matrix.

    E(x) = integral of the windows' cosine + sum over the first hits of rho E(hit).  The windows
    are sampled by area and by cosine, joined with the balance heuristic.  A hit may be a window,
    which reflects to the room what its triangle's reflectance says.  A path that goes on by the
    gloss of a hit carries radiance instead, and meets windows by itself alone.

    Args:
        carried: share of light that Russian roulette starts with; None: roulette starts late.
    """
    K = mi.UInt32(bins.size)
    width = opaque(bins.size * len(tracer.groups), mi.UInt32)
    none = mi.UInt32(0)
    depth = mi.UInt32(0)  # bounces so far
    early = carried is not None
    carried = mi.Float(1.0 if carried is None else carried)  # product of reflectances so far
    entry, later = mi.UInt32(entry), mi.UInt32(later)  # copies: the loop changes them
    counts = mi.UInt32(0 if counted is None else counted)
    counting = bounces is not None
    area = tracer.window_area(room)
    shiny = tracer.gloss is not None
    by_gloss = mi.Bool(mirrored is not None)  # the path goes on as a mirror sends it
    onwards = mi.Vector3f(normal if mirrored is None else mirrored)
    while active:
        u_window = mi.Point2f(generator.next_float32(), generator.next_float32())
        u_bounce = mi.Point2f(generator.next_float32(), generator.next_float32())
        if depth == 0:
            u_window = lattice_2d(sample, stream, 0)
            u_bounce = lattice_2d(sample, stream, 2)
        elif depth == 1:
            u_window = lattice_2d(sample, stream, 4)

        # ----- Next event: a point on the windows -----
        target, group = tracer.sample_window(u_window, active, room)
        to_window = target - position
        distance2 = dr.squared_norm(to_window)
        distance = dr.sqrt(distance2)
        omega = to_window / distance
        local = tracer.to_local(group, omega, active)
        cos_start = dr.dot(normal, omega)
        visible = active & (cos_start > 0) & (local.z > 1e-4)
        if dr.hint(shiny, mode="scalar"):
            visible &= ~by_gloss
        shadow = mi.Ray3f(position, omega, distance * (1 - 1e-4), 0.0, [])
        visible &= ~tracer.scene.ray_test(shadow, coherent=False, active=visible)
        density_area = distance2 / (area * local.z)
        value = cos_start / (density_area + cos_start * dr.inv_pi)
        patch = mi.UInt32(group) * K + bins.index(local)
        if dr.hint(light is None, mode="scalar"):
            dr.scatter_add(matrix, mi.Float64(beta * value), entry + patch, visible)
            if dr.hint(counting, mode="scalar"):
                bounces.add(matrix, beta * value, counts, entry + patch, visible)
        drawn, drawn_value = mi.UInt32(patch), dr.select(visible, beta * value, 0.0)

        # ----- Next direction: cosine about the normal -----
        frame = mi.Frame3f(normal)
        local_out = mi.warp.square_to_cosine_hemisphere(u_bounce)
        direction = frame.to_world(local_out)
        if dr.hint(shiny, mode="scalar"):
            direction = dr.select(by_gloss, onwards, direction)
        ray = tracer.ray(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        active &= hit.is_valid()
        group_hit = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)

        # ----- The cosine sample found a window: the other half of the heuristic -----
        glazed = active & (group_hit != OPAQUE)
        local = tracer.to_local(group_hit, direction, glazed)
        glazed &= local.z > 1e-4
        cos_start = local_out.z
        density_area = hit.t * hit.t / (area * local.z)
        value = cos_start / (density_area + cos_start * dr.inv_pi)
        if dr.hint(shiny, mode="scalar"):
            value = dr.select(by_gloss, 1.0, value)
        patch = mi.UInt32(group_hit) * K + bins.index(local)
        if dr.hint(light is None, mode="scalar"):
            dr.scatter_add(matrix, mi.Float64(beta * value), entry + patch, glazed)
            if dr.hint(counting, mode="scalar"):
                bounces.add(matrix, beta * value, counts, entry + patch, glazed)
        else:
            first = dr.select(depth == 0, none, width)
            met_value = dr.select(glazed, beta * value, 0.0)
            light.add(matrix, entry, first + drawn, drawn_value, first + patch, met_value)

        # ----- Bounce: E(x) gains rho E(hit); Russian roulette -----
        position, normal, rho = tracer.surface_at(hit, position, direction, active)
        if dr.hint(shiny, mode="scalar"):
            glossy, onwards, rho = tracer.gloss.leave(hit.prim_index, normal, direction, rho, generator, active)
            beta *= dr.select(by_gloss, 1.0, dr.pi) * dr.select(glossy, 1.0, dr.inv_pi)
            by_gloss = mi.Bool(glossy)
        if dr.hint(counting, mode="scalar"):
            counts += bounces.met(tracer, hit.prim_index, active & ~by_gloss)
        beta *= rho
        carried *= rho
        depth += 1
        entry += later
        later = mi.UInt32(0)
        if dr.hint(early, mode="scalar"):
            survival = dr.minimum(carried * ROULETTE, 1.0)
        else:
            # by what is left, not by beta: a picture's is small, and survivors would shine
            survival = dr.select(depth > 3, dr.minimum(carried * 2.0, 0.95), 1.0)
        active &= (generator.next_float32() < survival) & (depth < max_depth) & (beta > 0)
        beta /= dr.maximum(survival, 1e-6)
        carried /= dr.maximum(survival, 1e-6)


def add_mirrored(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    hit: mi.PreliminaryIntersection3f,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    *,
    entry: mi.UInt32,  # as of `add_view_paths`
    later: mi.UInt32,  # entries further on that what comes after the first bounce is added to
    beta: mi.Float,  # weight of the radiance of what the rays meet
    sample: mi.UInt32,
    stream: mi.UInt32,
    generator: mi.PCG32,
    max_depth: mi.UInt32,
    active: mi.Bool,
    room: mi.UInt32 | None = None,
    bounces: BounceCounts | None = None,
) -> None:
    """Add the light that the gloss of surfaces reflects to rays with first hits `hit`."""
    position, face, _ = tracer.surface_at(hit, origin, direction, active)
    glossy, onwards, weight = tracer.gloss.leave(hit.prim_index, face, direction, mi.Float(0), generator, active)
    add_view_paths(
        tracer,
        bins,
        matrix,
        entry,
        position,
        face,
        later=later,
        beta=dr.select(glossy, beta * weight, 0.0),
        sample=sample,
        stream=mi.sample_tea_32(stream, mi.UInt32(0x6A09E667))[0],
        generator=generator,
        max_depth=max_depth,
        active=glossy & (weight > 0),
        carried=None,
        mirrored=onwards,
        light=None,
        room=room,
        bounces=bounces,
        counted=None,
    )
