"""The sun's beam on the surfaces of a room, and what these reflect to a view's pixels.

    L[row] = sum over elements e of share[row, e] E_sun[e]

Elements are small parts of the surfaces; the sun on them is found by shadow rays, hour by hour.  A
few paths from a tile of pixels would meet the window's patch with the sun once or never, and make
the tile white or dark.

What lies far from a place lights it much as the places beside it, and many tiles share it.  What
is near (the wall that meets the floor in a corner) does not: it is taken by rays of each tile's
own, to elements as small as they are near.  The weight of a place at distance d from a surface
that is D from the eye goes over from one to the other between d = N D / 2 and N D, N the angle
of `NEAR_TILES`.  The sun is asked for at one place of an element so near; where the edge of a
spot of sun crosses it, at many (`EdgePlaces`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import View, pixel_solid_angles
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.pixel_rows import PictureRows, shown_hits
from mitsuba_cfs.trace.kernels.pixel_sharing import FACE_STEPS, numbered
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, tables
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.sun.lit_points import Places, face_places, reflecting_places

ELEMENTS = 1024  # into which the surfaces' area is divided, about
POINTS = 4  # on each, that the sun is taken at; one on those near a tile
EDGE_POINTS = 16  # on one near a tile that the edge of a spot of sun crosses
PATHS = 2**19  # of a view at most, but one of each pixel
MOST_PATHS = 32  # of a pixel
RAYS = 2**18  # at once
NEAR_TILES = 12  # [tiles' widths] that a surface is near within, twice what smoothing spans
NEAR_RAYS = 1024  # of each tile to what is near: narrow strips of sun beside a corner are small
SAMPLES = 8  # paths of a pixel for all else, with fewer of which these too are fewer, in proportion
FINENESS = 0.5  # edge of an element near a tile over how near it is
HALVINGS = 4  # of the elements' edge at most


@dataclass(frozen=True, slots=True)
class EdgePlaces:
    """More places on the elements near rows, for those that the edge of a spot of sun crosses."""

    places: Places  # [f * EDGE_POINTS]
    beside: sparse.csr_array  # [f, f] 1 for elements that share an edge, or one holds the other

    def crossed(self, light: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Elements and hours [p] whose light [f, h] is there and not all beside, or the reverse."""
        lit = (light > 0).astype(np.uint8)
        bright, count = self.beside @ lit, np.diff(self.beside.indptr)[:, None]
        return np.nonzero(np.where(lit, bright < count, bright > 0))


@dataclass(frozen=True, slots=True)
class SunElements:
    """Parts of the surfaces that reflect the sun, and what each row of a picture has of them."""

    places: Places  # [e * POINTS + f]
    share: sparse.csr_array  # [m, e] luminance of a row per unit irradiance of an element
    near: sparse.csr_array  # [m, f] the same of the smaller elements near rows, not to be smoothed
    smooth: sparse.csr_array  # [m, m] of rows, after `share`: the product of both would be full
    edges: EdgePlaces  # of the elements near rows

    def rows(self, irradiance: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [m, h] of rows under the irradiance [.., h] of the elements' places."""
        far, near = np.split(irradiance, [POINTS * self.share.shape[1]])
        mean = far.reshape(-1, POINTS, irradiance.shape[1]).mean(axis=1)
        return self.smooth @ (self.share @ mean) + self.near @ near

    def of_rows(self, rows: sparse.csr_array, smooth: sparse.csr_array) -> SunElements:
        """Of other rows [k] that these make up [k, m], with their smoothing."""
        share, near = (sparse.csr_array(rows @ part) for part in (self.share, self.near))
        return SunElements(self.places, share, near, smooth, self.edges)


@dataclass(frozen=True, slots=True)
class SunlitRows:
    """What the rows of a picture have of the elements, whatever light comes in by the windows."""

    mean: SunElements  # of the rows [m]
    noise: SunElements  # half the difference of the rows' halves; the same places
    close: NDArray[np.bool_]  # [m] rows that show what another surface is near to


@dataclass(frozen=True, slots=True)
class _Hits:
    """Places that reflect to the rows of a picture."""

    row: NDArray[np.int64]  # [q]
    weight: NDArray[np.floating]  # [q] luminance of the row per unit irradiance of the place
    places: Places  # [q]
    halvings: NDArray[np.int8]  # [q] of the edge of the place's element

    @staticmethod
    def joined(parts: Sequence[_Hits]) -> _Hits:
        """All of several."""
        none, small = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int8)
        nothing = np.empty(0, dtype=np.float32)
        return _Hits(
            np.concatenate([none, *(p.row for p in parts)]),
            np.concatenate([nothing, *(p.weight for p in parts)]),
            Places.joined([p.places for p in parts]),
            np.concatenate([small, *(p.halvings for p in parts)]),
        )


@dataclass(frozen=True, slots=True)
class _Shown:
    """Where rays of pixels meet what reflects; axis r."""

    ray: NDArray[np.int64]  # [r] number of the pixel
    value: NDArray[np.float64]  # [r] rho / pi over the number of the pixel's rays
    places: Places
    reach: NDArray[np.float64]  # [r] how near is near [m]

    def far_share(self, path: NDArray[np.int64], met: Places) -> NDArray[np.float64]:
        """What of the light of places met first counts as far, 0 to 1."""
        return np.clip(2 * self.distance(path, met) / self.reach[path] - 1, 0.0, 1.0)

    def distance(self, path: NDArray[np.int64], met: Places) -> NDArray[np.float64]:
        """Of places from those that the paths start at [m]."""
        return np.linalg.norm(met.point - self.places.point[path], axis=1)


@dataclass(frozen=True, slots=True)
class _Pixels:
    """Pixels to trace, some of them again and again; axis p."""

    pixel: NDArray[np.int64]  # [p] row * width + column
    row: NDArray[np.int64]  # [p] half of a row: 2 * row or 1 more
    number: NDArray[np.int64]  # [p] among those of its half
    weight: NDArray[np.float64]  # [p] 1 over how often it comes

    @classmethod
    def of(cls, rows: PictureRows, chosen: NDArray[np.int64], times: NDArray[np.int64]) -> _Pixels:
        """Some pixels [n] of a picture, each so many times [n]."""
        some = np.repeat(chosen, times)
        half = rows.half[some]
        return cls(rows.pixels[some], half, numbered(half), np.repeat(1 / times, times))

    def blocks(self, samples: int) -> Iterator[_Pixels]:
        """Some at a time, so that their rays fit."""
        size = max(1, RAYS // samples)
        for start in range(0, len(self.pixel), size):
            part = slice(start, start + size)
            yield _Pixels(self.pixel[part], self.row[part], self.number[part], self.weight[part])


class _Look:
    """Traces a view's pixels to what reflects sun to what they show."""

    def __init__(self, tracer: TracedScene, view: View, tile: int, edge: float, seed: int) -> None:
        self._tracer, self._view, self._edge, self._seed = tracer, view, edge, seed
        width = float(np.sqrt(pixel_solid_angles(view).max()))
        self._near = NEAR_TILES * tile * width if tile > 1 else 0.0  # over the distance to the eye

    def far(self, part: _Pixels, samples: int, key: int) -> tuple[_Hits, NDArray[np.int64]]:
        """What paths meet but for what is near, and the rows [..] that something is near to."""
        shown, row = self._shown(part, samples), part.row
        found = reflecting_places(self._tracer, shown.places, self._seed * 1_000_003 + key)
        weight = found.weight * shown.value[found.path]
        path, met = found.path[: found.first], found.places.some(np.arange(found.first))
        far = shown.far_share(path, met)
        weight[: found.first] *= far
        rows = row[shown.ray[found.path]]
        some = np.flatnonzero(weight > 0)
        none = np.zeros(len(some), dtype=np.int8)
        hits = _Hits(rows[some], weight[some], found.places.some(some), none)
        return hits, np.unique(rows[: found.first][far < 1])

    def near(self, part: _Pixels, samples: int) -> _Hits:
        """What rays of pixels find near, stratified over the pixels of a row by their number."""
        tracer, lane = self._tracer, dr.arange(mi.UInt32, len(part.pixel) * samples)
        pixel = lane // dr.opaque(mi.UInt32, samples)
        number = column(part.number * samples, mi.UInt32)
        sample = dr.gather(mi.UInt32, number, pixel) + lane - pixel * dr.opaque(mi.UInt32, samples)
        stream = column(part.row + self._seed * 1_000_003 & 0xFFFFFFFF, mi.UInt32)
        value = dr.gather(mi.Float, column(part.weight / (np.pi * samples)), pixel)
        # ----- What the ray shows, and what is near to that -----
        eye, way, hit, found = shown_hits(tracer, self._view, part.pixel, samples)
        start, normal, _ = tracer.surface_at(hit, eye, way, found)
        value *= dr.gather(mi.Float, tracer.reflectance, hit.prim_index, found)
        reach = dr.maximum(hit.t * opaque(self._near), 1e-6)
        found &= value > 0
        u = lattice_2d(sample, dr.gather(mi.UInt32, stream, pixel), 0)
        way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        ray = mi.Ray3f(start, way)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=found)
        found &= hit.is_valid()
        point, face, _ = tracer.surface_at(hit, start, way, found)
        value *= dr.gather(mi.Float, tracer.reflectance, hit.prim_index, found)
        distance = dr.norm(point - start)
        value *= 1 - dr.clip(2 * distance / reach - 1, 0.0, 1.0)
        finer = dr.log2(opaque(self._edge / FINENESS) / dr.maximum(distance, 1e-6))
        halvings = dr.clip(dr.ceil(finer), 0.0, HALVINGS)
        # ----- Those that count, a third or less of all -----
        met = [value, pixel, halvings, *point, *face]
        dr.eval(met, found)
        some = dr.compress(found & (value > 0))
        weight, pixel, halvings, *axes = tables(*(dr.gather(type(a), a, some) for a in met))
        places = Places(np.stack(axes[:3], axis=1), np.stack(axes[3:], axis=1))
        return _Hits(part.row[pixel], weight, places, halvings.astype(np.int8))

    def _shown(self, part: _Pixels, samples: int) -> _Shown:
        tracer = self._tracer
        eye, way, hit, found = shown_hits(tracer, self._view, part.pixel, samples)
        rho = dr.gather(mi.Float, tracer.reflectance, hit.prim_index, found)
        places, found, rho, far = face_places(tracer, eye, way, hit, found, found, rho, hit.t)
        kept = np.flatnonzero(found & (rho > 0))
        reach = np.maximum(self._near * far[kept], 1e-6)
        value = rho[kept] * part.weight[kept // samples] / (np.pi * samples)
        return _Shown(kept // samples, value, places.some(kept), reach)


def sun_elements(
    tracer: TracedScene,
    area: float,
    view: View,
    rows: PictureRows,
    times: NDArray[np.int64],
    *,
    samples: int = SAMPLES,
    seed: int = 0,
) -> tuple[SunElements, NDArray[np.bool_]]:
    """Elements by the places that paths of a view's pixels meet after what the pixel shows.

    Their rows are the halves [2 m], the luminance of one the sum of its pixels'.  And the rows [m]
    that show what another surface is near to.

    Args:
        area: of the room's surfaces [m2].
        rows: of the picture's pixels; times: [n] how often a pixel has paths to what is far.
        samples: paths of a pixel for the rest of the picture.
    """
    every, tile, share = np.arange(len(rows.pixels)), rows.tiles.size, min(samples / SAMPLES, 1.0)
    samples = int(np.clip(PATHS * share // max(int(times.sum()), 1), 1, MOST_PATHS))
    edge = float(np.sqrt(max(area, 1e-6) / ELEMENTS))
    look = _Look(tracer, view, tile, edge, seed)
    far, close = [], np.zeros(len(rows.keys), dtype=bool)
    for number, part in enumerate(_Pixels.of(rows, every, times).blocks(samples)):
        hits, beside = look.far(part, samples, number * RAYS // samples)
        far.append(hits)
        close[beside // 2] = True
    rays_each = int(np.ceil(NEAR_RAYS * share / tile**2))
    chosen, again = np.flatnonzero(close[rows.row]), rows.times(smoothed=False)
    blocks = _Pixels.of(rows, chosen, again[chosen]).blocks(rays_each)
    near = [look.near(part, rays_each) for part in blocks]
    hits = _Hits.joined(far), _Hits.joined(near)
    return _summed(hits, 2 * len(rows.keys), edge, seed), close


def window_elements(
    tracer: TracedScene, area: float, *, samples: int, seed: int = 0
) -> SunElements:
    """Elements by the places that windows see in the room; rows [G * K]: radiance that meets them.

    The mean over a group and over its back's incident patch; arguments as of `sun_elements`.

    Args: samples: paths of each patch.
    """
    bins, found = DirectionBins(KLEMS_FULL), []

    def follow(_: mi.Float64, paths: WindowPaths) -> None:
        inward = paths.inward(tracer)
        start = mi.Point3f(paths.position - tracer.exterior_normal(paths.group) * tracer.epsilon)
        hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(start, inward), coherent=False)
        met = hit.is_valid()
        rho, of = tracer.whole(hit.prim_index, inward, met), paths.patch + paths.group * bins.size
        places, met, rho, of = face_places(tracer, start, inward, hit, met, met, rho, of)
        kept = np.flatnonzero(met & (rho > 0))
        value, row, first = rho[kept] / (np.pi * samples), of[kept].astype(int), places.some(kept)
        later = reflecting_places(tracer, first, seed * 1_000_003 + paths.group)
        none = np.zeros(len(kept) + len(later.path), dtype=np.int8)
        found.append(
            _Hits(
                np.concatenate([row, row[later.path]]),
                np.concatenate([value, value[later.path] * later.weight]),
                Places.joined([first, later.places]),
                none,
            )
        )

    window_batches(tracer, bins, 1, samples, seed, follow)(0)
    edge = float(np.sqrt(max(area, 1e-6) / ELEMENTS))
    rows = len(tracer.groups) * bins.size
    return _summed((_Hits.joined(found), _Hits.joined([])), rows, edge, seed)


def _summed(hits: Sequence[_Hits], rows: int, edge: float, seed: int) -> SunElements:
    """Elements of an edge [m] by hits far and near."""
    shares, places = [], []
    for some, points in zip(hits, (POINTS, EDGE_POINTS), strict=True):
        element, order, cubes = _elements(some, edge)
        entries = some.weight.astype(np.float32), (some.row, element)
        shares.append(sparse.csr_array(sparse.coo_array(entries, shape=(rows, len(cubes)))))
        chosen = _chosen(element[order], len(cubes), points, seed)
        places.append(some.places.some(order[chosen]))
    far, near = places
    first = Places.joined([far, near.some(np.arange(0, near.size, EDGE_POINTS))])
    alone = sparse.csr_array(sparse.eye_array(rows, dtype=np.float32))
    return SunElements(first, *shares, alone, EdgePlaces(near, _beside(cubes)))


def _elements(
    hits: _Hits, edge: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The element of each place, cubes of an edge [m] by the side of the surface.

    Returns: [q]; the places in the elements' order [q]; and of each element the cube's numbers, the
    side and the halvings [e, 7], sorted.
    """
    places, table = hits.places, np.empty((7, len(hits.row)), dtype=np.int32)
    each = np.ldexp(1 / edge, hits.halvings)
    for axis in range(3):
        table[axis] = np.floor(np.ascontiguousarray(places.point[:, axis]) * each)
        table[3 + axis] = np.round(places.normal[:, axis] * FACE_STEPS)
    table[6] = hits.halvings
    kind = _keys(table[3:], table[3:])  # sides and sizes: numbered one by one, they are few
    kind = np.cumsum(np.bincount(kind) > 0)[kind]
    both = np.vstack([table[:3], kind], dtype=np.int32, casting="unsafe")
    keys = _keys(both, both)
    order = _order(keys)
    first = np.diff(keys[order], prepend=-1) > 0
    element = np.empty(len(keys), dtype=np.int64)
    element[order] = np.cumsum(first) - 1
    return element, order, table[:, order[first]].T.astype(np.int64)


def _order(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """The order [n] of numbers of 0 or more, equal ones as they come."""
    bits = len(keys).bit_length()
    if keys.max(initial=0) >> (63 - bits):
        return np.argsort(keys, kind="stable")
    # by numbers that hold both, which NumPy sorts several times as fast as it finds an order
    return np.sort((keys << bits) + np.arange(len(keys))) & ((1 << bits) - 1)


def _keys(some: NDArray[np.int64], table: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of columns [d, n] in their order, of one outside the table none of the table's."""
    if not table.shape[1]:  # no element
        return np.empty(0, dtype=np.int64)
    keys = np.zeros(some.shape[1], dtype=np.int64)
    for row, low, high in zip(some, table.min(axis=1) - 1, table.max(axis=1) + 1, strict=True):
        keys *= int(high) - int(low) + 1
        keys += np.clip(row, low, high) - low
    return keys


def _beside(cubes: NDArray[np.int64]) -> sparse.csr_array:
    """1 for elements [f, f] of one size that share an edge, and for those that hold another."""
    count, cubes = len(cubes), np.ascontiguousarray(cubes.T)
    keys = _keys(cubes, cubes)
    pairs = [np.empty((2, 0), dtype=np.int64)]
    holders = np.concatenate([cubes[:3] // 2, cubes[3:6], cubes[6:] - 1])
    for others in (holders, *(cubes + step[:, None] for step in np.eye(7, dtype=np.int64)[:3])):
        wanted = _keys(others, cubes)
        place = np.minimum(np.searchsorted(keys, wanted), count - 1)
        found = np.flatnonzero(keys[place] == wanted)
        pairs.append(np.stack([found, place[found]]))
    one, other = np.concatenate(pairs, axis=1)
    both = np.concatenate([one, other]), np.concatenate([other, one])
    ones = np.ones(len(both[0]), dtype=np.uint8)
    return sparse.csr_array((ones, both), shape=(count, count))


def _chosen(element: NDArray[np.int64], count: int, points: int, seed: int) -> NDArray[np.int64]:
    """Some places of each element, evenly among its own and again where it has fewer.

    Args: element: of the places, in order; returns their numbers [count * points].
    """
    if not count:
        return np.empty(0, dtype=np.int64)
    ends = np.searchsorted(element, np.arange(count + 1))
    start = np.random.default_rng(seed).random(count)
    share = (start[:, None] + np.arange(points) / points) % 1.0
    return (ends[:-1, None] + (share * np.diff(ends)[:, None]).astype(np.int64)).ravel()
