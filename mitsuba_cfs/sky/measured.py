"""Weather from a pyranometer pair: measured global and diffuse horizontal irradiance."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.sky import sun
from mitsuba_cfs.sky.options import LABELS, LEAST_ALTITUDE_DEG
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.sky.weather_table import checked_sun

COLUMNS = ("time", "global_horizontal", "diffuse_horizontal")
MOST_IRRADIANCE = 1800.0  # [W/m2] broken clouds can double a clear sky's diffuse light


def measured_weather(
    site: Weather,
    global_horizontal: ArrayLike,
    diffuse_horizontal: ArrayLike,
    *,
    sun_model: str = "spa",
    least_altitude_deg: float = LEAST_ALTITUDE_DEG,
) -> Weather:
    """`site` (place and times) with the direct normal irradiance that two measurements imply.

    DNI = (global - diffuse)/sin(altitude) in the middle of each interval, 0 below
    `least_altitude_deg`; there the whole global value counts as diffuse.
    """
    whole = np.asarray(global_horizontal, dtype=float)
    diffuse = np.asarray(diffuse_horizontal, dtype=float)
    sine = sun.sun_directions(site, model=sun_model)[:, 2]
    direct = sun.direct_normal_from_global(whole, diffuse, sine, least_altitude_deg=least_altitude_deg)
    low = sine <= np.sin(np.radians(least_altitude_deg))
    return replace(
        site,
        direct_normal=direct,
        diffuse_horizontal=np.where(low, np.maximum(whole, 0.0), diffuse),
        global_horizontal=whole,
    )


def read_measured(
    path: str | PathLike[str],
    *,
    latitude_deg: float,
    longitude_deg: float,
    timezone_h: float,
    elevation_m: float = 0.0,
    label: str = "middle",
    least_altitude_deg: float = LEAST_ALTITUDE_DEG,
) -> Weather:
    """Weather of a CSV file with the columns time, global_horizontal, diffuse_horizontal [W/m2].

    Args:
        timezone_h: of the file's times, which must have no zone of their own.
        label: whether a time is the `start`, `middle` or `end` of its interval; the shortest gap
            between times is the interval.

    Raises: `DataError` that names the file, the line and the column.
    """
    if label not in LABELS:
        raise ValueError(f"label: expected one of {tuple(LABELS)}, got {label!r}")
    table = _table(path)
    times = pd.DatetimeIndex(table["time"])
    gaps = np.diff(times) / np.timedelta64(1, "h")
    if len(gaps) == 0 or np.any(gaps <= 0):
        row = int(np.argmax(gaps <= 0)) + 1 if len(gaps) else 0
        raise DataError("expected at least two rising times", file=path, element=f"line {row + 2}", field="time")
    step = float(np.min(gaps))
    none = np.zeros(len(times))
    site = Weather(
        site="measured",
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        timezone_h=timezone_h,
        elevation_m=elevation_m,
        step_h=step,
        times=times + pd.Timedelta(hours=(1.0 - LABELS[label]) * step),
        direct_normal=none,
        diffuse_horizontal=none,
    )
    weather = measured_weather(
        site,
        table["global_horizontal"].to_numpy(),
        table["diffuse_horizontal"].to_numpy(),
        least_altitude_deg=least_altitude_deg,
    )
    return checked_sun(weather, path)


def _table(path: str | PathLike[str]) -> pd.DataFrame:
    """The three columns, checked: times as dates, irradiances as numbers within bounds."""
    try:
        table = pd.read_csv(path, dtype=str, skipinitialspace=True)
    except (OSError, UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise DataError(f"cannot be read as CSV: {reason(error)}", file=path) from error
    for name in COLUMNS:
        if name not in table:
            raise DataError("missing: expected " + ", ".join(COLUMNS), file=path, field=name)
    result = pd.DataFrame({"time": pd.to_datetime(table["time"], format="ISO8601", errors="coerce")})
    if getattr(result["time"].dtype, "tz", None) is not None:
        raise DataError("expected times without a zone", file=path, field="time")
    wrong = {"time": result["time"].isna()}
    for name in COLUMNS[1:]:
        values = pd.to_numeric(table[name], errors="coerce").astype(float)
        wrong[name] = ~values.between(-20.0, MOST_IRRADIANCE)  # night offsets of pyranometers
        result[name] = np.maximum(values, 0.0)
    for name, bad in wrong.items():
        if bad.any():
            row = int(np.argmax(bad))
            expected = "a date" if name == "time" else f"-20 to {MOST_IRRADIANCE:g} W/m2"
            raise DataError(
                f"expected {expected}, got {table[name].iloc[row]!r}", file=path, element=f"line {row + 2}", field=name
            )
    return result
