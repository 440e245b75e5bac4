"""Random walks over diffuse surfaces: starts, directions after a reflection, roulette."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi


@dataclass
class PathStarts:
    """Start of one path per lane, and its largest depth."""

    row: mi.UInt32  # of the matrix or result that each path adds to
    position: mi.Point3f
    direction: mi.Vector3f
    generator: mi.PCG32
    max_depth: mi.UInt32  # most bounces
    active: mi.Bool


def diffuse_direction(normal: mi.Vector3f, generator: mi.PCG32) -> mi.Vector3f:
    """A random direction about a normal, as a diffuse surface reflects."""
    u = mi.Point2f(generator.next_float32(), generator.next_float32())
    return mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))


def roulette(beta: mi.Float, depth: mi.UInt32, generator: mi.PCG32) -> tuple[mi.Bool, mi.Float]:
    """Which paths survive Russian roulette after some bounces, and their weights."""
    survival = dr.select(depth > 2, dr.minimum(beta * 2.0, 0.95), 1.0)
    alive = (generator.next_float32() < survival) & (beta > 0)
    return alive, beta / dr.maximum(survival, 1e-6)
