"""Weather of EnergyPlus's EPW files."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky import weather_table
from mitsuba_cfs.sky.weather import (
    Weather,
    dew_point,
    relative_humidity,
    sky_longwave,
    standard_pressure,
)
from mitsuba_cfs.sky.weather_table import checked_sun

FloatArray = NDArray[np.float64]
# Values that no weather has.  Records by the WMO: 56.7 and -89.2 degC (Antarctica apart -67.8), a
# mean wind of 60 m/s in tropical cyclones; a dew point rounded as the temperature is
HOTTEST_C, COLDEST_C, STRONGEST_WIND = 57.0, -68.0, 60.0
SPIKE_K = 15.0  # of one hour against both neighbours
DEW_ABOVE_K, LEAST_HUMIDITY = 3.0, 0.005


def read_epw(path: str | PathLike[str]) -> Weather:
    """The weather of an EnergyPlus EPW file of a whole year (8760 or 8784 hours, or parts of them).

    Dew point, humidity, pressure and sky longwave are derived where the file marks them missing.
    A missing temperature, irradiance or wind speed is interpolated over up to six hours and noted;
    a longer gap is an error.  A pressure out of bounds is replaced and noted; values that no
    weather has, but within the format's bounds, are noted.  Whether the radiation is that of the
    stated place and clock is checked.

    Raises: `DataError` that names the file, the line and the field.
    Source: EnergyPlus Auxiliary Programs, "EnergyPlus Weather File (EPW) Data Dictionary".
    """
    head, table = weather_table.epw_lines(path)
    site = weather_table.epw_location(head, path)
    depth, ground = weather_table.epw_ground(head, path)
    column = weather_table.EpwColumns(path, len(head), table)
    times, step_h = column.times()
    dry = column.required("dry bulb temperature")
    dew = column.optional("dew point temperature")
    humidity = column.optional("relative humidity") / 100
    if (np.isnan(dew) & np.isnan(humidity)).any():  # of neither there is a value
        humidity = column.filled("relative humidity", humidity)
    wind = column.required("wind speed")
    notes = implausible(column, site.name, dry, dew, humidity, wind)
    humidity = np.where(np.isnan(humidity), relative_humidity(dry, dew), humidity)
    dew = np.where(np.isnan(dew), dew_point(dry, humidity), dew)
    pressure, more = _pressure(column, site)
    infrared = _infrared(column, dry, dew)
    direct = column.required("direct normal irradiance")
    diffuse = column.required("diffuse horizontal irradiance")
    weather = Weather(
        site=site.name,
        latitude_deg=site.latitude_deg,
        longitude_deg=site.longitude_deg,
        timezone_h=site.timezone_h,
        elevation_m=site.elevation_m,
        step_h=step_h,
        times=times,
        direct_normal=direct,
        diffuse_horizontal=diffuse,
        global_horizontal=column.whole("global horizontal irradiance"),
        direct_normal_illuminance=column.whole("direct normal illuminance"),
        diffuse_horizontal_illuminance=column.whole("diffuse horizontal illuminance"),
        global_horizontal_illuminance=column.whole("global horizontal illuminance"),
        dry_bulb_c=dry,
        dew_point_c=dew,
        relative_humidity=humidity,
        pressure_pa=pressure,
        wind_speed=wind,
        wind_direction_deg=column.whole("wind direction"),
        horizontal_infrared=infrared,
        stated_albedo=column.unchecked("albedo"),
        snow_depth_cm=column.unchecked("snow depth"),
        rain_mm=column.unchecked("liquid precipitation depth"),
        ground_depth_m=depth,
        ground_temperature_c=ground,
        first_weekday=weather_table.epw_first_weekday(head),
        notes=(*filled_gaps(column, site.name), *notes, *more),
        file=Path(path),
    )
    return checked_sun(weather, path)


def filled_gaps(column: weather_table.EpwColumns, site: str) -> tuple[str, ...]:
    """A note for each field that has interpolated values."""
    return tuple(
        Note(
            "Weather {site}: {field}: {count} missing values, the first in line {line}, are "
            "interpolated.",
            "Weather {site}: {field}: {count} missing value, in line {line}, is interpolated.",
            site=site,
            field=field,
            count=len(rows),
            line=column.first_line + int(rows[0]),
        )
        for field, rows in column.gaps.items()
    )


def implausible(
    column: weather_table.EpwColumns,
    site: str,
    dry: FloatArray,
    dew: FloatArray,
    humidity: FloatArray,
    wind: FloatArray,
) -> tuple[str, ...]:
    """A note for each field with values that no weather has; they are used as they are.

    Args: dry, dew: temperatures [H] [deg C]; humidity: [H] 0 to 1; wind: speed [H] [m/s]; NaN
        where missing.
    """
    cases = {
        "dry bulb temperature": (dry, spikes(dry) | (dry > HOTTEST_C) | (dry < COLDEST_C)),
        "dew point temperature": (dew, spikes(dew) | (dew > dry + DEW_ABOVE_K)),
        "relative humidity": (100 * humidity, humidity < LEAST_HUMIDITY),
        "wind speed": (wind, wind > STRONGEST_WIND),
    }
    return tuple(
        Note(
            "Weather {site}: {field}: {count} implausible values, the first in line {line}: "
            "{value:g}; they are used as they are.",
            "Weather {site}: {field}: {count} implausible value, in line {line}: {value:g}; it is "
            "used as it is.",
            site=site,
            field=field,
            count=int(np.count_nonzero(wrong)),
            line=column.first_line + int(np.argmax(wrong)),
            value=values[np.argmax(wrong)],
        )
        for field, (values, wrong) in cases.items()
        if wrong.any()
    )


def spikes(values: FloatArray) -> NDArray[np.bool_]:
    """Values [H] that are far above or below both of their neighbours."""
    before, after = values - np.roll(values, 1), values - np.roll(values, -1)
    return (np.minimum(abs(before), abs(after)) > SPIKE_K) & (before * after > 0)


def _pressure(
    column: weather_table.EpwColumns, site: weather_table.Location
) -> tuple[FloatArray, tuple[str, ...]]:
    """Pressure [H] [Pa], the standard atmosphere's where it is missing or impossible, and a note.

    It enters the refraction of the sun's light (its mean) and the density of the outdoor air: an
    hour of it is not worth a file.
    """
    pressure, wrong = column.plausible("pressure")
    standard = standard_pressure(site.elevation_m)
    notes: tuple[str, ...] = ()
    if wrong.any():
        row = int(np.argmax(wrong))
        notes = (
            Note(
                "Weather {site}: {count} impossible pressures, the first in line {line}; "
                "{pressure:.0f} Pa (standard atmosphere) is used.",
                "Weather {site}: {count} impossible pressure, in line {line}; {pressure:.0f} Pa "
                "(standard atmosphere) is used.",
                site=site.name,
                count=int(np.count_nonzero(wrong)),
                line=column.first_line + row,
                pressure=standard,
            ),
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
        infrared = np.where(missing, sky_longwave(dry, dew, cover), infrared)
    return infrared
