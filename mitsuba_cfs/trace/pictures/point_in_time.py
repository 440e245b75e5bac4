"""Point-in-time pictures: a view of a room under one sky, path-traced through the real BSDF.

    L[pixel] = sharp part + sum over the faces that it shows, share of the face times shared light

Sharp, from the pixel's own rays: the sun's disc, its beam on surfaces, the sun that a window
scatters towards the eye, sky and outdoors through the straight beam, what the glass mirrors.
Shared (`pixel_rows`), because it varies slowly over a face and its noise would make false glare
sources: light on a surface from windows or after reflections, and the sky that a window scatters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View, pixel_directions, pixel_rays
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.pixel_rows import STEPS, SharedLight, Tiles, face_numbers, tile_size
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.sampling import lattice, lattice_2d, path_generator, pixel_positions, streams, vectors
from mitsuba_cfs.trace.kernels.scene import OPAQUE, TracedScene
from mitsuba_cfs.trace.paths.disc import add_discs, eye_of
from mitsuba_cfs.trace.paths.point_in_time import add_paths, leave, window_parts, window_sun
from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
from mitsuba_cfs.trace.paths.sun import Vertex, on_disc, surface_sun

BLOCK = 2**19  # paths traced at a time
WINDOW_STEPS = (1,)  # [tiles] of the smoothing where windows scatter


def _sharp_light(
    room: PathTracingScene,
    sky: Sky,
    vertex: Vertex,
    triangle: mi.UInt32,
    direction: mi.Vector3f,
    *,
    rho: mi.Float,  # diffuse reflectance
    u_sun: mi.Point2f,
    generator: mi.PCG32,
    depth: mi.UInt32,
    active: mi.Bool,
) -> mi.Float64:
    """Radiance of surfaces by the direct sun and by their gloss, for each ray."""
    sun = surface_sun(
        room, sky, vertex, triangle, direction, rho=rho, came=mi.Float(0), u=u_sun, generator=generator, active=active
    )
    sharp = dr.select(active, mi.Float64(sun), 0.0)
    for tracer, here in ((room.inside, ~vertex.outdoors), (room.outside, vertex.outdoors)):
        if tracer.gloss is None:
            continue
        glossy, towards, weight = tracer.gloss.leave(
            triangle, vertex.normal, direction, mi.Float(0), generator, active & here
        )
        lane = dr.arange(mi.UInt32, dr.width(direction))
        seen = dr.zeros(mi.Float64, dr.width(direction))
        starts = PathStarts(
            lane, mi.Point3f(vertex.position), mi.Vector3f(towards), mi.PCG32(generator), depth, glossy & (weight > 0)
        )
        add_paths(
            room,
            sky,
            seen,
            starts,
            cosine=mi.Float(0),
            came=mi.Float(0),
            aimed=mi.Float(0),
            beta=dr.select(glossy, weight, 0.0),
            outdoors=mi.Bool(vertex.outdoors),
        )
        sharp += seen
    return sharp


def point_in_time_picture(
    room: PathTracingScene,
    sky: Sky,
    view: View,
    *,
    samples: int = 16,
    tile: int | None = None,
    pixels: NDArray[np.int64] | None = None,
    max_depth: int = 24,
    seed: int = 0,
    disc: bool = True,
    progress: Progress = silent,
) -> NDArray[np.float32]:
    """Luminance (radiance) picture [ny, nx] under one sky.

    Args:
        samples: rays and paths for each pixel, spread over it.
        tile: pixels across of the squares that share slowly varying light, by default 0.9 degrees
            (2 pixels at least); 1: each pixel alone, without smoothing, for a picture free
            of any assumption.
        pixels: [n] row * width + column of those to trace, by default all that show something.
        disc: the sun's disc and its images in mirrors too; without them, they are to be rated apart
            (`mitsuba_cfs.trace.paths.disc.discs_seen`).
    """
    tile = tile_size(view) if tile is None else tile
    shown = np.flatnonzero(pixel_directions(view)[1].reshape(-1)) if pixels is None else pixels
    shifts = np.random.default_rng(seed).random((len(shown), 2))
    tiles, numbers = Tiles(tile, view.width), _Faces(room)
    picture = np.zeros(view.height * view.width)
    kernel = _Kernel(room, sky, view, numbers, tiles, samples=samples, max_depth=max_depth, seed=seed)
    pairs, rows = [], []
    size = max(1, BLOCK // samples)
    for start in range(0, len(shown), size):
        block = shown[start : start + size]
        sharp, shared = kernel.trace(block, shifts[start : start + size])
        picture[block] = sharp
        for light in shared:
            pairs.append(light.by_pixel(block, samples))
            rows.append(light.by_tile(block, samples, tiles))
        progress("picture", (start + len(block)) / len(shown))
    _add_shared(picture, tiles, pairs, rows, numbers.windows)
    if disc:
        add_discs(picture, room, sky, view)
    return picture.astype(np.float32).reshape(view.height, view.width)


def colour_picture(
    rooms: Sequence[PathTracingScene], skies: Sequence[Sky], view: View, **options: Any
) -> NDArray[np.float32]:
    """Radiance picture [ny, nx, 3] [W/m2/sr] of red, green and blue.

    Args:
        rooms, skies: for each band, with its reflectances, systems and sky; the shapes are equal.
        options: of `point_in_time_picture`; the bands share their random numbers, so that noise
            is grey.
    """
    if not len(rooms) == len(skies) == 3:
        raise ValueError(f"{len(rooms)} rooms and {len(skies)} skies: expected three bands")
    bands = [point_in_time_picture(r, s, view, **options) for r, s in zip(rooms, skies, strict=True)]
    return np.stack(bands, axis=-1)


def _add_shared(picture: NDArray, tiles: Tiles, pairs: Sequence, rows: Sequence, windows: int) -> None:
    """Add to each pixel the smoothed light of the faces that it shows."""
    key, total, count = (np.concatenate(part) for part in zip(*rows, strict=True))
    if not len(key):
        return
    light = SharedLight(tiles, key, total, count)
    if tiles.size > 1:
        glass = light.faces < windows
        for step in STEPS:
            light = light.smoothed(step, None if step in WINDOW_STEPS else ~glass)
    pixel, face, weight = (np.concatenate(part) for part in zip(*pairs, strict=True))
    np.add.at(picture, pixel, weight * light.at(pixel, face))


class _Faces:
    """Numbers of faces: windows, then both sides of faces indoors, then outdoors."""

    def __init__(self, room: PathTracingScene) -> None:
        self.windows = len(room.systems) + 1  # the last: windows seen from outdoors
        self._inside, count = self._table(room.inside)
        self._outside, _ = self._table(room.outside)
        self._first_outside = self.windows + 2 * count

    @staticmethod
    def _table(scene: TracedScene) -> tuple[mi.UInt32, int]:
        face = scene.derived(face_numbers)
        return mi.UInt32(face.astype(np.uint32)), int(face.max()) + 1

    def inside(self, prim: mi.UInt32, behind: mi.Bool, active: mi.Bool) -> mi.UInt32:
        """Number of the side of a triangle in the room."""
        face = dr.gather(mi.UInt32, self._inside, prim, active)
        return self.windows + 2 * face + dr.select(behind, mi.UInt32(1), mi.UInt32(0))

    def outside(self, prim: mi.UInt32, behind: mi.Bool, active: mi.Bool) -> mi.UInt32:
        """Number of the side of a triangle outdoors."""
        face = dr.gather(mi.UInt32, self._outside, prim, active)
        return self._first_outside + 2 * face + dr.select(behind, mi.UInt32(1), mi.UInt32(0))


@dataclass(frozen=True)
class _Light:
    """Shared light of the rays [n] of a block: face, its weight in the ray, the path's light."""

    face: NDArray[np.int64]
    weight: NDArray[np.float64]  # 0 where the ray shows no such face
    value: NDArray[np.float64]

    def by_pixel(self, pixels: NDArray, samples: int) -> tuple[NDArray, NDArray, NDArray]:
        """Pixels, faces and the faces' weights in the pixels' means."""
        ray = np.flatnonzero(self.weight > 0)
        key = (self.face[ray] << 32) + pixels[ray // samples]
        lit, place = np.unique(key, return_inverse=True)
        weight = np.bincount(place, self.weight[ray], minlength=len(lit)) / samples
        return lit & 0xFFFFFFFF, lit >> 32, weight

    def by_tile(self, pixels: NDArray, samples: int, tiles: Tiles) -> tuple[NDArray, NDArray, NDArray]:
        """Numbers of faces in tiles, and the sum and number of their paths."""
        ray = np.flatnonzero(self.weight > 0)
        key = tiles.of_pixels(pixels[ray // samples], self.face[ray])
        keys, place = np.unique(key, return_inverse=True)
        total = np.bincount(place, self.value[ray], minlength=len(keys))
        return keys, total, np.bincount(place, minlength=len(keys)).astype(float)


class _Kernel:
    """Traces blocks of pixels."""

    def __init__(
        self,
        room: PathTracingScene,
        sky: Sky,
        view: View,
        faces: _Faces,
        tiles: Tiles,
        *,
        samples: int,
        max_depth: int,
        seed: int,
    ) -> None:
        self._room, self._sky, self._view, self._faces = room, sky, view, faces
        self._tiles = tiles
        self._samples, self._places = samples, pixel_positions(samples)
        self._eye = eye_of(room, view)
        self._depth = dr.opaque(mi.UInt32, max_depth)
        self._seed, self._key = seed, dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
        self._beams = any(system.beam is not None for system in room.systems)
        self._mirrors = any(m is not None for system in room.systems for m in system.mirrors)

    def trace(self, pixels: NDArray, shifts: NDArray) -> tuple[NDArray, list[_Light]]:
        """Sharp light of the pixels [n], and the light of their rays to share."""
        n = self._samples
        number = np.repeat(pixels, n)
        across, down = np.mod(self._places + shifts[:, None], 1.0).reshape(-1, 2).T
        directions, exists = pixel_rays(self._view, number, across, down)
        way = vectors(directions)
        path = mi.UInt32(number.astype(np.uint32)) * n + dr.arange(mi.UInt32, len(number)) % n
        generator = path_generator(path, self._key)
        stream, sample = self._strata(number)
        sharp, shared = self._rays(way, generator, stream, sample, mi.Bool(exists))
        dr.eval(sharp, *(part for light in shared for part in light))
        lights = [
            _Light(face.numpy().astype(np.int64), weight.numpy().astype(float), value.numpy())
            for face, weight, value in shared
        ]
        return sharp.numpy().reshape(-1, n).mean(axis=1), lights

    def _strata(self, number: NDArray) -> tuple[mi.UInt32, mi.UInt32]:
        """Tile of each ray, and its number in the tile, to stratify the shared light."""
        size, n = self._tiles.size, self._samples
        row, column = np.divmod(number, self._view.width)
        tile = self._tiles.of_pixels(number, np.zeros_like(number))
        place = (row % size * size + column % size) * n + np.arange(len(number)) % n
        return streams(tile, self._seed), mi.UInt32(place.astype(np.uint32))

    def _rays(
        self, direction: mi.Vector3f, generator: mi.PCG32, stream: mi.UInt32, sample: mi.UInt32, active: mi.Bool
    ) -> tuple[mi.Float64, list[tuple[mi.UInt32, mi.Float, mi.Float64]]]:
        """One ray and its paths for each lane: sharp light; face, weight and light to share."""
        room, sky = self._room, self._sky
        inside = room.inside
        lane = dr.arange(mi.UInt32, dr.width(direction))
        indoors = mi.Bool(False)

        # ----- What the ray meets -----
        ray = mi.Ray3f(self._eye, direction)
        hit = inside.scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, inside.group, hit.prim_index, active)
        point = mi.Point3f(self._eye + direction * hit.t)
        opaque, glazed = active & (group == OPAQUE), active & (group != OPAQUE)
        glazed &= inside.to_local(group, direction, glazed).z > 1e-4
        u_sun = mi.Point2f(generator.next_float32(), generator.next_float32())
        u, choice = lattice_2d(sample, stream, 0), lattice(sample, stream, 2)

        # ----- A surface: the sun's beam on it, and a path from it -----
        normal = dr.gather(mi.Vector3f, inside.normal, hit.prim_index, opaque)
        behind = dr.dot(normal, direction) > 0
        normal = dr.select(behind, -normal, normal)
        rho = inside.diffuse(hit.prim_index, -dr.dot(normal, direction), opaque)
        vertex = Vertex(mi.Point3f(point + normal * inside.epsilon), normal, indoors)
        sharp = _sharp_light(
            room,
            sky,
            vertex,
            hit.prim_index,
            direction,
            rho=rho,
            u_sun=u_sun,
            generator=generator,
            depth=self._depth,
            active=opaque,
        )
        away, aimed = leave(room, sky, vertex, u, choice, opaque)
        cosine = dr.select(opaque, dr.dot(away, normal), 0.0)

        # ----- A window: the sun scattered in it, and a path through what scatters -----
        towards = on_disc(sky, u_sun)
        scattered, straight, mirrored, mirror, rest, onwards = window_parts(
            room, group, direction, towards, u=u, choice=choice, glazed=glazed
        )
        step = inside.outward(group, glazed)
        outer, inner = mi.Point3f(point + step), mi.Point3f(point - step)
        sunlit = glazed & (scattered > 0) & (sky.sun_radiance > 0)
        sunlit &= ~room.outside.hides(mi.Ray3f(outer, towards), sunlit)
        sun = scattered * float(SUN_SOLID_ANGLE) * sky.sun_radiance
        sharp += dr.select(sunlit, mi.Float64(sun), 0.0)
        if room.glossy:
            more = window_sun(room, sky, outer, group, direction, generator=generator, glazed=glazed)
            sharp += dr.select(glazed, mi.Float64(more), 0.0)
        outward = glazed & (dr.dot(step, onwards) > 0)

        # ----- The paths whose light is shared -----
        found = dr.zeros(mi.Float64, dr.width(lane))
        origin = dr.select(opaque, vertex.position, dr.select(outward, outer, inner))
        starts = PathStarts(
            lane,
            mi.Point3f(origin),
            dr.select(opaque, away, onwards),
            mi.PCG32(generator),
            self._depth,
            (opaque & (cosine > 0)) | (glazed & (rest > 0)),
        )
        add_paths(
            room,
            sky,
            found,
            starts,
            cosine=cosine,
            came=cosine * dr.inv_pi,
            aimed=dr.select(opaque, aimed, 0.0),
            beta=dr.select(opaque, 1.0, rest),
            outdoors=outward,
        )
        face = self._faces.inside(hit.prim_index, behind, opaque)
        face = dr.select(opaque, face, mi.UInt32(group))
        scattering = dr.select(glazed & self._scatters(group), 1.0, 0.0)
        weight = dr.select(opaque, rho * dr.inv_pi, scattering)
        shared = [(face, weight, found)]

        # ----- Straight on, and back by the mirror -----
        if self._beams:
            beam, light = self._outdoors(outer, direction, straight, u, generator, glazed)
            sharp += beam
            shared.append(light)
        if self._mirrors:
            seen = dr.zeros(mi.Float64, dr.width(lane))
            starts = PathStarts(lane, inner, mirror, mi.PCG32(generator), self._depth, glazed & (mirrored > 0))
            add_paths(
                room,
                sky,
                seen,
                starts,
                cosine=mi.Float(0),
                came=mi.Float(0),
                aimed=mi.Float(0),
                beta=mirrored,
                outdoors=mi.Bool(False),
            )
            sharp += seen
        return sharp, shared

    def _scatters(self, group: mi.Int32) -> mi.Bool:
        """Which window groups scatter light."""
        found = mi.Bool(False)
        for g, system in enumerate(self._room.systems):
            found |= (group == g) & (system.bsdf is not None)
        return found

    def _outdoors(
        self,
        origin: mi.Point3f,
        direction: mi.Vector3f,
        straight: mi.Float,
        u: mi.Point2f,
        generator: mi.PCG32,
        active: mi.Bool,
    ) -> tuple[mi.Float64, tuple[mi.UInt32, mi.Float, mi.Float64]]:
        """Sharp light of rays straight outdoors, and their light to share."""
        room, sky = self._room, self._sky
        outside = room.outside
        lane, outdoors = dr.arange(mi.UInt32, dr.width(direction)), mi.Bool(True)
        active = active & (straight > 0)
        hit, before = outside.met_outdoors(origin, direction, active)
        free = active & ~hit.is_valid()
        radiance = dr.gather(mi.Float, sky.radiance, sky.bins.index(direction), free)
        sharp = dr.select(free, mi.Float64(straight * radiance), 0.0)
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, outside.group, hit.prim_index, active)
        opaque = active & (group == OPAQUE)
        normal = dr.gather(mi.Vector3f, outside.normal, hit.prim_index, opaque)
        behind = dr.dot(normal, direction) > 0
        normal = dr.select(behind, -normal, normal)
        place = mi.Point3f(before + direction * hit.t + normal * room.inside.epsilon)
        vertex = Vertex(place, normal, outdoors)
        rho = outside.diffuse(hit.prim_index, -dr.dot(normal, direction), opaque)
        u_sun = mi.Point2f(generator.next_float32(), generator.next_float32())
        sharp += straight * _sharp_light(
            room,
            sky,
            vertex,
            hit.prim_index,
            direction,
            rho=rho,
            u_sun=u_sun,
            generator=generator,
            depth=self._depth,
            active=opaque,
        )
        away, _ = leave(room, sky, vertex, u, mi.Float(1), opaque)
        # a surface's irradiance is pi times the mean by cosine; another window is looked into
        found = dr.zeros(mi.Float64, dr.width(lane))
        starts = PathStarts(
            lane,
            dr.select(opaque, place, origin),
            dr.select(opaque, away, direction),
            mi.PCG32(generator),
            self._depth,
            mi.Bool(active),  # a copy: the loop changes what it is given
        )
        add_paths(
            room,
            sky,
            found,
            starts,
            cosine=mi.Float(0),
            came=dr.select(opaque, dr.dot(away, normal) * dr.inv_pi, 0.0),
            aimed=mi.Float(0),
            beta=dr.select(opaque, dr.pi, 1.0),
            outdoors=outdoors,
        )
        face = self._faces.outside(hit.prim_index, behind, opaque)
        face = dr.select(opaque, face, mi.UInt32(self._faces.windows - 1))
        weight = dr.select(active, straight * dr.select(opaque, rho * dr.inv_pi, 1.0), 0.0)
        return sharp, (face, weight, found)
