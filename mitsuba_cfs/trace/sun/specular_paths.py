"""The ways from outdoors to the sun: straight, and by each plane that mirrors it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.sampling import opaque_vector
from mitsuba_cfs.trace.kernels.scene import TracedScene

BEFORE = 1e-3  # [m] of a window's plane, that a mirror must reach to send it light
LEAST = 1e-9  # of a direction along an axis, to divide by
CLEAR = 10  # steps off a surface that a box is wider by than what it holds


class SunWay:
    """One way: where the sun's light comes from, and what of it reaches a place."""

    def __init__(self, outside: TracedScene, plane: int | None = None) -> None:
        """Straight, or by a smooth mirror plane of the scene."""
        self._outside, self._plane = outside, plane
        self.free = plane is None and not outside.surface_count  # nothing stands before the windows

    @property
    def mirrors(self) -> bool:
        """Whether the light comes by a mirror."""
        return self._plane is not None

    def turned(self, suns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Directions [Q, 3] that the light of the suns [Q, 3] comes from."""
        if self._plane is None:
            return suns
        normal = self._outside.gloss.normals[self._plane]
        return suns - 2 * (suns @ normal)[:, None] * normal

    def reaching(self, ray: mi.Ray3f, active: mi.Bool, *, coherent: bool = False) -> mi.Float:
        """Share of the sun along rays towards it, from places outdoors: 0 where it is hidden."""
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
        """Whether rays pass the box that holds the mirrors of the plane."""
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


def sun_ways(outside: TracedScene) -> list[SunWay]:
    """All ways, the straight one first, without mirrors that no window of the scene can see."""
    mirrors = [] if outside.gloss is None else outside.gloss.mirrors
    return [SunWay(outside), *(SunWay(outside, int(p)) for p in mirrors if _seen(outside, p))]


def _seen(outside: TracedScene, plane: int) -> bool:
    """Whether a plane has a corner before one of the windows; true without any window."""
    corners = outside.gloss.corners[plane]
    windows = [window for group in outside.groups for window in group.windows]
    before = ((corners - w.triangles.mean(axis=(0, 1))) @ w.normal > BEFORE for w in windows)
    return not windows or any(map(np.any, before))


def shining(
    outside: TracedScene, facing: NDArray[np.float64], suns: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Suns [Q, 3] that stand before one of the planes with normals [G, 3], or in a mirror do."""
    if not len(suns):
        return np.zeros(0, dtype=bool)
    ways = [way.turned(suns) @ facing.T > 0 for way in sun_ways(outside)]
    return np.any(ways, axis=(0, 2))
