"""Channels: bands of wavelength in which light is computed, and what they tell of detectors.

In each band transmittances and reflectances have their mean under D65, and light has its power.
A detector receives of a band what it would receive of D65 with as much power in it; the error of
that falls with the number of bands (docs/spectral.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.spectra.detectors import NANOMETRES, detected, illuminant

FloatArray = NDArray[np.float64]
LOWEST_NM, HIGHEST_NM = float(NANOMETRES[0]), float(NANOMETRES[-1])


@dataclass(frozen=True)
class Channels:
    """Bands of wavelength between edges."""

    edges_nm: tuple[float, ...]  # [C + 1] rising from 380 to 780

    def __post_init__(self) -> None:
        edges = np.asarray(self.edges_nm, dtype=float)
        if len(edges) < 2 or np.any(np.diff(edges) < 1.0):
            raise ValueError("edges_nm: expected at least two, rising by 1 nm or more")
        if edges[0] != LOWEST_NM or edges[-1] != HIGHEST_NM:
            raise ValueError(f"edges_nm: expected {LOWEST_NM:g} to {HIGHEST_NM:g} nm")

    @property
    def count(self) -> int:
        """C, the number of bands."""
        return len(self.edges_nm) - 1

    @cached_property
    def widths(self) -> FloatArray:
        """Width of each nanometre's cell in each band [C, N] [nm]; a cell may lie in two."""
        low = np.maximum(NANOMETRES - 0.5, LOWEST_NM)
        high = np.minimum(NANOMETRES + 0.5, HIGHEST_NM)
        edges = np.asarray(self.edges_nm, dtype=float)
        overlap = np.minimum(high, edges[1:, None]) - np.maximum(low, edges[:-1, None])
        widths: FloatArray = np.maximum(overlap, 0.0)
        return widths

    def power(self, spectrum: ArrayLike) -> FloatArray:
        """Power of spectra [.., N] in each band [.., C]."""
        return np.asarray(spectrum, dtype=float) @ self.widths.T

    def mean(self, values: ArrayLike) -> FloatArray:
        """Means [.., C] of transmittances or reflectances [.., N] under D65."""
        daylight = illuminant("D65")
        means: FloatArray = self.power(np.asarray(values, dtype=float) * daylight)
        return means / self.power(daylight)

    def spectrum(self, power: ArrayLike) -> FloatArray:
        """Spectra [.., N] of powers [.., C]: D65 in each band, scaled to its power."""
        return np.asarray(power, dtype=float) @ self._shapes

    @cached_property
    def detection(self) -> FloatArray:
        """What `DETECTORS` receive of a unit of power in each band [9, C]."""
        return detected(self._shapes).T

    @cached_property
    def _shapes(self) -> FloatArray:
        """Spectra [C, N] of a unit of power in each band."""
        bands = self.widths * illuminant("D65")
        shapes: FloatArray = bands / bands.sum(axis=1, keepdims=True)
        return shapes


def _even(step: float) -> tuple[float, ...]:
    return tuple(np.arange(LOWEST_NM, HIGHEST_NM + step / 2, step).tolist())


def _five_nanometres() -> tuple[float, ...]:
    middles = np.arange(LOWEST_NM + 2.5, HIGHEST_NM, 5.0)
    return (LOWEST_NM, *middles.tolist(), HIGHEST_NM)


# By their number.  3 and 9: Lark 2 (Inanici, Brennan, Clark 2015, "Spectral daylighting
# simulations", Building Simulation 2015, 1245-1252); 20: Radiance's spectral samples; 81: every
# 5 nm; 5: least error of the alpha-opic quantities of the daylight in tests/spectra/test_channels
CHANNEL_SETS = {
    3: (380.0, 498.0, 586.0, 780.0),
    5: (380.0, 400.0, 470.0, 540.0, 620.0, 780.0),
    9: (380.0, 422.0, 460.0, 498.0, 524.0, 550.0, 586.0, 650.0, 714.0, 780.0),
    20: _even(20.0),
    81: _five_nanometres(),
}


def channels_of(count: int) -> Channels:
    """The set of so many bands.

    Raises: `ValueError` for a number of which there is no set.
    """
    if count not in CHANNEL_SETS:
        known = ", ".join(map(str, CHANNEL_SETS))
        raise ValueError(f"channels: expected one of {known}, got {count}")
    return Channels(CHANNEL_SETS[count])
