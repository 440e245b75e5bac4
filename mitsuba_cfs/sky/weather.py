"""Weather of a site by time step: the `Weather` record; its readers are `epw` and `wea`.

Its functions of moist air and longwave sky radiation replace missing fields of a file.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

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
    wind_direction_deg: FloatArray | None = (
        None  # [H] that the wind blows from, clockwise from north
    )
    horizontal_infrared: FloatArray | None = None  # [H] sky longwave on a horizontal plane [W/m2]
    # ground reflectance, one or [H], see `albedo`; 0.2 is gendaymtx's and EnergyPlus's default
    albedo: float | FloatArray = 0.2
    stated_albedo: FloatArray | None = None  # [H] of the file, NaN where missing
    snow_depth_cm: FloatArray | None = None  # [H] of the file, NaN where missing
    ground_depth_m: FloatArray | None = None  # [G]
    ground_temperature_c: FloatArray | None = None  # [G, 12] monthly, January first
    turned_deg: float = 0.0  # north is so far counter-clockwise of +y, see `turned`
    first_weekday: int | None = None  # of January 1, Monday 0, where the file says it
    notes: tuple[str, ...] = ()  # what the reader made up, or found to be odd
    file: Path | None = None  # that it was read from

    def __post_init__(self) -> None:
        if not -90 <= self.latitude_deg <= 90 or not -180 <= self.longitude_deg <= 180:
            raise ValueError(
                f"expected latitude -90..90 and longitude -180..180, "
                f"got {self.latitude_deg}, {self.longitude_deg}"
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
        return replace(
            self, turned_deg=(self.turned_deg + angle_deg) % 360.0, wind_direction_deg=wind
        )

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


def sky_longwave(
    dry_bulb_c: ArrayLike, dew_point_c: ArrayLike, sky_cover: ArrayLike
) -> NDArray[np.float64]:
    """Horizontal infrared irradiance from the sky [W/m2]; `sky_cover` in tenths.

    Source: Walton 1983 / Clark and Allen 1978, as in EnergyPlus's Engineering Reference.
    """
    n = np.asarray(sky_cover, dtype=float)
    dew = np.asarray(dew_point_c, dtype=float) + KELVIN
    dry = np.asarray(dry_bulb_c, dtype=float) + KELVIN
    clear = 0.787 + 0.764 * np.log(dew / 273.0)
    emissivity = clear * (1 + 0.0224 * n - 0.0035 * n**2 + 0.00028 * n**3)
    return emissivity * STEFAN_BOLTZMANN * dry**4
