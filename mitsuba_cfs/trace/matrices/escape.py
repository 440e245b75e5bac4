"""Leaks of a room's model: the share of a sensor's view that leaves it through no window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.random_walk import PathStarts, roulette
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene

SIDES = ("west", "east", "south", "north", "floor", "ceiling")  # of the box round a room
FIGURES = 4  # share, and share times x, y, z
BATCHES = 4


@dataclass(frozen=True, slots=True)
class Escape:
    """Shares of the sensors' view, direct and reflected, that leave the room through leaks."""

    share: NDArray[np.float64]  # [S] of what a sensor sees
    error: NDArray[np.float64]  # [S] standard error
    by_side: NDArray[np.float64]  # [S, 6] by the side (`SIDES`) of the box round the room
    place: NDArray[np.float64]  # [6, 3] mean point of each side where it is left [m]; NaN if never


def escaped_view(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    points: ArrayLike,
    directions: ArrayLike,
    *,
    samples: int = 1024,
    max_depth: int = 16,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> Escape:
    """Share of each sensor's view that meets neither a surface nor a window, and its points.

        share[s] = 1/pi integral over the directions that leave, + rho times that of the hits

    A row sum of V over pi, this and what the room absorbs make 1.  These are paths of their own,
    few of them: the view matrix is the same with and without.

    Args:
        surfaces, groups, points, directions: as of `view_matrix`.
        samples: paths of each sensor in each of 4 batches.
    """
    scenes = SceneCache() if scenes is None else scenes
    points, directions = sensors_of(points, directions)
    tracer = scenes.scene(surfaces, groups)
    corners = np.concatenate(
        [surfaces.triangles, *(w.triangles for group in groups for w in group.windows)]
    ).reshape(-1, 3)
    box = [tracer.place(f(axis=0)) for f in (corners.min, corners.max)]
    S, n = len(points), int(samples)
    place = vectors(points - tracer.centre, mi.Point3f)
    normal = vectors(directions)
    shape = (S, len(SIDES), FIGURES)

    def batch(number: int) -> NDArray[np.float64]:
        sums = empty_sums(math.prod(shape))
        count = dr.opaque(mi.UInt32, n)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        key = batch_key(seed, number)
        stream = mi.sample_tea_32(sensor, key ^ mi.UInt32(0x1F83D9AB))[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(path - sensor * count, stream, 0))
        starts = PathStarts(
            sensor,
            mi.Point3f(dr.gather(mi.Point3f, place, sensor)),
            mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local),
            path_generator(path, key ^ mi.UInt32(0x5BE0CD19)),
            dr.opaque(mi.UInt32, max_depth),
            mi.Bool(True),
        )
        _add_escapes(tracer, *box, sums, starts)
        return sums_of(sums, shape) / n

    found = accumulate(
        batch,
        stopping=Stopping(batches=BATCHES),
        label="escape",
        progress=progress,
        entry=cache_entry(
            cache, "escape", surfaces, groups, points, directions, n, max_depth, seed,
            by=__name__, stopping=Stopping(batches=BATCHES),
        ),
    )  # fmt: skip
    return _escape(found, tracer.centre)


def _escape(found: Estimate, centre: NDArray[np.float64]) -> Escape:
    """Shares and points from the sums [S, 6, 4]."""
    by_side = found.values[..., 0]
    total = found.values.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        place = total[:, 1:] / total[:, :1] + centre
    error = np.sqrt((found.standard_error[..., 0] ** 2).sum(axis=1))
    return Escape(by_side.sum(axis=1), error, by_side, place)


@dr.syntax
def _add_escapes(
    tracer: TracedScene,
    low: mi.Point3f,  # corners of the box round the room
    high: mi.Point3f,
    sums: mi.Float64,  # [rows * 6 * 4], accumulated in place
    starts: PathStarts,
) -> None:
    """Follow each path until it meets a window or nothing, is absorbed or too deep."""
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    beta = mi.Float(1.0)  # product of reflectances
    depth = mi.UInt32(0)  # bounces so far
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)

        # ----- It met nothing: where it leaves the box -----
        lost = active & ~hit.is_valid()
        end = dr.select(direction > 0, high, low)
        way = dr.select(dr.abs(direction) > 1e-8, (end - position) / direction, dr.inf)
        t = dr.maximum(dr.minimum(way.x, dr.minimum(way.y, way.z)), 0.0)
        axis = dr.select(
            way.x <= dr.minimum(way.y, way.z),
            mi.UInt32(0),
            dr.select(way.y <= way.z, mi.UInt32(1), mi.UInt32(2)),
        )
        along = dr.select(axis == 0, direction.x, dr.select(axis == 1, direction.y, direction.z))
        side = 2 * axis + dr.select(along > 0, mi.UInt32(1), mi.UInt32(0))
        slot = (row * 6 + side) * 4
        exit = position + direction * t
        dr.scatter_add(sums, mi.Float64(beta), slot, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.x), slot + 1, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.y), slot + 2, lost)
        dr.scatter_add(sums, mi.Float64(beta * exit.z), slot + 3, lost)

        # ----- Bounce off what is no window; Russian roulette -----
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)
        active &= group == OPAQUE
        position, direction, reflectance, _ = tracer.bounce(
            hit, position, direction, generator, active
        )
        depth += 1
        alive, beta = roulette(beta * reflectance, depth, generator)
        active &= alive & (depth < max_depth)
