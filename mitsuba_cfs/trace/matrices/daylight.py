"""Daylight matrices: what reaches a window patch, or a sensor outdoors, from each sky patch.

Directions in which a flat receiver takes up light: the cosine times its angular acceptance.

Cells of a window have daylight matrices from few paths that all of them share.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import SharedOutdoors, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, row_slices
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.random_walk import PathStarts, roulette
from mitsuba_cfs.trace.kernels.rooms import TracedRoom, batches_of_rooms, of_rooms
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
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.window_parts import Cells

BATCHES = 2


def cells_of_rooms(
    rooms: Sequence[TracedRoom],
    outdoors: SharedOutdoors | None,
    cells: Sequence[Sequence[Cells]],
    paths: Sequence[PathOptions],
) -> list[list[NDArray[np.float32]]]:
    """Daylight matrices [C, K, P] of the cells of each window group, as `daylight_matrix`, of rooms traced together.

    Every cell sends out the same directions with the same random numbers: what two cells see alike
    is alike to the last digit, and their difference has far less noise than either.

    Args:
        rooms, outdoors: as of `daylight_of_rooms`.
        cells: of each group of each room.
        paths: of each room, which differ in their number alone, in each of 2 batches.
    """
    scenes, max_depth, seed = paths[0].scenes, paths[0].max_depth, paths[0].seed
    bins, sky = DirectionBins(KLEMS_FULL), SkyBins(ReinhartSky(1))
    places = [list(_places(room.groups, of, np.zeros(3))) for room, of in zip(rooms, cells, strict=True)]
    entries = [
        of.entry("cell daylight", room.surfaces, room.groups, *place[1:], by=__name__)
        for room, place, of in zip(rooms, places, paths, strict=True)
    ]

    def traced(some: Sequence[int]) -> NDArray[np.float32]:
        if outdoors is None:
            tracer = scenes.scene(rooms[0].surfaces, rooms[0].groups)
        else:
            tracer = scenes.outdoors(outdoors, [rooms[i] for i in some])
        samples = np.array([paths[i].samples for i in some])
        counts = np.array([len(places[i][0]) for i in some])
        joined = (np.concatenate([places[i][part] for i in some]) for part in range(4))
        frames, corner, *sides = joined
        tables = [vectors(v) for v in (corner - tracer.centre, *sides)]
        axes = [vectors(frames[:, i]) for i in range(3)]
        batch = _batches(
            tracer, bins, sky, tables, axes, counts=counts, samples=samples, max_depth=max_depth, seed=seed
        )
        return _mean([batch(number) for number in range(BATCHES)], np.repeat(1.0 / samples, counts * bins.size))

    stored = (None if entry is None else entry.read(_stored) for entry in entries)
    values = [one for one in stored if one is not None]
    if len(values) < len(rooms):
        shapes = [(len(place[0]), bins.size, sky.size) for place in places]
        of_room: dict[int, NDArray[np.float32]] = {}
        for some in batches_of_rooms(rooms, list(map(math.prod, shapes)), outdoors=True):
            ends = np.cumsum([math.prod(shapes[i][:-1]) for i in some])
            for i, one in zip(some, np.split(traced(some), ends[:-1]), strict=True):
                of_room[i] = one.reshape(shapes[i])
        values = [of_room[i] for i in range(len(rooms))]
        for entry, one in zip(entries, values, strict=True):
            if entry is not None:
                entry.write({"cells": one})
    pairs = zip(values, cells, strict=True)
    return [np.split(one, np.cumsum([len(c.area) for c in of])[:-1]) for one, of in pairs]


def _mean(sums: Sequence[NDArray[np.float64]], share: NDArray[np.float64]) -> NDArray[np.float32]:
    """The mean of batches of which each row is a share [n] of its sums [n, P].

    In single precision: their noise is a thousand times the rounding of seven digits.
    """
    mean = np.empty(sums[0].shape, dtype=np.float32)
    for some in row_slices(*mean.shape):
        weight = share[some, None]
        result = sums[0][some] * weight
        for count, of_batch in enumerate(sums[1:], 2):
            result += (of_batch[some] * weight - result) / count
        mean[some] = result
    return mean


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
    """Batches of the sums over the paths of each patch of the cells of some rooms [C * K, P].

    Args: counts, samples: cells of each room, and paths of each of their patches.
    """
    K, lanes = bins.size, Ranges(counts * bins.size * samples)
    each, first = (column(v, mi.UInt32) for v in (samples, np.cumsum(counts) - counts))

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
        return sums_of(matrix, (counts.sum() * K, sky.size))

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


ENTRIES = 4096  # of the inverse distribution


class AcceptedDirections:
    """Directions over the hemisphere with density a(theta) cos(theta) / total."""

    def __init__(self, acceptance: ArrayLike | None = None) -> None:
        """Prepare the distribution.

        Args:
            acceptance: a(theta) at even steps from 0 to 90 degrees, linear between; 1 by default.
        """
        a = np.ones(2) if acceptance is None else np.asarray(acceptance, dtype=float)
        if a.ndim != 1 or len(a) < 2 or a.min() < 0 or not a.max() > 0:
            raise ValueError("acceptance: expected two or more values, none negative, not all 0")
        # u = sin^2(theta) is even for a cosine: pi times the integral of a over u is the total
        u = np.linspace(0.0, 1.0, ENTRIES + 1)
        middle = np.arcsin(np.sqrt(0.5 * (u[1:] + u[:-1])))
        density = np.interp(middle, np.linspace(0.0, np.pi / 2, len(a)), a)
        cumulative = np.concatenate([[0.0], np.cumsum(density)]) / ENTRIES
        self.total = float(np.pi * cumulative[-1])  # projected solid angle [sr]
        inverse = np.interp(u, cumulative / cumulative[-1], u)
        self._inverse = mi.Float(inverse.astype(np.float32))

    def sample(self, u: mi.Point2f) -> mi.Vector3f:
        """A local direction, z along the receiver's normal."""
        place = u.x * ENTRIES
        index = dr.minimum(mi.UInt32(place), ENTRIES - 1)
        low = dr.gather(mi.Float, self._inverse, index)
        high = dr.gather(mi.Float, self._inverse, index + 1)
        sine2 = dr.clip(low + (high - low) * (place - mi.Float(index)), 0.0, 1.0)
        sine, phi = dr.sqrt(sine2), dr.two_pi * u.y
        return mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), dr.sqrt(1.0 - sine2))


@dr.syntax
def add_daylight_paths(
    tracer: TracedScene,
    sky: SkyBins,
    matrix: mi.Float64,  # [rows * P], accumulated in place
    starts: PathStarts,  # on the window or the sensor, outdoors
    weight: mi.Float | None = None,  # of each path, 1 by default
    patches: mi.UInt32 | None = None,  # [rows] to set to the patch met, with one path in each row of a `matrix` [rows]
) -> None:
    """Follow each path to the sky, where the patch it meets gains the product of reflectances.

    Where panes stand close before windows (a screen behind them) a path passes those that it meets
    from the room's side; to what comes back from outdoors windows are black.  A path of one segment
    may have one more by a smooth mirror, which shows the sky and the sun.
    """
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    weight = mi.Float(1.0 if weight is None else weight)
    beta = mi.Float(1.0)
    depth = mi.UInt32(0)
    in_series = tracer.panes_in_series
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        free = active & ~hit.is_valid()
        slot = row * mi.UInt32(sky.size) + sky.index(direction)
        if dr.hint(patches is not None, mode="scalar"):
            dr.scatter(patches, sky.index(direction), row, free)
            slot = mi.UInt32(row)
        dr.scatter_add(matrix, mi.Float64(beta * weight), slot, free)
        active &= hit.is_valid()
        if active:
            passed = mi.Bool(False)
            if dr.hint(in_series, mode="scalar"):
                passed = tracer.leaves(hit, direction, active)
            before, face, _ = tracer.surface_at(hit, position, direction, active)
            beyond = mi.Point3f(before - 2 * tracer.epsilon * face)
            after, away, reflectance, mirrored = tracer.bounce(hit, position, direction, generator, active)
            position = dr.select(passed, beyond, after)
            direction = dr.select(passed, direction, away)
            depth += dr.select(passed, mi.UInt32(0), mi.UInt32(1))
            alive, onwards = roulette(beta * reflectance, depth, generator)
            beta = dr.select(passed, beta, onwards)
            within = depth < max_depth
            if dr.hint(tracer.gloss is not None, mode="scalar"):
                within |= mirrored & (depth == 1) & (max_depth == 1)
            active &= passed | (alive & within)


def daylight_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    subdivision: int = 4,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 4096,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Daylight matrices [G, K, P]: mean radiance of each window patch per unit sky radiance.

        L_window[g, k] = sum over p of D[g, k, p] s[p]

    The mean is over the area of the group's windows and, weighted by the cosine, over the
    directions of the patch, so the irradiance on the group is the sum of Omega_k L_window[k].
    Sky patch 0 is the ground: a ray that leaves downwards and meets nothing.  A row of a window
    that sees no obstruction sums to 1.

    Args:
        surfaces: outdoors, in the band of the radiances, without the windows' own panes and
            anything on the room side of them.
        subdivision: Reinhart's MF (1, 2, 4, 6).
        samples: paths for each window patch in each batch.
        cache: of traced matrices, `MatrixCache.of_user()`; none by default.

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261 (three-phase method).
    """
    room = TracedRoom(surfaces, tuple(groups))
    paths = PathOptions(int(samples), max_depth, stopping, seed, progress, cache)
    (estimate,) = daylight_of_rooms([room], None, paths, subdivision=subdivision, basis=basis)
    return estimate


def daylight_of_rooms(
    rooms: Sequence[TracedRoom],
    outdoors: SharedOutdoors | None,
    paths: PathOptions,
    *,
    subdivision: int = 4,
    basis: KlemsBasis = KLEMS_FULL,
) -> list[Estimate]:
    """`daylight_matrix` of several rooms of a building, traced together.

    The random numbers of a room do not depend on the other rooms.

    Args:
        rooms: their surfaces are what is in front of the windows of each.
        outdoors: the same of all rooms; None for a single room.
    """
    scenes, seed, stopping = paths.scenes, paths.seed, paths.stopping
    bins, sky = DirectionBins(basis), SkyBins(ReinhartSky(subdivision))
    label = "daylight matrix"
    entries = [paths.entry(label, one.surfaces, one.groups, subdivision, basis, by=__name__) for one in rooms]

    def traced(some: Sequence[int]) -> Callable[[int], NDArray[np.float64]]:
        something = outdoors is not None or len(rooms[0].surfaces.triangles) > 0
        if outdoors is None:
            tracer = scenes.scene(rooms[0].surfaces, rooms[0].groups, windows_block=something)
        else:
            tracer = scenes.outdoors(outdoors, [rooms[i] for i in some])

        def follow(matrix: mi.Float64, of: WindowPaths) -> None:
            depth = dr.opaque(mi.UInt32, paths.max_depth)
            # light comes back to the windows where there is something
            clear = tracer.exterior_normal(of.group) * tracer.epsilon if something else 0.0
            place = mi.Point3f(of.position + clear)
            starts = PathStarts(of.row, place, of.outward, of.generator, depth, mi.Bool(True))
            here = tracer.of_lanes(tracer.group_in_room(of.group)[0])
            add_daylight_paths(here, sky, matrix, starts)

        batch = window_batches(tracer, bins, sky.size, paths.samples, seed, follow, stopping=stopping or Stopping())
        return lambda number: batch(number).reshape(-1, sky.size)

    return of_rooms(
        rooms,
        traced,
        entries,
        shapes=[(len(room.groups), bins.size, sky.size) for room in rooms],
        stopping=stopping,
        label=label,
        progress=paths.progress,
        outdoors=True,
    )


def sky_irradiance_matrix(
    surfaces: Surfaces,
    points: ArrayLike,
    directions: ArrayLike,
    *,
    subdivision: int = 4,
    acceptance: ArrayLike | None = None,
    samples: int = 16384,
    max_depth: int = 16,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Estimate:
    """Irradiance at sensors outdoors per unit radiance of each sky patch [S, P] [sr, projected].

        E[s] = sum over p of C[s, p] sky[p]

    A row sums to pi where nothing around the sensor absorbs.

    Args:
        points, directions: [S, 3] sensor positions [m] and normals; or [S, K, 3] points of each
            sensor, over which its row is averaged.
        acceptance: angular acceptance at even steps of incidence from 0 to 90 degrees; 1 by
            default.
        max_depth: 1 for direct sky light only.
        samples: paths for each sensor in each batch.
    """
    points = np.asarray(points, dtype=float)
    places = points if points.ndim == 3 else np.atleast_2d(points)[:, None]
    middles, directions = sensors_of(places.mean(axis=1), directions)
    if max_depth == 1:  # what the sensor sees itself, mirrors are left to the rest
        surfaces = replace(surfaces, gloss=())
    scenes = SceneCache() if scenes is None else scenes
    tracer = scenes.of_surfaces(surfaces, middles.mean(axis=0))
    sky = SkyBins(ReinhartSky(subdivision))
    accepted = AcceptedDirections(acceptance)
    S, P, n = len(places), sky.size, int(samples)
    place = vectors(places.reshape(-1, 3) - tracer.centre, mi.Point3f)
    normal = vectors(directions)

    def batch(number: int) -> NDArray[np.float64]:
        matrix = empty_sums(S * P)
        K = places.shape[1]
        count, each = dr.opaque(mi.UInt32, n), dr.opaque(mi.UInt32, K)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        turn = dr.opaque(mi.UInt32, number * n % K)  # where the last batch ended
        at = sensor * each + (path - sensor * count + turn) % each
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(sensor, key)[0]
        local = accepted.sample(lattice_2d(path - sensor * count, stream, 0))
        starts = PathStarts(
            sensor,
            mi.Point3f(dr.gather(mi.Point3f, place, at)),
            mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local),
            path_generator(path, key),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        add_daylight_paths(tracer, sky, matrix, starts)
        return sums_of(matrix, (S, P)) * (accepted.total / n)

    by_angle = () if acceptance is None else np.asarray(acceptance, dtype=float)
    paths = PathOptions(int(samples), max_depth, stopping, seed, progress, cache)
    inputs = surfaces, points, directions, subdivision, by_angle
    return paths.estimate("sky irradiance", batch, *inputs, by=__name__)
