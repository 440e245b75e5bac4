"""The skies of a year as the methods take them: Reinhart patches of the hours with the sun up."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.matrix import sky_matrix, sky_series, sun_up
from mitsuba_cfs.sky.weather import Weather


@dataclass(frozen=True, slots=True)
class AnnualSky:
    """Skies and suns of some hours L of a year of H hours, by default those with the sun up."""

    whole: NDArray[np.floating]  # [P, L] luminance, the sun among it [cd/m2]
    direction: NDArray[np.float64]  # [L, 3] to the sun
    illuminance: NDArray[np.float64]  # [L] of the sun, normal to it [lx]
    lit: NDArray[np.int64]  # [L] which hours of the year
    hours: int  # H
    sun: NDArray[np.floating] | None = None  # [P, L] the sun alone, spread over patches [cd/m2]
    solar: NDArray[np.floating] | None = None  # [P, L] radiance, the sun among it [W/m2/sr]

    def without_sun(self, hours: Any = slice(None)) -> NDArray[np.floating]:
        """Luminance [P, n] of sky and ground without the sun, of some of the hours L [cd/m2]."""
        if self.sun is None:
            raise ValueError("the sky was made without the sun alone: annual_sky(sun=True)")
        return np.maximum(self.whole[:, hours] - self.sun[:, hours], 0.0)

    def part(self, hours: ArrayLike) -> AnnualSky:
        """Some of the hours L, given by their numbers among them."""
        hours = np.asarray(hours)
        return replace(
            self,
            whole=self.whole[:, hours],
            direction=self.direction[hours],
            illuminance=self.illuminance[hours],
            lit=self.lit[hours],
            sun=None if self.sun is None else self.sun[:, hours],
            solar=None if self.solar is None else self.solar[:, hours],
        )

    def whole_year(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values [..., L] as values [..., H] of all hours of the year, the others 0."""
        full = np.zeros((*values.shape[:-1], self.hours), dtype=values.dtype)
        full[..., self.lit] = values
        return full


def annual_sky(
    weather: Weather,
    subdivision: int = 4,
    *,
    hours: ArrayLike | None = None,
    sun: bool = True,
    solar: bool = False,
    rotation_deg: float = 0.0,
) -> AnnualSky:
    """Perez skies of a weather, single precision.

    Args:
        subdivision: Reinhart's MF.
        hours: which hours of the year; by default those with the sun up.
        sun: the sun alone too, which all methods but the three-phase need.
        solar: radiances too, for heat.
        rotation_deg: see `mitsuba_cfs.sky.matrix.sky_matrix`.
    """
    lit = np.flatnonzero(sun_up(weather)) if hours is None else np.asarray(hours, dtype=np.int64)
    options: dict[str, Any] = {"rotation_deg": rotation_deg, "hours": lit, "dtype": np.float32}

    def matrix(band: str, parts: str) -> NDArray[np.float32]:
        return sky_matrix(weather, subdivision, band, parts, **options)

    series = sky_series(weather, rotation_deg=rotation_deg)
    return AnnualSky(
        matrix("visible", "all"),
        series.sun[lit],
        series.direct_normal[lit],
        lit,
        len(weather.times),
        matrix("visible", "sun") if sun else None,
        matrix("solar", "all") if solar else None,
    )
