"""The sun's disc straight through windows: alike all over but where an edge crosses it.

A sensor sees the disc whole or it is hidden, except at the edges of shadows.  Some rays to the rim
of the disc and into it find where; there alone many more follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.kernels.sampling import column, lattice, lattice_2d, opaque, opaque_vector
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.sun.specular_paths import CLEAR, SunWay, meets_box

RIM_RAYS = 16  # between two of them a straight edge hides 0.3 % of the disc at most
RIM = 0.998  # of the disc's area within them
DISC_RAYS = 16  # inside, for edges that leave the rim alone
EDGE_RAYS = 256  # in each batch, to a disc that an edge crosses
SPREAD = float(1.01 * SUN_RADIUS)  # of directions on the disc about its middle, at most
LANES = 2**22  # rays at once
TURN = 0.5 * (3 - 5**0.5)  # of a spiral between neighbours, the golden section of it


@dataclass(frozen=True)
class SunScene:
    """The room, the way outdoors to the suns, the sensors and where the suns' light comes from."""

    inside: TracedScene
    way: SunWay
    place: mi.Point3f  # [S]
    normal: mi.Vector3f  # [S]
    towards: mi.Vector3f  # [Q]


class SunDiscs:
    """The sun straight through windows at all pairs of sensor and sun [S * Q]."""

    def __init__(
        self, around: SunScene, scattering: Sequence[Scattering | None], seed: int
    ) -> None:
        """Find the pairs whose disc an edge crosses."""
        self._around, self._scattering = around, scattering
        chosen = np.flatnonzero(self._before_windows())
        shape = dr.width(around.place) * dr.width(around.towards)
        self._whole = [np.zeros(shape, dtype=np.float32) for _ in scattering]
        self._crossed = chosen
        if not len(chosen):
            return
        sensor, sun = self._pair(column(chosen, mi.UInt32))
        stream = mi.sample_tea_32(sensor, dr.opaque(mi.UInt32, (seed ^ 0x3C6EF372) & 0xFFFFFFFF))[0]
        centre, turn = dr.gather(mi.Vector3f, around.towards, sun), lattice(sensor, stream, 4)
        total, alike = self._looked(sensor, centre, turn, stream)
        dr.eval(total, alike)
        for whole, part in zip(self._whole, total, strict=True):
            whole[chosen] = part.numpy()
        self._crossed = chosen[~alike.numpy()]

    @dr.syntax
    def _looked(
        self, sensor: mi.UInt32, centre: mi.Vector3f, turn: mi.Float, stream: mi.UInt32
    ) -> tuple[list[mi.Float], mi.Bool]:
        """What rays inside the discs have on average, and whether all and the rim's are alike."""
        total, first, alike = [mi.Float(0) for _ in self._scattering], mi.Int32(0), mi.Bool(True)
        number = mi.UInt32(0)
        while number < RIM_RAYS + DISC_RAYS:
            inner = number >= RIM_RAYS
            rim = mi.Point2f(RIM, (mi.Float(number) + turn) / RIM_RAYS)
            u = dr.select(inner, _spiral(number - RIM_RAYS, DISC_RAYS, stream), rim)
            values, passed = self._rays(sensor, disc_direction(centre, u))
            first = dr.select(number == 0, passed, first)
            alike &= passed == first
            share = dr.select(inner, mi.Float(1 / DISC_RAYS), 0.0)
            total = _added(total, values, share)
            number += 1
        return total, alike

    def light(self, key: mi.UInt32) -> list[NDArray[np.float32]]:
        """Mean over each disc of cos(sensor) tau(sun) through each group [G][S * Q]."""
        found = [part.copy() for part in self._whole]
        step = LANES // EDGE_RAYS
        for start in range(0, len(self._crossed), step):
            crossed = self._crossed[start : start + step]
            lane = dr.arange(mi.UInt32, len(crossed) * EDGE_RAYS)
            row = lane // EDGE_RAYS
            sensor, sun = self._pair(dr.gather(mi.UInt32, column(crossed, mi.UInt32), row))
            centre = dr.gather(mi.Vector3f, self._around.towards, sun)
            # the sensor's alone: an hour's light does not hang on those computed with it
            stream = mi.sample_tea_32(sensor, key)[0]
            way = disc_direction(centre, _spiral(lane - row * EDGE_RAYS, EDGE_RAYS, stream))
            for part, values in zip(found, self._rays(sensor, way)[0], strict=True):
                part[crossed] = values.numpy().reshape(-1, EDGE_RAYS).mean(axis=1)
        return found

    def _pair(self, number: mi.UInt32) -> tuple[mi.UInt32, mi.UInt32]:
        """Sensor and sun of pairs by their number."""
        suns = dr.opaque(mi.UInt32, dr.width(self._around.towards))
        sensor = number // suns
        return sensor, number - sensor * suns

    def _before_windows(self) -> NDArray[np.bool_]:
        """Pairs [S * Q] whose disc may be seen through a window.

        The sensor faces it, and it stands behind the box that holds one of the groups.
        """
        around, inside = self._around, self._around.inside
        sensor, sun = pairs(dr.width(around.place), dr.width(around.towards))
        towards = dr.gather(mi.Vector3f, around.towards, sun)
        origin = dr.gather(mi.Point3f, around.place, sensor)
        facing = dr.dot(dr.gather(mi.Vector3f, around.normal, sensor), towards) > -SPREAD
        behind = mi.Bool(False)
        for g, system in enumerate(self._scattering):
            if system is not None:
                behind |= _meets_group(inside, g, origin, towards)
        return np.broadcast_to((facing & behind).numpy(), dr.width(sensor))

    def _rays(self, sensor: mi.UInt32, direction: mi.Vector3f) -> tuple[list[mi.Float], mi.Int32]:
        """cos(sensor) tau of rays to the sun through each group; which group passes them."""
        around = self._around
        inside, start = around.inside, dr.gather(mi.Point3f, around.place, sensor)
        cosine = dr.dot(dr.gather(mi.Vector3f, around.normal, sensor), direction)
        ray = mi.Ray3f(start, direction)
        hit = inside.scene.ray_intersect_preliminary(ray, coherent=False, active=cosine > 0)
        active = (cosine > 0) & hit.is_valid()
        group = dr.gather(mi.Int32, inside.group, hit.prim_index, active)
        active &= group != OPAQUE
        beyond = mi.Ray3f(mi.Point3f(start + direction * hit.t), direction)
        share = around.way.reaching(beyond, active)
        local = inside.to_local(group, direction, active)
        active &= (local.z > 0) & (share > 0)
        passed = dr.select(active, group, OPAQUE)
        values = [
            dr.zeros(mi.Float, dr.width(cosine))
            if system is None
            else dr.select(passed == g, cosine * share * system.through(local), 0.0)
            for g, system in enumerate(self._scattering)
        ]
        return values, passed


def _added(total: list[mi.Float], values: list[mi.Float], share: mi.Float) -> list[mi.Float]:
    return [a + share * b for a, b in zip(total, values, strict=True)]


def _meets_group(
    inside: TracedScene, group: int, origin: mi.Point3f, towards: mi.Vector3f
) -> mi.Bool:
    """Whether a disc about a direction may lie behind the box of a group, in the group's frame."""
    windows = inside.groups[group].windows
    corners = np.concatenate([w.triangles for w in windows]).reshape(-1, 3) - inside.centre
    corners = corners @ inside.groups[group].frame.T
    start, way = inside.to_group(group, mi.Vector3f(origin)), inside.to_group(group, towards)
    low, high = corners.min(axis=0), corners.max(axis=0)
    # what a ray to the disc's edge is off the middle's at the far side of the box
    reach = dr.norm(opaque_vector(0.5 * (low + high)) - start)
    reach += opaque(0.5 * np.linalg.norm(high - low))
    margin = SPREAD * reach + CLEAR * inside.epsilon
    return (way.z > -SPREAD) & meets_box(start, way, (low, high), margin)


def pairs(first: int, second: int) -> tuple[mi.UInt32, mi.UInt32]:
    """Indices of all pairs [first * second], the second running fastest."""
    index = dr.arange(mi.UInt32, first * second)
    size = dr.opaque(mi.UInt32, second)
    row = index // size
    return row, index - row * size


def on_disc(centre: mi.Vector3f, sample: mi.UInt32, stream: mi.UInt32) -> mi.Vector3f:
    """A direction uniform on the sun's disc."""
    return disc_direction(centre, lattice_2d(sample, stream, 2))


def _spiral(number: mi.UInt32, count: int, stream: mi.UInt32) -> mi.Point2f:
    """Places even over a disc, as shares of its area and of the turn (Vogel 1979's spiral)."""
    place = (mi.Float(number) + lattice(stream * 0, stream, 2)) / count
    turn = mi.Float(number) * TURN + lattice(stream * 0, stream, 3)
    return mi.Point2f(place, turn - dr.floor(turn))


def disc_direction(centre: mi.Vector3f, u: mi.Point2f) -> mi.Vector3f:
    """The direction that has a share `u.x` of the sun's disc within it, at a share of the turn."""
    height = u.x * float(1 - np.cos(SUN_RADIUS))  # 1 - cos, which single precision has no more
    cosine, sine = 1 - height, dr.sqrt(height * (2 - height))
    phi = dr.two_pi * u.y
    frame = mi.Frame3f(centre)
    return frame.to_world(mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), cosine))
