"""Radiance's WEA weather files, read and written."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

from mitsuba_cfs.files import write_bytes
from mitsuba_cfs.sky import wea_table, weather_table
from mitsuba_cfs.sky.plausible import checked_sun
from mitsuba_cfs.sky.sun import direct_normal_from_global, sun_directions
from mitsuba_cfs.sky.weather import Weather


def read_wea(path: str | PathLike[str], *, whole_year: bool = True) -> Weather:
    """The weather of a Radiance WEA file: direct normal and diffuse horizontal irradiance.

    A line's time is the middle of its interval, as gendaymtx takes it.  Unit 1 is direct normal,
    unit 2 direct horizontal irradiance.  `whole_year=False` accepts any rising times.

    Raises: `DataError` that names the file, the line and the field.
    """
    site, unit, rows, first_line = wea_table.wea_rows(path)
    times, step_h = wea_table.wea_times(rows, path, first_line, whole_year)
    direct, diffuse = (
        weather_table.checked(path, first_line, name, rows[:, 3 + i], 0.0, 1500.0)
        for i, name in enumerate(("direct irradiance", "diffuse irradiance"))
    )
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
        file=Path(path),
    )
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
