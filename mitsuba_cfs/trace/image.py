"""Luminance pictures of a room lit through its windows, one matrix row for each pixel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.images.view import View, pixel_directions, pixel_rays
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.bins import DirectionBins
from mitsuba_cfs.trace.picture_sharing import numbered
from mitsuba_cfs.trace.sampling import (
    batch_key,
    column,
    empty_sums,
    opaque,
    path_generator,
    pixel_places,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.scene import OPAQUE, TracedScene, kept_scene
from mitsuba_cfs.trace.view_paths import add_mirrored, add_view_paths

BLOCK_BYTES = 128 * 2**20  # of the matrix that is held at a time
PARTS = 3  # of a pixel's row: windows seen, their light on what is seen, the rest


def luminance_pictures(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    view: View,
    window_luminance: ArrayLike,
    *,
    samples: int = 32,
    **options: Any,
) -> NDArray[np.float32]:
    """Pictures [H, ny, nx]: luminance of each pixel for every hour's window luminance.

        L[pixel, h] = sum over g, k of V[pixel, g, k] L_window[g, k, h]

    Args:
        window_luminance: [G, K, H] of the windows towards the room, T D s [cd/m2].
        samples, options: see `picture_part_blocks`.
    """
    window_luminance = np.asarray(window_luminance, dtype=np.float32)
    G, K, H = window_luminance.shape
    flat = window_luminance.reshape(G * K, H)
    pictures = np.zeros((H, view.height * view.width), dtype=np.float32)
    blocks = picture_matrix_blocks(surfaces, groups, view, samples=samples, **options)
    for pixels, matrix in blocks:
        pictures[:, pixels] = (matrix.reshape(len(pixels), G * K) @ flat).T
    return pictures.reshape(H, view.height, view.width)


def picture_matrix_blocks(
    surfaces: Surfaces, groups: Sequence[WindowGroup], view: View, **options: Any
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Blocks of the view matrix of a picture: pixel numbers [n] and their rows [n, G, K].

    The rows of a pixel hold its radiance per unit radiance of each window patch: 1 shared among the
    patches that it sees directly, and what the surfaces it sees reflect.

    Args: options: of `picture_part_blocks`.
    """
    for pixels, parts in picture_part_blocks(surfaces, groups, view, **options):
        yield pixels, parts.sum(axis=0)


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
    progress: Progress = silent,
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Blocks of the view matrix of a picture in three parts [3, n, G, K], of the same paths.

    The first holds the windows that a pixel shows, the second what surfaces that it shows reflect
    of the windows' light, the last what comes after more reflections.  Pixels that show nothing
    (row * width + column) are left out.  Results do not depend on the block size.

    Args:
        samples: paths for each pixel, at as many places within it.
        window_reflectance: [G] of the windows from the room, as if diffuse; black by default.
        pixels: [n] those to trace; one that comes again has other paths, stratified with its first.
    """
    tracer = kept_scene(surfaces, groups, window_reflectance=window_reflectance)
    bins = DirectionBins(basis)
    shape = (len(groups), bins.size)
    size = max(256, BLOCK_BYTES // (8 * PARTS * int(np.prod(shape))))
    size = min(size, max(1, 2**31 // samples))
    shown = np.flatnonzero(pixel_directions(view)[1].reshape(-1)) if pixels is None else pixels
    time = numbered(shown)
    options = {"samples": samples, "max_depth": max_depth, "seed": seed}
    for start in range(0, len(shown), size):
        part = slice(start, start + size)
        matrix = _block(tracer, bins, view, shown[part], time[part], **options)
        yield shown[part], matrix.reshape(PARTS, len(shown[part]), *shape)
        progress("picture", (start + len(shown[part])) / len(shown))


def _block(
    tracer: TracedScene,
    bins: DirectionBins,
    view: View,
    pixels: NDArray[np.int64],
    time: NDArray[np.int64],
    *,
    samples: int,
    max_depth: int,
    seed: int,
) -> NDArray[np.float32]:
    """Rows [PARTS * n, G * K] of some pixels [n], each for the first time (0) or again [n]."""
    shape = PARTS * len(pixels), bins.size * len(tracer.groups)
    matrix = empty_sums(math.prod(shape))
    eye = tracer.place(view.position)
    number, first = column(pixels, mi.UInt32), column(time * samples, mi.UInt32)
    path = column(pixels + time * view.width * view.height & 0xFFFFFFFF, mi.UInt32)
    places = pixel_places((int(time.max(initial=0)) + 1) * samples)
    for j in range(samples):
        dx, dy = places[time * samples + j].T
        directions, exists = pixel_rays(view, pixels, dx, dy)
        add_picture_paths(
            tracer,
            bins,
            matrix,
            eye,
            vectors(directions),
            column(exists, mi.Bool),
            row=dr.arange(mi.UInt32, dr.width(number)),
            apart=dr.opaque(mi.UInt32, len(pixels)),
            stream=number,
            sample=first + dr.opaque(mi.UInt32, j),
            generator=path_generator(path, batch_key(seed, j)),
            max_depth=dr.opaque(mi.UInt32, max_depth),
        )
        dr.eval(matrix)
    return (sums_of(matrix, shape) / samples).astype(np.float32)


def add_picture_paths(
    tracer: TracedScene,
    bins: DirectionBins,
    matrix: mi.Float64,
    eye: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
    *,
    row: mi.UInt32,
    apart: mi.UInt32,  # rows between what is seen, what that reflects, and what more reflect; or 0
    stream: mi.UInt32,  # of the stratified samples: a pixel
    sample: mi.UInt32,
    generator: mi.PCG32,
    max_depth: mi.UInt32,
) -> None:
    """One path for each lane: L = 1 of the patch seen directly, else rho / pi E of the surface."""
    K = mi.UInt32(bins.size)
    width = opaque(bins.size * len(tracer.groups), mi.UInt32)
    ray = mi.Ray3f(eye, direction)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True, active=active)
    active = active & hit.is_valid()
    group = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)

    glazed = active & (group != OPAQUE)
    local = tracer.to_local(group, direction, glazed)
    glazed &= local.z > 0
    slot = row * width + mi.UInt32(group) * K + bins.index(local)
    dr.scatter_add(matrix, mi.Float64(1.0), slot, glazed)

    position, face, reflectance = tracer.surface_at(hit, eye, direction, active)
    mirrors = mi.PCG32(generator)  # a copy: the loop changes what it is given
    add_view_paths(
        tracer,
        bins,
        matrix,
        row + apart,
        position,
        face,
        later=apart,
        beta=reflectance * dr.inv_pi,
        sample=sample,
        stream=mi.sample_tea_32(stream, mi.UInt32(0x1F123BB5))[0],
        generator=generator,
        max_depth=max_depth,
        active=mi.Bool(active),
        carried=None,
        mirrored=None,
    )
    if tracer.gloss is not None:
        add_mirrored(
            tracer, bins, matrix, hit, eye, direction,
            row=row, later=2 * apart, beta=mi.Float(1), sample=sample, stream=stream,
            generator=mirrors, max_depth=max_depth, active=active,
        )  # fmt: skip
