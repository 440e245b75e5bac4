"""The sun's disc of 0.533 degrees as sensors see it through open windows, whatever fills these later.

The disc is uniform unless partly occluded, so a few rays to its rim and inside find the pairs of
sensor and sun that an edge crosses, and only these get many rays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import normalize
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.sampling import batch_key, column, lattice, opaque, opaque_vector, tables, vectors
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.sun.specular_paths import (
    CLEAR,
    SPREAD,
    SpecularPath,
    disc_direction,
    meets_box,
    specular_sun_paths,
)

RIM_RAYS = 16  # between two of them a straight edge hides 0.3 % of the disc at most
RIM = 0.998  # of the disc's area within them
DISC_RAYS = 16  # inside, for edges that leave the rim alone
EDGE_RAYS = 256  # in each batch, to a disc that an edge crosses
LANES = 2**22  # rays at once
TURN = 0.5 * (3 - 5**0.5)  # of a spiral between neighbours, the golden section of it


class SunScene:
    """The room, one specular path to the suns, the sensors, and the suns' apparent directions."""

    def __init__(
        self, inside: TracedScene, way: SpecularPath, place: mi.Point3f, normal: mi.Vector3f, towards: mi.Vector3f
    ) -> None:
        """Of sensors [S] and suns [Q]; no dataclass, which a loop of a kernel would take for its state."""
        self.inside, self.way = inside, way
        self.place, self.normal, self.towards = place, normal, towards


@dataclass(frozen=True, slots=True)
class SunDiscs:
    """Pairs of sensor and sun [S * Q] whose disc is visible through open windows, by one specular path.

    Light is the mean over the disc of cos(sensor) times the reflectance of mirrors on the path.
    """

    pair: NDArray[np.uint32]  # [n] numbers of those whose disc is whole: sensor * Q + sun
    group: NDArray[np.int16]  # [n] the window group that it is visible through
    light: NDArray[np.float32]  # [n]
    crossed: NDArray[np.uint32]  # [m] numbers of those whose disc an edge crosses

    @property
    def hidden(self) -> bool:
        """Whether no sensor sees any of the discs."""
        return not len(self.pair) and not len(self.crossed)

    def add_to(
        self,
        total: NDArray[np.float32],
        edges: DiscEdges,
        transmittance: NDArray[np.floating],
        of_edges: NDArray[np.floating],
    ) -> None:
        """Add the light of the pairs through windows with a straight beam to a sum [B, G, S * Q].

        Args:
            edges: of the crossed discs.
            transmittance: of the beam in each group, mean over the disc of each sun [G, Q].
            of_edges: the same towards what is visible of the crossed discs [B, G, m].
        """
        tau = transmittance.astype(np.float32)
        total[:, self.group, self.pair] += self.light * tau[self.group, self.pair % tau.shape[1]]
        total[:, :, self.crossed] += edges.light * of_edges.astype(np.float32)


@dataclass(frozen=True, slots=True)
class DiscEdges:
    """Discs that an edge crosses, through each window group G in some batches B; light as of `SunDiscs`."""

    light: NDArray[np.float32]  # [B, G, m]
    towards: NDArray[np.float32]  # [B, G, m, 3] mean direction to what is visible; 0 where nothing is


def sun_discs(around: SunScene, seed: int) -> SunDiscs:
    """Classify the pairs: disc hidden, whole, or crossed by an edge."""
    chosen = np.flatnonzero(_before_windows(around))
    if not len(chosen):
        none = np.empty(0, dtype=np.uint32)
        return SunDiscs(none, none.astype(np.int16), none.astype(np.float32), none)
    sensor, sun = _pair(column(chosen, mi.UInt32), dr.width(around.towards))
    stream = mi.sample_tea_32(sensor, dr.opaque(mi.UInt32, (seed ^ 0x3C6EF372) & 0xFFFFFFFF))[0]
    centre, turn = dr.gather(mi.Vector3f, around.towards, sun), lattice(sensor, stream, 4)
    found = _disc_samples(around, sensor, centre, turn, stream)
    dr.eval(found)
    light, group, is_uniform = (values.numpy() for values in found)
    whole = is_uniform & (group != OPAQUE)
    number = chosen.astype(np.uint32)
    return SunDiscs(number[whole], group[whole].astype(np.int16), light[whole], number[~is_uniform])


def crossed_discs(around: SunScene, crossed: NDArray[np.uint32], keys: mi.UInt32) -> DiscEdges:
    """The discs that an edge crosses.

    Args: crossed: numbers of the pairs [m]; keys: of the batches [B].
    """
    count = dr.width(keys)
    light = np.zeros((count, len(around.inside.groups), len(crossed)), dtype=np.float32)
    towards = np.zeros((*light.shape, 3), dtype=np.float32)
    step = max(LANES // EDGE_RAYS // count, 1)
    for start in range(0, len(crossed), step):
        some, part = crossed[start : start + step], slice(start, start + step)
        lane = dr.arange(mi.UInt32, count * len(some) * EDGE_RAYS)
        row = lane // EDGE_RAYS
        batch, place = _pair(row, len(some))
        number = dr.gather(mi.UInt32, column(some, mi.UInt32), place)
        sensor, sun = _pair(number, dr.width(around.towards))
        centre = dr.gather(mi.Vector3f, around.towards, sun)
        # the sensor's alone: an hour's light does not depend on those computed with it
        stream = mi.sample_tea_32(sensor, dr.gather(mi.UInt32, keys, batch))[0]
        direction = disc_direction(centre, _spiral(lane - row * EDGE_RAYS, EDGE_RAYS, stream))
        value, group = _rays(around, sensor, direction)
        dr.eval(direction, value, group)
        passed = np.unique(group.numpy())
        for g in passed[passed != OPAQUE].tolist():
            by_group = dr.select(group == opaque(g, mi.Int32), value, 0.0)
            total = dr.block_sum(by_group, EDGE_RAYS)
            sums = tables(total, dr.block_sum(direction * by_group, EDGE_RAYS))
            mean = sums[1] / np.maximum(sums[0], np.float32(1e-9))[:, None]
            light[:, g, part] = (sums[0] / EDGE_RAYS).reshape(count, -1)
            towards[:, g, part] = mean.reshape(count, -1, 3)
    return DiscEdges(light, towards)


@dr.syntax
def _disc_samples(
    around: SunScene, sensor: mi.UInt32, centre: mi.Vector3f, turn: mi.Float, stream: mi.UInt32
) -> tuple[mi.Float, mi.Int32, mi.Bool]:
    """Mean over rays inside the discs, the group of the first, and whether all rays agree."""
    total, first, is_uniform = mi.Float(0), mi.Int32(0), mi.Bool(True)
    number = mi.UInt32(0)
    while number < RIM_RAYS + DISC_RAYS:
        inner = number >= RIM_RAYS
        rim = mi.Point2f(RIM, (mi.Float(number) + turn) / RIM_RAYS)
        u = dr.select(inner, _spiral(number - RIM_RAYS, DISC_RAYS, stream), rim)
        value, group = _rays(around, sensor, disc_direction(centre, u))
        first = dr.select(number == 0, group, first)
        is_uniform &= group == first
        total += dr.select(inner, mi.Float(1 / DISC_RAYS), 0.0) * value
        number += 1
    return total, first, is_uniform


def _before_windows(around: SunScene) -> NDArray[np.bool_]:
    """Whether the disc of each pair [S * Q] may be visible through a window.

    The sensor faces the disc, and the ray to it meets the bounding box of a window group.
    """
    inside = around.inside
    sensor, sun = pairs(dr.width(around.place), dr.width(around.towards))
    towards = dr.gather(mi.Vector3f, around.towards, sun)
    origin = dr.gather(mi.Point3f, around.place, sensor)
    facing = dr.dot(dr.gather(mi.Vector3f, around.normal, sensor), towards) > -SPREAD
    behind = mi.Bool(False)
    for g in range(len(inside.groups)):
        behind |= _meets_group(inside, g, origin, towards)
    return np.broadcast_to((facing & behind).numpy(), dr.width(sensor))


def _rays(around: SunScene, sensor: mi.UInt32, direction: mi.Vector3f) -> tuple[mi.Float, mi.Int32]:
    """cos(sensor) times the reflectance of mirrors of rays to the sun, and the group that they pass."""
    inside, start = around.inside, dr.gather(mi.Point3f, around.place, sensor)
    cosine = dr.dot(dr.gather(mi.Vector3f, around.normal, sensor), direction)
    ray = mi.Ray3f(start, direction)
    hit = inside.scene.ray_intersect_preliminary(ray, coherent=False, active=cosine > 0)
    active = (cosine > 0) & hit.is_valid()
    group = dr.gather(mi.Int32, inside.group, hit.prim_index, active)
    active &= group != OPAQUE
    beyond = mi.Ray3f(mi.Point3f(start + direction * hit.t), direction)
    share = around.way.transmittance(beyond, active)
    local = inside.to_local(group, direction, active)
    active &= (local.z > 0) & (share > 0)
    return dr.select(active, cosine * share, 0.0), dr.select(active, group, OPAQUE)


def _meets_group(inside: TracedScene, group: int, origin: mi.Point3f, towards: mi.Vector3f) -> mi.Bool:
    """Whether a disc about a direction may meet the bounding box of a window group."""
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
    return _pair(dr.arange(mi.UInt32, first * second), second)


def _pair(number: mi.UInt32, second: int) -> tuple[mi.UInt32, mi.UInt32]:
    """Both indices of numbers of pairs."""
    size = dr.opaque(mi.UInt32, second)
    first = number // size
    return first, number - first * size


def _spiral(number: mi.UInt32, count: int, stream: mi.UInt32) -> mi.Point2f:
    """Points even over a disc, as shares of its area and of the turn (Vogel 1979's spiral)."""
    place = (mi.Float(number) + lattice(stream * 0, stream, 2)) / count
    turn = mi.Float(number) * TURN + lattice(stream * 0, stream, 3)
    return mi.Point2f(place, turn - dr.floor(turn))


@dataclass(frozen=True, slots=True)
class VisibleSuns:
    """How much of the sun's disc eyes see through each window group, by one specular path."""

    directions: NDArray[np.float64]  # [Q, 3] apparent directions to the centres of the discs
    share: NDArray[np.float32]  # [G, S, Q] of the disc, times the reflectance of mirrors on the path


def visible_suns(
    interior: Surfaces,
    exterior: Surfaces,
    groups: Sequence[WindowGroup],
    points: ArrayLike,
    suns: ArrayLike,
    *,
    seed: int = 0,
    scenes: SceneCache | None = None,
) -> list[VisibleSuns]:
    """Shares of the suns' discs that eyes see through the openings, whatever fills these.

    A sun below the horizon, such as one mirrored by water, is left out.

    Args:
        points: [S, 3] eyes [m]; suns: [Q, 3] directions to the centres of the discs.
        interior, exterior, groups, scenes: as of `direct_sun_matrix`.
    """
    scenes = SceneCache() if scenes is None else scenes
    points = np.atleast_2d(np.asarray(points, dtype=float))
    suns = normalize(np.atleast_2d(np.asarray(suns, dtype=float)))
    inside = scenes.scene(interior, groups)
    outside = scenes.scene(exterior, groups, windows_block=False)
    place = vectors(points - inside.centre, mi.Point3f)
    upwards = vectors(np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    found, key = [], column([batch_key(seed, 0)[0]], mi.UInt32)
    for way in specular_sun_paths(outside):
        apparent = way.apparent(suns)
        around = SunScene(inside, way, place, upwards, vectors(apparent))
        discs = sun_discs(around, seed)
        by_cosine = np.zeros((1, len(groups), len(points) * len(suns)), dtype=np.float32)
        edges, one = crossed_discs(around, discs.crossed, key), np.ones((len(groups), len(suns)))
        discs.add_to(by_cosine, edges, one, np.ones(edges.light.shape))
        height = np.maximum(apparent[:, 2], SPREAD)
        shares = by_cosine.reshape(len(groups), len(points), len(suns)) / height
        found.append(VisibleSuns(apparent, np.minimum(shares, 1.0).astype(np.float32)))
    return found
