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

from collections.abc import Callable, Iterator, Sequence
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
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_points, reflecting_points, sunlight_of_many
from mitsuba_cfs.trace.sun.outdoors import MOST_MIRRORS, PixelRays, RoughFaces, mirrored

BOUNCES = 32  # surfaces that a path meets at most; roulette ends most before
PLACES = 1024  # largest number of points that represent the hits of paths, by default
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
MORTON_BITS = 12  # along each axis
# shifts and masks that leave two empty bits behind each of up to 16
SPREAD_BITS = ((16, 0xFF0000FF), (8, 0xF00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249))
ROUGH = 4096  # rough faces whose lobes a row sees, at most
LANES = 2**22  # shadow rays at once


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
        rough = None
        if any(m.rough for m in met):
            rough = _few(RoughFaces.joined([part for m in met for part in m.rough]))
        if not len(weight):
            return cls(places, sparse.csr_array((rows, 0)), rough)
        of_row = weight / np.bincount(row, weight, rows)[row]
        run, chosen = _runs(places, of_row, most, np.random.default_rng(seed))
        few = places.some(chosen)
        share = sparse.csr_array(sparse.coo_array((weight, (row, run)), shape=(rows, len(chosen))))
        return cls(few, share, rough)


@dataclass(frozen=True, slots=True)
class _Met:
    """Points that paths met, with the row and weight of each."""

    row: NDArray[np.int64]
    weight: NDArray[np.float64]
    places: SurfacePoints
    rough: list[RoughFaces]


@dataclass(frozen=True, slots=True)
class Straight:
    """The straight beam of a window group, through which sensors see the outdoors."""

    group: int
    scattering: Scattering


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
    return _shares_of(outside, starts, seeds, (count, samples), places)


def view_shares(
    inside: TracedScene,
    outside: TracedScene,
    beams: Sequence[Straight],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    places: int = PLACES,
    seeds: Sequence[int] = (0,),
) -> list[SunShares]:
    """Sunlit outdoor surfaces that sensors see through straight beams; rows [S].

    Args:
        sensors: positions and normals [S, 3].
        samples: points on the group for each sensor; places: as for `window_shares`.

    Returns: of each beam, for each of the seeds.
    """

    def begun(beam: Straight, seed: int) -> _Met:
        key = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
        sensor, target, omega, weight = straight_rays(inside, beam.group, beam.scattering, sensors, samples, key)
        return _first_met(outside, sensor, weight / samples, target, omega)

    starts = [partial(begun, beam, seed) for beam in beams for seed in seeds]
    shape = len(sensors[0]), samples
    return _shares_of(outside, starts, [*seeds] * len(beams), shape, places)


def outdoor_light(
    sets: Sequence[SunShares], outside: TracedScene, suns: NDArray[np.float64], strength: NDArray[np.float64]
) -> list[NDArray[np.float32]]:
    """Light of the rows of each set [rows, h] from sunlit outdoor surfaces.

    Points of several sets are in one launch as long as these are small.

    Args: suns: [h, 3]; strength: [h] irradiance normal to it.
    """
    strength, light = strength.astype(np.float32), []
    each = [shares.places.size * len(suns) for shares in sets]
    for block in _together(each):
        light += _light_of_block(sets[block], outside, suns, strength)
    return light


def _light_of_block(
    sets: Sequence[SunShares], outside: TracedScene, suns: NDArray[np.float64], strength: NDArray[np.float32]
) -> list[NDArray[np.float32]]:
    """Light of the rows of some sets [rows, h]."""
    light = [np.zeros((one.share.shape[0], len(suns)), dtype=np.float32) for one in sets]
    share = [one.share.astype(np.float32) for one in sets]
    places, counts = SurfacePoints.joined([o.places for o in sets]), [o.places.size for o in sets]
    number, first = np.concatenate([np.arange(n) for n in counts]), np.cumsum([0, *counts])
    for hours in _blocks(places.size, len(suns)):
        at_places = sunlight_of_many(outside, places, suns[hours], number)
        for i, values in enumerate(light):
            values[:, hours] = share[i] @ at_places[first[i] : first[i + 1]] * strength[hours]
    for one, values in zip(sets, light, strict=True):
        if one.rough is None:
            continue
        count = len(one.rough.weight)
        entries = one.rough.weight, (one.rough.pixel, np.arange(count))
        of_row = sparse.csr_array(entries, shape=(len(values), count), dtype=np.float32)
        for hours in _blocks(count, len(suns)):
            values[:, hours] += of_row @ one.rough.lobes(outside, suns[hours]) * strength[hours]
    return light


def _together(sizes: Sequence[int]) -> Iterator[slice]:
    """Neighbours whose sizes sum to `LANES` at most, and larger ones alone."""
    first, total = 0, 0
    for i, size in enumerate(sizes):
        if i > first and total + size > LANES:
            yield slice(first, i)
            first, total = i, 0
        total += size
    if sizes:
        yield slice(first, len(sizes))


def _shares_of(
    outside: TracedScene, starts: Sequence[Callable[[], _Met]], seeds: Sequence[int], shape: tuple[int, int], most: int
) -> list[SunShares]:
    """Shares of what paths meet after what they meet first, those of several runs in one launch.

    Args: starts: give what the paths of each run meet first; shape: rows, and paths of each.
    """
    rows, samples = shape
    shares = []
    for block in _together([rows * samples] * len(starts)):
        begun = [start() for start in starts[block]]
        runs = [(s, one.places.size) for s, one in zip(seeds[block], begun, strict=True)]
        joined = SurfacePoints.joined([one.places for one in begun])
        later = reflecting_points(outside, joined, runs, BOUNCES, mirrored=True)
        ends = np.cumsum([count for _, count in runs])
        run = np.searchsorted(ends, later.path, side="right")
        for i, (one, (seed, count)) in enumerate(zip(begun, runs, strict=True)):
            some = np.flatnonzero(run == i)
            path = later.path[some] - (ends[i] - count)
            met = _Met(
                np.concatenate([one.row, one.row[path]]),
                np.concatenate([one.weight, one.weight[path] * later.weight[some]]),
                SurfacePoints.joined([one.places, later.places.some(some)]),
                one.rough,
            )
            shares.append(SunShares.of([met], rows, seed, most=most))
    return shares


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


def _few(rough: RoughFaces) -> RoughFaces:
    """The first `ROUGH` faces of each row, spread as evenly as all."""
    order = np.argsort(rough.pixel, kind="stable")
    row = rough.pixel[order]
    kept = order[np.arange(len(row)) - np.searchsorted(row, row) < ROUGH]
    rows = int(rough.pixel.max(initial=0)) + 1
    of_all = np.bincount(rough.pixel, rough.weight, rows)
    of_kept = np.bincount(rough.pixel[kept], rough.weight[kept], rows)
    few = rough.some(kept)
    return replace(few, weight=few.weight * (of_all / np.maximum(of_kept, 1e-30))[few.pixel])


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


def _blocks(places: int, hours: int) -> list[slice]:
    """Blocks of hours whose shadow rays are traced at once."""
    step = max(1, LANES // max(places, 1))
    return [slice(start, start + step) for start in range(0, hours if places else 0, step)]
