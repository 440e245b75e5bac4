"""Pictures of a view for a year: patterns for slowly varying light, codes for sharp light.

    L[pixel] = share reflected[row]            surfaces, by patterns
             + window[pixel] ratio[pixel]      pixels that show windows, by patterns and their error
             + beam[pixel]                     the sun's straight beam on surfaces, by codes

Illuminances at the eye are those of the pictures themselves: each part of each hour is scaled to
its own.  The sun's disc is apart, as it is for glare (`mitsuba_cfs.glare.sun_disc`).
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.annual import Pictures, full_picture
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView, in_picture_order
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.progress import Progress, silent

FINEST = 5e-4  # of the typical value: step of the patterns' whole numbers
MOST = 32767  # of a whole number of 16 bits


@dataclass(frozen=True, slots=True)
class Patterns:
    """Low-rank form of values that vary slowly from hour to hour.

        x[h, i] = scale[h] typical[i] sum over r of amount[h, r] pattern[r, i]

    Hours are scaled to one mean and pixels to one root mean square first, so that dim hours and
    dark corners keep their accuracy.  Patterns are the leading right singular vectors of a sample
    of hours.

    Source: truncated singular value decomposition (Eckart and Young 1936, Psychometrika 1:211-218).
    """

    typical: NDArray[np.float32]  # [n]
    weight: NDArray[np.float64]  # [n] of a place, in the sums over places
    pattern: NDArray[np.int16]  # [r, n] in steps
    step: float
    axes: NDArray[np.float64]  # [r, n] orthonormal, of weighted values over typical ones
    spread: NDArray[np.float64]  # [r] root mean square of each axis in the sample

    @property
    def rank(self) -> int:
        """Number of patterns."""
        return len(self.pattern)

    def amounts(self, values: NDArray[np.floating]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Scale [h] and amounts [h, r] of hours of values [h, n]."""
        scale = mean_of(values, self.weight)
        relative = values / scale[:, None] / self.typical * np.sqrt(self.weight)
        return scale, (relative @ self.axes.T) / self.spread

    def values(self, scale: NDArray[Any], amounts: NDArray[Any]) -> NDArray[np.float32]:
        """Values of hours [h, n], reconstructed and non-negative."""
        relative = amounts.astype(np.float32) @ (self.pattern.astype(np.float32) * self.step)
        return np.maximum(relative, 0.0) * self.typical * scale[:, None].astype(np.float32)


def patterns_of(sample: NDArray[np.floating], weight: NDArray[np.floating], rank: int) -> Patterns:
    """The leading patterns of a sample of hours [s, n].

    Args: weight: [n] of each place; rank: of the patterns at most, fewer where the sample is small.
    """
    weight = np.asarray(weight, dtype=float)
    relative = sample / mean_of(sample, weight)[:, None]
    typical = np.sqrt(np.mean(relative.astype(float) ** 2, axis=0))
    typical = np.maximum(typical, 1e-6 * typical.max(initial=1e-6)).astype(np.float32)
    relative = (relative / typical * np.sqrt(weight)).astype(float)
    square, vectors = np.linalg.eigh(relative @ relative.T)
    kept = np.flatnonzero(square[::-1] > 1e-12 * square.max(initial=1e-30))[:rank]
    length = np.sqrt(square[::-1][kept])
    axes = (vectors[:, ::-1][:, kept].T @ relative) / length[:, None]
    spread = length / np.sqrt(len(sample))
    whole = axes * spread[:, None] / np.sqrt(weight)
    step = max(FINEST, float(np.abs(whole).max(initial=0.0)) / MOST)
    return Patterns(typical, weight, np.round(whole / step).astype(np.int16), step, axes, spread)


def mean_of(values: NDArray[np.floating], weight: NDArray[np.floating]) -> NDArray[np.float64]:
    """Mean [h] of values [h, n] by weight, above 0."""
    return np.maximum(values @ weight / max(float(np.sum(weight)), 1e-30), 1e-6)


LEVELS = 255  # and 0 for none
STEP = 0.04  # of the logarithm between levels, at least
DEFLATED = -15  # raw deflate, as a browser inflates it
SMALL = 1e-3  # of the logarithm: what levels of one step may leave out


@dataclass(frozen=True, slots=True)
class Codes:
    """One level for each pixel, 0 for none."""

    level: NDArray[np.float32]  # [k] level of the codes 1..k
    code: NDArray[np.uint8]  # [n]

    def values(self, otherwise: float) -> NDArray[np.float32]:
        """The level [n] of each pixel, `otherwise` for none."""
        return np.append(np.float32(otherwise), self.level)[self.code]


def coded(values: NDArray[np.floating], chosen: NDArray[np.bool_]) -> Codes:
    """Codes of positive values [n] at chosen pixels [n]."""
    code = np.zeros(len(values), dtype=np.uint8)
    if not chosen.any():
        return Codes(np.empty(0, dtype=np.float32), code)
    logarithm = np.log(values[chosen].astype(float))
    low, high = logarithm.min(), logarithm.max()
    step = max(STEP, (high - low) / (LEVELS - 1) + SMALL)
    place = np.round((logarithm - low) / step).astype(np.int64)
    used, number = np.unique(place, return_inverse=True)
    total = np.bincount(number, values[chosen].astype(float), minlength=len(used))
    level = total / np.bincount(number, minlength=len(used))
    code[chosen] = number + 1
    return Codes(level.astype(np.float32), code)


def packed(*parts: Codes) -> bytes:
    """Several codes, concatenated and deflated; b"" for none.

    Counts of levels (16 bits each), levels (32-bit numbers), then a byte for each place; little
    end first.
    """
    if not any(len(part.level) for part in parts):
        return b""
    counts = np.array([len(part.level) for part in parts], dtype="<u2").tobytes()
    levels = b"".join(part.level.astype("<f4").tobytes() for part in parts)
    codes = b"".join(part.code.tobytes() for part in parts)
    press = zlib.compressobj(9, zlib.DEFLATED, DEFLATED)
    return press.compress(counts + levels + codes) + press.flush()


def unpacked(data: bytes, sizes: tuple[int, ...]) -> list[Codes]:
    """The codes in `packed` for parts of these lengths."""
    if not data:
        empty = np.empty(0, dtype=np.float32)
        return [Codes(empty, np.zeros(size, dtype=np.uint8)) for size in sizes]
    raw = zlib.decompress(data, DEFLATED)
    counts = np.frombuffer(raw, "<u2", len(sizes))
    at, levels, result = 2 * len(sizes), [], []
    for count in counts.tolist():
        levels.append(np.frombuffer(raw, "<f4", count, at))
        at += 4 * count
    for level, size in zip(levels, sizes, strict=True):
        result.append(Codes(level, np.frombuffer(raw, np.uint8, size, at)))
        at += size
    return result


SAMPLE = 400  # hours that the patterns are found from
ROWS, WINDOWS = 64, 32  # patterns of surfaces, of pixels that show windows
OFTEN = 0.3  # of the hours: pixels with light of their own in more of them are kept by patterns
FAINT = 2.0  # [cd/m2] of the sun's beam on a pixel: less is left out
UNLIKE = 0.08  # of the logarithm: window pixels that patterns miss by more are coded
FLOOR = 0.02  # of an hour's mean window luminance: below it no such pixel is coded
CHECKED = 100  # hours whose DGP is compared
BATCH_BYTES = 64 * 2**20  # of the pictures of a batch of hours


@dataclass(frozen=True, slots=True)
class DgpCheck:
    """DGP of some hours from the pictures and from their compressed form."""

    hours: NDArray[np.int64]  # [c] numbers among the hours of the year's pictures
    dgp: NDArray[np.float64]  # [c]
    compressed_dgp: NDArray[np.float64]  # [c]

    @property
    def largest(self) -> float:
        """The largest difference."""
        return float(np.abs(self.compressed_dgp - self.dgp).max(initial=0.0))


@dataclass(frozen=True, slots=True)
class PictureYear:
    """The pictures of a view in some hours H."""

    view: View
    pixels: NDArray[np.int64]  # [n] row * width + column of the pixels that show something
    row: NDArray[np.int64]  # [n] row of the surfaces' patterns
    share: NDArray[np.float32]  # [n] of the pixel that shows surfaces
    window: NDArray[np.int64]  # [w] numbers of the pixels that are kept as windows
    rows: Patterns  # of m rows
    windows: Patterns  # of w pixels
    scale: NDArray[np.float32]  # [2, H] of rows and windows
    amounts: tuple[NDArray[np.int16], NDArray[np.int16]]  # [H, r] of rows and windows, in steps
    amount_step: tuple[NDArray[np.float32], NDArray[np.float32]]  # [r]
    floor: NDArray[np.float32]  # [H] luminance below which no window pixel is corrected
    codes: tuple[bytes, ...]  # [H] beam [n] and ratio [w], see `codes.packed`
    discs: tuple[tuple[SunDisc, ...], ...]  # [H]
    check: DgpCheck | None = None

    def values(self, hour: int) -> NDArray[np.float32]:
        """Luminance [n] of the pixels in an hour, without the sun's disc."""
        beam, ratio = unpacked(self.codes[hour], (len(self.pixels), len(self.window)))
        result = self._part(0, hour)[self.row] * self.share + beam.values(0.0)
        shown = self._part(1, hour)
        if ratio.code.any():
            known = np.maximum(shown, self.floor[hour])
            shown = np.where(ratio.code > 0, known * ratio.values(1.0), shown)
        result[self.window] += shown
        return result

    def _part(self, which: int, hour: int) -> NDArray[np.float32]:
        patterns = (self.rows, self.windows)[which]
        amounts = self.amounts[which][hour] * self.amount_step[which]
        return patterns.values(self.scale[which, [hour]], amounts[None])[0]


def picture_year(pictures: Pictures, *, seed: int = 0, progress: Progress = silent) -> PictureYear:
    """Compress all pictures of a view, and compare DGP in some hours.

    Args: seed: of the hours that the patterns are found from, and of those that are compared.
    """
    work = _Work(pictures, seed)
    chosen = np.random.default_rng(seed).permutation(pictures.hours)
    checked = set(chosen[:CHECKED].tolist())
    rated: dict[int, float] = {}
    done = 0
    for batch in _batches(pictures):
        rows, own = pictures.by_rows(batch)
        work.add(batch, rows, own)
        for hour in checked.intersection(batch.tolist()):
            at = hour - int(batch[0])
            whole = rows[at][work.row] * work.share + own[at]
            rated[hour] = work.dgp(whole, work.discs[hour])
        done += len(batch)
        progress("explorer", done / max(pictures.hours, 1))
    year = work.year()
    hours = np.array(sorted(rated), dtype=np.int64)
    dgps = [work.dgp(year.values(h), year.discs[h]) for h in hours.tolist()]
    check = DgpCheck(hours, np.array([rated[h] for h in hours.tolist()]), np.array(dgps))
    return work.year(check)


def _batches(pictures: Pictures) -> Iterator[NDArray[np.int64]]:
    size = max(1, BATCH_BYTES // (8 * max(len(pictures.pixels), 1)))
    for start in range(0, pictures.hours, size):
        yield np.arange(start, min(start + size, pictures.hours))


class _Work:
    """Accumulates the compressed hours, batch by batch."""

    def __init__(self, pictures: Pictures, seed: int) -> None:
        self._pictures = pictures
        shared, H = pictures.shared, pictures.hours
        self.row, self.share = shared.row, shared.share
        sample = np.random.default_rng(seed).choice(H, min(SAMPLE, H), replace=False)
        rows, own = self._sampled(np.sort(sample))
        often = (own > 0).mean(axis=0) > OFTEN if H else np.zeros(len(self.share), dtype=bool)
        self.window = np.flatnonzero(often | (self.share < 1))
        self._sparse = np.ones(len(self.share), dtype=bool)
        self._sparse[self.window] = False
        count = np.bincount(self.row, minlength=rows.shape[1])
        even = np.ones(len(self.window))
        self.patterns = (patterns_of(rows, np.maximum(count, 1), ROWS), patterns_of(own[:, self.window], even, WINDOWS))
        self._geometry = GlareView(pictures.view)
        projected = in_picture_order(self._geometry.projected).ravel()[pictures.pixels]
        of_rows = np.bincount(self.row, projected * self.share, minlength=rows.shape[1])
        self._weights = of_rows, projected[self.window]
        self.scale = np.zeros((2, H), dtype=np.float32)
        self._amounts = [np.zeros((H, p.rank)) for p in self.patterns]
        self.floor = np.zeros(H, dtype=np.float32)
        self.codes: list[bytes] = [b""] * H
        self.discs: list[tuple[SunDisc, ...]] = [()] * H

    def _sampled(self, hours: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
        parts = [self._pictures.by_rows(hours[i : i + 50]) for i in range(0, len(hours), 50)]
        rows, own = zip(*parts, strict=True)
        return np.concatenate(rows), np.concatenate(own)

    def add(self, batch: NDArray[np.int64], rows: NDArray[Any], own: NDArray[Any]) -> None:
        """Add a batch of hours: luminance of rows [h, m] and of pixels [h, n]."""
        shown = own[:, self.window]
        known = self._fitted(0, batch, rows), self._fitted(1, batch, shown)
        self.floor[batch] = FLOOR * shown.mean(axis=1) if shown.size else 0.0
        for i, hour in enumerate(batch.tolist()):
            beam = coded(own[i], self._sparse & (own[i] > FAINT))
            floor = max(float(self.floor[hour]), 1e-6)
            ratio = np.maximum(shown[i], floor) / np.maximum(known[1][i], floor)
            wrong = coded(ratio, np.abs(np.log(ratio)) > UNLIKE)
            self.codes[hour] = packed(beam, wrong)
        for hour, discs in zip(batch.tolist(), self._pictures.discs(batch), strict=True):
            self.discs[hour] = discs

    def _fitted(self, which: int, batch: NDArray[np.int64], values: NDArray[Any]) -> NDArray[Any]:
        """The hours [h, ..] by the patterns, with the original illuminance at the eye."""
        patterns, weight = self.patterns[which], self._weights[which]
        scale, amounts = patterns.amounts(values)
        known = patterns.values(scale, amounts)
        lux, now = values @ weight, known @ weight
        factor = np.divide(lux, now, out=np.ones_like(lux), where=now > 0)
        self.scale[which, batch] = scale * factor
        self._amounts[which][batch] = amounts
        return known * factor[:, None]

    def dgp(self, values: NDArray[Any], discs: tuple[SunDisc, ...]) -> float:
        """DGP of pixels' luminance [n], and of the sun's disc and its images."""
        picture = full_picture(values, self._pictures.pixels, self._pictures.view)
        return evaluate(picture, self._geometry, discs=discs).dgp

    def year(self, check: DgpCheck | None = None) -> PictureYear:
        """The compressed pictures."""
        steps = [np.abs(a).max(axis=0, initial=1e-12) / MOST for a in self._amounts]
        whole = [np.round(a / s).astype(np.int16) for a, s in zip(self._amounts, steps, strict=True)]
        return PictureYear(
            self._pictures.view,
            self._pictures.pixels,
            self.row,
            self.share,
            self.window,
            *self.patterns,
            self.scale,
            (whole[0], whole[1]),
            (steps[0].astype(np.float32), steps[1].astype(np.float32)),
            self.floor,
            tuple(self.codes),
            tuple(self.discs),
            check,
        )
