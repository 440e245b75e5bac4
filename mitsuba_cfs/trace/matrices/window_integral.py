"""The light of windows that a point sees, integrated patch by patch rather than sampled."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import opaque
from mitsuba_cfs.trace.kernels.scene import TracedScene

STEEPEST = 1e4  # tangent of the last polar angle that is looked at
NEWTON_STEPS = 3  # the integrand is nearly linear within a ring


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
    and one shadow ray, placed as the integrand, says whether the interval is seen.  Where nothing
    stands in the way only the azimuth is left to chance, within one patch.
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
