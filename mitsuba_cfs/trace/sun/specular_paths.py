"""Specular sun paths, direct and by mirrors, and directions on the sun's disc."""

from __future__ import annotations

from collections.abc import Sequence
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
from mitsuba_cfs.trace.sun.mirror_map import MirrorMaps

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
        self._alone = SpecularPaths(outside, [planes]) if planes else None

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
        if self._alone is None:
            hidden = self._outside.hides(ray, active, coherent=coherent)
            return dr.select(active & ~hidden, mi.Float(1), mi.Float(0))
        return self._alone.transmittance(ray, opaque(0, mi.UInt32), active, coherent=coherent)


class SpecularPaths:
    """Several specular paths, for launches in which each ray follows one of them."""

    def __init__(self, outside: TracedScene, planes: Sequence[tuple[int, ...]]) -> None:
        """By the mirror planes of each path [N]."""
        self._outside = outside
        self._maps = outside.derived(_mirror_maps) if any(planes) else None
        table = np.zeros((len(planes), MOST_MIRRORS), dtype=np.uint32)
        for row, numbers in zip(table, planes, strict=True):
            row[: len(numbers)] = numbers
        self._planes = column(table.ravel(), mi.UInt32)
        self._length = column([len(numbers) for numbers in planes], mi.UInt32)

    def transmittance(self, ray: mi.Ray3f, path: mi.UInt32, active: mi.Bool, *, coherent: bool = False) -> mi.Float:
        """Transmittance of rays from points outdoors to the apparent sun; 0 where it is hidden.

        Args: path: number of each ray's path.
        """
        tau = mi.Float(1)
        if self._maps is not None:
            ray, tau, active = self._by_mirrors(ray, path, active, coherent)
        return dr.select(active & ~self._outside.hides(ray, active, coherent=coherent), tau, 0.0)

    @dr.syntax
    def _by_mirrors(
        self, ray: mi.Ray3f, path: mi.UInt32, active: mi.Bool, coherent: bool
    ) -> tuple[mi.Ray3f, mi.Float, mi.Bool]:
        """Rays behind the mirrors of their paths, what these reflect, and which rays met them all."""
        outside, gloss = self._outside, self._outside.gloss
        position, way, tau = mi.Point3f(ray.o), mi.Vector3f(ray.d), mi.Float(1)
        met, length = mi.UInt32(0), dr.gather(mi.UInt32, self._length, path, active)
        done = active & (length == 0)
        near = self._is_near(position, way, path, met, active & (length > 0))
        while near:  # few rays come close to a mirror
            plane = self._plane(path, met, near)
            hit = outside.scene.ray_intersect_preliminary(mi.Ray3f(position, way), coherent=coherent, active=near)
            near &= hit.is_valid()
            near &= gloss.plane_of(hit.prim_index, near) == mi.Int32(plane)
            normal, _ = gloss.plane(plane)
            normal = dr.mulsign(normal, -dr.dot(normal, way))
            cosine = -dr.dot(normal, way)
            tau *= gloss.specular(hit.prim_index, cosine, near)
            position = mi.Point3f(position + way * hit.t + normal * outside.epsilon)
            way = mi.Vector3f(way + normal * (2 * cosine))
            met += 1
            done |= near & (met == length)
            near = self._is_near(position, way, path, met, near & (met < length))
        return mi.Ray3f(position, way), tau, done

    def _plane(self, path: mi.UInt32, met: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """The plane of the next mirror."""
        return dr.gather(mi.UInt32, self._planes, path * MOST_MIRRORS + met, active)

    def _is_near(
        self, position: mi.Point3f, way: mi.Vector3f, path: mi.UInt32, met: mi.UInt32, active: mi.Bool
    ) -> mi.Bool:
        """Whether rays may meet the next mirror."""
        slack = CLEAR * self._outside.epsilon
        return self._maps.may_meet(position, way, self._plane(path, met, active), active, slack)


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
    return [SpecularPath(outside, planes) for planes in outside.derived(_paths_of_planes)]


def _paths_of_planes(outside: TracedScene) -> list[tuple[int, ...]]:
    """The mirror planes of each specular path."""
    return [(), *((p,) for p in _mirrors(outside) if _seen(outside, p)), *mirror_sequences(outside)]


def _mirrors(outside: TracedScene) -> list[int]:
    return [] if outside.gloss is None else [int(p) for p in outside.gloss.mirrors]


def _mirror_maps(outside: TracedScene) -> MirrorMaps:
    """Where the mirrors of each plane are."""
    gloss = outside.gloss
    return MirrorMaps([corners - outside.centre for corners in gloss.corners], gloss.normals)


def mirror_sequences(outside: TracedScene) -> list[tuple[int, ...]]:
    """Sequences of two mirror planes and more that sunlight may take to a window, shortest first.

    A plane holds all mirrors of one orientation and gloss, so that it follows itself where two
    facades face each other.  At most `MOST_SEQUENCES`, those between the largest mirrors first.
    """
    mirrors = _mirrors(outside)
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
