"""The sun in the pixels of a view: disc, beam on surfaces, scattered light in windows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.glare.sun_disc import SunDisc, seen_disc
from mitsuba_cfs.images.view import View, pixel_directions, pixel_solid_angles
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, opaque_vector, vectors
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache
from mitsuba_cfs.trace.sun.lit_points import on_disc_of, points_and_suns
from mitsuba_cfs.trace.sun.pixels import (
    EDGE_SAMPLES,
    before_eye,
    disc_parts,
    disc_rays,
    disc_reach,
    edge_pixels,
    pixel_samples,
)
from mitsuba_cfs.trace.sun.specular_paths import SpecularPath, specular_sun_paths
from mitsuba_cfs.trace.sun.sunlit_cells import Beam, RoomCells
from mitsuba_cfs.trace.sun.sunlit_rows import EDGE_POINTS, SunlitShares

LANES = 1 << 23  # pairs of pixel and sun traced at a time
CELL_POINTS = 4096  # on all windows, that the sun is followed from to the cells of the room
LEAST_POINTS = 256  # on each window group
WINDOW_POINTS = 64  # on each group, for its sunlit share
PATCH_POINTS = 16  # directions in each window patch, for its mean of scattered sun


@dataclass(frozen=True, slots=True)
class _DiscImage:
    """The sun's disc of some hours as the eye may see it, straight or in mirrors."""

    suns: NDArray[np.float64]  # [h, 3] apparent directions to its centre
    illuminance: NDArray[np.float64]  # [h] normal to it, before glazing and mirrors [lx]
    hours: NDArray[np.int64]  # those in which it may be visible
    transmittance: Callable[[mi.Vector3f], mi.Float]  # from the eye, of directions on the disc


class PictureSun:
    """The sun in the pixels of a view, without reflections before the one that the pixel shows.

    One ray through the centre of each pixel decides whether the beam falls on it; pixels at the
    edge of a shadow get several rays.  Small pieces of the sun's disc give it its solid angle
    whatever the size of the pixels.
    """

    def __init__(
        self,
        interior: Surfaces,
        exterior: Surfaces,
        groups: Sequence[WindowGroup],
        scattering: Sequence[Scattering],
        view: View,
        *,
        basis: KlemsBasis = KLEMS_FULL,
        scenes: SceneCache | None = None,
    ) -> None:
        """Trace the first hit of each pixel; arguments as for `direct_sun_matrix`."""
        scenes = SceneCache() if scenes is None else scenes
        if len(scattering) != len(groups):
            raise ValueError(f"{len(scattering)} systems for {len(groups)} window groups")
        self._inside = scenes.scene(interior, groups)
        self._outside = scenes.scene(exterior, groups, windows_block=False)
        self._way, *mirrors = specular_sun_paths(self._outside)
        self._free = self._way.free
        self._mirrors: list[PictureSun] = []
        self._last: tuple[RoomCells, bytes, sparse.csr_array] | None = None
        self._scattering, self._bins = tuple(scattering), DirectionBins(basis)
        self.view = view
        directions, counts = pixel_directions(view)
        shown = np.flatnonzero(counts.reshape(-1))
        self.pixels = shown
        self._directions = directions.reshape(-1, 3)[shown]
        self._tree = cKDTree(self._directions)
        self._size = float(np.sqrt(pixel_solid_angles(view).max()))  # of a pixel [rad]
        self._eye = self._inside.place(view.position)
        self._look()
        self._mirrors = [self._in_mirror(path) for path in mirrors]

    def _in_mirror(self, path: SpecularPath) -> PictureSun:
        """The same pixels for the sun by another specular path."""
        other = copy(self)
        other._way, other._free = path, path.free
        return other

    def _look(self) -> None:
        """Trace the centre of every pixel: its window group, point, normal and reflectance."""
        tracer = self._inside
        direction = vectors(self._directions)
        hit = tracer.scene.ray_intersect_preliminary(mi.Ray3f(self._eye, direction), coherent=True)
        valid = hit.is_valid()
        group = dr.select(valid, dr.gather(mi.Int32, tracer.group, hit.prim_index, valid), OPAQUE)
        face = dr.gather(mi.Vector3f, tracer.normal, hit.prim_index, valid)
        face = dr.mulsign(face, -dr.dot(face, direction))
        place = self._eye + direction * hit.t + face * tracer.epsilon
        reflectance = tracer.diffuse(hit.prim_index, -dr.dot(face, direction), valid)
        dull = valid & (group == OPAQUE) & (reflectance > 0)
        self._surface = np.flatnonzero(dull.numpy())
        chosen = column(self._surface, mi.UInt32)
        self._place = dr.gather(mi.Point3f, mi.Point3f(place), chosen)
        self._normal = dr.gather(mi.Vector3f, face, chosen)
        self._reflectance = dr.gather(mi.Float, reflectance, chosen)
        groups, self._panes = group.numpy(), []
        for g in range(len(tracer.groups)):
            pane = np.flatnonzero(groups == g)
            if not len(pane):  # the view shows nothing of this group
                self._panes.append((pane, None, None))
                continue
            chosen = column(pane, mi.UInt32)
            towards = tracer.to_group(g, dr.gather(mi.Vector3f, direction, chosen))
            point = dr.gather(mi.Point3f, mi.Point3f(self._eye + direction * hit.t), chosen)
            step = tracer.exterior_normal(g) * tracer.epsilon
            self._panes.append((pane, mi.Point3f(point + step), towards))

    def add_to(self, values: NDArray, suns: NDArray, illuminance: NDArray) -> None:
        """Add the sun's light on surfaces and windows [cd/m2] to the pixels' values [h, n].

        Without its disc and the images of it: see `add_disc` and `discs`.

        Args: suns: [h, 3] directions to the disc; illuminance: [h] normal to it [lx].
        """
        for mirror in self._mirrors:
            mirror.add_to(values, suns, illuminance)
        suns, illuminance = self._turned(suns, illuminance)
        lit = self._shining(suns, illuminance)
        if not len(lit):
            return
        towards, strength = suns[lit], illuminance[lit]
        self._add(values, lit, self._surface, towards, strength, self._beam_on_surfaces, edges=True)
        for g, (pane, _, _) in enumerate(self._panes):
            self._add(values, lit, pane, towards, strength, self._scattered_in_panes, g)

    def sunlit_luminance(self, sunlit: SunlitShares, suns: NDArray, illuminance: NDArray) -> NDArray[np.float32]:
        """Luminance [m, h] of a picture's rows by the sun that the surfaces of the room reflect."""
        shining = np.flatnonzero((suns[:, 2] > 0) & (illuminance > 0))
        found = np.zeros((sunlit.share.shape[0], len(suns)), dtype=np.float32)
        irradiance = self._on_cells(sunlit.cells, suns[shining], illuminance[shining])
        found[:, shining] = sunlit.far_rows(irradiance)
        self._add_near(found, sunlit, suns, illuminance)
        return found

    def _on_cells(self, cells: RoomCells, suns: NDArray, illuminance: NDArray) -> sparse.csr_array:
        """Irradiance of the room's cells by the windows' straight beams [c, h] [lx].

        That of the last hours is stored: a picture, its noise and the windows ask for it in turn.
        """
        hours = suns.tobytes() + illuminance.tobytes()
        if self._last is None or self._last[0] is not cells or self._last[1] != hours:
            self._last = cells, hours, self._traced_on_cells(cells, suns, illuminance)
        return self._last[2]

    def _traced_on_cells(self, cells: RoomCells, suns: NDArray, illuminance: NDArray) -> sparse.csr_array:
        groups, scenes = self._inside.groups, (self._inside, self._outside)
        whole, flux = sum(group.area for group in groups), sparse.csr_array((cells.size, len(suns)))
        for g, (group, scattering) in enumerate(zip(groups, self._scattering, strict=True)):
            points = max(round(CELL_POINTS * group.area / whole), LEAST_POINTS)
            flux = flux + Beam(scenes, g, scattering, points).flux(cells, suns)
        by_area = sparse.diags_array(1 / cells.area) @ flux @ sparse.diags_array(illuminance)
        return sparse.csr_array(by_area).astype(np.float32)

    def _add_near(self, found: NDArray, sunlit: SunlitShares, suns: NDArray, illuminance: NDArray) -> None:
        """Add the luminance [m, h] of rows by the sunlit pieces near them, point by point."""
        for mirror in self._mirrors:
            mirror._add_near(found, sunlit, suns, illuminance)
        suns, illuminance = self._turned(suns, illuminance)
        lit, places = self._shining(suns, illuminance), sunlit.places
        if not places.size or not len(lit):
            return
        step = max(1, LANES // places.size)
        for start in range(0, len(lit), step):
            hours = lit[start : start + step]
            light = self._beam_at(*points_and_suns(places, suns[hours]))
            light = light.reshape(places.size, len(hours))
            self._resample_pieces(sunlit, light, suns[hours])
            found[:, hours] += sunlit.near @ (light * illuminance[hours].astype(np.float32))

    def _resample_pieces(self, sunlit: SunlitShares, near: NDArray, suns: NDArray) -> None:
        """Set the mean over several points of each piece that the edge of a spot of sun crosses."""
        element, hour = sunlit.edges.crossed(near)
        step = LANES // EDGE_POINTS
        for start in range(0, len(hour), step):
            part = slice(start, start + step)
            number = (element[part, None] * EDGE_POINTS + np.arange(EDGE_POINTS)).ravel()
            places = sunlit.edges.places.some(number)
            towards = vectors(np.repeat(suns[hour[part]], EDGE_POINTS, axis=0))
            to_sun = on_disc_of(towards, column(number, mi.UInt32))
            value = self._beam_at(places.points(), places.normals(), to_sun)
            near[element[part], hour[part]] = value.reshape(-1, EDGE_POINTS).mean(axis=1)

    def _beam_at(self, point: mi.Point3f, normal: mi.Vector3f, to_sun: mi.Vector3f) -> NDArray[np.float32]:
        """Irradiance of points through the windows, per unit normal to the sun [n]."""
        cosine = dr.dot(normal, to_sun)
        tau = self._straight(point, to_sun, cosine > 0)
        return dr.select(tau > 0, tau * cosine, 0.0).numpy()

    def _turned(self, suns: NDArray, illuminance: NDArray) -> tuple[NDArray, NDArray]:
        """Apparent directions of suns, and their illuminance: 0 with the sun down."""
        return self._way.apparent(suns), np.where(suns[:, 2] > 0, illuminance, 0.0)

    def _shining(self, suns: NDArray, illuminance: NDArray) -> NDArray[np.int64]:
        """Hours with the sun in front of a window."""
        facing = np.any([suns @ g.frame[2] > 0 for g in self._inside.groups], axis=0)
        return np.flatnonzero(facing & (illuminance > 0))

    def discs(self, suns: NDArray, illuminance: NDArray) -> list[tuple[SunDisc, ...]]:
        """The sun's disc and its images in mirrors [h], as far as the eye sees them.

        Args: suns, illuminance: as of `add_to`.
        """
        discs: list[tuple[SunDisc, ...]] = [()] * len(suns)
        for image in self._images(suns, illuminance):
            lit = image.hours
            lit = lit[self._tree.query(image.suns[lit])[0] < self._size] if len(lit) else lit
            if not len(lit):
                continue
            ways = np.stack([disc_parts(image.suns[hour]) for hour in lit])
            tau = image.transmittance(vectors(ways.reshape(-1, 3))).numpy()
            tau = np.broadcast_to(tau, ways.shape[0] * ways.shape[1]).reshape(ways.shape[:2])
            for hour, way, part in zip(lit, ways, tau * before_eye(self.view, ways), strict=True):
                disc = seen_disc(way, part * (image.illuminance[hour] / SUN_SOLID_ANGLE))
                discs[hour] += () if disc is None else (disc,)
        return discs

    def _images(self, suns: NDArray, illuminance: NDArray) -> Iterator[_DiscImage]:
        """The disc, its image in each mirror of the room, and those of each mirror outdoors."""
        gloss, eye = self._inside.gloss, mi.Point3f(self._eye)
        shown, strength = self._turned(suns, illuminance)
        hours = self._shining(shown, strength)
        straight = partial(self._straight, eye, active=mi.Bool(True))
        yield _DiscImage(shown, strength, hours, straight)
        for plane in [] if gloss is None else gloss.mirrors:
            mirrored = shown - 2 * (shown @ gloss.normals[plane])[:, None] * gloss.normals[plane]
            by_mirror = partial(self._by_mirror, plane=int(plane))
            yield _DiscImage(mirrored, strength, np.flatnonzero(strength), by_mirror)
        for mirror in self._mirrors:
            yield from mirror._images(suns, illuminance)

    def _add(self, values, lit, columns, suns, strength, kernel, *options, edges=False) -> None:
        """Add the values of a kernel for pairs of hours and pixels, some hours at a time.

        Args: edges: whether to sample pixels again that a shadow's edge crosses.
        """
        if not len(columns):
            return
        step = max(1, LANES // len(columns))
        for start in range(0, len(lit), step):
            part = slice(start, start + step)
            towards = vectors(suns[part])
            light = mi.Float(strength[part].astype(np.float32))
            lane = dr.arange(mi.UInt32, len(columns) * dr.width(light))
            width = dr.opaque(mi.UInt32, len(columns))
            hour = lane // width
            found = kernel(lane - hour * width, hour, towards, light, *options)
            found = found.numpy().reshape(-1, len(columns))
            if edges:
                self._resample_edges(found, suns[part], strength[part])
            for row, hour_values in zip(lit[part], found, strict=True):
                some = np.flatnonzero(hour_values)  # the sun falls on few pixels
                values[row, columns[some]] += hour_values[some]

    def _beam_on_surfaces(self, pixel, hour, suns, light) -> mi.Float:
        """Luminance of the surfaces where the windows' straight beam falls on them."""
        to_sun = on_disc_of(dr.gather(mi.Vector3f, suns, hour), pixel)
        cosine = dr.dot(dr.gather(mi.Vector3f, self._normal, pixel), to_sun)
        place = dr.gather(mi.Point3f, self._place, pixel)
        tau = self._straight(place, to_sun, cosine > 0)
        rho = dr.gather(mi.Float, self._reflectance, pixel)
        value = rho * dr.inv_pi * cosine * tau * dr.gather(mi.Float, light, hour)
        return dr.select(tau > 0, value, 0.0)

    def _resample_edges(self, found: NDArray, suns: NDArray, light: NDArray) -> None:
        """Set the mean over several rays in each pixel [h, m] that the edge of a shadow crosses.

        There the sun falls on the pixel's centre and not on a neighbour's, or the reverse.
        """
        hour, pixel = edge_pixels(found > 0, self.pixels[self._surface], self.view)
        order = np.argsort(pixel, kind="stable")  # each is looked at once for all of its hours
        hour, pixel = hour[order], pixel[order]
        step = LANES // EDGE_SAMPLES
        for start in range(0, len(hour), step):
            some, part = pixel[start : start + step], hour[start : start + step]
            found[part, some] = self._beam_in_pixels(some, suns[part]) * light[part]

    def _beam_in_pixels(self, pixel: NDArray[np.int64], suns: NDArray) -> NDArray[np.float32]:
        """Luminance [r] of surfaces per unit illuminance of suns [r, 3], mean over each pixel.

        Args: pixel: [r] number among those that show surfaces, in ascending order.
        """
        shown, row = np.unique(pixel, return_inverse=True)
        place, normal, rho = self._places_in(self.pixels[self._surface[shown]])
        lane = dr.arange(mi.UInt32, len(pixel) * EDGE_SAMPLES)
        pair = lane // EDGE_SAMPLES
        number = lane - pair * EDGE_SAMPLES
        at = dr.gather(mi.UInt32, column(row, mi.UInt32), pair) * EDGE_SAMPLES + number
        on_disc = dr.gather(mi.UInt32, column(pixel, mi.UInt32), pair) * EDGE_SAMPLES + number
        to_sun = on_disc_of(dr.gather(mi.Vector3f, vectors(suns), pair), on_disc)
        cosine = dr.dot(dr.gather(mi.Vector3f, normal, at), to_sun)
        rho = dr.gather(mi.Float, rho, at)
        tau = self._straight(dr.gather(mi.Point3f, place, at), to_sun, (rho > 0) & (cosine > 0))
        value = dr.select(tau > 0, rho * dr.inv_pi * cosine * tau, 0.0)
        return (dr.block_sum(value, EDGE_SAMPLES) / EDGE_SAMPLES).numpy()

    def _places_in(self, pixels: NDArray[np.int64]) -> tuple[mi.Point3f, mi.Vector3f, mi.Float]:
        """Points, normals and reflectances of surfaces in rays spread over pixels [k].

        The reflectance is 0 where a ray shows no surface.
        """
        tracer, direction = self._inside, vectors(pixel_samples(self.view, pixels))
        ray = mi.Ray3f(self._eye, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=True)
        shown = hit.is_valid()
        place, normal, rho = tracer.surface_at(hit, self._eye, direction, shown)
        shown &= dr.gather(mi.Int32, tracer.group, hit.prim_index, shown) == OPAQUE
        found = place, normal, dr.select(shown, rho, 0.0)
        dr.eval(found)
        return found

    @dr.syntax
    def _straight(self, place: mi.Point3f, to_sun: mi.Vector3f, active: mi.Bool) -> mi.Float:
        """Transmittance from points in the room straight to the sun; 0 if hidden."""
        ray = mi.Ray3f(place, to_sun)
        hit = self._inside.scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        active = active & hit.is_valid()
        group = dr.gather(mi.Int32, self._inside.group, hit.prim_index, active)
        active &= group != OPAQUE
        tau = dr.zeros(mi.Float, dr.width(active))
        if active:  # few rays meet a window: the others skip its BSDF and the ray outdoors
            tau = self._passed(group, mi.Point3f(place + to_sun * hit.t), to_sun, active)
        return tau

    def _passed(self, group: mi.Int32, window: mi.Point3f, to_sun: mi.Vector3f, active: mi.Bool) -> mi.Float:
        """Transmittance from points on windows to the sun."""
        local = self._inside.to_local(group, to_sun, active)
        active = active & (local.z > 0)
        tau = mi.Float(0)
        for g, system in enumerate(self._scattering):
            tau = dr.select(active & (group == g), system.through(local), tau)
        if not self._free:
            active &= tau > 0
            tau *= self._way.transmittance(mi.Ray3f(window, to_sun), active, coherent=True)
        return tau

    def _scattered_in_panes(self, pixel, hour, suns, light, g: int) -> mi.Float:
        """Luminance of window pixels: f(sun, pixel) times the sun's illuminance on the pane."""
        _, place, towards = self._panes[g]
        to_sun = on_disc_of(dr.gather(mi.Vector3f, suns, hour), pixel)
        local = self._inside.to_group(g, to_sun)
        lit, share = local.z > 0, mi.Float(1)
        if not self._free:
            ray = mi.Ray3f(dr.gather(mi.Point3f, place, pixel), to_sun)
            share = self._way.transmittance(ray, lit, coherent=True)
        f = share * self._scattering[g].scattered(local, dr.gather(mi.Vector3f, towards, pixel))
        return dr.select(lit, f * local.z * dr.gather(mi.Float, light, hour), 0.0)

    def scattered_luminance(self, suns: NDArray, illuminance: NDArray) -> NDArray[np.float32]:
        """Luminance [G, K, h] of the sunlight that windows scatter, mean over each group.

        f is the mean over each patch, times the sunlit share of the group.
        """
        K, h, G = self._bins.size, len(suns), len(self._panes)
        result = np.zeros((G, K, h), dtype=np.float32)
        for mirror in self._mirrors:
            result += mirror.scattered_luminance(suns, illuminance)
        suns, illuminance = self._turned(suns, illuminance)
        strength = np.maximum(illuminance, 0.0)
        if not strength.any():
            return result
        towards = vectors(suns)
        lane = dr.arange(mi.UInt32, K * PATCH_POINTS * h)
        hours = dr.opaque(mi.UInt32, h)
        sample = lane // hours
        patch = sample // PATCH_POINTS
        to_sun = dr.gather(mi.Vector3f, towards, lane - sample * hours)
        u = lattice_2d(sample - patch * PATCH_POINTS, patch, 0)
        outward = self._bins.sample(patch, u)
        for g, system in enumerate(self._scattering):
            local = self._inside.to_group(g, to_sun)
            f = dr.select(local.z > 0, system.scattered(local, outward) * local.z, 0.0)
            mean = f.numpy().reshape(K, PATCH_POINTS, h).mean(axis=1)
            result[g] += mean * (strength * self._sunlit_share(g, towards))
        return result

    def _sunlit_share(self, g: int, suns: mi.Vector3f) -> NDArray[np.float64] | float:
        """Share [h] of a group's area that the sun reaches."""
        if self._free:
            return 1.0
        lane = dr.arange(mi.UInt32, WINDOW_POINTS * dr.width(suns))
        hour = lane // WINDOW_POINTS
        place = self._inside.sample_group(g, lattice_2d(lane - hour * WINDOW_POINTS, opaque(g, mi.UInt32), 0))
        step = self._inside.exterior_normal(g) * self._inside.epsilon
        ray = mi.Ray3f(place + step, dr.gather(mi.Vector3f, suns, hour))
        seen = self._way.transmittance(ray, dr.full(mi.Bool, True, dr.width(lane)))
        return seen.numpy().reshape(-1, WINDOW_POINTS).mean(axis=1)

    def add_disc(self, values: NDArray, suns: NDArray, illuminance: NDArray) -> None:
        """Add the disc and its images to the pixels by their shares; arguments as of `add_to`."""
        for image in self._images(suns, illuminance):
            self._add_image(values, image)

    def _add_image(self, values: NDArray, image: _DiscImage) -> None:
        lit = image.hours
        if not len(lit):
            return
        suns, strength = image.suns[lit], image.illuminance[lit]
        reach = 2 * np.sin(disc_reach(self._size) / 2)
        near = self._tree.query_ball_point(suns, reach)
        hour = np.repeat(np.arange(len(lit)), [len(found) for found in near])
        if not len(hour):
            return
        pixel = np.concatenate([found for found in near if found]).astype(np.int64)
        pair, way, share = disc_rays(self.view, self.pixels[pixel], suns[hour], self._size)
        if not len(pair):
            return
        tau = image.transmittance(vectors(way)).numpy()
        seen = np.bincount(pair, tau, minlength=len(hour)) * share
        np.add.at(values, (lit[hour], pixel), seen * strength[hour] / SUN_SOLID_ANGLE)

    def _by_mirror(self, towards: mi.Vector3f, plane: int) -> mi.Float:
        """Transmittance from the eye by a mirror plane of the room to the sun."""
        gloss = self._inside.gloss
        normal = opaque_vector(gloss.normals[plane])
        ray = mi.Ray3f(mi.Point3f(self._eye), towards)
        hit = self._inside.scene.ray_intersect_preliminary(ray, coherent=True)
        met = hit.is_valid()
        met &= gloss.plane_of(hit.prim_index, met) == plane
        normal = dr.mulsign(normal, -dr.dot(normal, towards))
        cosine = -dr.dot(normal, towards)
        place = mi.Point3f(ray.o + towards * hit.t + normal * self._inside.epsilon)
        tau = self._straight(place, mi.Vector3f(towards + normal * (2 * cosine)), met)
        return tau * gloss.specular(hit.prim_index, cosine, met)
