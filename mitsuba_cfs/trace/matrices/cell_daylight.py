"""Daylight matrices of the cells of a window, from few paths that all cells share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import SharedOutdoors, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.rooms import TracedRoom, of_rooms
from mitsuba_cfs.trace.kernels.sampling import (
    Ranges,
    batch_key,
    column,
    empty_sums,
    lattice_2d,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import SceneCache, TracedScene
from mitsuba_cfs.trace.matrices.daylight import add_daylight_paths
from mitsuba_cfs.window_parts import Cells

BATCHES = 2


def cell_daylight(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    cells: Sequence[Cells],
    *,
    subdivision: int = 1,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 8,
    max_depth: int = 16,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> list[NDArray[np.float64]]:
    """Daylight matrices [C, K, P] of the cells of each window group, as `daylight_matrix`.

    Every cell sends out the same directions with the same random numbers: what two cells see alike
    is alike to the last digit, and their difference has far less noise than either.

    Args: samples: paths of each cell and patch in each of 2 batches.
    """
    room = TracedRoom(surfaces, tuple(groups))
    (found,) = cells_of_rooms(
        [room], None, [cells], [samples], subdivision=subdivision, basis=basis,
        max_depth=max_depth, seed=seed, cache=cache, scenes=scenes,
    )  # fmt: skip
    return found


def cells_of_rooms(
    rooms: Sequence[TracedRoom],
    outdoors: SharedOutdoors | None,
    cells: Sequence[Sequence[Cells]],
    samples: Sequence[int],
    *,
    subdivision: int = 1,
    basis: KlemsBasis = KLEMS_FULL,
    max_depth: int = 16,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> list[list[NDArray[np.float64]]]:
    """`cell_daylight` of several rooms of a building, traced together.

    Args:
        rooms, outdoors: as of `daylight_of_rooms`.
        cells: of each group of each room; samples: of each room.
    """
    scenes = SceneCache() if scenes is None else scenes
    bins, sky = DirectionBins(basis), SkyBins(ReinhartSky(subdivision))
    places = [
        list(_places(room.groups, of, np.zeros(3))) for room, of in zip(rooms, cells, strict=True)
    ]
    entries = [
        None if cache is None else cache.entry(
            "cell daylight", mi.variant(), room.surfaces, room.groups, *place[1:], subdivision,
            basis, n, max_depth, seed, by=__name__,
        )
        for room, place, n in zip(rooms, places, samples, strict=True)
    ]  # fmt: skip

    def traced(some: Sequence[int]) -> Callable[[int], NDArray[np.float64]]:
        if outdoors is None:
            tracer = scenes.scene(rooms[0].surfaces, rooms[0].groups)
        else:
            tracer = scenes.outdoors(outdoors, [rooms[i] for i in some])
        paths = np.array([samples[i] for i in some])
        counts = np.array([len(places[i][0]) for i in some])
        joined = (np.concatenate([places[i][part] for i in some]) for part in range(4))
        frames, corner, *sides = joined
        tables = [vectors(v) for v in (corner - tracer.centre, *sides)]
        axes = [vectors(frames[:, i]) for i in range(3)]
        return _batches(tracer, bins, sky, tables, axes, counts=counts, samples=paths,
                        max_depth=max_depth, seed=seed)  # fmt: skip

    stored = (None if entry is None else entry.read(_stored) for entry in entries)
    values = [one for one in stored if one is not None]
    if len(values) < len(rooms):
        found = of_rooms(
            rooms,
            traced,
            [None] * len(rooms),
            shapes=[(len(place[0]), bins.size, sky.size) for place in places],
            stopping=Stopping(batches=BATCHES),
            label="cell daylight",
            outdoors=True,
        )
        # their noise is a thousand times the rounding of seven digits, and nobody reads it
        values = [one.values.astype(np.float32) for one in found]
        for entry, one in zip(entries, values, strict=True):
            if entry is not None:
                entry.write({"cells": one})
    return [
        np.split(one.astype(float), np.cumsum([len(c.area) for c in of])[:-1])
        for one, of in zip(values, cells, strict=True)
    ]


def _stored(data: Mapping[str, NDArray[np.float32]]) -> NDArray[np.float32]:
    return data["cells"]


def _batches(
    tracer: TracedScene,
    bins: DirectionBins,
    sky: SkyBins,
    places: Sequence[mi.Vector3f],
    axes: Sequence[mi.Vector3f],
    *,
    counts: NDArray[np.int64],
    samples: NDArray[np.int64],
    max_depth: int,
    seed: int,
) -> Callable[[int], NDArray[np.float64]]:
    """Batches of the matrices of the cells of some rooms [C * K, P].

    Args: counts, samples: cells of each room, and paths of each of their patches.
    """
    K, lanes = bins.size, Ranges(counts * bins.size * samples)
    each, first = (column(v, mi.UInt32) for v in (samples, np.cumsum(counts) - counts))
    share = np.repeat(1.0 / samples, counts * K)[:, None]

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(counts.sum() * K * sky.size)
        room, lane = lanes.of(dr.arange(mi.UInt32, lanes.total))
        count = dr.maximum(dr.gather(mi.UInt32, each, room), 1)
        row = lane // count  # cell and patch
        cell = row // K
        patch, sample = row - cell * K, lane - row * count
        before = dr.gather(mi.UInt32, first, room)
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(patch, key)[0]
        place, across, up = (dr.gather(mi.Vector3f, table, before + cell) for table in places)
        x, y, z = (dr.gather(mi.Vector3f, axis, before + cell) for axis in axes)
        local = bins.sample(patch, lattice_2d(sample, stream, 0))
        u = lattice_2d(sample, stream, 2)
        starts = PathStarts(
            before * K + row,
            mi.Point3f(place + across * u.x + up * u.y + z * tracer.epsilon),
            x * local.x + y * local.y + z * local.z,
            path_generator(patch * count + sample, key),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        add_daylight_paths(tracer.of_lanes(room), sky, matrix, starts)
        return sums_of(matrix, (counts.sum() * K, sky.size)) * share

    return batch


def _places(
    groups: Sequence[WindowGroup], cells: Sequence[Cells], centre: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    """Frames [C, 3, 3], corners from the centre and both sides [C, 3] of all cells."""
    pairs = list(zip(groups, cells, strict=True))
    for values in (
        [np.tile(g.frame, (len(c.area), 1, 1)) for g, c in pairs],
        [c.corner @ g.frame - centre for g, c in pairs],
        [c.sides[:, :1] * g.frame[0] for g, c in pairs],
        [c.sides[:, 1:] * g.frame[1] for g, c in pairs],
    ):
        yield np.concatenate(values)
