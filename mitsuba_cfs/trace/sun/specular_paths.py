"""Specular sun paths, direct and by mirrors, and directions on the sun's disc."""

from __future__ import annotations

from itertools import pairwise

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.surfaces import triangle_areas
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, opaque_vector, vectors
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import TracedScene

SPREAD = float(1.01 * SUN_RADIUS)  # of directions on the disc about its middle, at most
BEFORE = 1e-3  # [m] in front of a window's plane, where a mirror must be to send it light
MOST_MIRRORS = 3  # on a path: of a fourth pane of 15 % comes 0.05 % of the sun
MOST_SEQUENCES = 8  # of two mirrors or more: each costs as many rays as the direct sun
LEAST = 1e-9  # of a direction along an axis, to divide by
DISC_POINTS = 16  # of a disc, for its mean transmittance
TURN = 0.5 * (3 - 5**0.5)  # of a spiral between neighbours, the golden section of it
CLEAR = 10  # steps off a surface that a box is wider by than what it holds


class SpecularPath:
    """One specular path to the sun: its apparent direction, and its transmittance."""

    def __init__(self, outside: TracedScene, planes: tuple[int, ...] = ()) -> None:
        """The path by smooth mirror planes of the scene, from the receiver on; none: direct."""
        self._outside, self.planes = outside, planes
        self.free = not planes and not outside.surface_count  # no obstacle outdoors

    @property
    def mirrors(self) -> bool:
        """Whether the path meets mirrors."""
        return bool(self.planes)

    def apparent(self, suns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apparent directions [Q, 3] of suns [Q, 3]: mirrored in the planes, the last one first."""
        for plane in reversed(self.planes):
            normal = self._outside.gloss.normals[plane]
            suns = suns - 2 * (suns @ normal)[:, None] * normal
        return suns

    def apparent_rays(self, sun: mi.Vector3f) -> mi.Vector3f:
        """Apparent directions of directions to the sun, inside a kernel."""
        for plane in reversed(self.planes):
            normal = opaque_vector(self._outside.gloss.normals[plane])
            sun = sun - normal * (2 * dr.dot(sun, normal))
        return sun

    def transmittance(self, ray: mi.Ray3f, active: mi.Bool, *, coherent: bool = False) -> mi.Float:
        """Transmittance of rays from points outdoors to the apparent sun; 0 where it is hidden."""
        outside = self._outside
        if not self.planes:
            hidden = outside.hides(ray, active, coherent=coherent)
            return dr.select(active & ~hidden, mi.Float(1), mi.Float(0))
        gloss, tau = outside.gloss, mi.Float(1)
        for plane in self.planes:
            active &= self._may_meet(ray, plane)
            hit = outside.scene.ray_intersect_preliminary(ray, coherent=coherent, active=active)
            active &= hit.is_valid()
            active &= gloss.plane_of(hit.prim_index, active) == opaque(plane, mi.Int32)
            normal = opaque_vector(gloss.normals[plane])
            normal = dr.mulsign(normal, -dr.dot(normal, ray.d))
            cosine = -dr.dot(normal, ray.d)
            tau *= gloss.specular(hit.prim_index, cosine, active)
            position = mi.Point3f(ray.o + ray.d * hit.t + normal * outside.epsilon)
            ray = mi.Ray3f(position, mi.Vector3f(ray.d + normal * (2 * cosine)))
        active &= ~outside.hides(ray, active, coherent=coherent)
        return dr.select(active, tau, 0.0)

    def _may_meet(self, ray: mi.Ray3f, plane: int) -> mi.Bool:
        """Whether rays meet the bounding box of a plane's mirrors."""
        corners = self._outside.gloss.corners[plane] - self._outside.centre
        box = corners.min(axis=0), corners.max(axis=0)
        start, margin = mi.Vector3f(ray.o), CLEAR * self._outside.epsilon
        return meets_box(start, ray.d, box, margin)


def meets_box(
    start: mi.Vector3f, way: mi.Vector3f, box: tuple[NDArray[np.float64], NDArray[np.float64]], margin: mi.Float
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
    """All specular paths: direct, by each mirror plane that a window sees, by several mirrors."""
    mirrors = [] if outside.gloss is None else [int(p) for p in outside.gloss.mirrors]
    return [
        SpecularPath(outside),
        *(SpecularPath(outside, (p,)) for p in mirrors if _seen(outside, p)),
        *(SpecularPath(outside, planes) for planes in mirror_sequences(outside)),
    ]


def mirror_sequences(outside: TracedScene) -> list[tuple[int, ...]]:
    """Sequences of two mirror planes and more that sunlight may take to a window, shortest first.

    A plane holds all mirrors of one orientation and gloss, so that it follows itself where two
    facades face each other.  At most `MOST_SEQUENCES`, those between the largest mirrors first.
    """
    mirrors = [] if outside.gloss is None else [int(p) for p in outside.gloss.mirrors]
    facing = {(a, b): _mutual_area(outside, a, b) for a in mirrors for b in mirrors}
    sequences: list[tuple[int, ...]] = []
    ends = [(p,) for p in mirrors if _seen(outside, p)]
    for _ in range(1, MOST_MIRRORS):
        longer = [(*s, b) for s in ends for b in mirrors if facing[s[-1], b] > 0]
        longer.sort(key=lambda s: -min(facing[pair] for pair in pairwise(s)))
        ends = longer[: MOST_SEQUENCES - len(sequences)]
        sequences += ends
    return sequences


def _mutual_area(outside: TracedScene, first: int, second: int) -> float:
    """Area of the smaller of two mirror planes [m2]; 0 where neither can see the other."""
    gloss = outside.gloss
    a, b = (gloss.corners[plane].reshape(-1, 3, 3) for plane in (first, second))
    if not len(a) or not len(b):
        return 0.0
    off = [
        np.abs((others.reshape(-1, 3) - mirrors[:, :1].mean(axis=(0, 1))) @ gloss.normals[plane])
        for plane, mirrors, others in ((first, a, b), (second, b, a))
    ]
    if min(float(heights.max()) for heights in off) < BEFORE:
        return 0.0
    return float(min(triangle_areas(a).sum(), triangle_areas(b).sum()))


def _seen(outside: TracedScene, plane: int) -> bool:
    """Whether a mirror plane has a corner in front of a window; true without any window."""
    corners = outside.gloss.corners[plane]
    windows = [window for group in outside.groups for window in group.windows]
    before = ((corners - w.triangles.mean(axis=(0, 1))) @ w.normal > BEFORE for w in windows)
    return not windows or any(map(np.any, before))


def shining(outside: TracedScene, facing: NDArray[np.float64], suns: NDArray[np.float64]) -> NDArray[np.bool_]:
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
    height = u.x * float(1 - np.cos(SUN_RADIUS))  # 1 - cos, which single precision has lost
    cosine, sine = 1 - height, dr.sqrt(height * (2 - height))
    phi = dr.two_pi * u.y
    frame = mi.Frame3f(centre)
    return frame.to_world(mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), cosine))


def beam_transmittance(scattering: Scattering, towards: NDArray[np.float64]) -> NDArray[np.float32]:
    """Transmittance of a straight beam, the mean over discs [n] about local directions [n, 3]; 0 from the room."""
    found = np.zeros(len(towards), dtype=np.float32)
    outdoors = np.flatnonzero(towards[:, 2] > -SPREAD)
    if not len(outdoors):
        return found
    # in opposite pairs: what rises to one side of the disc falls to the other
    pairs = np.arange(DISC_POINTS // 2)
    share = np.tile((pairs + 0.5) / len(pairs), 2)
    turn = np.concatenate([pairs * TURN, pairs * TURN + 0.5]) % 1.0
    u = mi.Point2f(column(np.tile(share, len(outdoors))), column(np.tile(turn, len(outdoors))))
    way = disc_direction(vectors(np.repeat(towards[outdoors], DISC_POINTS, axis=0)), u)
    tau = dr.select(way.z > 0, scattering.through(way), 0.0).numpy()
    found[outdoors] = np.broadcast_to(tau, len(outdoors) * DISC_POINTS).reshape(-1, DISC_POINTS).mean(axis=1)
    return found
