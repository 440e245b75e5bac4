"""View matrices of the pixels of a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.images.view import View, pixel_directions, pixel_rays
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.bounce_counts import BounceCounts
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.kernels.pixel_rows import numbered
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    column,
    empty_sums,
    opaque,
    path_generator,
    pixel_positions,
    streams,
    sums_of,
    tables,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.kernels.view_paths import add_mirrored, add_view_paths

BLOCK_BYTES = 128 * 2**20  # of the matrix that is held at a time
NO_PATCH = -1  # of a ray that meets none


@dataclass(frozen=True, slots=True)
class PictureBlock:
    """Rows of the view matrix of some pixels [n], by the number of reflections.

    With a `PatchLight` the reflected parts have its c hours in place of the patches G * K.
    """

    pixels: NDArray[np.int64]  # [n] row * width + column
    seen: sparse.csr_array  # [n, G * K] window patches that a pixel shows directly
    row: NDArray[np.int64]  # [b] numbers of the rows that pixels share
    lit: NDArray[np.float32]  # [b, c] light of the windows after one reflection
    later: NDArray[np.float32]  # [b, c] light after more reflections


def picture_part_blocks(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    view: View,
    *,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 32,
    max_depth: int = 32,
    window_reflectance: ArrayLike | None = None,
    seed: int = 0,
    pixels: NDArray[np.int64] | None = None,
    row: NDArray[np.int64] | None = None,
    weight: NDArray[np.floating] | None = None,
    light: PatchLight | None = None,
    progress: Progress = silent,
    scenes: SceneCache | None = None,
) -> Iterator[PictureBlock]:
    """Blocks of the view matrix of a picture, by parts.

    Pixels that show nothing are left out.  Results do not depend on the block size.

    Args:
        samples: paths for each pixel, at as many places within it.
        window_reflectance: [G] of the windows from the room, as if diffuse; black by default.
        pixels: [n] to trace; repeated pixels get new paths, stratified with the first ones.
        row: [n] row of reflected light that each pixel adds to; by default one of its own.
        weight: [n] of each pixel in its row; 1 by default.
        light: luminances of hours to accumulate in place of patches; not for glossy rooms.
    """
    scenes = SceneCache() if scenes is None else scenes
    tracer = scenes.scene(surfaces, groups, window_reflectance=window_reflectance)
    if light is not None and tracer.gloss is not None:
        raise ValueError("light: expected None for a room with gloss, whose matrix is stored by patches")
    bins = DirectionBins(basis)
    shown = np.flatnonzero(pixel_directions(view)[1].reshape(-1)) if pixels is None else pixels
    row = np.arange(len(shown)) if row is None else row
    weight = np.ones(len(shown)) if weight is None else weight
    held = 2 * np.count_nonzero(np.bincount(row)) / max(len(row), 1)  # rows for each pixel
    held += tracer.gloss is not None
    columns = len(groups) * bins.size if light is None else light.hours
    size = max(256, int(BLOCK_BYTES / (8 * held * columns)))
    size = min(size, max(1, 2**31 // samples))
    time = numbered(shown)
    options = {"samples": samples, "max_depth": max_depth, "seed": seed, "light": light}
    for start in range(0, len(shown), size):
        end = start + size
        part = shown[start:end], time[start:end], row[start:end], weight[start:end]
        yield _block(tracer, bins, view, part, **options)
        progress("picture", min(end, len(shown)) / len(shown))


def _block(
    tracer: TracedScene,
    bins: DirectionBins,
    view: View,
    chosen: tuple[NDArray, NDArray, NDArray, NDArray],
    *,
    samples: int,
    max_depth: int,
    seed: int,
    light: PatchLight | None,
) -> PictureBlock:
    """Rows of some pixels.

    Args: chosen: pixels [n], their repetition numbers from 0 [n], rows and weights [n].
    """
    pixels, time, row, weight = chosen
    some = np.bincount(row) > 0
    rows, place = np.flatnonzero(some), (np.cumsum(some) - 1)[row]
    n, b = len(pixels), len(rows)
    own = n if tracer.gloss is not None else 0  # rows of what pixels show by gloss
    columns = len(tracer.groups) * bins.size
    shape = own + 2 * b, columns if light is None else light.hours
    matrix, patches = empty_sums(math.prod(shape)), []
    width = dr.opaque(mi.UInt32, shape[1])
    eye, share = tracer.place(view.position), column(weight)
    stream, first = streams(pixels, seed), column(time * samples, mi.UInt32)
    lit, again = column(own + place, mi.UInt32), dr.opaque(mi.UInt32, b)
    path = column(pixels + time * view.width * view.height & 0xFFFFFFFF, mi.UInt32)
    places = pixel_positions((int(time.max(initial=0)) + 1) * samples)
    for j in range(samples):
        dx, dy = places[time * samples + j].T
        directions, exists = pixel_rays(view, pixels, dx, dy)
        way, exist = vectors(directions), column(exists, mi.Bool)
        hit, patch, glazed = seen_patch(tracer, bins, eye, way, exist)
        add_picture_paths(
            tracer,
            bins,
            matrix,
            eye,
            way,
            hit,
            active=exist,
            entry=dr.arange(mi.UInt32, dr.width(first)) * width,
            lit=lit * width,
            later=(lit + again) * width,
            beta=share,
            stream=stream,
            sample=first + dr.opaque(mi.UInt32, j),
            generator=path_generator(path, batch_key(seed, j)),
            max_depth=dr.opaque(mi.UInt32, max_depth),
            light=light,
        )
        patches.append(tables(dr.select(glazed, mi.Int32(patch), NO_PATCH), matrix)[0])
    sums = np.divide(sums_of(matrix, shape), samples, dtype=np.float32, casting="same_kind")
    seen = _shares(np.stack(patches), weight / samples, columns)
    if own:
        seen = seen + sparse.csr_array(sums[:own])
    return PictureBlock(pixels, seen, rows, sums[own : own + b], sums[own + b :])


def _shares(patches: NDArray[np.int32], weight: NDArray[np.floating], columns: int) -> sparse.csr_array:
    """Share of each patch in each pixel [n, columns], from the patches of its rays [samples, n]."""
    _, pixel = indices = np.nonzero(patches != NO_PATCH)
    entries = weight[pixel], (pixel, patches[indices])
    shares = sparse.coo_array(entries, shape=(len(weight), columns))
    return sparse.csr_array(shares).astype(np.float32)


def seen_patch(
    tracer: TracedScene, bins: DirectionBins, eye: mi.Point3f, direction: mi.Vector3f, active: mi.Bool
) -> tuple[mi.PreliminaryIntersection3f, mi.UInt32, mi.Bool]:
    """First hits of rays, the window patch that each shows, and whether it shows one."""
    ray = mi.Ray3f(eye, direction)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True, active=active)
    met = active & hit.is_valid()
    group = dr.gather(mi.Int32, tracer.group, hit.prim_index, met)
    glazed = met & (group != OPAQUE)
    local = tracer.to_local(group, direction, glazed)
    return hit, mi.UInt32(group) * mi.UInt32(bins.size) + bins.index(local), glazed & (local.z > 0)


def add_seen_and_reflected(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    eye: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
    *,
    row: mi.UInt32,
    beta: mi.Float,
    layers: int = 1,
    **paths: Any,
) -> None:
    """Add what each ray shows to its row: the window patch that it meets, or reflected light.

    Args:
        layers: of each row, with `bounces` one more than groups.
        paths: `stream` to `bounces` of `add_picture_paths`.
    """
    hit, patch, glazed = seen_patch(tracer, bins, eye, direction, active)
    entry = row * opaque(layers * bins.size * len(tracer.groups), mi.UInt32)
    dr.scatter_add(matrix, mi.Float64(beta), entry + patch, glazed)
    add_picture_paths(
        tracer,
        bins,
        matrix,
        eye,
        direction,
        hit,
        active=active,
        entry=entry,
        lit=entry,
        later=entry,
        beta=beta,
        light=None,
        **paths,
    )


def add_picture_paths(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    eye: mi.Point3f,
    direction: mi.Vector3f,
    hit: mi.PreliminaryIntersection3f,  # of `seen_patch`
    *,
    active: mi.Bool,  # as of that
    entry: mi.UInt32,  # where the row of specular reflections begins
    lit: mi.UInt32,  # ... that of light after one reflection
    later: mi.UInt32,  # ... that of light after more reflections
    beta: mi.Float,  # weight of the path
    stream: mi.UInt32,  # of the stratified samples: a pixel
    sample: mi.UInt32,
    generator: mi.PCG32,
    max_depth: mi.UInt32,
    light: PatchLight | None,  # of `add_view_paths`; without gloss alone
    bounces: BounceCounts | None = None,
) -> None:
    """Add rho / pi E of the surface that each lane meets, by one path; nothing for a window.

    The three rows may be the same.
    """
    active = active & hit.is_valid()
    position, face, reflectance = tracer.surface_at(hit, eye, direction, active)
    mirrors = mi.PCG32(generator)  # a copy, as the loop changes it
    add_view_paths(
        tracer,
        bins,
        matrix,
        lit,
        position,
        face,
        later=later - lit,
        beta=beta * reflectance * dr.inv_pi,
        sample=sample,
        stream=mi.sample_tea_32(stream, mi.UInt32(0x1F123BB5))[0],
        generator=generator,
        max_depth=max_depth,
        active=mi.Bool(active),
        carried=None,
        mirrored=None,
        light=light,
        room=None,
        bounces=bounces,
        counted=None if bounces is None else bounces.met(tracer, hit.prim_index, active),
    )
    if tracer.gloss is not None:
        add_mirrored(
            tracer,
            bins,
            matrix,
            hit,
            eye,
            direction,
            entry=entry,
            later=later - entry,
            beta=beta,
            sample=sample,
            stream=stream,
            generator=mirrors,
            max_depth=max_depth,
            active=active,
            bounces=bounces,
        )
