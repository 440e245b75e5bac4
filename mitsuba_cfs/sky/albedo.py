"""Solar and visible reflectance of the ground: a number, by month, or from the weather file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather

FROM_FILE = ("file", "snow")
# Reflectance of ground under snow, and 0.2 without: Liu and Jordan 1963, "The long-term average
# performance of flat-plate solar-energy collectors", Solar Energy 7 (2), 53-74
SNOW = 0.7
SNOW_CM = 1.0  # depth that covers the ground
TOO_WARM_C = 10.0  # daily mean outdoors above which a file's snow is not credible
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
        snow = depth >= SNOW_CM
        warm = int(np.count_nonzero(snow & (_daily_means(weather) > TOO_WARM_C)))
        if warm:
            message = f"has snow in {warm} hours of days warmer than {TOO_WARM_C:g} °C on average"
            raise DataError(
                f"{message}; state the albedo by month", file=weather.file, field="albedo"
            )
        return replace(weather, albedo=np.where(snow, SNOW, weather.albedo))
    stated = weather.stated_albedo
    if stated is None or np.isnan(stated).all():
        raise DataError("has no albedo", file=weather.file, field="albedo")
    missing = np.isnan(stated)
    notes = weather.notes
    if missing.any():
        note = Note(
            "{file}: the albedo is missing in {count} hours; {albedo:g} is used there.",
            "{file}: the albedo is missing in {count} hour; {albedo:g} is used there.",
            file=_name(weather),
            count=int(missing.sum()),
            albedo=float(np.mean(weather.albedo)),
        )
        notes = (*notes, note)
    return replace(weather, albedo=np.where(missing, weather.albedo, stated), notes=notes)


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
