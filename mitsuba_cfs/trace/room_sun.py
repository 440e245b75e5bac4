"""The sun's beam on the surfaces of a room, and what these reflect to a view's pixels.

    L[row] = sum over elements e of share[row, e] E_sun[e]

Elements are small parts of the surfaces; the sun on them is found by shadow rays, hour by hour.  A
few paths from a tile of pixels would meet the window's patch with the sun once or never, and make
the tile white or dark.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.images.view import View, rays
from mitsuba_cfs.trace.picture_sharing import FACE_STEPS
from mitsuba_cfs.trace.sampling import pixel_places
from mitsuba_cfs.trace.scene import TracedScene
from mitsuba_cfs.trace.sun_paths import Places, face_places, reflecting_places

ELEMENTS = 1024  # into which the surfaces' area is divided, about
POINTS = 4  # on each, that the sun is taken at
PATHS = 2**19  # of a view at most, but one of each pixel
RAYS = 2**18  # at once


@dataclass(frozen=True, slots=True)
class SunElements:
    """Parts of the surfaces that reflect the sun, and what each row of a picture has of them."""

    places: Places  # [e * POINTS]
    share: sparse.csr_array  # [m, e] luminance of a row per unit irradiance of an element
    smooth: sparse.csr_array  # [m, m] of rows, afterwards: the product of both would be full

    def rows(self, irradiance: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [m, h] of rows under the irradiance [e * POINTS, h] of the elements' places."""
        mean = irradiance.reshape(-1, POINTS, irradiance.shape[1]).mean(axis=1)
        return self.smooth @ (self.share @ mean)


def sun_elements(
    tracer: TracedScene,
    area: float,
    view: View,
    pixels: NDArray[np.int64],
    row: NDArray[np.int64],
    *,
    samples: int = 8,
    seed: int = 0,
) -> SunElements:
    """Elements by the places that paths of a view's pixels meet after what the pixel shows.

    Args:
        area: of the room's surfaces [m2].
        pixels, row: [n] pixels, and the row of each; a row's luminance is the sum of its pixels'.
        samples: paths of each pixel, fewer in large pictures.
    """
    samples = int(np.clip(PATHS // max(len(pixels), 1), 1, samples))
    rows, weights, met = [], [], []
    size = max(1, RAYS // samples)
    for start in range(0, len(pixels), size):
        block = pixels[start : start + size]
        of_ray, value, places = _shown(tracer, view, block, samples)
        if not places.size:
            continue
        found = reflecting_places(tracer, places, seed * 1_000_003 + start)
        rows.append(row[start : start + size][of_ray[found.path]])
        weights.append(found.weight * value[found.path])
        met.append(found.places)
    places = Places.joined(met)
    edge = float(np.sqrt(max(area, 1e-6) / ELEMENTS))
    element, count = _elements(places, edge)
    none = np.empty(0, dtype=np.int64)
    weight = np.concatenate([np.empty(0), *weights]).astype(np.float32)
    entries = weight, (np.concatenate([none, *rows]), element)
    m = int(row.max(initial=-1)) + 1
    share = sparse.csr_array(sparse.coo_array(entries, shape=(m, count)))
    alone = sparse.csr_array(sparse.eye_array(m, dtype=np.float32))
    return SunElements(places.some(_chosen(element, count, seed)), share, alone)


def _shown(
    tracer: TracedScene, view: View, pixels: NDArray[np.int64], samples: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], Places]:
    """Pixel of each ray that meets what reflects, rho / pi over the samples, and the place."""
    eye = mi.Point3f(*map(float, np.asarray(view.position) - tracer.centre))
    dx, dy = np.tile(pixel_places(samples), (len(pixels), 1)).T
    number = np.repeat(pixels, samples)
    x, y = (number % view.width + dx) / view.width, number // view.width + dy
    directions, exists = rays(view, x, 1.0 - y / view.height)
    way = mi.Vector3f(directions.T.astype(np.float32))
    ray = mi.Ray3f(eye, way)
    hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True, active=mi.Bool(exists))
    found = mi.Bool(exists) & hit.is_valid()
    rho = dr.gather(mi.Float, tracer.reflectance, hit.prim_index, found).numpy()
    places = face_places(tracer, eye, way, hit, found)
    kept = np.flatnonzero(found.numpy() & (rho > 0))
    return kept // samples, rho[kept] / (np.pi * samples), places.some(kept)


def _elements(places: Places, edge: float) -> tuple[NDArray[np.int64], int]:
    """The element of each place, cubes of an edge [m] by the side of the surface; how many."""
    if not places.size:
        return np.empty(0, dtype=np.int64), 0
    cube = np.floor(places.point / edge).astype(np.int64)
    side = np.round(places.normal * FACE_STEPS).astype(np.int64)
    table = np.concatenate([cube, side], axis=1)
    table -= table.min(axis=0)
    key = np.ravel_multi_index(tuple(table.T), tuple(table.max(axis=0) + 1))
    found, element = np.unique(key, return_inverse=True)
    return element, len(found)


def _chosen(element: NDArray[np.int64], count: int, seed: int) -> NDArray[np.int64]:
    """`POINTS` places of each element, again where it has fewer [count * POINTS]."""
    if not count:
        return np.empty(0, dtype=np.int64)
    random = np.random.default_rng(seed)
    order = np.lexsort((random.random(len(element)), element))
    ends = np.searchsorted(element[order], np.arange(count + 1))
    step = np.arange(POINTS)[None] % np.maximum(np.diff(ends), 1)[:, None]
    return order[(ends[:-1, None] + step).ravel()]
