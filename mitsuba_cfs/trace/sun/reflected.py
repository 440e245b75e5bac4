"""The sun that outdoor surfaces reflect to the windows, and through them straight to sensors.

    L[row] = sum over points m of share[row, m] E_sun[m]
             + sum over rough faces r that its paths meet, weight[r] f(path, sun) E_sun[r]

Paths find the surfaces that send light to a row; a few thousand of their points represent all, and
a shadow ray from each to the sun gives its irradiance hour by hour.  The paths need not meet the
sun themselves: of the reflected paths of a window patch one in five hundred would.

Source: Kajiya 1986, "The rendering equation", with next-event estimation of the sun; the points
represent others nearby as the virtual lights of Keller 1997, "Instant radiosity".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import batch_key, column, lattice_2d, opaque, tables, vectors
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.matrices.straight_view import straight_rays
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_points, reflecting_points
from mitsuba_cfs.trace.sun.outdoors import MOST_MIRRORS, PixelRays, RoughFaces, mirrored
from mitsuba_cfs.trace.sun.sun_at_points import SunAtPoints, blocks, sun_at_points, together

BOUNCES = 32  # surfaces that a path meets at most; roulette ends most before
PLACES = 1024  # largest number of points that represent the hits of paths, by default
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
MORTON_BITS = 12  # along each axis
# shifts and masks that leave two empty bits behind each of up to 16
SPREAD_BITS = ((16, 0xFF0000FF), (8, 0xF00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249))
ROUGH = 4096  # rough faces whose lobes a row sees, at most


@dataclass(frozen=True, slots=True)
class SunShares:
    """Points that reflect the sun, and the share that rows have of their irradiance."""

    places: SurfacePoints  # [m]
    share: sparse.csr_array  # [rows, m]
    rough: RoughFaces | None = None  # whose lobes the rows see

    @classmethod
    def of(cls, met: Sequence[_Met], rows: int, seed: int, *, most: int = PLACES) -> SunShares:
        """From hits of paths: one of each run of nearby points, drawn by weight, represents all.

        Weights count relative to their row, so that a sensor deep in the room gets as many points
        as one that sees more.

        Args: most: largest number of points.
        """
        places = SurfacePoints.joined([m.places for m in met])
        row = np.concatenate([np.empty(0, dtype=np.int64), *(m.row for m in met)])
        weight = np.concatenate([np.empty(0), *(m.weight for m in met)])
        few, run = _represented(places, row, weight, rows, seed, most)
        rough = RoughFaces.joined([part for m in met for part in m.rough])
        share = _sums(weight, row, run, (rows, few.size))
        return cls(few, share, _few(rough) if len(rough.weight) else None)


@dataclass(frozen=True, slots=True)
class ViewShares:
    """The same seen by sensors through an open window group: for any straight beam in it."""

    places: SurfacePoints  # [m]
    sensors: int  # S
    sensor: NDArray[np.integer]  # [n] of each hit of a path
    place: NDArray[np.integer]  # [n] that represents the hit
    weight: NDArray[np.float32]  # [n]
    way: NDArray[np.float32]  # [n, 3] local direction in which the path passes the window
    rough: tuple[RoughFaces, NDArray[np.float32]] | None = None  # of the sensors, with the same directions

    def through(self, scattering: Scattering) -> SunShares:
        """The shares of the sensors through a system's straight beam."""
        tau = _through(scattering, self.way)
        share = _sums(self.weight * tau, self.sensor, self.place, (self.sensors, self.places.size))
        if self.rough is None:
            return SunShares(self.places, share)
        rough, way = self.rough
        return SunShares(self.places, share, replace(rough, weight=rough.weight * _through(scattering, way)))


def _through(scattering: Scattering, way: NDArray[np.float32]) -> NDArray[np.float32]:
    """Transmittance of the straight beam along local directions [n, 3]."""
    if not len(way):
        return np.empty(0, dtype=np.float32)
    return np.broadcast_to(scattering.through(vectors(way)).numpy(), len(way))


def _sums(
    weight: NDArray[np.floating], row: NDArray[np.integer], column: NDArray[np.integer], shape: tuple[int, int]
) -> sparse.csr_array:
    return sparse.csr_array(sparse.coo_array((weight, (row, column)), shape=shape))


@dataclass(frozen=True, slots=True)
class _Met:
    """Points that paths met, with the row and weight of each."""

    row: NDArray[np.int64]
    weight: NDArray[np.float64]
    places: SurfacePoints
    rough: list[RoughFaces]


def window_shares(
    outside: TracedScene, *, samples: int, places: int = PLACES, seeds: Sequence[int] = (0,)
) -> list[SunShares]:
    """Sunlit outdoor surfaces in the window patches, of each seed; rows [Q * K], radiance.

    Args: samples: paths of each patch; places: largest number of points that represent the hits.
    """
    bins = DirectionBins(KLEMS_FULL)
    count = len(outside.groups) * bins.size

    def begun(seed: int) -> _Met:
        lane = dr.arange(mi.UInt32, count * samples)
        row = lane // dr.opaque(mi.UInt32, samples)
        sample = lane - row * dr.opaque(mi.UInt32, samples)
        group = row // bins.size
        patch = row - group * bins.size
        stream = mi.sample_tea_32(patch, batch_key(seed, 0) + group)[0]
        way = outside.to_world_any(group, bins.sample(patch, lattice_2d(sample, stream, 0)))
        position = outside.sample_group(group, lattice_2d(sample, stream, 2))
        weight = opaque(1.0 / samples) + dr.zeros(mi.Float, count * samples)
        return _first_met(outside, row, weight, position, way)

    starts = [partial(begun, seed) for seed in seeds]
    met = _met_by(outside, starts, seeds, count * samples)
    return [SunShares.of([one], count, seed, most=places) for one, seed in zip(met, seeds, strict=True)]


def view_shares(
    inside: TracedScene,
    outside: TracedScene,
    groups: Sequence[int],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    places: int = PLACES,
    seeds: Sequence[int] = (0,),
) -> list[ViewShares]:
    """Sunlit outdoor surfaces that sensors see straight through open window groups.

    Args:
        groups: numbers of the groups; sensors: positions and normals [S, 3].
        samples: points on the group for each sensor; places: as for `window_shares`.

    Returns: of each group, for each of the seeds.
    """
    ways: list[NDArray[np.float32]] = []

    def begun(group: int, seed: int) -> _Met:
        key = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
        _, target, omega, weight = straight_rays(inside, group, sensors, samples, key)
        local = inside.to_group(group, omega)
        dr.eval(target, omega, weight, local)
        ways.append(np.ascontiguousarray(local.numpy().T, dtype=np.float32))
        ray = dr.arange(mi.UInt32, dr.width(weight))
        return _first_met(outside, ray, weight / samples, target, omega)

    count, pairs = len(sensors[0]), [(g, seed) for g in groups for seed in seeds]
    every = _met_by(outside, [partial(begun, *pair) for pair in pairs], [s for _, s in pairs], count * samples)
    return [
        _seen(met, way, (count, samples), seed, places) for met, way, (_, seed) in zip(every, ways, pairs, strict=True)
    ]


def _seen(met: _Met, way: NDArray[np.float32], shape: tuple[int, int], seed: int, most: int) -> ViewShares:
    """What the sensors see, from hits whose rows are numbers of rays, and the directions of all rays [n, 3]."""
    count, samples = shape
    sensor, rough = met.row // samples, None
    places, place = _represented(met.places, sensor, met.weight, count, seed, most)
    faces = RoughFaces.joined(met.rough)
    if len(faces.weight):
        # `_few` takes rows for rays: the directions follow by the ray's number
        few = _few(faces, faces.pixel // samples)
        rough = replace(few, pixel=few.pixel // samples), way[few.pixel]
    smallest = (np.min_scalar_type(max(n - 1, 0)) for n in (count, places.size))
    sensor, place = (a.astype(t) for a, t in zip((sensor, place), smallest, strict=True))
    return ViewShares(places, count, sensor, place, met.weight.astype(np.float32), way[met.row], rough)


def outdoor_light(
    sets: Sequence[SunShares], outside: TracedScene, suns: NDArray[np.float64], strength: NDArray[np.float64]
) -> list[NDArray[np.float32]]:
    """Light of the rows of each set [rows, h] from sunlit outdoor surfaces.

    Args: suns: [h, 3]; strength: [h] irradiance normal to it.
    """
    sun = sun_at_points(outside, [one.places for one in sets], suns)
    return [light_of_rows(one, at, outside, suns, strength) for one, at in zip(sets, sun, strict=True)]


def light_of_rows(
    shares: SunShares, sun: SunAtPoints, outside: TracedScene, suns: NDArray[np.float64], strength: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Light of rows [rows, h] by the sun at their points; rays are traced for rough gloss alone."""
    light = np.zeros((shares.share.shape[0], len(suns)), dtype=np.float32)
    share, strength = shares.share.astype(np.float32), strength.astype(np.float32)
    for hours in blocks(shares.places.size, len(suns)):
        light[:, hours] = share @ sun.light(shares.places, suns, hours) * strength[hours]
    if shares.rough is not None:
        count = len(shares.rough.weight)
        entries = shares.rough.weight, (shares.rough.pixel, np.arange(count))
        of_row = sparse.csr_array(entries, shape=(len(light), count), dtype=np.float32)
        for hours in blocks(count, len(suns)):
            light[:, hours] += of_row @ shares.rough.lobes(outside, suns[hours]) * strength[hours]
    return light


def _met_by(outside: TracedScene, starts: Sequence[Callable[[], _Met]], seeds: Sequence[int], size: int) -> list[_Met]:
    """What the paths of several runs meet, first and later; small runs share launches.

    Args: starts: give what the paths of each run meet first; size: number of paths of each.
    """
    every = []
    for block in together([size] * len(starts)):
        begun = [start() for start in starts[block]]
        runs = [(s, one.places.size) for s, one in zip(seeds[block], begun, strict=True)]
        joined = SurfacePoints.joined([one.places for one in begun])
        later = reflecting_points(outside, joined, runs, BOUNCES, mirrored=True)
        ends = np.cumsum([count for _, count in runs])
        run = np.searchsorted(ends, later.path, side="right")
        for i, (one, (_, count)) in enumerate(zip(begun, runs, strict=True)):
            some = np.flatnonzero(run == i)
            path = later.path[some] - (ends[i] - count)
            every.append(
                _Met(
                    np.concatenate([one.row, one.row[path]]),
                    np.concatenate([one.weight, one.weight[path] * later.weight[some]]),
                    SurfacePoints.joined([one.places, later.places.some(some)]),
                    one.rough,
                )
            )
    return every


def _first_met(outside: TracedScene, row: mi.UInt32, weight: mi.Float, origin: mi.Point3f, way: mi.Vector3f) -> _Met:
    """Points that paths from windows meet first, with their BRDF rho / pi as weights [1/sr].

    Gloss sends a path on to the surfaces that it mirrors; the direct sun has the sun in a mirror.
    """
    start, along, share, of = tables(origin, way, weight, row)
    some = np.flatnonzero(share > 0)
    lanes = PixelRays(of.astype(np.int64), start.T, along.T, share.astype(float)).some(some)
    rows, values = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    places, rough = [], []
    for bounce in range(MOST_MIRRORS + 1):
        if not len(lanes.row):
            break
        direction = vectors(lanes.way.T)
        last = vectors(lanes.origin.T, mi.Point3f)
        hit, last = outside.met_outdoors(last, direction, mi.Bool(True))
        met = hit.is_valid()
        normal = dr.gather(mi.Vector3f, outside.normal, hit.prim_index, met)
        rho = outside.diffuse(hit.prim_index, dr.abs(dr.dot(normal, direction)), met)
        others = met, rho, hit.prim_index, last
        there, met, rho, prim, begun = hit_points(outside, last, direction, hit, met, *others)
        lanes = replace(lanes, origin=begun.T)
        value = lanes.weight * rho / np.pi
        kept = np.flatnonzero(met & (value > 0))
        rows.append(lanes.row[kept])
        values.append(value[kept])
        places.append(there.some(kept))
        if outside.gloss is not None:
            rough.append(_rough(outside, lanes, there, np.where(met, prim, 0), met))
        lanes = mirrored(outside, lanes, hit, bounce)
    return _Met(np.concatenate(rows), np.concatenate(values), SurfacePoints.joined(places), rough)


def _rough(
    outside: TracedScene, lanes: PixelRays, places: SurfacePoints, triangle: NDArray[np.uint32], met: NDArray[np.bool_]
) -> RoughFaces:
    """Hits on faces with rough gloss."""
    alpha = outside.gloss.roughness(column(triangle, mi.UInt32), column(met, mi.Bool)).numpy()
    rough = np.flatnonzero(alpha > 0)
    some, faces = lanes.some(rough), triangle[rough].astype(np.int64)
    return RoughFaces(some.row, some.weight, faces, some.way, places.some(rough))


def _few(rough: RoughFaces, rows: NDArray[np.int64] | None = None) -> RoughFaces:
    """The first `ROUGH` faces of each row, spread as evenly as all.

    Args: rows: of the faces, where their pixels are other numbers.
    """
    rows = rough.pixel if rows is None else rows
    order = np.argsort(rows, kind="stable")
    row = rows[order]
    kept = order[np.arange(len(row)) - np.searchsorted(row, row) < ROUGH]
    count = int(rows.max(initial=0)) + 1
    of_all = np.bincount(rows, rough.weight, count)
    of_kept = np.bincount(rows[kept], rough.weight[kept], count)
    few = rough.some(kept)
    return replace(few, weight=few.weight * (of_all / np.maximum(of_kept, 1e-30))[rows[kept]])


def _represented(
    places: SurfacePoints, row: NDArray[np.int64], weight: NDArray[np.float64], rows: int, seed: int, most: int
) -> tuple[SurfacePoints, NDArray[np.int64]]:
    """Points that represent others nearby, and which of them represents each."""
    if not len(weight):
        return places, row
    of_row = weight / np.bincount(row, weight, rows)[row]
    run, chosen = _runs(places, of_row, most, np.random.default_rng(seed))
    return places.some(chosen), run


def _runs(
    places: SurfacePoints, weight: NDArray[np.float64], most: int, random: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Runs of nearby points, equal in weight: each point's run, and the point that represents it.

    Runs follow Morton's curve over the points that face one of 26 directions.
    """
    facing = np.round(FACING * places.normal).astype(np.int64) @ [9, 3, 1]
    side = _numbered(facing - facing.min(initial=0))
    order = np.argsort((side << 3 * MORTON_BITS) + _morton(places.point), kind="stable")
    side, weight = side[order], weight[order]
    climbed, total = np.cumsum(weight), np.bincount(side, weight)
    number = np.ceil(most * total / total.sum()).astype(np.int64)
    within = (climbed - 0.5 * weight - (np.cumsum(total) - total)[side]) / total[side]
    run = np.clip((within * number[side]).astype(np.int64), 0, number[side] - 1)
    run = _numbered((np.cumsum(number) - number)[side] + run)
    of_run = np.bincount(run, weight)
    marks = np.cumsum(of_run) - random.random(len(of_run)) * of_run
    drawn = np.clip(
        np.searchsorted(climbed, marks),
        np.searchsorted(run, np.arange(len(of_run))),
        np.searchsorted(run, np.arange(len(of_run)), side="right") - 1,
    )
    runs = np.empty_like(run)
    runs[order] = run
    return runs, order[drawn]


def _numbered(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rank of small whole numbers [m] among the distinct ones."""
    there = np.bincount(values) > 0
    return (np.cumsum(there) - 1)[values]


def _morton(point: NDArray[np.float32]) -> NDArray[np.int64]:
    """Position of points [m, 3] along Morton's curve through their bounding box."""
    low, size = point.min(axis=0), max(float(np.ptp(point, axis=0).max()), 1e-6)
    cell = np.minimum((point - low) / size * 2**MORTON_BITS, 2**MORTON_BITS - 1).astype(np.int64)
    for shift, mask in SPREAD_BITS:
        cell = (cell | cell << shift) & mask
    return cell @ [1, 2, 4]
