"""The skies of a year as the methods take them: Reinhart patches of the hours with the sun up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from mitsuba_cfs.phases import lit_rows
from mitsuba_cfs.sky.matrix import (
    DEFAULT_ALBEDO,
    DEFAULT_DEW_POINT_C,
    SkySeries,
    series_for_suns,
    series_matrix,
    sky_series,
)
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.sky.three_part import three_part
from mitsuba_cfs.sky.weather import Weather

NO_SUN = "the sky was made without the sun alone: annual_sky(sun=True)"


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
    _lit_sun: list[Any] = field(default_factory=list, init=False, repr=False, compare=False)
    _totals: list[Any] = field(default_factory=list, init=False, repr=False, compare=False)

    @property
    def lit_sun(self) -> NDArray[np.floating] | csr_array:
        """The sun alone as `phases.times_sky` takes it fastest, made once for all rooms."""
        if self.sun is None:
            raise ValueError(NO_SUN)
        if not self._lit_sun:
            self._lit_sun.append(lit_rows(self.sun))
        return self._lit_sun[0]

    def sun_alone(self, hours: Any = slice(None)) -> NDArray[np.floating]:
        """Luminance [P, n] of the sun alone, of some of the hours L [cd/m2]."""
        if self.sun is None:
            raise ValueError(NO_SUN)
        return self.sun[:, hours]

    def without_sun(self, hours: Any = slice(None)) -> NDArray[np.floating]:
        """Luminance [P, n] of sky and ground without the sun, of some of the hours L [cd/m2]."""
        if self.sun is None:
            raise ValueError(NO_SUN)
        return np.maximum(self.whole[:, hours] - self.sun[:, hours], 0.0)

    def totals(self, hours: NDArray[np.bool_]) -> tuple[NDArray[np.float64], ...]:
        """Sums over some of the hours [L]: whole, the sun alone, and the rest [P] [cd/m2].

        The last two are 0 where the sky was made without the sun alone.  Those of all hours are
        made once for all rooms.
        """
        if self._totals and hours.all():
            return self._totals[0]
        some = slice(None) if hours.all() else hours
        whole = self.whole[:, some].sum(axis=1, dtype=float)
        sun = rest = np.zeros_like(whole)
        if self.sun is not None:
            sun = self.sun[:, some].sum(axis=1, dtype=float)
            rest = self.without_sun(some).sum(axis=1, dtype=float)
        if hours.all():
            self._totals.append((whole, sun, rest))
        return whole, sun, rest

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
    sun_model: str = "spa",
    ground: str = "reflected",
    towards: NDArray[np.float64] | None = None,
) -> AnnualSky:
    """Perez skies of a weather, single precision.

    Args:
        subdivision: Reinhart's MF.
        hours: which hours of the weather; by default those with the sun up.
        sun: the sun alone too, which all methods but the three-phase need.
        solar: radiances too, for heat.
        rotation_deg, sun_model, ground: see `mitsuba_cfs.sky.matrix.sky_matrix`.
        towards: `sun_directions` of the weather [H, 3], where they are known.
    """
    if towards is None:
        towards = sun_directions(weather, model=sun_model)
    place: dict[str, Any] = {"towards": towards, "rotation_deg": rotation_deg}
    visible = sky_series(weather, **place)
    radiance = three_part(sky_series(weather, "solar", **place)) if solar else None
    return _of_series(
        visible, radiance, subdivision, hours, sun=sun, reflectance=weather.albedo, ground=ground
    )


def given_sky(
    direction: ArrayLike,
    direct_normal: ArrayLike,
    diffuse_horizontal: ArrayLike,
    subdivision: int = 4,
    *,
    day_of_year: ArrayLike,
    dew_point_c: ArrayLike = DEFAULT_DEW_POINT_C,
    hours: ArrayLike | None = None,
    sun: bool = True,
    solar: bool = False,
    ground: str = "reflected",
    ground_reflectance: float | NDArray[np.float64] = DEFAULT_ALBEDO,
) -> AnnualSky:
    """Perez skies of given suns and irradiances, wherever they come from; see `annual_sky`.

    Args:
        direction: [H, 3] unit vectors to the sun.
        direct_normal, diffuse_horizontal: [H] irradiances [W/m2].
        day_of_year: [H] or one, for the distance to the sun (`gendaylit -ang` takes 1).
        dew_point_c: [H] or one, for the luminous efficacies.
    """
    given = direction, direct_normal, diffuse_horizontal
    moment: dict[str, Any] = {"day_of_year": day_of_year, "dew_point_c": dew_point_c}
    visible = series_for_suns(*given, **moment)
    radiance = three_part(series_for_suns(*given, "solar", **moment)) if solar else None
    return _of_series(
        visible,
        radiance,
        subdivision,
        hours,
        sun=sun,
        reflectance=ground_reflectance,
        ground=ground,
    )


def hour_numbers(hours: ArrayLike, count: int) -> NDArray[np.int64]:
    """Numbers of hours [n]; `ValueError` where one is not among so many."""
    numbers = np.asarray(hours, dtype=np.int64)
    if numbers.ndim != 1 or numbers.min(initial=0) < 0 or numbers.max(initial=0) >= max(count, 1):
        raise ValueError(f"hours: expected numbers from 0 to {count - 1}, got {hours!r:.60}")
    return numbers


def _of_series(
    series: SkySeries,
    solar: SkySeries | None,
    subdivision: int,
    hours: ArrayLike | None,
    *,
    sun: bool,
    reflectance: float | NDArray[np.float64],
    ground: str,
) -> AnnualSky:
    every = len(series.sun)
    lit = np.flatnonzero(is_up(series.sun)) if hours is None else hour_numbers(hours, every)
    options: dict[str, Any] = {
        "ground_reflectance": reflectance,
        "ground": ground,
        "dtype": np.float32,
    }
    return AnnualSky(
        series_matrix(series, lit, subdivision, **options),
        series.sun[lit],
        series.direct_normal[lit],
        lit,
        every,
        series_matrix(series, lit, subdivision, "sun", **options) if sun else None,
        None if solar is None else series_matrix(solar, lit, subdivision, **options),
    )
