"""Specular sun paths, direct and after one mirror, and directions on the sun's disc."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.kernels.sampling import lattice_2d, opaque_vector
from mitsuba_cfs.trace.kernels.scene import TracedScene

SPREAD = float(1.01 * SUN_RADIUS)  # of directions on the disc about its middle, at most
BEFORE = 1e-3  # [m] in front of a window's plane, where a mirror must be to send it light
LEAST = 1e-9  # of a direction along an axis, to divide by
CLEAR = 10  # steps off a surface that a box is wider by than what it holds


class SpecularPath:
    """One specular path to the sun: its apparent direction, and its transmittance."""

    def __init__(self, outside: TracedScene, plane: int | None = None) -> None:
        """The direct path, or that by a smooth mirror plane of the scene."""
        self._outside, self._plane = outside, plane
        self.free = plane is None and not outside.surface_count  # nothing stands before the windows

    @property
    def mirrors(self) -> bool:
        """Whether the path goes by a mirror."""
        return self._plane is not None

    def apparent(self, suns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apparent directions [Q, 3] of suns [Q, 3]: mirrored in the plane."""
        if self._plane is None:
            return suns
        normal = self._outside.gloss.normals[self._plane]
        return suns - 2 * (suns @ normal)[:, None] * normal

    def transmittance(self, ray: mi.Ray3f, active: mi.Bool, *, coherent: bool = False) -> mi.Float:
        """Transmittance of rays from points outdoors to the apparent sun; 0 where it is hidden."""
        if self._plane is None:
            hidden = self._outside.hides(ray, active, coherent=coherent)
            return dr.select(active & ~hidden, mi.Float(1), mi.Float(0))
        gloss = self._outside.gloss
        active &= self._may_meet(ray)
        hit = self._outside.scene.ray_intersect_preliminary(ray, coherent=coherent, active=active)
        met = active & hit.is_valid()
        met &= gloss.plane_of(hit.prim_index, met) == self._plane
        normal = opaque_vector(gloss.normals[self._plane])
        normal = dr.mulsign(normal, -dr.dot(normal, ray.d))
        cosine = -dr.dot(normal, ray.d)
        place = mi.Point3f(ray.o + ray.d * hit.t + normal * self._outside.epsilon)
        beyond = mi.Ray3f(place, mi.Vector3f(ray.d + normal * (2 * cosine)))
        met &= ~self._outside.hides(beyond, met, coherent=coherent)
        return dr.select(met, gloss.specular(hit.prim_index, cosine, met), 0.0)

    def _may_meet(self, ray: mi.Ray3f) -> mi.Bool:
        """Whether rays meet the bounding box of the plane's mirrors."""
        corners = self._outside.gloss.corners[self._plane] - self._outside.centre
        box = corners.min(axis=0), corners.max(axis=0)
        start, margin = mi.Vector3f(ray.o), CLEAR * self._outside.epsilon
        return meets_box(start, ray.d, box, margin)


def meets_box(
    start: mi.Vector3f,
    way: mi.Vector3f,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    margin: mi.Float,
) -> mi.Bool:
    """Whether rays meet a box, given by its lowest and highest corner [3], or start within it.

    Args: margin: [m] that the box is made wider by on each side.

    Source: Kay and Kajiya 1986, "Ray tracing complex scenes" (slabs).
    """
    low, high = (opaque_vector(corner) for corner in box)
    least = mi.Vector3f(LEAST)
    way = dr.select(dr.abs(way) < least, dr.mulsign(least, way), way)
    first, second = (low - margin - start) / way, (high + margin - start) / way
    enters, leaves = dr.max(dr.minimum(first, second)), dr.min(dr.maximum(first, second))
    return leaves >= dr.maximum(enters, 0)


def specular_sun_paths(outside: TracedScene) -> list[SpecularPath]:
    """All specular paths, the direct one first, without mirrors that no window can see."""
    mirrors = [] if outside.gloss is None else outside.gloss.mirrors
    return [
        SpecularPath(outside),
        *(SpecularPath(outside, int(p)) for p in mirrors if _seen(outside, p)),
    ]


def _seen(outside: TracedScene, plane: int) -> bool:
    """Whether a mirror plane has a corner in front of a window; true without any window."""
    corners = outside.gloss.corners[plane]
    windows = [window for group in outside.groups for window in group.windows]
    before = ((corners - w.triangles.mean(axis=(0, 1))) @ w.normal > BEFORE for w in windows)
    return not windows or any(map(np.any, before))


def shining(
    outside: TracedScene, facing: NDArray[np.float64], suns: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether suns [Q, 3] are in front of a plane with normals [G, 3], directly or mirrored."""
    if not len(suns):
        return np.zeros(0, dtype=bool)
    ways = [way.apparent(suns) @ facing.T > 0 for way in specular_sun_paths(outside)]
    return np.any(ways, axis=(0, 2))


def on_disc(centre: mi.Vector3f, sample: mi.UInt32, stream: mi.UInt32) -> mi.Vector3f:
    """A direction uniform on the sun's disc."""
    return disc_direction(centre, lattice_2d(sample, stream, 2))


def disc_direction(centre: mi.Vector3f, u: mi.Point2f) -> mi.Vector3f:
    """The direction on the sun's disc at shares of its area (from the centre) and of the turn."""
    height = u.x * float(1 - np.cos(SUN_RADIUS))  # 1 - cos, which single precision has no more
    cosine, sine = 1 - height, dr.sqrt(height * (2 - height))
    phi = dr.two_pi * u.y
    frame = mi.Frame3f(centre)
    return frame.to_world(mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), cosine))
