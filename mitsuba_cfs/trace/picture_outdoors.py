"""What a view shows of the outdoors straight through its windows, pixel by pixel.

The phase methods see the sky through a window in the window's Klems patches, 10 to 15 degrees wide,
and as the mean over the window.  What the system's straight beam shows is known better than that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.images.view import View, pixel_directions, rays
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.daylight_matrix import add_daylight_paths
from mitsuba_cfs.trace.direct_sun import Scattering
from mitsuba_cfs.trace.random_walk import PathStarts
from mitsuba_cfs.trace.sampling import lattice_2d, path_generator, pixel_places
from mitsuba_cfs.trace.scene import OPAQUE, TracedScene

BLOCK_BYTES = 128 * 2**20
PATCH_POINTS = 16  # directions in each window patch, for its mean transmittance
MAX_DEPTH = 16


@dataclass(frozen=True)
class OutdoorCoefficients:
    """Luminance of the pixels through the windows' straight beam, per unit luminance of the sky."""

    sky: sparse.csr_array  # [n, P] sky and ground that the pixel shows itself
    reflected: sparse.csr_array  # [n, P] what surfaces outdoors reflect to it
    beam: NDArray[np.float64]  # [G, K] transmittance of the beam, mean over each window patch


def outdoors(
    interior: Surfaces,
    exterior: Surfaces,
    groups: Sequence[WindowGroup],
    scattering: Sequence[Scattering],
    view: View,
    *,
    subdivision: int = 4,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 8,
    seed: int = 0,
) -> OutdoorCoefficients:
    """Trace every pixel through the windows to the sky; arguments as for `direct_sun_matrix`.

    Args:
        subdivision: Reinhart's MF of the sky.
        samples: paths for each pixel, at as many places within it.
    """
    inside = TracedScene(interior, groups)
    outside = TracedScene(exterior, groups, windows_block=False)
    sky = SkyBins(ReinhartSky(subdivision))
    pixels = np.flatnonzero(pixel_directions(view)[1].reshape(-1))
    size = max(256, BLOCK_BYTES // (8 * sky.size))
    free, whole = [], []
    for start in range(0, len(pixels), size):
        block = pixels[start : start + size]
        lanes = _through_windows(inside, scattering, view, block, samples)
        for rows, depth in ((free, 1), (whole, MAX_DEPTH)):
            rows.append(_rows(outside, sky, lanes, len(block), depth, seed))
    free, whole = (sparse.csr_array(sparse.vstack(rows)) for rows in (free, whole))
    return OutdoorCoefficients(free, (whole - free).maximum(0), _beams(scattering, basis))


def _through_windows(
    inside: TracedScene,
    scattering: Sequence[Scattering],
    view: View,
    pixels: NDArray[np.int64],
    samples: int,
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Rays of a block's pixels that meet a window: row, key, direction [3, r], and weight."""
    eye = mi.Point3f(*map(float, np.asarray(view.position) - inside.centre))
    row = np.repeat(np.arange(len(pixels)), samples)
    number = pixels[row]
    dx, dy = np.tile(pixel_places(samples), (len(pixels), 1)).T
    x = (number % view.width + dx) / view.width
    y = 1.0 - (number // view.width + dy) / view.height
    directions, exists = rays(view, x, y)
    way = mi.Vector3f(directions.T.astype(np.float32))
    hit = inside.scene.ray_intersect_preliminary(
        mi.Ray3f(eye, way), coherent=True, active=mi.Bool(exists)
    )
    active = hit.is_valid()
    group = dr.gather(mi.Int32, inside.group, hit.prim_index, active)
    active &= group != OPAQUE
    local = inside.to_local(group, way, active)
    weight = mi.Float(0)
    for g, system in enumerate(scattering):
        seen = active & (group == g) & (local.z > 0)
        weight = dr.select(seen, system.through(local), weight)
    weight = weight.numpy() / samples
    lit = np.flatnonzero(weight > 0)
    place = mi.Point3f(eye + way * hit.t).numpy()[:, lit]
    keys = number[lit] * samples + lit % samples
    return row[lit], keys, np.concatenate([place, directions[lit].T]), weight[lit]


def _rows(outside, sky, lanes, count, depth, seed) -> sparse.csr_array:
    """Rows [count, P] of a block."""
    row, keys, way, weight = lanes
    if not len(row):
        return sparse.csr_array((count, sky.size), dtype=np.float32)
    used, place = np.unique(row, return_inverse=True)
    matrix = dr.zeros(mi.Float64, len(used) * sky.size)
    origin, direction = way[:3].astype(np.float32), way[3:].astype(np.float32)
    key = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
    starts = PathStarts(
        mi.UInt32(place.astype(np.uint32)),
        mi.Point3f(origin),
        mi.Vector3f(direction),
        path_generator(mi.UInt32(keys.astype(np.uint32)), key),
        dr.opaque(mi.UInt32, depth),
        mi.Bool(True),
    )
    add_daylight_paths(outside, sky, matrix, starts)
    values = matrix.numpy().reshape(len(used), sky.size)
    mean = np.bincount(place, weight) / np.bincount(place)
    found = sparse.csr_array((values * mean[:, None]).astype(np.float32))
    spread = sparse.csr_array(
        (np.ones(len(used), dtype=np.float32), (used, np.arange(len(used)))), (count, len(used))
    )
    return sparse.csr_array(spread @ found)


def _beams(scattering: Sequence[Scattering], basis: KlemsBasis) -> NDArray[np.float64]:
    """Transmittance [G, K] of the straight beam, mean over each patch."""
    bins = DirectionBins(basis)
    lane = dr.arange(mi.UInt32, bins.size * PATCH_POINTS)
    patch = lane // PATCH_POINTS
    local = bins.sample(patch, lattice_2d(lane - patch * PATCH_POINTS, patch, 0))
    found = [system.through(local) + dr.zeros(mi.Float, dr.width(lane)) for system in scattering]
    return np.stack([f.numpy().reshape(-1, PATCH_POINTS).mean(axis=1) for f in found])
