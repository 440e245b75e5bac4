"""The sun's beam on the surfaces of a room, as the pixels of a picture and the windows see it.

    L[row] = sum over cells c of share[row, c] E_sun[c]
             + sum over small pieces f near the row of near[row, f] E_sun[f]

A few paths from a tile of pixels would meet the window's patch with the sun once or never, and make
the tile white or dark.  So paths and rays only find the share that a row has of each surface, and
the sun's irradiance of the surfaces is found hour by hour.

What is far from a place lights it much as it lights the places beside it, and many tiles share it:
it is the irradiance of the room's cells, by the flux of the beam on them (`sunlit_cells`), the same
that the sensors take.  What is near (the wall that meets the floor in a corner) does not: it is
taken by rays of each tile's own, to pieces as small as they are near, far smaller than a flux could
be counted in; the sun is asked for at one point of a piece, by a shadow ray, and at many where the
edge of a spot of sun crosses it (`EdgePoints`).  The weight of a place at distance d from a surface
that is D from the eye goes over from one to the other between d = N D / 2 and N D, N the angle
of `NEAR_TILES`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import View, pixel_solid_angles
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.pixel_rows import FACE_STEPS, PictureRows, numbered, pixel_hits
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, streams, tables
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_points, reflecting_points
from mitsuba_cfs.trace.sun.sorting import joint_keys, order_of
from mitsuba_cfs.trace.sun.sunlit_cells import RoomCells, surface_cells

PIECES = 1024  # that the surfaces' area would be divided into by pieces of the widest edge
EDGE_POINTS = 16  # on a piece near a tile that the edge of a spot of sun crosses
PATHS = 2**19  # of a view at most, but one of each pixel
MOST_PATHS = 32  # of a pixel
RAYS = 2**18  # at once
NEAR_TILES = 12  # [tiles' widths] that a surface is near within, twice what smoothing spans
NEAR_RAYS = 1024  # of each tile to what is near: narrow strips of sun beside a corner are small
SAMPLES = 8  # paths of a pixel for all else, with fewer of which these too are fewer, in proportion
FINENESS = 0.5  # edge of a piece near a tile over how near it is
HALVINGS = 4  # of the pieces' edge at most
SPARSE = ("data", "indices", "indptr", "shape")  # the parts of a sparse matrix


@dataclass(frozen=True, slots=True)
class EdgePoints:
    """More points on the pieces near rows, for those that the edge of a spot of sun crosses."""

    places: SurfacePoints  # [f * EDGE_POINTS]
    beside: sparse.csr_array  # [f, f] 1 for pieces that share an edge, or one holds the other

    def crossed(self, light: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Pieces and hours [p] whose light [f, h] is there and not all beside, or the reverse."""
        lit = (light > 0).astype(np.uint8)
        bright, count = self.beside @ lit, np.diff(self.beside.indptr)[:, None]
        return np.nonzero(np.where(lit, bright < count, bright > 0))


@dataclass(frozen=True, slots=True)
class SunlitShares:
    """Luminance of rows per unit irradiance of the room's cells, and of pieces nearby."""

    cells: RoomCells
    share: sparse.csr_array  # [m, c] of the cells
    smooth: sparse.csr_array  # [m, m] of rows, after `share`: the product of both would be full
    near: sparse.csr_array  # [m, f] of the pieces near rows, not to be smoothed
    places: SurfacePoints  # [f] one point of each piece
    edges: EdgePoints  # of the pieces

    def rows(self, cells: NDArray[np.float32] | sparse.csr_array, near: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [m, h] of rows under irradiances of the cells [c, h] and pieces [f, h]."""
        return self.far_rows(cells) + self.near @ near

    def far_rows(self, irradiance: NDArray[np.float32] | sparse.csr_array) -> NDArray[np.float32]:
        """Luminance [m, h] of rows by the cells with irradiances [c, h]."""
        luminance = self.share @ irradiance
        return self.smooth @ (luminance.toarray() if sparse.issparse(luminance) else luminance)

    def of_rows(self, rows: sparse.csr_array, smooth: sparse.csr_array) -> SunlitShares:
        """The shares of other rows [k], by `rows` [k, m] of these, with their smoothing."""
        share, near = (sparse.csr_array(rows @ part) for part in (self.share, self.near))
        return SunlitShares(self.cells, share, smooth, near, self.places, self.edges)

    def arrays(self, number: int = 0) -> dict[str, NDArray[Any]]:
        """The shares as the arrays of a file, `number`: among those of the same cells and pieces."""
        cells = self.cells
        arrays = {
            "cell_edge": np.array(cells.edge),
            "cell_low": cells.low,
            "cell_halvings": np.array(cells.halvings),
            "cell_keys": cells.keys,
            "cell_area": cells.area,
        }
        matrices = {f"far{number}": self.share, f"near{number}": self.near}
        for name, matrix in ({"smooth": self.smooth, "beside": self.edges.beside} | matrices).items():
            arrays |= sparse_arrays(name, matrix)
        for name, places in (("places", self.places), ("more", self.edges.places)):
            arrays |= {f"{name}_point": places.point, f"{name}_normal": places.normal}
        return arrays

    @classmethod
    def of_arrays(cls, data: Mapping[str, NDArray[Any]], count: int = 1) -> list[SunlitShares]:
        """So many shares of the same cells and pieces, from the arrays of a file.

        Raises: `KeyError` where one is missing.
        """
        cells = RoomCells(
            float(data["cell_edge"]), data["cell_low"], int(data["cell_halvings"]), data["cell_keys"], data["cell_area"]
        )
        places = SurfacePoints(data["places_point"], data["places_normal"])
        more = SurfacePoints(data["more_point"], data["more_normal"])
        smooth, edges = (sparse_matrix(data, "smooth"), EdgePoints(more, sparse_matrix(data, "beside")))
        return [
            cls(cells, sparse_matrix(data, f"far{i}"), smooth, sparse_matrix(data, f"near{i}"), places, edges)
            for i in range(count)
        ]


@dataclass(frozen=True, slots=True)
class SunlitRows:
    """Shares of the sunlit surfaces in the rows of a picture, for any sky."""

    mean: SunlitShares  # of the rows [m]
    noise: SunlitShares  # half the difference of the rows' halves; the same cells and pieces
    close: NDArray[np.bool_]  # [m] rows that show a surface close to another

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The shares as the arrays of a file."""
        return {"close": self.close} | self.mean.arrays(0) | self.noise.arrays(1)

    @classmethod
    def of_arrays(cls, data: Mapping[str, NDArray[Any]]) -> SunlitRows:
        """From the arrays of a file.

        Raises: `KeyError` where one is missing.
        """
        return cls(*SunlitShares.of_arrays(data, 2), data["close"])


def sparse_arrays(name: str, matrix: sparse.csr_array) -> dict[str, NDArray[Any]]:
    """A sparse matrix as the arrays of a file, numbers of columns in 32 bits where these suffice."""
    kind = sparse.get_index_dtype(maxval=max(matrix.nnz, *matrix.shape))
    indices, starts = matrix.indices.astype(kind, copy=False), matrix.indptr.astype(kind, copy=False)
    parts = matrix.data, indices, starts, np.asarray(matrix.shape)
    return {f"{name}_{part}": array for part, array in zip(SPARSE, parts, strict=True)}


def sparse_matrix(data: Mapping[str, NDArray[Any]], name: str) -> sparse.csr_array:
    """A sparse matrix from the arrays of a file."""
    *parts, shape = (data[f"{name}_{part}"] for part in SPARSE)
    return sparse.csr_array(tuple(parts), shape=tuple(shape))


@dataclass(frozen=True, slots=True)
class _Hits:
    """Points near the rows of a picture that reflect to them."""

    row: NDArray[np.int64]  # [q]
    weight: NDArray[np.floating]  # [q] luminance of the row per unit irradiance of the place
    places: SurfacePoints  # [q]
    halvings: NDArray[np.int8]  # [q] of the edge of the place's piece

    @staticmethod
    def joined(parts: Sequence[_Hits]) -> _Hits:
        """All of several."""
        none, small = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int8)
        nothing = np.empty(0, dtype=np.float32)
        return _Hits(
            np.concatenate([none, *(p.row for p in parts)]),
            np.concatenate([nothing, *(p.weight for p in parts)]),
            SurfacePoints.joined([p.places for p in parts]),
            np.concatenate([small, *(p.halvings for p in parts)]),
        )


@dataclass(frozen=True, slots=True)
class _Shown:
    """Reflecting points that rays of pixels meet; axis r."""

    ray: NDArray[np.int64]  # [r] number of the pixel
    value: NDArray[np.float64]  # [r] rho / pi over the number of the pixel's rays
    places: SurfacePoints
    reach: NDArray[np.float64]  # [r] how near is near [m]

    def far_share(self, path: NDArray[np.int64], met: SurfacePoints) -> NDArray[np.float64]:
        """Share of the light of points met first that counts as far, 0 to 1."""
        distance = np.linalg.norm(met.point - self.places.point[path], axis=1)
        return np.clip(2 * distance / self.reach[path] - 1, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class _Pixels:
    """Pixels to trace, some repeatedly; axis p."""

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
    """Traces a view's pixels to the surfaces that reflect sun to the shown ones."""

    def __init__(self, tracer: TracedScene, cells: RoomCells, view: View, tile: int, edge: float, seed: int) -> None:
        self._tracer, self._cells, self._view = tracer, cells, view
        self._edge, self._seed = edge, seed
        width = float(np.sqrt(pixel_solid_angles(view).max()))
        self._near = NEAR_TILES * tile * width if tile > 1 else 0.0  # over the distance to the eye

    def far(
        self, part: _Pixels, samples: int, key: int, shape: tuple[int, int]
    ) -> tuple[sparse.csr_array, NDArray[np.int64]]:
        """Share of the cells in the rows, except near ones; the rows close to another surface."""
        shown, row = self._shown(part, samples), part.row
        points = reflecting_points(self._tracer, shown.places, self._seed * 1_000_003 + key)
        weight = points.weight * shown.value[points.path]
        path, met = points.path[: points.first], points.places.some(np.arange(points.first))
        far = shown.far_share(path, met)
        weight[: points.first] *= far
        rows = row[shown.ray[points.path]]
        share = _cell_shares(self._cells, rows, weight, points.places, shape)
        return share, np.unique(rows[: points.first][far < 1])

    def near(self, part: _Pixels, samples: int) -> _Hits:
        """Hits of pixels' rays on near surfaces, stratified over the pixels of a row."""
        tracer, lane = self._tracer, dr.arange(mi.UInt32, len(part.pixel) * samples)
        pixel = lane // dr.opaque(mi.UInt32, samples)
        number = column(part.number * samples, mi.UInt32)
        sample = dr.gather(mi.UInt32, number, pixel) + lane - pixel * dr.opaque(mi.UInt32, samples)
        stream = streams(part.row, self._seed)
        value = dr.gather(mi.Float, column(part.weight / (np.pi * samples)), pixel)
        # ----- What the ray shows, and what is near to that -----
        eye, way, hit, is_hit = pixel_hits(tracer, self._view, part.pixel, samples)
        start, normal, _ = tracer.surface_at(hit, eye, way, is_hit)
        value *= dr.gather(mi.Float, tracer.reflectance, hit.prim_index, is_hit)
        reach = dr.maximum(hit.t * opaque(self._near), 1e-6)
        is_hit &= value > 0
        u = lattice_2d(sample, dr.gather(mi.UInt32, stream, pixel), 0)
        way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        ray = mi.Ray3f(start, way)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=is_hit)
        is_hit &= hit.is_valid()
        point, face, _ = tracer.surface_at(hit, start, way, is_hit)
        value *= dr.gather(mi.Float, tracer.reflectance, hit.prim_index, is_hit)
        distance = dr.norm(point - start)
        value *= 1 - dr.clip(2 * distance / reach - 1, 0.0, 1.0)
        finer = dr.log2(opaque(self._edge / FINENESS) / dr.maximum(distance, 1e-6))
        halvings = dr.clip(dr.ceil(finer), 0.0, HALVINGS)
        # ----- Those that count, a third or less of all -----
        met = [value, pixel, halvings, *point, *face]
        dr.eval(met, is_hit)
        some = dr.compress(is_hit & (value > 0))
        weight, pixel, halvings, *axes = tables(*(dr.gather(type(a), a, some) for a in met))
        places = SurfacePoints(np.stack(axes[:3], axis=1), np.stack(axes[3:], axis=1))
        return _Hits(part.row[pixel], weight, places, halvings.astype(np.int8))

    def _shown(self, part: _Pixels, samples: int) -> _Shown:
        tracer = self._tracer
        eye, way, hit, is_hit = pixel_hits(tracer, self._view, part.pixel, samples)
        rho = dr.gather(mi.Float, tracer.reflectance, hit.prim_index, is_hit)
        places, is_hit, rho, far = hit_points(tracer, eye, way, hit, is_hit, is_hit, rho, hit.t)
        kept = np.flatnonzero(is_hit & (rho > 0))
        reach = np.maximum(self._near * far[kept], 1e-6)
        value = rho[kept] * part.weight[kept // samples] / (np.pi * samples)
        return _Shown(kept // samples, value, places.some(kept), reach)


def picture_sunlit_shares(
    tracer: TracedScene,
    view: View,
    rows: PictureRows,
    times: NDArray[np.int64],
    *,
    samples: int = SAMPLES,
    seed: int = 0,
) -> tuple[SunlitShares, NDArray[np.bool_]]:
    """Share of the sunlit surfaces in the halves of a picture's rows [2 m].

    By the points that paths of the pixels meet after the surface that the pixel shows; a half is
    the sum of its pixels.  And the rows [m] that show a surface close to another.

    Args:
        rows: of the picture's pixels; times: [n] repetitions of each pixel.
        samples: paths of a pixel for the rest of the picture.
    """
    every, tile, share = np.arange(len(rows.pixels)), rows.tiles.size, min(samples / SAMPLES, 1.0)
    samples = int(np.clip(PATHS * share // max(int(times.sum()), 1), 1, MOST_PATHS))
    cells, edge = _far_cells(tracer), _widest(tracer.surfaces)
    look = _Look(tracer, cells, view, tile, edge, seed)
    shape = 2 * len(rows.keys), cells.size
    far, close = sparse.csr_array(shape, dtype=np.float32), np.zeros(len(rows.keys), dtype=bool)
    for number, part in enumerate(_Pixels.of(rows, every, times).blocks(samples)):
        met, beside = look.far(part, samples, number * RAYS // samples, shape)
        far = far + met
        close[beside // 2] = True
    rays_each = int(np.ceil(NEAR_RAYS * share / tile**2))
    chosen, again = np.flatnonzero(close[rows.row]), rows.times(smoothed=False)
    blocks = _Pixels.of(rows, chosen, again[chosen]).blocks(rays_each)
    near = _Hits.joined([look.near(part, rays_each) for part in blocks])
    return _with_pieces(cells, far, near, edge, seed), close


def window_sunlit_shares(tracer: TracedScene, *, samples: int, seed: int = 0) -> SunlitShares:
    """Share of the sunlit surfaces in the light on the windows; rows [G * K]: incident radiance.

    The mean over a group and over an incident patch of its back.

    Args: samples: paths of each patch.
    """
    bins, cells = DirectionBins(KLEMS_FULL), _far_cells(tracer)
    shape = len(tracer.groups) * bins.size, cells.size
    shares = [sparse.csr_array(shape, dtype=np.float32)]

    def follow(_: mi.Float64, paths: WindowPaths) -> None:
        inward = paths.inward(tracer)
        start = mi.Point3f(paths.position - tracer.exterior_normal(paths.group) * tracer.epsilon)
        hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(start, inward), coherent=False)
        met = hit.is_valid()
        rho, of = tracer.whole(hit.prim_index, inward, met), paths.group * bins.size + paths.patch
        places, met, rho, of = hit_points(tracer, start, inward, hit, met, met, rho, of)
        kept = np.flatnonzero(met & (rho > 0))
        value, row, first = rho[kept] / (np.pi * samples), of[kept].astype(int), places.some(kept)
        later = reflecting_points(tracer, first, seed * 1_000_003 + len(shares) - 1)
        rows = np.concatenate([row, row[later.path]])
        weight = np.concatenate([value, value[later.path] * later.weight])
        both = SurfacePoints.joined([first, later.places])
        shares.append(_cell_shares(cells, rows, weight, both, shape))

    window_batches(tracer, bins, 1, samples, seed, follow)(0)
    return _with_pieces(cells, sum(shares[1:], shares[0]), _Hits.joined([]), 1.0, seed)


def _far_cells(tracer: TracedScene) -> RoomCells:
    """The room's cells, joined: far away the wider ones are as sharp, with less noise."""
    return tracer.derived(_joined_cells)


def _joined_cells(tracer: TracedScene) -> RoomCells:
    return surface_cells(tracer).cells.joined()[0]


def _cell_shares(
    cells: RoomCells,
    row: NDArray[np.int64],
    weight: NDArray[np.floating],
    places: SurfacePoints,
    shape: tuple[int, int],
) -> sparse.csr_array:
    """Weights of places [q] summed over the cells that these are in, by rows."""
    cell = cells.numbers(places)
    some = np.flatnonzero((cell >= 0) & (weight > 0))
    entries = weight[some].astype(np.float32), (row[some], cell[some])
    return sparse.csr_array(sparse.coo_array(entries, shape=shape))


def _widest(interior: Surfaces) -> float:
    """Edge of the widest pieces near rows [m]."""
    return float(np.sqrt(max(float(interior.areas.sum()), 1e-6) / PIECES))


def _with_pieces(cells: RoomCells, far: sparse.csr_array, near: _Hits, edge: float, seed: int) -> SunlitShares:
    """The shares of the cells with those of pieces near rows, whose widest have an edge [m]."""
    piece, order, cubes = _pieces(near, edge)
    entries = near.weight.astype(np.float32), (near.row, piece)
    share = sparse.csr_array(sparse.coo_array(entries, shape=(far.shape[0], len(cubes))))
    chosen = _chosen(piece[order], len(cubes), EDGE_POINTS, seed)
    more = near.places.some(order[chosen])
    first = more.some(np.arange(0, more.size, EDGE_POINTS))
    alone = sparse.csr_array(sparse.eye_array(far.shape[0], dtype=np.float32))
    return SunlitShares(cells, far, alone, share, first, EdgePoints(more, _beside(cubes)))


def _pieces(hits: _Hits, edge: float) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The piece of each place, cubes of an edge [m] by the side of the surface.

    Returns: [q]; the places in the pieces' order [q]; and of each piece the cube's numbers, the
    side and the halvings [e, 7], sorted.
    """
    places, table = hits.places, np.empty((7, len(hits.row)), dtype=np.int32)
    each = np.ldexp(1 / edge, hits.halvings)
    for axis in range(3):
        table[axis] = np.floor(np.ascontiguousarray(places.point[:, axis]) * each)
        table[3 + axis] = np.round(places.normal[:, axis] * FACE_STEPS)
    table[6] = hits.halvings
    kind = joint_keys(table[3:])  # sides and sizes: numbered one by one, they are few
    kind = np.cumsum(np.bincount(kind) > 0)[kind]
    both = np.vstack([table[:3], kind], dtype=np.int32, casting="unsafe")
    keys = joint_keys(both)
    order = order_of(keys)
    first = np.diff(keys[order], prepend=-1) > 0
    element = np.empty(len(keys), dtype=np.int64)
    element[order] = np.cumsum(first) - 1
    return element, order, table[:, order[first]].T.astype(np.int64)


def _keys(some: NDArray[np.int64], table: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of columns [d, n] in their order, of one outside the table none of the table's."""
    if not table.shape[1]:  # no piece
        return np.empty(0, dtype=np.int64)
    keys = np.zeros(some.shape[1], dtype=np.int64)
    for row, low, high in zip(some, table.min(axis=1) - 1, table.max(axis=1) + 1, strict=True):
        keys *= int(high) - int(low) + 1
        keys += np.clip(row, low, high) - low
    return keys


def _beside(cubes: NDArray[np.int64]) -> sparse.csr_array:
    """1 for pieces [f, f] of one size that share an edge, and for those that hold another."""
    count, cubes = len(cubes), np.ascontiguousarray(cubes.T)
    keys = _keys(cubes, cubes)
    pairs = [np.empty((2, 0), dtype=np.int64)]
    holders = np.concatenate([cubes[:3] // 2, cubes[3:6], cubes[6:] - 1])
    for others in (holders, *(cubes + step[:, None] for step in np.eye(7, dtype=np.int64)[:3])):
        wanted = _keys(others, cubes)
        place = np.minimum(np.searchsorted(keys, wanted), count - 1)
        positions = np.flatnonzero(keys[place] == wanted)
        pairs.append(np.stack([positions, place[positions]]))
    one, other = np.concatenate(pairs, axis=1)
    both = np.concatenate([one, other]), np.concatenate([other, one])
    ones = np.ones(len(both[0]), dtype=np.uint8)
    return sparse.csr_array((ones, both), shape=(count, count))


def _chosen(element: NDArray[np.int64], count: int, points: int, seed: int) -> NDArray[np.int64]:
    """Some places of each piece, evenly among its own and again where it has fewer.

    Args: element: piece of the places, in order; returns their numbers [count * points].
    """
    if not count:
        return np.empty(0, dtype=np.int64)
    ends = np.searchsorted(element, np.arange(count + 1))
    start = np.random.default_rng(seed).random(count)
    share = (start[:, None] + np.arange(points) / points) % 1.0
    return (ends[:-1, None] + (share * np.diff(ends)[:, None]).astype(np.int64)).ravel()
