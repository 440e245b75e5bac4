"""Pictures of one view for a year by the phase methods, and the traced matrices of the view.

Three-phase   L = V T D s
Five-phase    L = V T D s - V_d T D_d s_d + direct sun, with the sun's true disc
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.files import unnamed_file
from mitsuba_cfs.glare.annual import PictureMatrix, ThreePhasePictures, add_seen, flat
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.kernels.pixel_rows import PictureRows, tile_size
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.pixel_view import PictureBlock, picture_part_blocks
from mitsuba_cfs.trace.pictures.outdoors import OutdoorCoefficients
from mitsuba_cfs.trace.sun.picture_beam import BeamLight, faces_luminance
from mitsuba_cfs.trace.sun.picture_sun import PictureSun
from mitsuba_cfs.trace.sun.sunlit_rows import SunlitRows, picture_sunlit_shares

MEMORY = 2 * 2**30  # [bytes] of a view's matrices; above it they lie on disk
NEGATIVE = 1e-4  # of the largest luminance: what rounding may leave below zero


@dataclass(frozen=True, slots=True)
class ViewNoise:
    """Half the difference of the matrices of two halves of the pixels (a chequerboard).

    It estimates the RMS error of the mean of both halves.
    """

    indirect: NDArray[np.float32]  # [m, G * K]
    lit: NDArray[np.float32]  # [m, G * K]


@dataclass(frozen=True, slots=True)
class ViewMatrices:
    """The matrix of a view in three non-negative parts: V = indirect + lit + seen.

    With a `PatchLight` the columns of `indirect` and `lit` are its hours in place of patches.
    """

    view: View
    pixels: NDArray[np.int64]  # [n] row * width + column of the pixels that show something
    indirect: PictureMatrix  # light after two reflections or more, V - V_d
    lit: PictureMatrix  # light of the windows on the surface that the pixel shows, in V_d
    seen: sparse.csr_array  # [n, G * K] share of each window patch in each pixel, in V_d
    noise: ViewNoise
    sunlit: SunlitRows | None = None  # of the rows of `indirect`, for the sun's beam

    def of_columns(self, part: slice) -> ViewMatrices:
        """The same for some columns: for some hours where hours are the columns."""
        parts = [PictureMatrix(p.rows[:, part], p.row, p.share) for p in (self.indirect, self.lit)]
        of_halves = {name: getattr(self.noise, name)[:, part] for name in ("indirect", "lit")}
        noise = replace(self.noise, **of_halves)
        return replace(self, indirect=parts[0], lit=parts[1], noise=noise)

    def three_phase(self, luminance: ArrayLike) -> ThreePhasePictures:
        """Pictures of hours with window luminances T D s [G, K, H]."""
        whole = PictureMatrix(self.indirect.rows + self.lit.rows, self.lit.row, self.lit.share)
        luminance, noise = np.asarray(luminance, dtype=np.float32), self.noise
        rows = noise.indirect + noise.lit
        return ThreePhasePictures(self.view, self.pixels, whole, self.seen, luminance, rows)


def view_matrices(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    view: View,
    *,
    tile: int | None = None,
    memory: float = MEMORY,
    folder: Path | None = None,
    window_reflectance: ArrayLike | None = None,
    light: PatchLight | None = None,
    sunlit: SunlitRows | None = None,
    progress: Progress = silent,
    scenes: SceneCache | None = None,
    **options: Any,
) -> ViewMatrices:
    """The matrices of a picture's pixels, in memory or, if they are too large, on disk.

    Args:
        tile: pixels across of the squares whose pixels share reflected light, separately for each
            face of each surface, by default `tile_size`; 1: every pixel has its own.
        memory: budget [bytes]; 800 x 800 pixels and a window group take 83 MB, without tiles 1160.
        folder: of the files on disk, which end with the process; the system's temporary folder by
            default.
        window_reflectance: [G] of the windows from the room, as if diffuse; black by default.
        light: of hours, which become the columns in place of patches.
        sunlit: of the same view and options, traced before under any light.
        options: basis, samples, max_depth, seed of `picture_part_blocks`.
    """
    scenes = SceneCache() if scenes is None else scenes
    tracer = scenes.scene(surfaces, groups, window_reflectance=window_reflectance)
    tile = tile_size(view) if tile is None else tile
    shared = PictureRows.of_view(tracer, view, tile)
    pixels, row, half, m = shared.pixels, shared.row, shared.half, len(shared.keys)
    patches = len(groups) * options.get("basis", KLEMS_FULL).size
    shape = (2 * m, patches if light is None else light.hours)
    sums = [_storage(shape, 8 * math.prod(shape) > memory, folder) for _ in range(2)]
    options.update(window_reflectance=window_reflectance, light=light, scenes=scenes)
    times = shared.times(smoothed=True)
    number = np.repeat(np.arange(len(pixels)), times)
    options.update(pixels=pixels[number], row=half[number], weight=(1 / times)[number])
    blocks = picture_part_blocks(surfaces, groups, view, progress=progress, **options)
    seen = _summed(blocks, number, sums)
    share = np.maximum(1 - np.asarray(seen.sum(axis=1)).ravel(), 0)
    if window_reflectance is not None:  # where a window reflects, all of a pixel does
        reflecting = np.append(np.asarray(window_reflectance) > 0, False)  # OPAQUE is the last
        share = np.where(reflecting[shared.group], 1.0, share)
    share = share.astype(np.float32)
    found, close = None, None if sunlit is None else sunlit.close
    if sunlit is None and options.get("max_depth", 2) > 1:
        seed = options.get("seed", 0)
        paths = {"samples": options.get("samples", 32), "seed": seed}
        found, close = picture_sunlit_shares(tracer, view, shared, times, **paths)
    mean, noise, smooth = _smooth(sums, shared, share, 0.5 / options.get("samples", 32), close)
    if found is not None:
        sunlit = SunlitRows(*(found.of_rows(a, smooth) for a in (mean, noise)), close)
    parts = (PictureMatrix(rows[:m], row, share) for rows in sums)
    off = ViewNoise(*(rows[m:] for rows in sums))
    return ViewMatrices(view, pixels, *parts, seen, off, sunlit)


def _summed(
    blocks: Iterator[PictureBlock], number: NDArray[np.int64], sums: Sequence[NDArray[np.float32]]
) -> sparse.csr_array:
    """Add the light after several reflections, and after one, to the sums; return the direct part.

    Args: number: of the view's pixel for each pixel of the blocks.
    """
    seen = []
    for block in blocks:
        first, end = block.row[0], block.row[-1] + 1  # they rise
        place = slice(first, end) if end - first == len(block.row) else block.row
        for rows, values in zip(sums, (block.later, block.lit), strict=True):
            rows[place] += values
        seen.append(block.seen)
    ones = np.ones(len(number), dtype=np.float32)
    of_pixel = sparse.csr_array((ones, (number, np.arange(len(number)))))
    return sparse.csr_array(of_pixel @ sparse.vstack(seen))


def _smooth(
    sums: Sequence[NDArray[np.float32]],
    shared: PictureRows,
    share: NDArray[np.float32],
    least: float,
    close: NDArray[np.bool_] | None,
) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]:
    """Turn sums by halves [2 m, N] in place into rows [m] and their noise [m], both smoothed.

    Returns: matrices from halves to rows and to their noise [m, 2 m], and the smoothing [m, m].
    """
    smooth = shared.smoothing(share, least)
    # sharper for the windows' light, which changes fastest where other surfaces are close
    sharper = smooth if close is None else shared.smoothing(share, least, close)
    mean, noise = shared.of_halves(share, least)
    m = len(shared.keys)
    for start in range(0, sums[0].shape[1], KLEMS_FULL.size):
        part = slice(start, start + KLEMS_FULL.size)
        for rows, means in zip(sums, (smooth, sharper), strict=True):
            of_halves = np.array(rows[:, part])
            rows[:m, part], rows[m:, part] = (means @ (a @ of_halves) for a in (mean, noise))
    return mean, noise, smooth


class FivePhasePictures:
    """Pictures of every hour by the five-phase method.

        L = V T D s - V_d T D_d s_d + direct sun
          = indirect (T D s - b) + (lit + seen) (T D s - T D_d s_d) + lit L_s
            + what the room reflects of the sun's beam + sun in each pixel

    b is the sun's beam in patches; its light after several reflections comes from cells of the
    surfaces instead, lit by the true disc at its own angle (`sunlit_rows`).  L_s is the sunlight
    that the windows scatter, by Klems patches; a pixel that shows a window has the BSDF's value
    for the sun and that pixel, and the beam is tested for each pixel.  With `show_outdoors` the
    outdoors seen through the straight beam, and the beam's light on surfaces, are not means over
    patches either.
    """

    def __init__(
        self,
        matrices: ViewMatrices | None,
        sun: PictureSun,
        luminance: ArrayLike,
        direct_luminance: ArrayLike,
        directions: ArrayLike,
        illuminance: ArrayLike,
        *,
        beam: ArrayLike | None = None,
    ) -> None:
        """From the hours' skies.

        Args:
            matrices: of patches; None: `see_by` gives those of the hours.
            luminance: [G, K, H] of the windows towards the room, T D s [cd/m2].
            direct_luminance: [G, K, H] T D_d s_d: D_d with `max_depth=1` and the seed and samples
                of D, s_d the sun alone (`sky_matrix(..., parts="sun")`).
            directions: [H, 3] to the sun; illuminance: [H] normal to it [lx].
            beam: [G, K, H] the beam's part b of T D_d s_d, which the matrices' `sunlit` replaces;
                without, the patches' stays.
        """
        self.view, self.pixels = sun.view, sun.pixels
        self._matrices, self._sun, self._of_hours = matrices, sun, False
        patches = math.prod(np.shape(luminance)[:-1])
        patches = patches if matrices is None else matrices.lit.rows.shape[1]
        self._whole = flat(luminance, patches)
        rest = self._whole - flat(direct_luminance, patches)
        if rest.min(initial=0) < -NEGATIVE * self._whole.max(initial=0):
            raise ValueError("the direct sun's luminance exceeds the whole: D_d is not part of D")
        self._rest = np.maximum(rest, 0)
        self._reflected = self._whole
        self._by_cells = beam is not None and (matrices is None or matrices.sunlit is not None)
        if beam is not None and self._by_cells:  # below 0 by rounding alone
            self._reflected = np.maximum(self._whole - flat(beam, len(self._whole)), 0)
        self._scattered, self._outdoors = self._rest, None
        self._lighting, self._light = self._rest, None
        self._directions = np.asarray(directions, dtype=float)
        self._illuminance = np.asarray(illuminance, dtype=float)
        expected = self._whole.shape[1]
        if self._directions.shape != (expected, 3) or self._illuminance.shape != (expected,):
            raise ValueError(f"expected {expected} directions and illuminances of the sun")

    def show_outdoors(
        self,
        seen: OutdoorCoefficients,
        daylight: ArrayLike,
        direct_daylight: ArrayLike,
        sky: ArrayLike,
        sun: ArrayLike,
        *,
        light: BeamLight | None = None,
    ) -> None:
        """Show the outdoors through the windows' straight beam pixel by pixel.

        Args:
            daylight, direct_daylight: D and D_d [G, K, P].
            sky, sun: [P, H] the sky without the sun, and the sun alone: s = sky + sun.
            light: of the beam on the room's surfaces; without it, by patches.
        """
        sky, sun = np.asarray(sky), np.asarray(sun)
        daylight, direct = np.asarray(daylight), np.asarray(direct_daylight)
        outside = np.matmul(daylight, sky) + np.matmul(daylight - direct, sun)
        beam = (seen.beam[:, :, None] * outside).reshape(self._rest.shape)
        self._scattered = np.maximum(self._rest - beam, 0).astype(np.float32)
        self._outdoors, self._sky = seen, sky.astype(np.float32)
        if light is not None:
            beam = (light.transmittance[:, :, None] * outside).reshape(self._rest.shape)
            self._lighting = np.maximum(self._rest - beam, 0).astype(np.float32)
            self._faces = faces_luminance(daylight, direct, sky + sun)
            self._light = light

    def light(self, batch: NDArray[np.int64]) -> PatchLight:
        """Window luminances for the view's paths in some hours."""
        rest, suns, strength = (self._lighting[:, batch], self._directions[batch], self._illuminance[batch])
        scattered = self._sun.scattered_luminance(suns, strength)
        return PatchLight(rest + scattered.reshape(rest.shape), self._reflected[:, batch])

    def see_by(self, matrices: ViewMatrices) -> None:
        """Set matrices whose columns are the hours, traced with `light` of all hours."""
        self._matrices, self._of_hours = matrices, True

    @property
    def hours(self) -> int:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._whole.shape[1]

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        values = self._values(batch)
        self.add_disc(values, batch)
        return values

    def without_disc(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[tuple[SunDisc, ...]]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._values(batch), self.discs(batch)

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        self._sun.add_disc(values, self._directions[batch], self._illuminance[batch])

    def discs(self, batch: NDArray[np.int64]) -> list[tuple[SunDisc, ...]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._sun.discs(self._directions[batch], self._illuminance[batch])

    @property
    def shared(self) -> PictureMatrix:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        return self._matrices.lit

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        m, noise = self._matrices, self._matrices.noise
        suns, strength = self._directions[batch], self._illuminance[batch]
        lit, later = self._columns(batch)
        rows = m.indirect.with_rows(noise.indirect).of_rows(later)
        rows += m.lit.with_rows(noise.lit).of_rows(lit)
        if self._by_cells:
            rows += self._sun.sunlit_luminance(m.sunlit.noise, suns, strength).T
        if self._light is not None:
            rows += self._light.noise(self._sky[:, batch], self._faces[:, batch])
        values = np.zeros((len(batch), len(m.pixels)), dtype=np.float32)
        m.lit.add_rows(values, rows)
        return values

    def _values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """Luminance [h, n] without the sun's disc."""
        rows, values = self.by_rows(batch)
        self._matrices.lit.add_rows(values, rows)
        return values

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """See `mitsuba_cfs.glare.annual.Pictures`."""
        m, (lit, later) = self._matrices, self._columns(batch)
        suns, strength = self._directions[batch], self._illuminance[batch]
        values = np.zeros((len(batch), len(m.pixels)), dtype=np.float32)
        add_seen(values, m.seen, self._scattered[:, batch])
        seen = self._outdoors
        if seen is not None:
            sky = self._sky[:, batch]
            add_seen(values, seen.sky, sky)
            seen.sun.add_to(values, suns, strength, seen.reflected @ sky)
            if seen.rough is not None:
                seen.rough.add_to(values, suns, strength)
        rows = m.indirect.of_rows(later)
        rows += m.lit.of_rows(lit)
        if self._light is not None:
            rows += self._light.rows(self._sky[:, batch], self._faces[:, batch])
        if self._by_cells:
            rows += self._sun.sunlit_luminance(m.sunlit.mean, suns, strength).T
        self._sun.add_to(values, suns, strength)
        return rows, values

    def _columns(self, batch: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
        """Factors of the columns of `lit` and `indirect` in some hours [.., h]."""
        if self._of_hours:
            own = np.eye(self.hours, dtype=np.float32)[:, batch]
            return own, own
        light = self.light(batch)
        return light.lit, light.later


def _storage(shape: tuple[int, int], on_disk: bool, folder: Path | None) -> NDArray[np.float32]:
    """A matrix of zeros, in memory or in a file without a name."""
    if not on_disk:
        return np.zeros(shape, dtype=np.float32)
    size = 4 * math.prod(shape)
    with unnamed_file(size, f"matrices of {size / 1e9:.1f} GB", folder) as file:
        return np.memmap(file, dtype=np.float32, mode="w+", shape=shape)
