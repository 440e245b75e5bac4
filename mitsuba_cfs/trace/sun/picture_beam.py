"""The windows' straight beam on the surfaces that a view shows, point by point.

    L[row] = sum over sky patches p of B[row, p] s[p]
             + sum over window patches k of F[row, k] L_outdoors[k]

The view matrix resolves the light of a window by patches, 10 to 15 degrees wide, and by the mean
over the window.  On a wall beside a window this is wrong by a factor: the wall sees the pane at
grazing angles, where the mean of the last patch transmits and the glass does not, and the part of
the sky that a point sees is not the window's mean.  Here each ray has the transmittance at its own
angle and meets the sky or a surface outdoors itself; only the luminance of that surface is a mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.images.view import View
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
from mitsuba_cfs.trace.kernels.pixel_rows import PictureRows, pixel_hits, tile_size
from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, streams, tables
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene

SAMPLES = 128  # of each tile by default, with a ray to a point of the windows and one by the cosine
PATHS = 2**22  # of a view at most, but one of each pixel
FEW, MORE = 1 / 8, 8  # share of rays to the sky below which a row has more of them; times as many
RAYS = 2**19  # at once
LEAST_SHARE = 0.02  # of a window patch that surfaces fill, below which few paths know their light


@dataclass(frozen=True, slots=True)
class BeamLight:
    """Luminance of a picture's rows by the windows' beams, per unit luminance outdoors."""

    transmittance: NDArray[np.float64]  # [G, K] of the beams by patch; 0: not among them
    sky: sparse.csr_array  # [m, P] of the sky that the rows see themselves
    faces: sparse.csr_array  # [m, G * K] of the surfaces outdoors that they see
    sky_noise: sparse.csr_array  # [m, P] half of what two halves of the rays differ by
    faces_noise: sparse.csr_array  # [m, G * K]

    def rows(self, sky: NDArray[np.float32], faces: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [h, m] under skies [P, h] with surfaces [G * K, h] outdoors [cd/m2]."""
        return (self.sky @ sky + self.faces @ faces).T

    def noise(self, sky: NDArray[np.float32], faces: NDArray[np.float32]) -> NDArray[np.float32]:
        """Noise of these [h, m]."""
        return (self.sky_noise @ sky + self.faces_noise @ faces).T


def faces_luminance(daylight: ArrayLike, direct: ArrayLike, sky: ArrayLike) -> NDArray[np.float32]:
    """Mean luminance of the outdoor surfaces that each window patch sees [G * K, H].

    Args: daylight, direct: D and D_d [G, K, P]; sky: [P, H] with its sun.
    """
    daylight, direct = np.asarray(daylight), np.asarray(direct)
    share = np.maximum(1 - direct.sum(axis=2), LEAST_SHARE)
    reflected = (daylight - direct) / share[:, :, None]
    return np.matmul(reflected, sky).reshape(-1, np.shape(sky)[1]).astype(np.float32)


def beam_light(
    interior: Surfaces,
    exterior: Surfaces,
    groups: Sequence[WindowGroup],
    scattering: Sequence[Scattering | None],
    transmittance: NDArray[np.float64],
    view: View,
    *,
    subdivision: int = 4,
    basis: KlemsBasis = KLEMS_FULL,
    tile: int | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    scenes: SceneCache | None = None,
) -> BeamLight:
    """Trace a view's pixels to the windows and straight through; rows as in `view_matrices`.

    Args:
        scattering: of each group's system; None leaves a group out.
        transmittance: [G, K] of the beams in the matrices T; 0 for groups left out.
        subdivision: Reinhart's MF of the sky.
        tile: as of `view_matrices`.
        samples: rays of each tile; of all pixels at most `PATHS`.
    """
    scenes = SceneCache() if scenes is None else scenes
    inside, outside = scenes.scene(interior, groups), scenes.scene(exterior, groups)
    tile = tile_size(view) if tile is None else tile
    rows = PictureRows.of_view(inside, view, tile)
    of_pixel = int(np.clip(PATHS // max(len(rows.pixels), 1), 1, -(-samples // tile**2)))
    bins = DirectionBins(basis), SkyBins(ReinhartSky(subdivision))
    shape = 2 * len(rows.keys), bins[1].size + len(groups) * basis.size
    look = _Look(inside, outside, scattering, bins, view, of_pixel)
    light, seen, carrying = look.rows(rows, np.arange(len(rows.pixels)), shape, seed)
    # a slit of sky beside or below obstructions may carry most of a row's light, and a
    # sliver of a face has the rays of one pixel
    lit = np.diff(light.indptr).reshape(-1, 2).any(axis=1)
    # each half by the rays of the other: chosen by its own, it would keep those that met more light
    carrying = 2 * carrying.reshape(-1, 2)[:, ::-1]
    sliver = np.bincount(rows.row, minlength=len(rows.keys)) * of_pixel < samples / 2
    few = (lit[:, None] & ((carrying < FEW * samples) | sliver[:, None])).ravel()
    again = np.flatnonzero(few[rows.half])
    look = _Look(inside, outside, scattering, bins, view, MORE * of_pixel)
    more, seen[again], _ = look.rows(rows, again, shape, seed)
    light, least = sparse.diags_array((~few).astype(np.float32)) @ light + more, 0.5 / of_pixel
    # rays enough and no smoothing: beside a window and below an overhang's edge a tile may have
    # half the light of the next
    mean, noise = (sparse.csr_array(a @ light) for a in rows.of_halves(seen, least))
    split = bins[1].size
    return BeamLight(transmittance, mean[:, :split], mean[:, split:], noise[:, :split], noise[:, split:])


class _Look:
    """Rays from the surfaces in pixels to the windows, and straight through."""

    def __init__(
        self,
        inside: TracedScene,
        outside: TracedScene,
        scattering: Sequence[Scattering | None],
        bins: tuple[DirectionBins, SkyBins],
        view: View,
        samples: int,
    ) -> None:
        self._inside, self._outside, self._view, self._samples = inside, outside, view, samples
        self._ways = list({id(way): way for way in scattering if way is not None}.values())
        self._bins, self._sky = bins
        numbers = {id(way): i for i, way in enumerate(self._ways)}
        self._way = mi.Int32([numbers.get(id(way), -1) for way in scattering])

    def rows(
        self, rows: PictureRows, chosen: NDArray[np.int64], shape: tuple[int, int], seed: int
    ) -> tuple[sparse.csr_array, NDArray[np.float32], NDArray[np.float64]]:
        """Sums of some pixels over the halves of rows, and the pixels' share without windows [n].

        And the effective number of rays of sky light in each half [2 m].
        """
        half, number = rows.half, rows.number
        found, share = sparse.csr_array(shape, dtype=np.float32), [np.empty(0, np.float32)]
        sums = np.zeros((2, shape[0]))
        block = max(1, RAYS // self._samples)
        for start in range(0, len(chosen), block):
            part = chosen[start : start + block]
            (value, place), opaque = self.at(rows.pixels[part], half[part], number[part], seed)
            found += sparse.csr_array(sparse.coo_array((value, place), shape=shape))
            share.append(opaque)
            sky = (place[1] > 0) & (place[1] < self._sky.size)  # 0: the ground
            for power, total in enumerate(sums, start=1):
                total += np.bincount(place[0][sky], value[sky] ** power, len(total))
        equal = sums[0] ** 2 / np.maximum(sums[1], 1e-300)
        return found, np.concatenate(share), equal

    def at(
        self, pixels: NDArray[np.int64], half: NDArray[np.int64], number: NDArray[np.int64], seed: int
    ) -> tuple[tuple[NDArray, tuple[NDArray, NDArray]], NDArray[np.float32]]:
        """Entries of the halves' rows, and the share [n] of each pixel that shows no window.

        Args: half: of a row that each pixel is of; number: of the pixel among those of its half.
        """
        inside, samples = self._inside, self._samples
        position, normal, beta, window = self._shown(pixels)
        lit = beta > 0
        # a row's rays are stratified over all of its pixels
        sample = np.add.outer(number * samples, np.arange(samples)).ravel()
        row = np.repeat(half, samples)
        place = column(sample, mi.UInt32)
        stream = streams(row, seed)
        parts = []
        for omega, distance, group, found in (
            self._to_point(position, normal, lattice_2d(place, stream, 0), lit),
            self._by_cosine(position, normal, lattice_2d(place, stream, 2), lit),
        ):
            local = inside.to_local(group, omega, found)
            cosine = dr.dot(normal, omega)
            seen = found & (local.z > 1e-4)
            density_area = dr.square(distance) / (inside.window_area() * local.z)
            value = beta * cosine / (density_area + cosine * dr.inv_pi)
            value = dr.select(seen, value * self._through(group, local, seen), 0.0)
            beyond = mi.Point3f(position + omega * distance + inside.outward(group, seen))
            met, _ = self._outside.met_outdoors(beyond, omega, value > 0)
            face = mi.UInt32(group) * self._bins.size + self._bins.index(local)
            slot = dr.select(met.is_valid(), face + self._sky.size, self._sky.index(omega))
            parts.append(tables(value, slot))
        values, slots = (np.concatenate(part) for part in zip(*parts, strict=True))
        some = np.flatnonzero(values > 0)
        entries = values[some], (np.tile(row, 2)[some], slots[some].astype(np.int64))
        return entries, 1 - window.numpy().reshape(-1, samples).mean(axis=1, dtype=np.float32)

    def _shown(self, pixels: NDArray[np.int64]) -> tuple[mi.Point3f, mi.Vector3f, mi.Float, mi.Bool]:
        """Hits of the pixels' rays: point, normal, luminance per irradiance; whether a window."""
        inside, samples = self._inside, self._samples
        eye, way, hit, shown = pixel_hits(inside, self._view, pixels, samples)
        window = shown & (dr.gather(mi.Int32, inside.group, hit.prim_index, shown) != OPAQUE)
        position, normal, rho = inside.surface_at(hit, eye, way, shown)
        beta = dr.select(shown & ~window, rho * dr.inv_pi / samples, 0.0)
        return position, normal, beta, window

    def _to_point(
        self, position: mi.Point3f, normal: mi.Vector3f, u: mi.Point2f, active: mi.Bool
    ) -> tuple[mi.Vector3f, mi.Float, mi.Int32, mi.Bool]:
        """Direction, distance and group of a point on the windows, and whether it is visible."""
        target, group = self._inside.sample_window(u, active)
        towards = target - position
        distance = dr.norm(towards)
        omega = mi.Vector3f(towards / distance)
        seen = active & (dr.dot(normal, omega) > 0)
        shadow = mi.Ray3f(position, omega, distance * (1 - 1e-4), 0.0, [])
        seen &= ~self._inside.scene.ray_test(shadow, coherent=False, active=seen)
        return omega, distance, group, seen

    def _by_cosine(
        self, position: mi.Point3f, normal: mi.Vector3f, u: mi.Point2f, active: mi.Bool
    ) -> tuple[mi.Vector3f, mi.Float, mi.Int32, mi.Bool]:
        """The same of a cosine-distributed ray."""
        omega = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        ray = mi.Ray3f(position, omega)
        hit = self._inside.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        seen = active & hit.is_valid()
        group = dr.gather(mi.Int32, self._inside.group, hit.prim_index, seen)
        seen &= group != OPAQUE
        return omega, dr.select(seen, hit.t, 1.0), dr.select(seen, group, 0), seen

    def _through(self, group: mi.Int32, local: mi.Vector3f, active: mi.Bool) -> mi.Float:
        """Transmittance of the beam of each lane's group; 0 for groups left out."""
        chosen, found = dr.gather(mi.Int32, self._way, group, active), mi.Float(0)
        for i, way in enumerate(self._ways):
            through = active & (chosen == i)
            found = dr.select(through, way.through(local), found)
        return found
