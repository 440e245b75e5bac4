"""Measured weather: a CSV file with named columns, at steps of one minute to one hour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather, standard_pressure
from scenes.toml_file import TomlTable

FloatArray = NDArray[np.float64]
LOWEST_SUN = 0.03  # sine of the altitude below which measured global sun is taken to be diffuse
STRONGEST = 1200.0  # direct normal irradiance [W/m2]: above it is the error of a low sun's sine


class ColumnsTable(TomlTable):
    """The columns of a weather file by what they hold; each value is the mean of its interval."""

    dry_bulb_c: str
    diffuse_horizontal: str  # [W/m2]
    global_horizontal: str | None = None  # [W/m2]; or the next
    direct_normal: str | None = None  # [W/m2]
    horizontal_infrared: str  # longwave of the sky [W/m2]
    relative_humidity: str  # [%]
    wind_speed: str  # [m/s] at 10 m
    wind_direction_deg: str | None = None
    pressure_pa: str | None = None


class MeasuredTable(TomlTable):
    """Where and when a weather file that is no EPW was measured."""

    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Field(ge=-180, le=180)]
    timezone_h: Annotated[float, Field(ge=-12, le=14)]  # of the file's times, ahead of UTC
    elevation_m: Annotated[float, Field(ge=-430, le=9000)] = 0.0
    time: str = "time"  # column of the intervals' ends, 2013-08-21T00:10
    albedo: Annotated[float, Field(ge=0, le=1)] = 0.2
    columns: ColumnsTable


def read_measured(path: Path, table: MeasuredTable) -> Weather:
    """The weather of a CSV file, cut to whole days.

    Raises: `DataError` that names file and column.
    """
    try:
        data = pd.read_csv(path)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    times = interval_ends(data, table.time, path)
    step = _step(times, path)
    names = table.columns.model_dump(exclude_none=True)
    values = {key: _column(data, name, path) for key, name in names.items()}
    starts = times - step
    days = np.asarray(starts == starts.normalize())
    per_day = round(pd.Timedelta(days=1) / step)
    first = int(np.argmax(days)) if days.any() else len(times)
    whole = per_day * ((len(times) - first) // per_day)
    if whole == 0:
        raise DataError("holds no whole day from midnight to midnight", file=path)
    kept = slice(first, first + whole)
    values, times, notes = {k: v[kept] for k, v in values.items()}, times[kept], []
    values["relative_humidity"] = values["relative_humidity"] / 100.0
    if "pressure_pa" not in values:
        values["pressure_pa"] = np.full(whole, standard_pressure(table.elevation_m))
        notes.append(Note("{file}: no pressure; that of the standard atmosphere is used.", file=path.name))
    if "wind_direction_deg" not in values:
        values["wind_direction_deg"] = np.zeros(whole)
        notes.append(Note("{file}: no wind direction; north is used.", file=path.name))
    given = {key: v for key, v in values.items() if key != "global_horizontal"}
    weather = Weather(
        path.stem,
        table.latitude_deg,
        table.longitude_deg,
        table.timezone_h,
        table.elevation_m,
        step / pd.Timedelta(hours=1),
        times,
        albedo=table.albedo,
        notes=tuple(notes),
        file=path,
        **({"direct_normal": np.zeros(whole)} | given),
    )
    return weather if "direct_normal" in values else _with_sun(weather, values, path)


def _with_sun(weather: Weather, values: dict[str, FloatArray], path: Path) -> Weather:
    """The weather with its direct sun from global and diffuse."""
    if "global_horizontal" not in values:
        raise DataError("name a column for `global_horizontal` or `direct_normal`", file=path, field="columns")
    sine = sun_directions(weather)[:, 2]
    direct = np.maximum(values["global_horizontal"] - values["diffuse_horizontal"], 0.0)
    up = sine > LOWEST_SUN
    normal = np.where(up, direct / np.maximum(sine, LOWEST_SUN), 0.0)
    return replace(weather, direct_normal=np.minimum(normal, STRONGEST))


def interval_ends(data: pd.DataFrame, column: str, path: Path) -> pd.DatetimeIndex:
    """The times [H] of a column; `DataError` where it is missing or holds anything else."""
    if column not in data.columns:
        raise DataError(no_column(column, data), file=path, field="time")
    try:
        times = pd.DatetimeIndex(pd.to_datetime(data[column], format="ISO8601"))
    except (ValueError, TypeError) as error:
        raise DataError(f"expected times as 2013-08-21T00:10: {error}", file=path, field=column) from error
    if times.tz is not None or times.hasnans:
        raise DataError("expected times without zone, none missing", file=path, field=column)
    return times


def _step(times: pd.DatetimeIndex, path: Path) -> pd.Timedelta:
    if len(times) < 2:
        raise DataError("expected at least two rows", file=path)
    gaps = np.diff(times.to_numpy())
    odd = np.flatnonzero(gaps != gaps[0])
    if odd.size:
        element = f"line {odd[0] + 3}"
        raise DataError("expected rows at one step, none missing", file=path, element=element)
    step = pd.Timedelta(gaps[0])
    minute, hour = pd.Timedelta(minutes=1), pd.Timedelta(hours=1)
    if not minute <= step <= hour or hour % step != pd.Timedelta(0):
        raise DataError(f"expected steps of 1 to 60 minutes that fill an hour, got {step}", file=path)
    return step


def _column(data: pd.DataFrame, name: str, path: Path) -> FloatArray:
    if name not in data.columns:
        raise DataError(no_column(name, data), file=path, field="columns")
    values = pd.to_numeric(data[name], errors="coerce").to_numpy(dtype=float)
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        element = f"line {wrong[0] + 2}"
        raise DataError("expected a number", file=path, element=element, field=name)
    return values


def no_column(name: str, data: pd.DataFrame) -> str:
    """The message on a column that there is not."""
    return f"no column {name!r}; there are {', '.join(map(str, data.columns))}"
