"""Weather of a site by time step: the `Weather` record, and EPW files."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky import air, weather_table

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Weather:
    """Weather of one site; every array is over the time steps H.

    A value stands for its interval, which ends at `times`.  What a file does not have is None.
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
    albedo: float = 0.2  # ground reflectance; 0.2 is gendaymtx's and EnergyPlus's default
    ground_depth_m: FloatArray | None = None  # [G]
    ground_temperature_c: FloatArray | None = None  # [G, 12] monthly, January first
    turned_deg: float = 0.0  # north is so far counter-clockwise of +y, see `turned`
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
    def midpoints(self) -> pd.DatetimeIndex:
        """Middle of each interval [H], local standard time."""
        return self.times - pd.Timedelta(hours=self.step_h / 2)


def read_epw(path: str | PathLike[str]) -> Weather:
    """The weather of an EnergyPlus EPW file of a whole year (8760 or 8784 hours, or parts of them).

    Dew point, humidity, pressure and sky longwave are derived where the file marks them missing;
    a missing temperature, irradiance or wind speed is an error.  A pressure out of bounds is
    replaced and noted.  Whether the radiation is that of the stated place and clock is checked.

    Raises: `DataError` that names the file, the line and the field.
    Source: EnergyPlus Auxiliary Programs, "EnergyPlus Weather File (EPW) Data Dictionary".
    """
    from mitsuba_cfs.sky.plausible import checked_sun

    head, table = weather_table.epw_lines(path)
    site = weather_table.epw_location(head, path)
    depth, ground = weather_table.epw_ground(head, path)
    column = weather_table.EpwColumns(path, len(head), table)
    times, step_h = column.times()
    dry = column.required("dry bulb temperature")
    dew = column.optional("dew point temperature")
    humidity = column.optional("relative humidity") / 100
    unknown = np.isnan(dew) & np.isnan(humidity)
    if unknown.any():
        raise column.error(
            "relative humidity", int(np.argmax(unknown)), "missing, and so is the dew point"
        )
    humidity = np.where(np.isnan(humidity), air.relative_humidity(dry, dew), humidity)
    dew = np.where(np.isnan(dew), air.dew_point(dry, humidity), dew)
    pressure, notes = _pressure(column, site)
    weather = Weather(
        site=site.name,
        latitude_deg=site.latitude_deg,
        longitude_deg=site.longitude_deg,
        timezone_h=site.timezone_h,
        elevation_m=site.elevation_m,
        step_h=step_h,
        times=times,
        direct_normal=column.required("direct normal irradiance"),
        diffuse_horizontal=column.required("diffuse horizontal irradiance"),
        global_horizontal=column.whole("global horizontal irradiance"),
        direct_normal_illuminance=column.whole("direct normal illuminance"),
        diffuse_horizontal_illuminance=column.whole("diffuse horizontal illuminance"),
        global_horizontal_illuminance=column.whole("global horizontal illuminance"),
        dry_bulb_c=dry,
        dew_point_c=dew,
        relative_humidity=humidity,
        pressure_pa=pressure,
        wind_speed=column.required("wind speed"),
        wind_direction_deg=column.whole("wind direction"),
        horizontal_infrared=_infrared(column, dry, dew),
        ground_depth_m=depth,
        ground_temperature_c=ground,
        notes=notes,
        file=Path(path),
    )
    return checked_sun(weather, path)


def _pressure(
    column: weather_table.EpwColumns, site: weather_table.Location
) -> tuple[FloatArray, tuple[str, ...]]:
    """Pressure [H] [Pa], the standard atmosphere's where it is missing or impossible, and a note.

    It enters the refraction of the sun's light (its mean) and the density of the outdoor air: an
    hour of it is not worth a file.
    """
    pressure, wrong = column.plausible("pressure")
    standard = air.standard_pressure(site.elevation_m)
    notes: tuple[str, ...] = ()
    if wrong.any():
        row = int(np.argmax(wrong))
        notes = (
            f"Weather {site.name}: {np.count_nonzero(wrong)} impossible pressures, the first in "
            f"line {column.first_line + row}: {standard:.0f} Pa of the standard atmosphere stand "
            "in.",
        )
    return np.where(np.isnan(pressure), standard, pressure), notes


def _infrared(column: weather_table.EpwColumns, dry: FloatArray, dew: FloatArray) -> FloatArray:
    """Horizontal infrared [H] of the file; from sky cover and dew point where it is missing."""
    infrared = column.optional("horizontal infrared irradiance")
    missing = np.isnan(infrared) | (infrared <= 0)
    if missing.any():
        opaque, total = column.optional("opaque sky cover"), column.optional("total sky cover")
        cover = np.where(np.isnan(opaque), total, opaque)
        unknown = missing & np.isnan(cover)
        if unknown.any():
            raise column.error(
                "horizontal infrared irradiance",
                int(np.argmax(unknown)),
                "missing, and so is the sky cover it could be estimated from",
            )
        infrared = np.where(missing, air.sky_longwave(dry, dew, cover), infrared)
    return infrared
