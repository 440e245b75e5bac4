"""Weather of a site by time step: the `Weather` record; its readers are `epw` and `wea`.

Its functions of moist air and longwave sky radiation replace missing fields of a file;
`in_city` gives the air of a street from that of a weather station outside the city.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.notes import Note

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Weather:
    """Weather of one site; every array is over the time steps H.

    A value is the mean of its interval, which ends at `times`.  Missing series are None.
    """

    site: str
    latitude_deg: float  # north positive
    longitude_deg: float  # east positive
    timezone_h: float  # hours ahead of UTC, east positive
    elevation_m: float
    step_h: float  # length of an interval [h]
    times: pd.DatetimeIndex  # [H] interval ends, local standard time
    direct_normal: FloatArray  # [H] direct normal irradiance [W/m2]
    diffuse_horizontal: FloatArray  # [H] diffuse horizontal irradiance [W/m2]
    global_horizontal: FloatArray | None = None  # [H] global horizontal irradiance [W/m2]
    direct_normal_illuminance: FloatArray | None = None  # [H] [lx]
    diffuse_horizontal_illuminance: FloatArray | None = None  # [H] [lx]
    global_horizontal_illuminance: FloatArray | None = None  # [H] [lx]
    dry_bulb_c: FloatArray | None = None  # [H]
    dew_point_c: FloatArray | None = None  # [H]
    relative_humidity: FloatArray | None = None  # [H] 0 to 1
    pressure_pa: FloatArray | None = None  # [H]
    wind_speed: FloatArray | None = None  # [H] [m/s]
    wind_direction_deg: FloatArray | None = None  # [H] that the wind blows from, clockwise from north
    horizontal_infrared: FloatArray | None = None  # [H] sky longwave on a horizontal plane [W/m2]
    # ground reflectance, one or [H], see `albedo`; 0.2 is gendaymtx's and EnergyPlus's default
    albedo: float | FloatArray = 0.2
    stated_albedo: FloatArray | None = None  # [H] of the file, NaN where missing
    snow_depth_cm: FloatArray | None = None  # [H] of the file, NaN where missing
    rain_mm: FloatArray | None = None  # [H] in each interval, NaN where missing
    ground_depth_m: FloatArray | None = None  # [G]
    ground_temperature_c: FloatArray | None = None  # [G, 12] monthly, January first
    turned_deg: float = 0.0  # north is so far counter-clockwise of +y, see `turned`
    first_weekday: int | None = None  # of January 1, Monday 0, where the file says it
    source: str = ""  # of the values, as the file's header and its comments state it
    notes: tuple[str, ...] = ()  # what the reader made up, or found to be odd
    file: Path | None = None  # that it was read from

    def __post_init__(self) -> None:
        if not -90 <= self.latitude_deg <= 90 or not -180 <= self.longitude_deg <= 180:
            raise ValueError(
                f"expected latitude -90..90 and longitude -180..180, got {self.latitude_deg}, {self.longitude_deg}"
            )
        if not self.step_h > 0:
            raise ValueError(f"step_h: expected a positive number of hours, got {self.step_h}")
        for name in self.series():
            shape = getattr(self, name).shape
            if shape != (len(self.times),):
                raise ValueError(f"{name}: expected [{len(self.times)}], got {shape}")

    def series(self) -> tuple[str, ...]:
        """Names of the arrays [H] that this weather has."""
        other = ("times", "ground_depth_m", "ground_temperature_c")
        arrays = (f.name for f in fields(self) if f.name not in other)
        return tuple(name for name in arrays if isinstance(getattr(self, name), np.ndarray))

    def select(self, hours: ArrayLike) -> Weather:
        """The same weather at some time steps only (a mask [H] or indices)."""
        hours = np.asarray(hours)
        chosen = {name: getattr(self, name)[hours] for name in self.series()}
        return replace(self, times=self.times[hours], **chosen)

    def turned(self, angle_deg: float) -> Weather:
        """The same weather round a model turned clockwise, seen from above, by an angle.

        The model stays where it is, sun and wind turn about it, so that whatever was traced of it
        serves every orientation.
        """
        wind = self.wind_direction_deg
        if wind is not None:
            wind = np.mod(wind - angle_deg, 360.0)
        return replace(self, turned_deg=(self.turned_deg + angle_deg) % 360.0, wind_direction_deg=wind)

    @property
    def weekday(self) -> NDArray[np.int64]:
        """Day of the week [H], Monday 0: counted from the file's first day, else the year's own."""
        days = self.midpoints
        if self.first_weekday is None:
            return days.day_of_week.to_numpy().astype(np.int64)
        return (self.first_weekday + days.day_of_year.to_numpy().astype(np.int64) - 1) % 7

    @property
    def per_day(self) -> int:
        """Time steps of a day."""
        return round(24 / self.step_h)

    @property
    def midpoints(self) -> pd.DatetimeIndex:
        """Middle of each interval [H], local standard time."""
        return self.times - pd.Timedelta(hours=self.step_h / 2)


STEFAN_BOLTZMANN = 5.670374419e-8  # [W/m2K4] CODATA
KELVIN = 273.15

# Magnus coefficients over water (WMO-No. 8, annex 4.B): e = 611.2 exp(17.62 t/(243.12 + t)) Pa
MAGNUS_SLOPE, MAGNUS_OFFSET_C = 17.62, 243.12


def relative_humidity(dry_bulb_c: ArrayLike, dew_point_c: ArrayLike) -> NDArray[np.float64]:
    """Relative humidity, 0 to 1, by the Magnus formula."""
    dry, dew = np.asarray(dry_bulb_c, dtype=float), np.asarray(dew_point_c, dtype=float)
    exponent = MAGNUS_SLOPE * (dew / (MAGNUS_OFFSET_C + dew) - dry / (MAGNUS_OFFSET_C + dry))
    return np.minimum(np.exp(exponent), 1.0)


def dew_point(dry_bulb_c: ArrayLike, humidity: ArrayLike) -> NDArray[np.float64]:
    """Dew point [deg C] of relative humidity (0 to 1; at least 0.1 %), by the Magnus formula."""
    dry = np.asarray(dry_bulb_c, dtype=float)
    humidity = np.maximum(np.asarray(humidity, dtype=float), 1e-3)
    x = np.log(humidity) + MAGNUS_SLOPE * dry / (MAGNUS_OFFSET_C + dry)
    return MAGNUS_OFFSET_C * x / (MAGNUS_SLOPE - x)


def standard_pressure(elevation_m: float) -> float:
    """Air pressure [Pa] of the standard atmosphere (ASHRAE Fundamentals 2021, ch. 1, eq. 3)."""
    return 101325.0 * (1 - 2.25577e-5 * elevation_m) ** 5.2559


def sky_longwave(dry_bulb_c: ArrayLike, dew_point_c: ArrayLike, sky_cover: ArrayLike) -> NDArray[np.float64]:
    """Horizontal infrared irradiance from the sky [W/m2]; `sky_cover` in tenths.

    Source: Walton 1983 / Clark and Allen 1978, as in EnergyPlus's Engineering Reference.
    """
    n = np.asarray(sky_cover, dtype=float)
    dew = np.asarray(dew_point_c, dtype=float) + KELVIN
    dry = np.asarray(dry_bulb_c, dtype=float) + KELVIN
    clear = 0.787 + 0.764 * np.log(dew / 273.0)
    emissivity = clear * (1 + 0.0224 * n - 0.0035 * n**2 + 0.00028 * n**3)
    return emissivity * STEFAN_BOLTZMANN * dry**4


SKY_VIEW, VEGETATION = (0.2, 0.9), (0.0, 0.4)  # that the equation was tried on
NORTH_DEG, EAST_DEG = (45.0, 61.0), (-11.0, 16.0)  # about where its cities lie
CALM = 0.5  # [m/s] one knot: below it a station reports no wind, and the equation has no bound
FIRST_HOUR = 8  # o'clock, of the day that a maximum is of
GAS, HEAT = 287.058, 1007.0  # of dry air: gas constant, specific heat capacity [J/(kg K)]
SOURCE = "Theeuwes et al. 2017"


def maximum_heat_island(
    sky_view: float, vegetation: float, heating: ArrayLike, temperature_range: ArrayLike, wind: ArrayLike
) -> NDArray[np.float64]:
    """Greatest excess of the air in a street over that in the country within a day [..] [K].

        (2 - SVF - f_veg) (S DTR^3 / U)^(1/4)

    Args:
        sky_view: sky view factor of the street.
        vegetation: share of green in the plan, within 500 m.
        heating: S, global irradiance, mean of 24 hours, over density and heat capacity of air
            [K m/s].
        temperature_range: DTR, greatest less least temperature in the country [K].
        wind: U, mean speed at 10 m in the country [m/s].

    Raises: `ValueError` out of the range that the equation was tried on, and without wind.
    Source: Theeuwes, Steeneveld, Ronda, Holtslag 2017, "A diagnostic equation for the daily maximum
    urban heat island effect for cities in northwestern Europe", Int. J. Climatology 37,
    doi 10.1002/joc.4717; the range from memory, as the paper was not available.
    """
    for name, value, (low, high) in (("sky_view", sky_view, SKY_VIEW), ("vegetation", vegetation, VEGETATION)):
        if not low <= value <= high:
            raise ValueError(f"{name}: expected {low:g} to {high:g} ({SOURCE}), got {value:g}")
    wind = np.asarray(wind, dtype=float)
    if not (wind > 0).all():
        raise ValueError(f"wind: a day without any has no heat island by {SOURCE}")
    range_ = np.asarray(temperature_range, dtype=float)
    return (2 - sky_view - vegetation) * (np.asarray(heating) * range_**3 / wind) ** 0.25


def in_city(weather: Weather, sky_view: float, vegetation: float, hourly_shares: Sequence[float]) -> Weather:
    """The same weather with the air of a street: warmer, the water in it as before.

    The excess of an hour is the maximum of its day, from 8 o'clock to 8 o'clock, times a share.
    Days of less wind than `CALM` count with it.

    Args:
        weather: hourly, of whole days.
        sky_view, vegetation: as of `maximum_heat_island`.
        hourly_shares: [24] share of the maximum in each hour of the clock, from midnight on; the
            equation has none.

    Raises: `ValueError` as `maximum_heat_island`, and for weather without global irradiance.
    """
    hours, sun = len(weather.times), weather.global_horizontal
    dry, dew, wind = weather.dry_bulb_c, weather.dew_point_c, weather.wind_speed
    shares = np.asarray(hourly_shares, dtype=float)
    if weather.step_h != 1.0 or hours % 24 or weather.times[0].hour != 1:
        raise ValueError("weather: expected whole days of hours")
    if sun is None or dry is None or dew is None or wind is None:
        raise ValueError("weather: expected global irradiance, temperature, dew point and wind")
    if shares.shape != (24,):
        raise ValueError(f"hourly_shares: expected 24, got {shares.size}")

    def days(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.roll(values, -FIRST_HOUR).reshape(-1, 24)

    pressure = np.full(hours, standard_pressure(weather.elevation_m))
    if weather.pressure_pa is not None:
        pressure = weather.pressure_pa
    density = pressure / (GAS * (dry + 273.15))
    maximum = maximum_heat_island(
        sky_view,
        vegetation,
        (sun / (density * HEAT)).reshape(-1, 24).mean(axis=1),
        np.ptp(days(dry), axis=1),
        np.maximum(days(wind).mean(axis=1), CALM),
    )
    excess = np.roll(np.repeat(maximum, 24), FIRST_HOUR) * np.tile(shares, hours // 24)
    warm = dry + excess
    return replace(
        weather,
        dry_bulb_c=warm,
        relative_humidity=relative_humidity(warm, dew),
        notes=(*weather.notes, *_notes(weather, maximum, excess)),
    )


def _notes(weather: Weather, maximum: NDArray[np.float64], excess: NDArray[np.float64]) -> list[str]:
    notes: list[str] = [
        Note(
            "Weather {site}: air of an urban street, on average {mean:.1f} K and at most "
            "{most:.1f} K warmer than in the file (urban heat island by {source}, median of the "
            "daily maxima {median:.1f} K); sky, wind, ground and absolute humidity are those of "
            "the file.",
            site=weather.site,
            mean=float(excess.mean()),
            most=float(excess.max()),
            source=SOURCE,
            median=float(np.median(maximum)),
        )
    ]
    for value, (low, high) in ((weather.latitude_deg, NORTH_DEG), (weather.longitude_deg, EAST_DEG)):
        if not low <= value <= high:
            notes.append(
                Note(
                    "Weather {site}: the heat island equation is for cities in north-western "
                    "Europe; this site is elsewhere.",
                    site=weather.site,
                )
            )
            break
    return notes
