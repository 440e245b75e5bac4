"""The sky of a year as the matrix methods take it, for the hours when the sun is up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.matrix import sky_matrix, sky_series, sun_up
from mitsuba_cfs.sky.weather import Weather


@dataclass(frozen=True, slots=True)
class Sun:
    """The sun's own light, for the methods that know its true disc."""

    patches: NDArray[np.float32]  # [P, L] the sun alone on the sky's patches [cd/m2]
    direction: NDArray[np.float64]  # [L, 3]
    illuminance: NDArray[np.float64]  # [L] normal to it [lx]


@dataclass(frozen=True, slots=True)
class Skies:
    """The sky of a year in both bands, for the hours when the sun is up."""

    visible: NDArray[np.float32]  # [P, L] luminance, the sun among it [cd/m2]
    solar: NDArray[np.float32]  # [P, L] radiance [W/m2/sr]
    lit: NDArray[np.int64]  # [L] which hours of the year
    hours: int  # H
    sun: Sun | None = None  # what methods finer than three-phase need

    def whole_year(self, values: NDArray) -> NDArray:
        """Values [..., L] of the lit hours as values [..., H] of all, dark ones 0."""
        full = np.zeros((*values.shape[:-1], self.hours), dtype=values.dtype)
        full[..., self.lit] = values
        return full


def year_of_skies(weather: Weather, subdivision: int, *, with_sun: bool = True) -> Skies:
    """Sky matrices of the hours with the sun up.

    Args: subdivision: Reinhart's MF; with_sun: the sun by itself too.
    """

    def matrix(band: str, parts: str) -> NDArray[np.float32]:
        return sky_matrix(weather, subdivision, band, parts, sun_up_only=True, dtype=np.float32)

    lit = np.flatnonzero(sun_up(weather))
    sun = None
    if with_sun:
        series = sky_series(weather)
        sun = Sun(matrix("visible", "sun"), series.sun[lit], series.direct_normal[lit])
    return Skies(matrix("visible", "all"), matrix("solar", "all"), lit, len(weather.times), sun)
