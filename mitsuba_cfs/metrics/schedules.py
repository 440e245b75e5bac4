"""Schedules of daylight metrics: working hours, LM-83's ten hours, EN 17037's half year."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather

Mask = NDArray[np.bool_]

LM83_HOURS = (8.0, 18.0)  # local time, every day of the year: 3,650 hours
RANKED_BY = ("diffuse", "global")


def working_hours(
    weather: Weather,
    start_h: float = 8.0,
    end_h: float = 18.0,
    *,
    weekdays_only: bool = False,
    clock_ahead_h: ArrayLike = 0.0,
) -> Mask:
    """Time steps [H] whose middle lies from `start_h` to `end_h` of the local clock.

    An end before the start is that of the next day: 22 to 6 is the night.

    Args:
        weekdays_only: leave out Saturdays and Sundays of the weather's calendar.
        clock_ahead_h: hours that the clock is ahead of standard time (daylight saving), a number
            or [H].
    """
    if not (0 <= start_h < 24 and 0 <= end_h <= 24 and start_h != end_h):
        raise ValueError(f"expected start and end of 0 to 24 that differ, got {start_h}, {end_h}")
    t = weather.midpoints
    hour = t.hour + t.minute / 60 + t.second / 3600 + np.asarray(clock_ahead_h, dtype=float)
    hour = np.mod(np.asarray(hour), 24.0)
    after, before = hour >= start_h, hour < end_h
    mask = after & before if start_h < end_h else after | before
    return mask & (weather.weekday < 5) if weekdays_only else mask


def lm83_hours(weather: Weather, *, clock_ahead_h: ArrayLike = 0.0) -> Mask:
    """The time steps [H] of LM-83: 8 to 18 o'clock every day, 3,650 hours of a year."""
    return working_hours(weather, *LM83_HOURS, clock_ahead_h=clock_ahead_h)


def daylight_hours(weather: Weather, *, ranked_by: str = "diffuse") -> Mask:
    """EN 17037's daylight hours [H]: the half of the year with the most daylight outside.

    4,380 of 8,760 hours.  The standard speaks of the diffuse horizontal illuminance; some programs
    rank by `global`.  Irradiance ranks the same as illuminance to within the efficacy; equal hours
    (the night) are ranked by the sun's height.
    """
    if ranked_by not in RANKED_BY:
        raise ValueError(f"ranked_by: expected one of {RANKED_BY}, got {ranked_by!r}")
    sine = sun_directions(weather)[:, 2]
    light = weather.diffuse_horizontal
    if ranked_by == "global":
        light = light + weather.direct_normal * np.maximum(sine, 0.0)
    order = np.lexsort((sine, light))  # light first, then the sun's height
    mask = np.zeros(len(light), dtype=bool)
    mask[order[len(light) - len(light) // 2 :]] = True
    return mask
