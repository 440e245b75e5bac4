"""Glare of one view in every hour of a year, from matrices.

A picture is a matrix of pixels times the luminance of the windows' patches in that hour.  Each
batch of hours is one product of matrices; its pictures are rated and discarded.
"""

from __future__ import annotations

import logging
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import replacing
from mitsuba_cfs.glare.dgp_error import dgp_error, dgp_errors, hours_by_halves, random_signs
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.progress import Progress, silent

BATCH_BYTES = 128 * 2**20  # of the pictures of a batch of hours
ROW_BYTES = 16 * 2**20  # read at a time of a matrix on disk
FIGURES = ("dgp", "Ev", "dgi", "ugr", "cgi", "vcp", "sources", "background_luminance", "dgp_standard_error")
MAGIC = b"\x93NUMPY"  # first bytes of a file of ratings

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class PictureMatrix:
    """Luminance of a view's surfaces per unit luminance of each window patch.

    Neighbouring pixels that show the same face share a row: reflected light varies slowly.
    """

    rows: NDArray[np.float32]  # [m, N] in memory or on disk (numpy.memmap); N = groups x patches
    row: NDArray[np.int64]  # [n] row of each pixel
    share: NDArray[np.float32]  # [n] of the pixel that shows surfaces; the rest shows windows

    def __post_init__(self) -> None:
        if self.rows.ndim != 2 or self.row.shape != self.share.shape or self.row.ndim != 1:
            raise ValueError(
                f"rows {self.rows.shape}, row {self.row.shape}, share {self.share.shape}: expected [m, N], [n], [n]"
            )

    def with_rows(self, rows: NDArray[np.float32]) -> PictureMatrix:
        """The same pixels with other rows."""
        return PictureMatrix(rows, self.row, self.share)

    def add_rows(self, values: NDArray[np.float32], of_rows: NDArray[np.float32]) -> None:
        """Add the luminance [h, m] of the rows to the pixels' values [h, n], by their shares."""
        of_pixels = np.empty(len(self.row), dtype=np.float32)  # one for all hours
        for hour, rows in zip(values, of_rows, strict=True):
            np.take(rows, self.row, out=of_pixels, mode="clip")  # "raise" would copy
            of_pixels *= self.share
            hour += of_pixels

    def of_rows(self, luminance: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [h, m] of the rows under patch luminances [N, h]."""
        across = np.ascontiguousarray(luminance.T, dtype=np.float32)
        products = np.empty((len(across), len(self.rows)), dtype=np.float32)
        step = len(self.rows)
        if isinstance(self.rows, np.memmap):
            step = max(1, ROW_BYTES // (4 * self.rows.shape[1]))
        for start in range(0, len(self.rows), step):
            rows = np.asarray(self.rows[start : start + step])
            np.matmul(across, rows.T, out=products[:, start : start + step])
        return products


@dataclass(frozen=True, slots=True)
class AnnualGlare:
    """Glare of one view in the rated hours; every array is [H]."""

    dgp: NDArray[np.float64]
    Ev: NDArray[np.float64]  # illuminance at the eye, of the picture [lx]
    dgi: NDArray[np.float64]
    ugr: NDArray[np.float64]
    cgi: NDArray[np.float64]
    vcp: NDArray[np.float64]  # [%]
    sources: NDArray[np.float64]  # number of glare sources
    background_luminance: NDArray[np.float64]  # [cd/m2]
    dgp_standard_error: NDArray[np.float64]  # from the noise of the pictures; NaN: unknown
    rule: str = GlareOptions().rule  # how glare sources are detected

    def worst(self, count: int) -> NDArray[np.int64]:
        """The hours [count] of the highest DGP, the worst first."""
        return np.argsort(-self.dgp, kind="stable")[:count]


class Pictures(Protocol):
    """The luminance of a view's pixels in every hour, computed batch by batch."""

    @property
    def view(self) -> View:
        """The view."""

    @property
    def pixels(self) -> NDArray[np.int64]:
        """Numbers [n], row * width + column, of the pixels inside the view."""

    @property
    def hours(self) -> int:
        """H, how many there are."""

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """Luminance [h, n] [cd/m2] of the pixels in some hours [h]."""

    def without_disc(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[tuple[SunDisc, ...]]]:
        """The same without the sun's disc and its images in mirrors, and these [h]."""

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """Add the discs to the luminances [h, n] of `without_disc`, which gives `values`."""

    @property
    def shared(self) -> PictureMatrix:
        """The pixels that share a row of reflected light."""

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The two parts of `without_disc`: of the shared rows [h, m], and of each pixel [h, n].

        A pixel's luminance is that of its row times its share, plus its own part.
        """

    def discs(self, batch: NDArray[np.int64]) -> list[tuple[SunDisc, ...]]:
        """The visible parts of the sun's disc and of its images in mirrors [h]."""

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """Half the difference of pictures [h, n] by two halves of the paths [cd/m2]."""


@dataclass(frozen=True, slots=True)
class ThreePhasePictures:
    """L[pixel, h] = sum over g, k of V[pixel, g, k] (T D s)[g, k, h]; V = reflected + seen."""

    view: View
    pixels: NDArray[np.int64]  # [n]
    reflected: PictureMatrix  # of n pixels
    seen: sparse.csr_array  # [n, G * K] share of each window patch in each pixel
    luminance: NDArray[np.float32]  # [G, K, H] of the windows towards the room, T D s [cd/m2]
    # [m, G * K] half the difference of `reflected.rows` by two halves of the paths
    row_noise: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        n, N = len(self.pixels), self.reflected.rows.shape[1]
        if self.seen.shape != (n, N) or len(self.reflected.row) != n:
            raise ValueError(f"matrices of {self.seen.shape} for {n} pixels and {N} patches")
        flat(self.luminance, N)

    @property
    def hours(self) -> int:
        """See `Pictures`."""
        return self.luminance.shape[2]

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `Pictures`."""
        of_rows, values = self.by_rows(batch)
        self.reflected.add_rows(values, of_rows)
        return values

    @property
    def shared(self) -> PictureMatrix:
        """See `Pictures`."""
        return self.reflected

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """See `Pictures`."""
        luminance = flat(self.luminance, self.seen.shape[1])[:, batch]
        own = np.zeros((len(batch), len(self.pixels)), dtype=np.float32)
        add_seen(own, self.seen, luminance)
        return self.reflected.of_rows(luminance), own

    def without_disc(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[tuple[SunDisc, ...]]]:
        """See `Pictures`; the patches include the sun."""
        return self.values(batch), self.discs(batch)

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """See `Pictures`; adds nothing, because the patches include the sun."""

    def discs(self, batch: NDArray[np.int64]) -> list[tuple[SunDisc, ...]]:
        """See `Pictures`; none, because the patches include the sun."""
        return [()] * len(batch)

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `Pictures`; 0 where the halves are unknown."""
        values = np.zeros((len(batch), len(self.pixels)), dtype=np.float32)
        if self.row_noise is not None:
            luminance = flat(self.luminance, self.seen.shape[1])[:, batch]
            rows = self.reflected.with_rows(self.row_noise).of_rows(luminance)
            self.reflected.add_rows(values, rows)
        return values


def annual_glare(
    pictures: Pictures,
    *,
    geometry: GlareView | None = None,
    options: GlareOptions | None = None,
    illuminance: ArrayLike | None = None,
    threads: int | None = None,
    checkpoint: Path | None = None,
    progress: Progress = silent,
) -> AnnualGlare:
    """Glare of every hour of one view.

    Args:
        geometry: of the pictures' view; computed by default.
        options: how glare sources are detected and rated, see `mitsuba_cfs.glare.evaluation`.
        illuminance: [H] at the eye from a separate calculation, for DGP [lx]: with pictures of
            direct light alone the result is eDGP.
        threads: pictures rated at a time; the processor's cores by default.
        checkpoint: file of the ratings so far: a killed run continues from it.  The caller names it
            so that other inputs have another file.
    """
    geometry = geometry or GlareView(pictures.view)
    options = options or GlareOptions()
    own = None if illuminance is None else np.asarray(illuminance, dtype=float)
    if own is not None and own.shape != (pictures.hours,):
        raise ValueError(f"illuminance {own.shape}: expected one for each of {pictures.hours} hours")
    table = _begin(checkpoint, pictures.hours)
    left = np.flatnonzero(np.isnan(table[:, 0]))
    size = max(1, BATCH_BYTES // (4 * max(1, len(pictures.pixels))))

    def rated(values: NDArray[np.float32], discs: tuple[SunDisc, ...], hour: int) -> GlareResult:
        picture = full_picture(values, pictures.pixels, pictures.view)
        known = options if own is None else replace(options, illuminance=float(own[hour]))
        return evaluate(picture, geometry, options=known, discs=discs)

    def row(values: NDArray[np.float32], discs: tuple[SunDisc, ...], hour: int) -> list[float]:
        return figures(rated(values, discs, hour))

    def made(batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[tuple[SunDisc, ...]]]:
        if options.sun == "source":
            return pictures.without_disc(batch)
        return pictures.values(batch), [()] * len(batch)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        for start in range(0, len(left), size):
            batch = left[start : start + size]
            table[batch] = list(pool.map(row, *made(batch), batch))
            _save(checkpoint, table)
            progress("glare", (len(table) - len(left) + start + len(batch)) / len(table))
        dgp = table[:, 0]
        errors: list[float] = []
        by_halves = hours_by_halves(dgp)
        signs = random_signs(pictures.view, pictures.pixels)

        def error(
            values: NDArray[np.float32], noise: NDArray[np.float32], discs: tuple[SunDisc, ...], hour: int
        ) -> float:
            return dgp_error(lambda some: rated(some, discs, hour).unlimited_dgp, values, noise, signs)

        for start in range(0, len(by_halves), size):
            batch = by_halves[start : start + size]
            (values, discs), noise = made(batch), pictures.noise(batch)
            errors.extend(pool.map(error, values, noise, discs, batch))
    table[:, FIGURES.index("dgp_standard_error")] = dgp_errors(dgp, by_halves, np.array(errors))
    _save(checkpoint, table)
    return AnnualGlare(**dict(zip(FIGURES, table.T, strict=True)), rule=options.rule)


def finished_glare(checkpoint: Path, hours: int) -> AnnualGlare | None:
    """Ratings in a checkpoint of `annual_glare` by its default rule; None: hours are missing."""
    table = _begin(checkpoint, hours)
    return None if np.isnan(table).any() else AnnualGlare(*table.T)


def full_picture(values: NDArray[np.float32], pixels: NDArray[np.int64], view: View) -> NDArray[np.float32]:
    """A picture [ny, nx] from the luminance [n] of the pixels inside the view."""
    picture = np.zeros(view.height * view.width, dtype=np.float32)
    picture[pixels] = values
    return picture.reshape(view.height, view.width)


def add_seen(values: NDArray[np.float32], shares: sparse.csr_array, luminance: NDArray[np.float32]) -> None:
    """Add the patches that pixels show to values [h, n]; shares [n, N], luminance [N, h]."""
    some = np.flatnonzero(np.diff(shares.indptr))  # most pixels show none
    shown = np.ascontiguousarray((shares[some] @ luminance).T)
    for hour, added in zip(values, shown, strict=True):
        hour[some] += added


def flat(window_luminance: ArrayLike, columns: int) -> NDArray[np.float32]:
    """Luminance [G, K, H] as [G * K, H]."""
    luminance = np.asarray(window_luminance, dtype=np.float32)
    if luminance.ndim != 3 or luminance.shape[0] * luminance.shape[1] != columns:
        raise ValueError(f"window luminance {luminance.shape}: expected [G, K, H] with {columns} patches")
    return luminance.reshape(columns, -1)


def figures(result: GlareResult) -> list[float]:
    """One row of the table, in the order of `FIGURES`."""
    return [float(result.count if f == "sources" else getattr(result, f)) for f in FIGURES]


def _begin(checkpoint: Path | None, hours: int) -> NDArray[np.float64]:
    """The ratings so far [H, figures], NaN where there is none."""
    empty = np.full((hours, len(FIGURES)), np.nan)
    if checkpoint is None or not checkpoint.is_file():
        return empty
    try:
        table = np.load(checkpoint, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        with open(checkpoint, "rb") as file:
            start = file.read(len(MAGIC))
        if start.strip(b"\0") and start != MAGIC[: len(start)]:
            raise DataError("is not a file of glare ratings", file=checkpoint) from error
        log.warning("%s: truncated or damaged; the hours are rated again", checkpoint)
        checkpoint.unlink()
        return empty
    if table.shape != empty.shape:
        raise DataError(
            f"ratings of shape {table.shape}, expected {empty.shape}: from another year, delete it", file=checkpoint
        )
    return table


def _save(checkpoint: Path | None, table: NDArray[np.float64]) -> None:
    """Write the ratings; the file is the old one or the new one at any time."""
    if checkpoint is None:
        return
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    with replacing(checkpoint) as part, open(part, "wb") as file:
        np.save(file, table)
