"""Glare of one view in every hour of a year, from matrices: pictures are made, rated and dropped.

A picture is a matrix of pixels times the luminance of the windows' patches in that hour.  Hours are
taken in batches, so that each batch is one product of matrices; only the ratings are kept.
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
from mitsuba_cfs.glare.dgp_error import dgp_errors, hours_by_halves
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.progress import Progress, silent

BATCH_BYTES = 128 * 2**20  # of the pictures of a batch of hours
ROW_BYTES = 16 * 2**20  # of a matrix that lies on disk, read at a time
FIGURES = (
    "dgp", "Ev", "dgi", "ugr", "cgi", "vcp", "sources", "background_luminance",
    "dgp_standard_error",
)  # fmt: skip
MAGIC = b"\x93NUMPY"  # first bytes of a file of ratings

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class PictureMatrix:
    """What a view's surfaces reflect per unit luminance of each window patch.

    Pixels beside one another that show the same face share a row: reflected light varies slowly.
    """

    rows: NDArray[np.float32]  # [m, N] in memory or on disk (numpy.memmap); N = groups x patches
    row: NDArray[np.int64]  # [n] row of each pixel
    share: NDArray[np.float32]  # [n] of the pixel that shows surfaces, the rest shows windows

    def __post_init__(self) -> None:
        if self.rows.ndim != 2 or self.row.shape != self.share.shape or self.row.ndim != 1:
            raise ValueError(
                f"rows {self.rows.shape}, row {self.row.shape}, share {self.share.shape}: "
                "expected [m, N], [n], [n]"
            )

    def with_rows(self, rows: NDArray[np.float32]) -> PictureMatrix:
        """The same pixels of other rows."""
        return PictureMatrix(rows, self.row, self.share)

    def add_rows(self, values: NDArray[np.float32], of_rows: NDArray[np.float32]) -> None:
        """Add the luminance [h, m] of the rows to the pixels' values [h, n], by their shares."""
        of_pixels = np.empty(len(self.row), dtype=np.float32)  # one for all hours
        for hour, found in zip(values, of_rows, strict=True):
            np.take(found, self.row, out=of_pixels, mode="clip")  # "raise" would copy
            of_pixels *= self.share
            hour += of_pixels

    def of_rows(self, luminance: NDArray[np.float32]) -> NDArray[np.float32]:
        """Luminance [h, m] of the rows under patch luminances [N, h]."""
        across = np.ascontiguousarray(luminance.T, dtype=np.float32)
        found = np.empty((len(across), len(self.rows)), dtype=np.float32)
        step = len(self.rows)
        if isinstance(self.rows, np.memmap):
            step = max(1, ROW_BYTES // (4 * self.rows.shape[1]))
        for start in range(0, len(self.rows), step):
            rows = np.asarray(self.rows[start : start + step])
            np.matmul(across, rows.T, out=found[:, start : start + step])
        return found


@dataclass(frozen=True, slots=True)
class AnnualGlare:
    """Glare of one view in the hours that were rated; every array is [H]."""

    dgp: NDArray[np.float64]
    Ev: NDArray[np.float64]  # illuminance at the eye, of the picture [lx]
    dgi: NDArray[np.float64]
    ugr: NDArray[np.float64]
    cgi: NDArray[np.float64]
    vcp: NDArray[np.float64]  # [%]
    sources: NDArray[np.float64]  # number of glare sources
    background_luminance: NDArray[np.float64]  # [cd/m2]
    dgp_standard_error: NDArray[np.float64]  # from the noise of the pictures; NaN: not known
    rule: str = GlareOptions().rule  # what its sources are

    def worst(self, count: int) -> NDArray[np.int64]:
        """The hours [count] of the highest DGP, the worst first."""
        return np.argsort(-self.dgp, kind="stable")[:count]


class Pictures(Protocol):
    """The luminance of a view's pixels in every hour, worked out when asked for."""

    @property
    def view(self) -> View:
        """The view."""

    @property
    def pixels(self) -> NDArray[np.int64]:
        """Numbers [n], row * width + column, of the pixels that show something."""

    @property
    def hours(self) -> int:
        """H, how many there are."""

    def values(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """Luminance [h, n] [cd/m2] of the pixels in some hours [h]."""

    def without_disc(
        self, batch: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], list[SunDisc | None]]:
        """The same without the sun's disc, and the disc [h] as far as it is seen."""

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """Add the sun's disc to luminances [h, n] without it: that makes them `values`."""

    @property
    def shared(self) -> PictureMatrix:
        """Which pixels share a row of what surfaces reflect."""

    def by_rows(self, batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The two parts of `without_disc`: of the shared rows [h, m], and of each pixel [h, n].

        A pixel is its row's luminance times its share, and its own.
        """

    def discs(self, batch: NDArray[np.int64]) -> list[SunDisc | None]:
        """The sun's disc [h] as far as it is seen."""

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """Half of what pictures [h, n] of two halves of the paths differ by [cd/m2]."""


@dataclass(frozen=True, slots=True)
class ThreePhasePictures:
    """L[pixel, h] = sum over g, k of V[pixel, g, k] (T D s)[g, k, h]; V = reflected + seen."""

    view: View
    pixels: NDArray[np.int64]  # [n]
    reflected: PictureMatrix  # of n pixels
    seen: sparse.csr_array  # [n, G * K] share of each window patch in each pixel
    luminance: NDArray[np.float32]  # [G, K, H] of the windows towards the room, T D s [cd/m2]
    unlike: NDArray[np.float32] | None = (
        None  # [m, G * K] half of what halves of `reflected` differ
    )

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

    def without_disc(
        self, batch: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], list[SunDisc | None]]:
        """See `Pictures`; the sun is part of the patches."""
        return self.values(batch), self.discs(batch)

    def add_disc(self, values: NDArray[np.float32], batch: NDArray[np.int64]) -> None:
        """See `Pictures`; nothing, for the sun is part of the patches."""

    def discs(self, batch: NDArray[np.int64]) -> list[SunDisc | None]:
        """See `Pictures`; none, for the sun is part of the patches."""
        return [None] * len(batch)

    def noise(self, batch: NDArray[np.int64]) -> NDArray[np.float32]:
        """See `Pictures`; none where the halves are not known."""
        values = np.zeros((len(batch), len(self.pixels)), dtype=np.float32)
        if self.unlike is not None:
            luminance = flat(self.luminance, self.seen.shape[1])[:, batch]
            rows = self.reflected.with_rows(self.unlike).of_rows(luminance)
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
        geometry: of the pictures' view, where it is at hand.
        options: how glare is rated, see `mitsuba_cfs.glare.evaluation`.
        illuminance: [H] at the eye from its own calculation, for DGP [lx]: with pictures of direct
            light alone the result is eDGP.
        threads: pictures rated at a time; the processor's cores by default.
        checkpoint: file of the ratings so far: a killed run continues from it.  The caller names it
            so that other inputs have another file.
    """
    geometry = geometry or GlareView(pictures.view)
    options = options or GlareOptions()
    own = None if illuminance is None else np.asarray(illuminance, dtype=float)
    if own is not None and own.shape != (pictures.hours,):
        raise ValueError(
            f"illuminance {own.shape}: expected one for each of {pictures.hours} hours"
        )
    table = _begin(checkpoint, pictures.hours)
    left = np.flatnonzero(np.isnan(table[:, 0]))
    size = max(1, BATCH_BYTES // (4 * max(1, len(pictures.pixels))))

    def rated(values: NDArray[np.float32], disc: SunDisc | None, hour: int) -> list[float]:
        picture = full_picture(values, pictures.pixels, pictures.view)
        known = options if own is None else replace(options, illuminance=float(own[hour]))
        return figures(evaluate(picture, geometry, options=known, disc=disc))

    def made(batch: NDArray[np.int64]) -> tuple[NDArray[np.float32], list[SunDisc | None]]:
        if options.sun == "source":
            return pictures.without_disc(batch)
        return pictures.values(batch), [None] * len(batch)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        for start in range(0, len(left), size):
            batch = left[start : start + size]
            table[batch] = list(pool.map(rated, *made(batch), batch))
            _save(checkpoint, table)
            progress("glare", (len(table) - len(left) + start + len(batch)) / len(table))
        dgp, errors = table[:, 0], []
        by_halves = hours_by_halves(dgp)
        for start in range(0, len(by_halves), size):
            batch = by_halves[start : start + size]
            (values, discs), noise = made(batch), pictures.noise(batch)
            halves = (np.maximum(values + noise, 0), np.maximum(values - noise, 0))
            one, other = (np.array(list(pool.map(rated, h, discs, batch)))[:, 0] for h in halves)
            errors.extend(np.abs(one - other) / 2)
    table[:, FIGURES.index("dgp_standard_error")] = dgp_errors(dgp, by_halves, np.array(errors))
    _save(checkpoint, table)
    return AnnualGlare(**dict(zip(FIGURES, table.T, strict=True)), rule=options.rule)


def finished_glare(checkpoint: Path, hours: int) -> AnnualGlare | None:
    """The finished ratings of a run of `annual_glare` by the rule that holds without a choice.

    None where hours are missing.
    """
    table = _begin(checkpoint, hours)
    return None if np.isnan(table).any() else AnnualGlare(*table.T)


def full_picture(
    values: NDArray[np.float32], pixels: NDArray[np.int64], view: View
) -> NDArray[np.float32]:
    """A picture [ny, nx] from the luminance [n] of the pixels that show something."""
    picture = np.zeros(view.height * view.width, dtype=np.float32)
    picture[pixels] = values
    return picture.reshape(view.height, view.width)


def add_seen(
    values: NDArray[np.float32], shares: sparse.csr_array, luminance: NDArray[np.float32]
) -> None:
    """Add what pixels show of patches to values [h, n]; shares [n, N], luminance [N, h]."""
    some = np.flatnonzero(np.diff(shares.indptr))  # most pixels show none
    shown = np.ascontiguousarray((shares[some] @ luminance).T)
    for hour, found in zip(values, shown, strict=True):
        hour[some] += found


def flat(window_luminance: ArrayLike, columns: int) -> NDArray[np.float32]:
    """Luminance [G, K, H] as [G * K, H]."""
    luminance = np.asarray(window_luminance, dtype=np.float32)
    if luminance.ndim != 3 or luminance.shape[0] * luminance.shape[1] != columns:
        raise ValueError(
            f"window luminance {luminance.shape}: expected [G, K, H] with {columns} patches"
        )
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
            raise DataError("is no file of ratings", file=checkpoint) from error
        log.warning("%s: ignored, it is cut off or damaged; the hours are rated again", checkpoint)
        checkpoint.unlink()
        return empty
    if table.shape != empty.shape:
        raise DataError(
            f"ratings of shape {table.shape}, expected {empty.shape}: of another year (delete it)",
            file=checkpoint,
        )
    return table


def _save(checkpoint: Path | None, table: NDArray[np.float64]) -> None:
    """Write the ratings; the file is the old one or the new one at any time."""
    if checkpoint is None:
        return
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    with replacing(checkpoint) as part, open(part, "wb") as file:
        np.save(file, table)
