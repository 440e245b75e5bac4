"""Weather files: EnergyPlus's EPW, and Radiance's WEA, read and written."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, write_bytes
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky import weather_table
from mitsuba_cfs.sky.sun import direct_normal_from_global, sun_directions
from mitsuba_cfs.sky.weather import Weather, dew_point, relative_humidity, sky_longwave, standard_pressure
from mitsuba_cfs.sky.weather_table import (
    TYPICAL_LEAP_YEAR,
    TYPICAL_YEAR,
    FilePath,
    Location,
    check_length,
    checked_sun,
    location,
    number,
    read_lines,
)


def weather_of_file(path: str | PathLike[str], *, whole_year: bool = True) -> Weather:
    """The weather of an EPW file, or of a WEA file, which begins with "place"; as `read_epw` and `read_wea`."""
    try:
        with open(path, "rb") as file:
            is_wea = file.read(5).lower() == b"place"
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    return read_wea(path, whole_year=whole_year) if is_wea else read_epw(path)


def read_wea(path: str | PathLike[str], *, whole_year: bool = True) -> Weather:
    """The weather of a Radiance WEA file: direct normal and diffuse horizontal irradiance.

    A line's time is the middle of its interval, as gendaymtx takes it.  Unit 1 is direct normal,
    unit 2 direct horizontal irradiance.  `whole_year=False` accepts any rising times.

    Raises: `DataError` that names the file, the line and the field.
    """
    site, unit, rows, first_line = wea_rows(path)
    times, step_h = wea_times(rows, path, first_line, whole_year)
    direct, diffuse = (
        weather_table.checked(path, first_line, name, rows[:, 3 + i], 0.0, 1500.0)
        for i, name in enumerate(("direct irradiance", "diffuse irradiance"))
    )
    weather = Weather(*site.values, step_h, times, direct, diffuse, file=Path(path))
    if unit == 1:
        return checked_sun(weather, path)
    weather = checked_sun(replace(weather, global_horizontal=direct + diffuse), path)
    sine = sun_directions(weather, model="radiance")[:, 2]
    normal = direct_normal_from_global(direct + diffuse, diffuse, sine)
    return replace(weather, direct_normal=normal)


def write_wea(weather: Weather, path: str | PathLike[str]) -> None:
    """Write a Radiance WEA file (unit 1): month, day, middle of the interval, DNI, DHI [W/m2]."""
    place = weather.site.replace(" ", "_").replace(",", "") or "unnamed"
    if "_" not in place:
        place += "_-"  # gendaymtx wants city_country
    head = (
        f"place {place}\nlatitude {weather.latitude_deg:.6f}\n"
        f"longitude {-weather.longitude_deg:.6f}\ntime_zone {-15 * weather.timezone_h:g}\n"
        f"site_elevation {weather.elevation_m:.1f}\nweather_data_file_units 1\n"
    )
    t = weather.midpoints
    hour = t.hour + t.minute / 60 + t.second / 3600
    lines = [
        f"{month} {day} {h:.4f} {direct:.6g} {diffuse:.6g}\n"
        for month, day, h, direct, diffuse in zip(
            t.month, t.day, hour, weather.direct_normal, weather.diffuse_horizontal, strict=True
        )
    ]
    write_bytes(path, (head + "".join(lines)).encode("ascii", "replace"))


WEA_HEADER = ("place", "latitude", "longitude", "time_zone", "site_elevation", "weather_data_file_units")


def wea_rows(path: FilePath) -> tuple[Location, int, NDArray[np.float64], int]:
    """Location, unit, rows [H, 5] of month, day, hour, direct, diffuse, and the first data line."""
    lines = read_lines(path)
    values = []
    for i, keyword in enumerate(WEA_HEADER):
        if i >= len(lines) or not lines[i].lower().startswith(keyword + " "):
            raise DataError(f"expected the header {keyword}", file=path, element=f"line {i + 1}")
        values.append(lines[i][len(keyword) :].strip())
    latitude, west, zone, elevation, unit = (
        number(text, path, i + 2, WEA_HEADER[i + 1]) for i, text in enumerate(values[1:])
    )
    if unit not in (1, 2):
        raise DataError(
            f"expected 1 (direct normal) or 2 (direct horizontal irradiance), got {unit:g}",
            file=path,
            element="line 6",
            field="weather_data_file_units",
        )
    first = len(WEA_HEADER) + 1
    rows = np.empty((len(lines) - len(WEA_HEADER), 5))
    for i, line in enumerate(lines[len(WEA_HEADER) :]):
        parts = line.split()
        if len(parts) < 5:
            raise DataError(
                f"expected month day hour direct diffuse, got {line!r}", file=path, element=f"line {first + i}"
            )
        names = ("month", "day", "hour", "direct irradiance", "diffuse irradiance")
        rows[i] = [number(parts[j], path, first + i, name) for j, name in enumerate(names)]
    site = location(path, values[0], (latitude, -west, -zone / 15, elevation))
    return site, int(unit), rows, first


def wea_times(
    rows: NDArray[np.float64], path: FilePath, first_line: int, whole_year: bool
) -> tuple[pd.DatetimeIndex, float]:
    """Interval ends [H] and the step [h] of WEA rows, whose own times are interval middles."""
    if len(rows) == 0:
        raise DataError("has no data rows", file=path)
    leap = bool(np.any((rows[:, 0] == 2) & (rows[:, 1] == 29)))
    year = TYPICAL_LEAP_YEAR if leap else TYPICAL_YEAR
    table = {"year": year, "month": rows[:, 0], "day": rows[:, 1]}
    days = pd.to_datetime(pd.DataFrame(table), errors="coerce")
    wrong = days.isna().to_numpy() | (rows[:, 2] < 0) | (rows[:, 2] > 24)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError("is not a date of month, day and hour", file=path, element=f"line {first_line + row}")
    middle = pd.DatetimeIndex(days) + pd.to_timedelta(np.round(rows[:, 2] * 3600), unit="s")
    gaps = np.diff(middle) / np.timedelta64(1, "h")
    step = float(np.min(gaps)) if len(gaps) else 1.0
    wrong = (gaps <= 0) | (whole_year & (np.abs(gaps - step) > 0.01))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"hours are missing or out of order: {middle[row]} is followed by {middle[row + 1]}",
            file=path,
            element=f"line {first_line + row + 1}",
            field="time",
        )
    if whole_year:
        check_length(path, len(rows), round(1 / step), leap)
    return middle + pd.Timedelta(hours=step / 2), step


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
        *site.values,
        step_h,
        times,
        direct,
        diffuse,
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
        source=weather_table.epw_source(head),
        notes=(*filled_gaps(column, site.name), *notes, *more),
        file=Path(path),
    )
    return checked_sun(weather, path)


def filled_gaps(column: weather_table.EpwColumns, site: str) -> tuple[str, ...]:
    """A note for each field that has interpolated values."""
    return tuple(
        Note(
            "Weather {site}: {field}: {count} missing values, the first in line {line}, are interpolated.",
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
            "Weather {site}: {field}: {count} implausible value, in line {line}: {value:g}; it is used as it is.",
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


def _pressure(column: weather_table.EpwColumns, site: weather_table.Location) -> tuple[FloatArray, tuple[str, ...]]:
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
