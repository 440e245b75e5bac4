"""What sensors see straight through glass between rooms of the windows of the room beyond."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import kept_scene
from mitsuba_cfs.trace.matrices.pixel_view import add_seen_and_reflected

Room = tuple[Surfaces, Sequence[WindowGroup]]


@dataclass(frozen=True, slots=True)
class LendingRoom:
    """A room that its glass lights, as rays from a room beside it meet it."""

    surfaces: Surfaces
    groups: tuple[WindowGroup, ...]  # axis G
    luminance: NDArray[np.float64]  # T D of these [G, K, P], towards the room
    exterior: Surfaces  # what those of them see that look outdoors, the first ones
    beam: NDArray[np.float64]  # [G, K] what goes straight on through them; 0 of those to rooms
    daylight: NDArray[np.float64]  # D of these [G, K, P]
    onward: tuple[RoomBehind, ...] = ()  # where some of the groups look into other rooms

    def rooms(self) -> Iterator[LendingRoom]:
        """The room itself and all behind it."""
        yield self
        for behind in self.onward:
            yield from behind.room.rooms()


@dataclass(frozen=True, slots=True)
class RoomBehind:
    """The room behind some of a room's groups, parts of one pane."""

    first: int  # of these groups
    count: int
    beam: NDArray[np.float64]  # [K] what goes straight on through them
    room: LendingRoom


def borrowed_view(
    room: Room,
    group: int,
    beam: NDArray[np.float64],
    beyond: LendingRoom,
    sensors: tuple[ArrayLike, ArrayLike],
    *,
    samples: int = 4096,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Irradiance at sensors straight through a window group [S, P], per unit sky radiance.

    Rays of the sensors that meet the group go on into the room beyond, a share of them by `beam`,
    and so through panes behind it.

    Args:
        room: surfaces and window groups of the sensors' room.
        group: which of its window groups the room beyond lies behind.
        beam: [K] what goes straight on in each patch of the group.
        beyond: the room beyond.
        sensors: positions [S, 3] [m] and normals [S, 3].
        samples: paths of a sensor in each batch.
    """
    points, directions = sensors_of(*sensors)
    here, bins, n, S = kept_scene(*room), DirectionBins(KLEMS_FULL), int(samples), len(points)
    flat = [one.luminance.reshape(-1, one.luminance.shape[-1]) for one in beyond.rooms()]
    place, normal = vectors(points - here.centre, mi.Point3f), vectors(directions)
    passed = mi.Float(np.asarray(beam, dtype=np.float32))

    def batch(number: int) -> NDArray[np.float64]:
        sums = [empty_sums(S * len(one)) for one in flat]
        count, key = dr.opaque(mi.UInt32, n), batch_key(seed, number)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        sample, stream = path - sensor * count, mi.sample_tea_32(sensor, key)[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(sample, stream, 0))
        away = mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local)
        start, generator = dr.gather(mi.Point3f, place, sensor), path_generator(path, key)
        hit = here.scene.ray_intersect_preliminary(mi.Ray3f(start, away), coherent=False)
        active = here.leaves(hit, away, mi.Bool(True))
        active &= dr.gather(mi.Int32, here.group, hit.prim_index, active) == opaque(group, mi.Int32)
        patch = bins.index(here.to_group(group, away))
        active &= generator.next_float32() < dr.gather(mi.Float, passed, patch, active)
        start = start + away * hit.t + here.exterior_normal(group) * here.epsilon
        _add_paths(
            beyond, iter(sums), bins, start, mi.Vector3f(away), active,
            centre=here.centre, row=sensor, stream=stream, sample=sample, generator=generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )  # fmt: skip
        dr.eval(*sums)
        each = zip(sums, flat, strict=True)
        return sum(sums_of(one, (S, len(light))) @ light for one, light in each) * (np.pi / n)

    return accumulate(
        batch,
        stopping=stopping,
        label="borrowed view",
        entry=cache_entry(
            cache, "borrowed view", room, group, beam, beyond, points, directions, n,
            max_depth, seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def _add_paths(
    room: LendingRoom,
    sums: Iterator[mi.Float64],
    bins: DirectionBins,
    start: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
    *,
    centre: NDArray[np.float64],
    generator: mi.PCG32,
    **paths: Any,
) -> None:
    """What rays find in a room, and straight through its panes in those behind it."""
    tracer, matrix = kept_scene(room.surfaces, room.groups, centre=centre), next(sums)
    if room.onward:
        ray = mi.Ray3f(start, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        leaves = tracer.leaves(hit, direction, active)
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, leaves)
    for behind in room.onward:
        met = leaves & (group >= opaque(behind.first, mi.Int32))
        met &= group < opaque(behind.first + behind.count, mi.Int32)
        passed = mi.Float(np.asarray(behind.beam, dtype=np.float32))
        patch = bins.index(tracer.to_group(behind.first, direction))
        through = met & (generator.next_float32() < dr.gather(mi.Float, passed, patch, met))
        outside = tracer.exterior_normal(behind.first) * tracer.epsilon
        _add_paths(
            behind.room, sums, bins, start + direction * hit.t + outside, direction, through,
            centre=centre, generator=generator, **paths,
        )  # fmt: skip
        active &= ~met
    add_seen_and_reflected(
        tracer, bins, matrix, start, direction, active,
        beta=mi.Float(1), generator=generator, **paths,
    )  # fmt: skip
