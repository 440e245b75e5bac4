"""The skies of a year as the methods take them: Reinhart patches of the hours with the sun up.

`with_albedo` sets the reflectance of the ground: a number, by month, or from the weather file.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
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
from mitsuba_cfs.sky.weather_table import LONGEST_GAP_H, interpolated

T = TypeVar("T")
FROM_FILE = ("file", "snow")
# Reflectance of ground under snow, and 0.2 without: Liu and Jordan 1963, "The long-term average
# performance of flat-plate solar-energy collectors", Solar Energy 7 (2), 53-74
SNOW = 0.7
SNOW_CM = 1.0  # depth that covers the ground
TOO_WARM_C = 10.0  # daily mean outdoors above which a file's snow is not credible
BRIGHTEST = 0.95  # new snow: Oke 1987, "Boundary layer climates", table 1.1
MANY_HOURS = 100  # in daylight, of snow that the results leave out


def with_albedo(weather: Weather, albedo: float | Sequence[float] | str | None) -> Weather:
    """The weather with a ground reflectance [H] or of all hours.

    Args:
        albedo: a number; twelve by month, January first; "file": the weather file's albedo; "snow":
            0.7 where the file has snow of at least 1 cm, else the weather's own, 0.2.  None: the
            weather's own, with a note where the file has snow.

    Raises: `DataError` where the file lacks what is asked for, or its snow is not credible.
    """
    if albedo is None:
        return _noted(weather)
    if isinstance(albedo, str):
        return _from_file(weather, albedo)
    values = np.asarray(albedo, dtype=float)
    if values.shape not in ((), (12,)) or values.min() < 0 or values.max() > 1:
        raise DataError(f"expected a number or twelve from 0 to 1, got {albedo}", field="albedo")
    if values.ndim == 0:
        return replace(weather, albedo=float(values))
    return replace(weather, albedo=values[weather.midpoints.month.to_numpy() - 1])


def _from_file(weather: Weather, source: str) -> Weather:
    if source not in FROM_FILE:
        message = f"expected a number, twelve, or one of {', '.join(FROM_FILE)}; got {source!r}"
        raise DataError(message, field="albedo")
    if source == "snow":
        depth = weather.snow_depth_cm
        if depth is None or np.isnan(depth).all():
            raise DataError("has no snow depth", file=weather.file, field="albedo")
        depth, notes = _without_gaps(weather, depth, "snow depth", 0.0)
        snow = depth >= SNOW_CM
        warm = int(np.count_nonzero(snow & (_daily_means(weather) > TOO_WARM_C)))
        if warm:
            message = f"has snow in {warm} hours of days warmer than {TOO_WARM_C:g} °C on average"
            raise DataError(f"{message}; state the albedo by month", file=weather.file, field="albedo")
        return replace(weather, albedo=np.where(snow, SNOW, weather.albedo), notes=notes)
    stated = weather.stated_albedo
    if stated is None or np.isnan(stated).all():
        raise DataError("has no albedo", file=weather.file, field="albedo")
    values, notes = _without_gaps(weather, stated, "albedo", weather.albedo)
    too_bright = int(np.count_nonzero(values > BRIGHTEST))
    if too_bright:
        note = Note(
            "{file}: the albedo is above {most:g} in {count} hours, which no ground reflects; it is used as it is.",
            "{file}: the albedo is above {most:g} in {count} hour, which no ground reflects; it is used as it is.",
            file=_name(weather),
            count=too_bright,
            most=BRIGHTEST,
        )
        notes = (*notes, note)
    return replace(weather, albedo=values, notes=notes)


def _without_gaps(
    weather: Weather, values: NDArray[np.float64], field: str, otherwise: float | NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Values [H] with short gaps (NaN) interpolated and long ones filled, and the notes of that."""
    between = interpolated(values, round(LONGEST_GAP_H / weather.step_h))
    filled, missing = np.isnan(values) & ~np.isnan(between), np.isnan(between)
    notes = weather.notes
    if filled.any():
        note = Note(
            "{file}: {field}: {count} missing values are interpolated.",
            "{file}: {field}: {count} missing value is interpolated.",
            file=_name(weather),
            field=field,
            count=int(filled.sum()),
        )
        notes = (*notes, note)
    if missing.any():
        note = Note(
            "{file}: {field}: missing or impossible in {count} hours; {value:g} is used there.",
            "{file}: {field}: missing or impossible in {count} hour; {value:g} is used there.",
            file=_name(weather),
            field=field,
            count=int(missing.sum()),
            value=float(np.mean(otherwise)),
        )
        notes = (*notes, note)
    return np.where(missing, otherwise, between), notes


def _noted(weather: Weather) -> Weather:
    """The weather, with a note where its file has credible snow that is left out."""
    depth = weather.snow_depth_cm
    if depth is None or weather.dry_bulb_c is None:
        return weather
    snow = depth >= SNOW_CM
    day = weather.direct_normal + weather.diffuse_horizontal > 0
    hours = int(np.count_nonzero(snow & day) * weather.step_h)
    if hours < MANY_HOURS or (snow & (_daily_means(weather) > TOO_WARM_C)).any():
        return weather
    note = Note(
        "{file}: snow lies in {hours} hours of daylight; the ground reflects {albedo:g} all year. "
        "Facades in snow can receive 13 to 36 % more light and heat: state albedo = 'snow'.",
        file=_name(weather),
        hours=hours,
        albedo=float(np.mean(weather.albedo)),
    )
    return replace(weather, notes=(*weather.notes, note))


def _daily_means(weather: Weather) -> NDArray[np.float64]:
    """Mean outdoor temperature [H] of each step's day [degC]."""
    if weather.dry_bulb_c is None:
        return np.zeros(len(weather.times))
    days = weather.midpoints.normalize()
    _, number = np.unique(days, return_inverse=True)
    means = np.bincount(number, weather.dry_bulb_c) / np.bincount(number)
    return means[number]


def _name(weather: Weather) -> str:
    return weather.site if weather.file is None else weather.file.name


NO_SUN = "the sky was made without the sun alone: annual_sky(sun=True)"


@dataclass(frozen=True, slots=True)
class AnnualSky:
    """Skies and suns of some hours L of a year of H hours, by default those with the sun up.

    `lit` [L] are the numbers of these hours in the year, so that `weather.midpoints[sky.lit]` are their times;
    `whole` [P, L] is the luminance of the patches [cd/m2], `direction` [L, 3] the direction to the sun and
    `illuminance` [L] that of the sun, normal to its beam [lx].
    """

    whole: NDArray[np.floating]  # [P, L] luminance, the sun among it [cd/m2]
    direction: NDArray[np.float64]  # [L, 3] to the sun
    illuminance: NDArray[np.float64]  # [L] of the sun, normal to it [lx]
    lit: NDArray[np.int64]  # [L] which hours of the year
    hours: int  # H
    sun: NDArray[np.floating] | None = None  # [P, L] the sun alone, spread over patches [cd/m2]
    solar: NDArray[np.floating] | None = None  # [P, L] radiance, the sun among it [W/m2/sr]
    _lit_sun: list[Any] = field(default_factory=list, init=False, repr=False, compare=False)
    _totals: list[Any] = field(default_factory=list, init=False, repr=False, compare=False)
    _of_year: dict[tuple[Any, ...], Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, function: Callable[..., T], weather: Weather, *arguments: Hashable) -> T:
        """A result of the weather of these skies and arguments alone, made once for all rooms."""
        key = function, *arguments
        if key not in self._of_year:
            self._of_year[key] = function(weather, *arguments)
        result: T = self._of_year[key]
        return result

    @property
    def lit_sun(self) -> NDArray[np.floating] | csr_array:
        """The sun alone as `phases.times_sky` takes it fastest, made once for all rooms."""
        if self.sun is None:
            raise ValueError(NO_SUN)
        if not self._lit_sun:
            self._lit_sun.append(lit_rows(self.sun))
        return self._lit_sun[0]

    def are_all(self, hours: NDArray[np.int64]) -> bool:
        """Whether some of the hours L are all of them, in their order."""
        return np.array_equal(hours, np.arange(len(self.lit)))

    def lit_sun_in(self, hours: NDArray[np.int64]) -> NDArray[np.floating] | csr_array:
        """The same in some of the hours L."""
        sun = self.lit_sun
        if self.are_all(hours):
            return sun
        return sun[:, hours] if isinstance(sun, np.ndarray) else sun[hours]

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
        if hours.dtype != bool:
            hours = hour_numbers(hours, len(self.illuminance))
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
    return _of_series(visible, radiance, subdivision, hours, sun=sun, reflectance=weather.albedo, ground=ground)


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
    return _of_series(visible, radiance, subdivision, hours, sun=sun, reflectance=ground_reflectance, ground=ground)


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
    options: dict[str, Any] = {"ground_reflectance": reflectance, "ground": ground, "dtype": np.float32}
    return AnnualSky(
        series_matrix(series, lit, subdivision, **options),
        series.sun[lit],
        series.direct_normal[lit],
        lit,
        every,
        series_matrix(series, lit, subdivision, "sun", **options) if sun else None,
        None if solar is None else series_matrix(solar, lit, subdivision, **options),
    )
