"""Adjacent rooms in a view, straight through glass between rooms, pixel by pixel.

The phase methods resolve the adjacent room by Klems patches, 10 to 15 degrees wide, and by the mean
over a part of the glass, which smears a bright window there over the wall around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.evaluate import ThroughPeak, specular_exponent
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.pixel_rows import Tiles, face_numbers, numbered, smoothing, surroundings, tile_size
from mitsuba_cfs.trace.kernels.sampling import column, empty_sums, opaque, path_generator, sums_of, vectors
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
from mitsuba_cfs.trace.kernels.scene import SceneCache, TracedScene
from mitsuba_cfs.trace.kernels.view_paths import add_view_paths
from mitsuba_cfs.trace.matrices.adjacent import AdjacentRoomLight, GlassToRoom
from mitsuba_cfs.trace.pictures.outdoors import RAYS, SeenOutdoors, through_windows, view_lanes
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_points
from mitsuba_cfs.trace.sun.outdoors import MOST_MIRRORS, PixelRays, mirrored

BLOCK_BYTES = 128 * 2**20
LEAST_PATHS = 64  # of a face in a tile: slivers have few rays


@dataclass(frozen=True, slots=True)
class RoomShown:
    """An adjacent room and the outdoors seen through its windows, in the n pixels of a view.

    L = seen (T D - diag(tau) D) s + faces irradiance T D s + (sky + outdoor_faces reflected) s
    """

    seen: sparse.csr_array  # [n, N] share of each patch of the room's windows
    scattered: NDArray[np.float32]  # [N, P] of these, T D without what goes straight on
    faces: sparse.csr_array  # [n, C] share of each face in a tile, times its reflectance / pi
    irradiance: NDArray[np.float32]  # [C, N] of these per unit luminance of the windows
    luminance: NDArray[np.float32]  # [N, P] of the windows towards the room, T D
    sky: sparse.csr_array  # [n, P] share of sky and ground
    outdoor_faces: sparse.csr_array  # [n, C] as `faces`, of the surroundings
    reflected: sparse.csr_array  # [C, P] irradiance of these

    def add_to(self, values: NDArray[np.float32], sky: NDArray[np.floating]) -> None:
        """Add the luminance [cd/m2] under skies [P, h] to values [h, n]."""
        sky = np.asarray(sky, dtype=np.float32)
        luminance = self.seen @ (self.scattered @ sky)
        luminance += self.faces @ (self.irradiance @ (self.luminance @ sky))
        luminance += self.sky @ sky + self.outdoor_faces @ (self.reflected @ sky)
        values += luminance.T


def adjacent_picture(
    interior: Surfaces,
    groups: Sequence[WindowGroup],
    behind: Sequence[GlassToRoom],
    view: View,
    *,
    subdivision: int = 4,
    samples: int = 8,
    tile: int | None = None,
    max_depth: int = 32,
    seed: int = 0,
    scenes: SceneCache | None = None,
) -> list[RoomShown]:
    """The rooms that a view shows straight through glass, and through glass of these.

    Args:
        interior, groups: of the eye's room.
        behind: the rooms that are seen through its glass.
        subdivision: Reinhart's MF of the sky.
        samples: rays of each pixel.
        tile: pixels across of the squares that share reflected light, by default `tile_size`.
        max_depth: segments of a path in a room.
    """
    scenes = SceneCache() if scenes is None else scenes
    inside, nodes = scenes.scene(interior, groups), _all_behind(behind)
    tracers = [scenes.scene(b.room.surfaces, b.room.groups, centre=inside.centre) for _, b in nodes]
    pixels = np.flatnonzero(pixel_directions(view)[1].reshape(-1))
    tiles = Tiles(tile_size(view) if tile is None else tile, view.width)
    sky = SkyBins(ReinhartSky(subdivision))
    met = [_MetInRoom(b.room, t, tiles, sky, scenes) for (_, b), t in zip(nodes, tracers, strict=True)]
    step = max(256, RAYS // samples)
    for start in range(0, len(pixels), step):
        block = pixels[start : start + step]
        first, lanes = view_lanes(inside, view, block, samples), []
        for i, (parent, one) in enumerate(nodes):
            before, tracer = (first, inside) if parent < 0 else (lanes[parent], tracers[parent])
            lanes.append(_into_room(tracer, one, before))
            met[i].add(lanes[i], block, start)
    return [one.shown(len(pixels), max_depth, seed) for one in met]


def _all_behind(behind: Sequence[GlassToRoom]) -> list[tuple[int, GlassToRoom]]:
    """All rooms behind glass, each with the number in this list of the room in front of it.

    -1: the eye's room.
    """
    rooms = [(-1, one) for one in behind]
    for i, (_, one) in enumerate(rooms):  # grows as it is read
        rooms += [(i, onward) for onward in one.room.onward]
    return rooms


def _into_room(tracer: TracedScene, behind: GlassToRoom, lanes: PixelRays) -> PixelRays:
    """Rays in a room that pass straight into a room behind it, offset off the glass."""
    beams = np.zeros((len(tracer.groups), KLEMS_FULL.size))
    beams[behind.first : behind.first + behind.count] = behind.beam
    found = through_windows(tracer, _panes(beams), lanes)
    outwards = tracer.groups[behind.first].frame[2] * tracer.epsilon.numpy()
    origin = (found.origin + outwards[:, None]).astype(np.float32)
    return PixelRays(found.row, origin, found.way, found.weight)


def _panes(beams: NDArray[np.float64]) -> list[KlemsScattering]:
    """Straight beams through window groups, by their patches [G, K]."""
    dark, panes = np.zeros((KLEMS_FULL.size, KLEMS_FULL.size)), {}
    for beam in beams:
        if beam.tobytes() not in panes:
            # an even beam (an open doorway) has no specular fall: an exponent of 0
            fall = specular_exponent(ThroughPeak(beam, dark), KLEMS_FULL)
            exponent = 0.0 if fall is None and np.ptp(beam) == 0 else fall
            panes[beam.tobytes()] = KlemsScattering(KLEMS_FULL, dark, beam, exponent)
    return [panes[beam.tobytes()] for beam in beams]


class _MetInRoom:
    """Accumulates hits of rays in a room and outside its windows: patches, points on surfaces."""

    def __init__(
        self, room: AdjacentRoomLight, tracer: TracedScene, tiles: Tiles, sky: SkyBins, scenes: SceneCache
    ) -> None:
        self.room, self.tracer, self.bins = room, tracer, DirectionBins(KLEMS_FULL)
        self._tiles, self._columns = tiles, len(room.groups) * KLEMS_FULL.size
        self._faces = tracer.derived(face_numbers)
        self._outdoors = room.onward[0].first if room.onward else len(room.groups)
        outside = scenes.scene(room.exterior, room.groups[: self._outdoors], centre=tracer.centre)
        self._beyond = SeenOutdoors(outside, sky, tiles)
        self._pixel, self._slot, self._share = [], [], []
        self._shown: list[tuple[NDArray, NDArray, NDArray, SurfacePoints]] = []

    def add(self, lanes: PixelRays, block: NDArray[np.int64], start: int) -> None:
        """Add the hits of a block's rays and their specular reflections; glass onwards is black."""
        tracer = self.tracer
        self._beyond.add(through_windows(tracer, _panes(self.room.beam), lanes), block, start)
        for bounce in range(MOST_MIRRORS + 1):
            if not len(lanes.row):
                return
            origin, way = vectors(lanes.origin.T, mi.Point3f), vectors(lanes.way.T)
            ray = mi.Ray3f(origin, way)
            hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False)
            is_hit = hit.is_valid()
            window = tracer.leaves(hit, way, is_hit)
            group = dr.gather(mi.Int32, tracer.group, hit.prim_index, window)
            patch = self.bins.index(tracer.to_local(group, way, window))
            cosine = dr.abs(dr.dot(dr.gather(mi.Vector3f, tracer.normal, hit.prim_index), way))
            rho = tracer.diffuse(hit.prim_index, cosine, is_hit)
            places, *of_hits = hit_points(
                tracer, origin, way, hit, is_hit, is_hit, window, group, patch, rho, hit.prim_index
            )
            self._sort(lanes, places, of_hits, block, start)
            lanes = mirrored(tracer, lanes, hit, bounce)

    def _sort(
        self, lanes: PixelRays, places: SurfacePoints, of_hits: list[NDArray], block: NDArray, start: int
    ) -> None:
        found, window, group, patch, rho, triangle = of_hits
        lit = np.flatnonzero(window & (group < self._outdoors))
        self._pixel.append(start + lanes.row[lit])
        self._slot.append(group[lit].astype(np.int64) * KLEMS_FULL.size + patch[lit])
        self._share.append(lanes.weight[lit])
        kept = np.flatnonzero(found & ~window & (rho > 0))
        row = lanes.row[kept]
        tile = self._tiles.of_pixels(block[row], self._faces[triangle[kept].astype(np.int64)])
        share = lanes.weight[kept] * rho[kept] / np.pi
        self._shown.append((start + row, tile, share, places.some(kept)))

    def shown(self, count: int, max_depth: int, seed: int) -> RoomShown:
        """The room in all pixels [n]."""
        slots = _joined(self._pixel), _joined(self._slot)
        pixel, tile, share = (_joined([s[k] for s in self._shown]) for k in range(3))
        keys, tile = np.unique(tile.astype(np.int64), return_inverse=True)
        size = np.bincount(tile, minlength=len(keys))
        places = SurfacePoints.joined([s[3] for s in self._shown])
        light = self._irradiance(tile, places, size, max_depth, seed)
        luminance, beam, daylight = (
            np.asarray(part, dtype=np.float32) for part in (self.room.luminance, self.room.beam, self.room.daylight)
        )
        outdoors, _, reflected = self._beyond.faces(seed)
        flat = self._columns, luminance.shape[-1]
        return RoomShown(
            _shares(_joined(self._share), slots, (count, self._columns)),
            np.maximum(luminance - beam[..., None] * daylight, 0).reshape(flat),
            _shares(share, (pixel, tile), (count, len(keys))),
            smoothing(surroundings(self._tiles, keys), size).astype(np.float32) @ light,
            luminance.reshape(flat),
            self._beyond.sky(),
            _shares(outdoors.value, (outdoors.pixel, outdoors.tile), (count, reflected.shape[0])),
            reflected,
        )

    def _irradiance(
        self, tile: NDArray[np.int64], places: SurfacePoints, size: NDArray, max_depth: int, seed: int
    ) -> NDArray[np.float32]:
        """Mean irradiance at the points of each tile per unit luminance of the windows [C, N]."""
        again = np.ceil(LEAST_PATHS / np.maximum(size, 1)).astype(np.int64)
        order = np.argsort(tile, kind="stable")
        order = np.repeat(order, again[tile[order]])
        ends = np.searchsorted(tile[order], np.arange(len(size) + 1))
        irradiance = np.empty((len(size), self._columns), dtype=np.float32)
        step = max(16, BLOCK_BYTES // (8 * self._columns))
        for start in range(0, len(size), step):
            end = min(start + step, len(size))
            part = order[ends[start] : ends[end]]
            matrix = empty_sums((end - start) * self._columns)
            path = np.arange(ends[start], ends[end])
            self._add_paths(matrix, path, tile[part] - start, places.some(part), max_depth, seed)
            values = sums_of(matrix, (end - start, self._columns))
            irradiance[start:end] = values / np.diff(ends[start : end + 1])[:, None]
        return irradiance

    def _add_paths(
        self,
        matrix: mi.Float64,
        path: NDArray[np.int64],
        row: NDArray[np.int64],
        places: SurfacePoints,
        max_depth: int,
        seed: int,
    ) -> None:
        key, width = dr.opaque(mi.UInt32, seed & 0xFFFFFFFF), opaque(self._columns, mi.UInt32)
        entry = column(row, mi.UInt32) * width
        first = path[np.unique(row, return_index=True)[1]]  # of each row, for its stream
        streams = column(first[row] & 0xFFFFFFFF, mi.UInt32)
        add_view_paths(
            self.tracer,
            self.bins,
            matrix,
            entry,
            places.points(),
            places.normals(),
            later=mi.UInt32(0),
            beta=mi.Float(1),
            sample=column(numbered(row), mi.UInt32),
            stream=mi.sample_tea_32(streams, key)[0],
            generator=path_generator(column(path & 0xFFFFFFFF, mi.UInt32), key),
            max_depth=dr.opaque(mi.UInt32, max_depth),
            active=mi.Bool(True),
            carried=None,
            mirrored=None,
            light=None,
            room=None,
            bounces=None,
            counted=None,
        )


def _joined(parts: Sequence[NDArray]) -> NDArray:
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def _shares(share: NDArray, place: tuple[NDArray, NDArray], shape: tuple[int, int]) -> sparse.csr_array:
    """A sparse matrix from entries at rows and columns, repeated ones summed."""
    rows, columns = (part.astype(np.int64) for part in place)
    entries = share.astype(np.float32), (rows, columns)
    return sparse.csr_array(sparse.coo_array(entries, shape=shape))
