"""The outdoors in a view, straight through the windows, pixel by pixel.

The phase methods resolve the sky through a window by Klems patches, 10 to 15 degrees wide, and by
the mean over the window.  Here each ray of a pixel follows the straight beam outdoors.
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
from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.pixel_rows import Tiles, face_numbers, smoothing, surroundings, tile_size
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import (
    column,
    empty_sums,
    lattice_2d,
    path_generator,
    spread_rays,
    sums_of,
    tables,
    vectors,
)
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.matrices.daylight import add_daylight_paths
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_points
from mitsuba_cfs.trace.sun.outdoors import (
    MOST_MIRRORS,
    OutdoorSun,
    PixelRays,
    RoughFaces,
    RoughSun,
    ShownFaces,
    mirrored,
)

BLOCK_BYTES = 128 * 2**20
PATCH_POINTS = 16  # directions in each window patch, for its mean transmittance
MAX_DEPTH = 16
RAYS = 2**20  # at once
_Met = tuple[PixelRays, NDArray[np.int64], NDArray[np.float32], SurfacePoints]  # and triangle, reflectance


@dataclass(frozen=True)
class OutdoorCoefficients:
    """Luminance of the pixels through the windows' straight beam, per unit luminance of the sky.

    `sun` has the sunlight on surfaces; `sky` and `reflected` are for the sky without the sun.
    """

    sky: sparse.csr_array  # [n, P] sky and ground that the pixel shows directly
    reflected: sparse.csr_array  # [C, P] irradiance of the faces in each tile
    beam: NDArray[np.float64]  # [G, K] transmittance of the beam, mean over each window patch
    sun: OutdoorSun
    rough: RoughSun | None = None  # the sun on rough gloss


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
    tile: int | None = None,
    seed: int = 0,
    scenes: SceneCache | None = None,
) -> OutdoorCoefficients:
    """Trace every pixel through the windows to the sky; arguments as for `direct_sun_matrix`.

    Args:
        subdivision: Reinhart's MF of the sky.
        samples: paths for each pixel.
        tile: pixels across of the squares that share slowly varying light on a face, by default
            `tile_size`.
    """
    scenes = SceneCache() if scenes is None else scenes
    inside = scenes.scene(interior, groups)
    outside = scenes.scene(exterior, groups)
    sky, tile = SkyBins(ReinhartSky(subdivision)), tile_size(view) if tile is None else tile
    pixels = np.flatnonzero(pixel_directions(view)[1].reshape(-1))
    rays_at_once = max(256, RAYS // samples)
    seen = SeenOutdoors(outside, sky, Tiles(tile, view.width))
    for start in range(0, len(pixels), rays_at_once):
        block = pixels[start : start + rays_at_once]
        lanes = through_windows(inside, scattering, view_lanes(inside, view, block, samples))
        seen.add(lanes, block, start)
    shown, smooth, reflected = seen.faces(seed)
    return OutdoorCoefficients(
        seen.sky(), reflected, _beams(scattering, basis), OutdoorSun(outside, shown, smooth, view, seed), seen.rough()
    )


class SeenOutdoors:
    """Accumulates hits of the pixels' rays outdoors, block by block."""

    def __init__(self, outside: TracedScene, sky: SkyBins, tiles: Tiles) -> None:
        """Empty."""
        self._outside, self._sky, self._tiles = outside, sky, tiles
        self._face = outside.derived(face_numbers)
        self._free: list[sparse.csr_array] = []
        self._shown: list[ShownFaces] = []
        self._rough: list[RoughFaces] = []

    def add(self, lanes: PixelRays, block: NDArray[np.int64], start: int) -> None:
        """Add the hits of a block of pixels, the first of which is number `start`."""
        rows = sparse.csr_array((len(block), self._sky.size), dtype=np.float32)
        for bounce in range(MOST_MIRRORS + 1):
            if not len(lanes.row):
                break
            seen, met, lanes = _sky_and_hits(self._outside, self._sky, lanes, len(block), bounce)
            rows = rows + seen
            self._shown.append(_with_faces(met, block, start, self._face, self._tiles))
            self._rough += _rough_faces(self._outside, met, start)
        self._free.append(rows)

    def sky(self) -> sparse.csr_array:
        """Sky and ground that each pixel shows directly [n, P]."""
        return sparse.csr_array(sparse.vstack(self._free))

    def faces(self, seed: int) -> tuple[ShownFaces, sparse.csr_array, sparse.csr_array]:
        """The faces by tile, their smoothing [C, C], and their smoothed irradiance [C, P]."""
        found, keys = _joined(self._shown)
        count = np.bincount(found.tile, minlength=len(keys))
        smooth = smoothing(surroundings(self._tiles, keys), count)
        reflected = smooth @ _reflected(self._outside, self._sky, found, len(keys), seed)
        return found, smooth, sparse.csr_array(reflected.astype(np.float32))

    def rough(self) -> RoughSun | None:
        """The sun on rough gloss; None without any."""
        return RoughSun(self._outside, RoughFaces.joined(self._rough)) if self._rough else None


def view_lanes(inside: TracedScene, view: View, pixels: NDArray[np.int64], samples: int) -> PixelRays:
    """Rays of a block's pixels from the eye."""
    eye = np.asarray(view.position) - inside.centre
    row = np.repeat(np.arange(len(pixels)), samples)
    directions, exists = spread_rays(view, pixels, samples)
    start = np.tile(eye[:, None], len(row)).astype(np.float32)
    share = np.full(len(row), 1.0 / samples)
    return PixelRays(row, start, directions.T.astype(np.float32), share).some(np.flatnonzero(exists))


def through_windows(inside: TracedScene, scattering: Sequence[Scattering], lanes: PixelRays) -> PixelRays:
    """Rays of a block that pass a window straight, at the window."""
    luminances = []
    for bounce in range(MOST_MIRRORS + 1):
        if not len(lanes.row):
            break
        passed, lanes = _passed(inside, scattering, lanes, bounce)
        luminances.append(passed)
    return PixelRays.joined(luminances)


def _passed(
    inside: TracedScene, scattering: Sequence[Scattering], lanes: PixelRays, bounce: int
) -> tuple[PixelRays, PixelRays]:
    """Rays that pass windows straight, and those reflected by glossy surfaces."""
    origin, way = vectors(lanes.origin.T, mi.Point3f), vectors(lanes.way.T)
    hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(origin, way), coherent=not bounce)
    active = hit.is_valid()
    group = dr.gather(mi.Int32, inside.group, hit.prim_index, active)
    active &= group != OPAQUE
    local = inside.to_local(group, way, active)
    weight = mi.Float(0)
    for g, system in enumerate(scattering):
        seen = active & (group == g) & (local.z > 0)
        weight = dr.select(seen, system.through(local), weight)
    tau, place = tables(weight, mi.Point3f(origin + way * hit.t))
    tau = np.broadcast_to(tau, len(lanes.row)).astype(float)
    lit = np.flatnonzero(tau > 0)
    place = np.broadcast_to(place, (len(lanes.row), 3)).T[:, lit]
    passed = PixelRays(lanes.row[lit], place, lanes.way[:, lit], (lanes.weight * tau)[lit])
    return passed, mirrored(inside, lanes, hit, bounce)


def _sky_and_hits(
    outside: TracedScene, sky: SkyBins, lanes: PixelRays, count: int, bounce: int
) -> tuple[sparse.csr_array, _Met, PixelRays]:
    """Sky in the rays by row [count, P]; hits of the others; rays reflected by gloss."""
    origin, way = vectors(lanes.origin.T, mi.Point3f), vectors(lanes.way.T)
    hit, origin = outside.met_outdoors(origin, way, mi.Bool(True))
    is_hit = hit.is_valid()
    face = dr.gather(mi.Vector3f, outside.normal, hit.prim_index, is_hit)
    rho = outside.diffuse(hit.prim_index, dr.abs(dr.dot(face, way)), is_hit)
    places, met, rho, patch, prim = hit_points(
        outside, origin, way, hit, is_hit, is_hit, rho, sky.index(way), hit.prim_index
    )
    patch = patch.astype(np.int64)
    entries = lanes.weight[~met].astype(np.float32), (lanes.row[~met], patch[~met])
    rows = sparse.csr_array(sparse.coo_array(entries, shape=(count, sky.size)))
    prim = prim.astype(np.int64)[met]
    onwards = mirrored(outside, lanes, hit, bounce)
    return rows, (lanes.some(met), prim, rho[met], places.some(met)), onwards


def _rough_faces(outside: TracedScene, met: _Met, start: int) -> list[RoughFaces]:
    """Hits on faces with rough gloss."""
    lanes, prim, _, places = met
    if outside.gloss is None or not len(prim):
        return []
    alpha = outside.gloss.roughness(mi.UInt32(prim.astype(np.uint32)), mi.Bool(True)).numpy()
    chosen = np.flatnonzero(alpha > 0)
    some = lanes.some(chosen)
    return [RoughFaces(start + some.row, some.weight, prim[chosen], some.way, places.some(chosen))]


def _with_faces(met: _Met, block: NDArray, start: int, faces: NDArray, tiles: Tiles) -> ShownFaces:
    """Hits of a block's rays by face and tile."""
    lanes, prim, rho, places = met
    tile = tiles.of_pixels(block[lanes.row], faces[prim])
    return ShownFaces(start + lanes.row, tile, lanes.weight * rho / np.pi, places)


def _joined(shown: Sequence[ShownFaces]) -> tuple[ShownFaces, NDArray[np.int64]]:
    """The faces of all blocks with tiles numbered from 0, and the keys of the tiles."""
    none, nothing = np.empty(0, dtype=np.int64), np.empty(0)
    pixel, tile = (np.concatenate([none, *(getattr(s, name) for s in shown)]) for name in ("pixel", "tile"))
    value = np.concatenate([nothing, *(s.value for s in shown)])
    numbers, tile = np.unique(tile, return_inverse=True)
    return ShownFaces(pixel, tile, value, SurfacePoints.joined([s.places for s in shown])), numbers


def _reflected(outside: TracedScene, sky: SkyBins, shown: ShownFaces, count: int, seed: int) -> sparse.csr_array:
    """Irradiance of the faces in tiles per unit luminance of the sky [C, P]."""
    order = np.argsort(shown.tile, kind="stable")
    ends = np.searchsorted(shown.tile[order], np.arange(count + 1))
    size = max(16, BLOCK_BYTES // (8 * sky.size))
    blocks = [sparse.csr_array((0, sky.size), dtype=np.float32)]
    for start in range(0, count, size):
        end = min(start + size, count)
        part = order[ends[start] : ends[end]]
        tile, places = shown.tile[part] - start, shown.places.some(part)
        matrix = empty_sums((end - start) * sky.size)
        generator = path_generator(column(part, mi.UInt32), dr.opaque(mi.UInt32, seed & 0xFFFFFFFF))
        u = mi.Point2f(generator.next_float32(), generator.next_float32())
        away = mi.warp.square_to_cosine_hemisphere(u)
        starts = PathStarts(
            column(tile, mi.UInt32),
            places.points(),
            mi.Frame3f(places.normals()).to_world(away),
            generator,
            dr.opaque(mi.UInt32, MAX_DEPTH - 1),
            mi.Bool(True),
        )
        add_daylight_paths(outside, sky, matrix, starts)
        values = sums_of(matrix, (end - start, sky.size))
        values *= np.pi / np.bincount(tile, minlength=end - start)[:, None]
        blocks.append(sparse.csr_array(values.astype(np.float32)))
    return sparse.csr_array(sparse.vstack(blocks))


def _beams(scattering: Sequence[Scattering], basis: KlemsBasis) -> NDArray[np.float64]:
    """Transmittance [G, K] of the straight beam, mean over each patch."""
    bins = DirectionBins(basis)
    lane = dr.arange(mi.UInt32, bins.size * PATCH_POINTS)
    patch = lane // PATCH_POINTS
    local = bins.sample(patch, lattice_2d(lane - patch * PATCH_POINTS, patch, 0))
    beams = [system.through(local) + dr.zeros(mi.Float, dr.width(lane)) for system in scattering]
    return np.stack([f.numpy().reshape(-1, PATCH_POINTS).mean(axis=1) for f in beams])
