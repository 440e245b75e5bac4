"""Light through glass between rooms, from the windows of the adjacent room.

`adjacent_daylight` is the daylight matrix D of the glass; `adjacent_view` the irradiance of sensors
by the beam that passes it straight.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
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
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.matrices.pixel_view import add_seen_and_reflected


def adjacent_daylight(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    luminance: NDArray[np.float64],
    inner: Sequence[WindowGroup],
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 512,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Daylight matrices [I, K, P] of glass to an adjacent room: radiance per unit sky radiance.

        D[i, k, p] = sum over g, k' of V[i, k, g k'] (T D)[g k', p]

    V is the radiance incident on the glass from patch k, averaged over its area, per unit radiance
    of a patch of the adjacent room's windows, interreflection included.

    Args:
        surfaces: of the adjacent room.
        groups: its windows, black to light from the room.
        luminance: T D of these windows [G, K, P], towards the adjacent room.
        inner: the glass, with normals into the adjacent room.
        samples: paths of a patch of each piece of glass in each batch.
    """
    scenes = SceneCache() if scenes is None else scenes
    tracer, bins, n = scenes.scene(surfaces, groups), DirectionBins(basis), int(samples)
    starts = scenes.scene(Surfaces.none(), inner, windows_block=False, centre=tracer.centre)
    flat = luminance.reshape(-1, luminance.shape[-1])

    def follow(matrix: mi.Float64, paths: WindowPaths) -> None:
        add_seen_and_reflected(
            tracer,
            bins,
            matrix,
            mi.Point3f(paths.position + starts.exterior_normal(paths.group) * tracer.epsilon),
            paths.outward,
            mi.Bool(True),
            row=paths.row,
            beta=mi.Float(1),
            stream=paths.stream,
            sample=paths.sample,
            generator=paths.generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )

    view = window_batches(starts, bins, len(flat), n, seed, follow)
    return accumulate(
        lambda number: view(number) @ flat,
        stopping=stopping,
        label="adjacent daylight",
        entry=cache_entry(
            cache, "adjacent daylight", surfaces, groups, flat, inner, basis, n, max_depth, seed,
            by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


Room = tuple[Surfaces, Sequence[WindowGroup]]


@dataclass(frozen=True, slots=True)
class AdjacentRoomLight:
    """An adjacent room with the light of its windows."""

    surfaces: Surfaces
    groups: tuple[WindowGroup, ...]  # axis G
    luminance: NDArray[np.float64]  # T D of these [G, K, P], towards the room
    exterior: Surfaces  # in front of the first groups, which look outdoors
    beam: NDArray[np.float64]  # [G, K] transmittance of the straight beam; 0 of glass to rooms
    daylight: NDArray[np.float64]  # D of these [G, K, P]
    onward: tuple[GlassToRoom, ...] = ()  # rooms behind the last groups

    def rooms(self) -> Iterator[AdjacentRoomLight]:
        """The room itself and all rooms behind it."""
        yield self
        for behind in self.onward:
            yield from behind.room.rooms()


@dataclass(frozen=True, slots=True)
class GlassToRoom:
    """The room behind some window groups, which are parts of one pane."""

    first: int  # number of the first group
    count: int
    beam: NDArray[np.float64]  # [K] transmittance of their straight beam
    room: AdjacentRoomLight


def adjacent_view(
    room: Room,
    group: int,
    beam: NDArray[np.float64],
    beyond: AdjacentRoomLight,
    sensors: tuple[ArrayLike, ArrayLike],
    *,
    samples: int = 4096,
    max_depth: int = 32,
    stopping: Stopping | None = None,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Irradiance at sensors straight through a window group [S, P], per unit sky radiance.

    Rays of the sensors that meet the group go on into the adjacent room with the probability
    `beam`, and in the same way through glass to rooms behind it.

    Args:
        room: surfaces and window groups of the sensors' room.
        group: number of the window group to the adjacent room.
        beam: [K] transmittance of the straight beam of the group.
        beyond: the adjacent room.
        sensors: positions [S, 3] [m] and normals [S, 3].
        samples: paths of a sensor in each batch.
    """
    scenes = SceneCache() if scenes is None else scenes
    points, directions = sensors_of(*sensors)
    here, bins, n, S = scenes.scene(*room), DirectionBins(KLEMS_FULL), int(samples), len(points)
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
            scenes=scenes, centre=here.centre, row=sensor, stream=stream, sample=sample,
            generator=generator,
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )  # fmt: skip
        dr.eval(*sums)
        each = zip(sums, flat, strict=True)
        return sum(sums_of(one, (S, len(light))) @ light for one, light in each) * (np.pi / n)

    return accumulate(
        batch,
        stopping=stopping,
        label="adjacent view",
        entry=cache_entry(
            cache, "adjacent view", room, group, beam, beyond, points, directions, n,
            max_depth, seed, by=__name__, stopping=stopping,
        ),
    )  # fmt: skip


def _add_paths(
    room: AdjacentRoomLight,
    sums: Iterator[mi.Float64],
    bins: DirectionBins,
    start: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
    *,
    scenes: SceneCache,
    centre: NDArray[np.float64],
    generator: mi.PCG32,
    **paths: Any,
) -> None:
    """Add the light that rays meet in a room, and through its glass in the rooms behind it."""
    tracer, matrix = scenes.scene(room.surfaces, room.groups, centre=centre), next(sums)
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
            scenes=scenes, centre=centre, generator=generator, **paths,
        )  # fmt: skip
        active &= ~met
    add_seen_and_reflected(
        tracer, bins, matrix, start, direction, active,
        beta=mi.Float(1), generator=generator, **paths,
    )  # fmt: skip
