"""Glare sources of a luminance picture, as evalglare finds them.

1. Bright pixels: luminance above the threshold.  2. Bright pixels within the search radius of one
another form one source.  3. Optionally pixels in between are added (smoothing).  4. The pixels of a
source above the peak luminance are taken out of it into sources of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare import passes, scan
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.sun_disc import SunDisc


@dataclass(frozen=True, slots=True)
class Sources:
    """Glare sources, in evalglare's order; x and y in scan order (y up from the bottom)."""

    labels: NDArray[np.int32]  # [nx, ny] 0: none, else 1 + index into the arrays below
    pixels: NDArray[np.float64]  # [n] number of pixels
    solid_angle: NDArray[np.float64]  # [n] [sr]
    luminance: NDArray[np.float64]  # [n] average over solid angle [cd/m2]
    x: NDArray[np.float64]  # [n] centre of flux [px]
    y: NDArray[np.float64]  # [n] centre of flux [px]
    illuminance: NDArray[np.float64]  # [n] at the eye [lx]


def glare_sources(
    luminance: NDArray[np.float64],
    geometry: GlareView,
    threshold: float,
    *,
    search_radius: float = 0.2,
    peak: float | None = 50000.0,
    smoothing: bool = False,
) -> Sources:
    """The glare sources of a picture.

    Args:
        luminance: [nx, ny] in scan order [cd/m2].
        threshold: pixels above it are bright [cd/m2].
        search_radius: opening angle of the search for neighbours [rad]: twice the largest angle.
        peak: luminance from which pixels are taken out as peaks [cd/m2]; None: no extraction.
        smoothing: add pixels of which a fifth of the surroundings belongs to a source.
    """
    radius = float(np.float32(search_radius))
    step = geometry.pixels_in(search_radius)
    reach = geometry.reach(radius / 2)
    valid, directions, omega = geometry.valid, geometry.directions, geometry.solid_angle
    labels, count = scan.label_bright(luminance, valid, directions, threshold, radius, reach, step > 1.0)
    if not count:
        return Sources(labels, *np.empty((6, 0)))
    peaks = peak if step >= 1.0 else None
    bright = int(np.count_nonzero(luminance >= peaks)) if peaks is not None else 0
    sums = scan.sum_sources(labels, luminance, omega, count + 1 + bright)
    fixed = (luminance, omega, valid, directions, radius, reach)
    if step > 1.0:
        scan.merge_sources(labels, sums, *fixed, 1, count, True)
    if smoothing and step >= 1.0:
        size, circle = sums[: count + 1], step / 1.75
        scan.smooth(labels, labels.copy(), size, luminance, omega, valid, float(np.float32(circle)))
    if peaks is not None and bright:
        _extract_peaks(labels, sums, count, peaks, search_radius / 2, fixed)
    return _collect(labels, sums, luminance, geometry)


def pixel_sources(luminance: NDArray[np.float64], geometry: GlareView, threshold: float) -> Sources:
    """Every bright pixel as a separate source; arguments as for `glare_sources`.

    The sum of L^2 omega / P^2 is then that of raytools and raytraverse: none is averaged away, and
    each pixel has its own position index.
    """
    x, y = np.nonzero((luminance > threshold) & geometry.valid)
    labels = np.zeros(luminance.shape, dtype=np.int32)
    labels[x, y] = np.arange(1, len(x) + 1)
    L = luminance[x, y]
    return Sources(
        labels,
        np.ones(len(x)),
        geometry.solid_angle[x, y],
        L,
        x.astype(float),
        y.astype(float),
        L * geometry.projected[x, y],
    )


def with_disc(sources: Sources, disc: SunDisc, illuminance: float, geometry: GlareView) -> Sources:
    """The sources and a disc as the last; it covers none of the pixels.

    Args: illuminance: of the disc at the eye [lx].
    """
    count, labels = len(sources.pixels), sources.labels
    x, y = geometry.pixel_at(disc.direction)
    if labels[x, y] == 0:  # so that it shows in a picture of the sources
        labels = labels.copy()
        labels[x, y] = count + 1
    own = (0.0, disc.solid_angle, disc.luminance, x, y, illuminance)
    values = (sources.pixels, sources.solid_angle, sources.luminance, sources.x, sources.y, sources.illuminance)
    return Sources(labels, *(np.append(a, b) for a, b in zip(values, own, strict=True)))


def _extract_peaks(
    labels: NDArray[np.int32],
    sums: NDArray[np.float64],
    count: int,
    limit: float,
    radius: float,
    fixed: tuple[Any, ...],
) -> None:
    """Take the peaks out of each source in turn, and merge those that are near one another."""
    luminance, omega, valid, directions, _, _ = fixed
    last = count
    brightest = passes.brightest_of(labels, luminance, count + 1)
    if brightest.max() <= limit:
        return
    for source in range(1, count + 1):
        if sums[source, scan.COUNT] > 0 and brightest[source] >= limit:
            first = last + 1
            last = scan.peaks_of(source, first, labels, sums, luminance, omega, valid, directions, limit, radius)
            scan.merge_sources(labels, sums, *fixed, first, last, False)


def _collect(
    labels: NDArray[np.int32], sums: NDArray[np.float64], luminance: NDArray[np.floating], geometry: GlareView
) -> Sources:
    """The sources that have pixels, numbered in the order in which they were made."""
    kept = np.flatnonzero(sums[:, scan.COUNT] > 0)
    numbers = np.zeros(len(sums), dtype=np.int32)
    numbers[kept] = np.arange(1, len(kept) + 1)
    illuminance = passes.renumber(labels, numbers, luminance, geometry.projected, len(kept))
    pixels, omega, flux, flux_x, flux_y = sums[kept].T
    return Sources(labels, pixels, omega, flux / omega, flux_x / flux, flux_y / flux, illuminance)
