"""The sun of a year in short steps, with the weather of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.annual import annual_sky
from mitsuba_cfs.sky.sun import is_up, sun_at
from mitsuba_cfs.sky.weather import Weather

FloatArray = NDArray[np.float64]

SUNSHINE = 120.0  # direct normal irradiance of sunshine, as the WMO defines it [W/m2]
STEPS_A_DAY = 288  # of five minutes, in which the sun goes 1.25 degrees


@dataclass(frozen=True, slots=True)
class SunYear:
    """Positions N of the sun above the horizon."""

    times: pd.DatetimeIndex  # [N] local standard time
    directions: FloatArray  # [N, 3] unit vectors to the sun
    shines: NDArray[np.bool_]  # [N] by the weather
    illuminance: FloatArray  # [N] of the sun, normal to it [lx]
    step_h: float

    @property
    def winter(self) -> NDArray[np.bool_]:
        """Positions [N] between 21 September and 21 March."""
        day = 100 * self.times.month + self.times.day
        return np.asarray((day >= 921) | (day < 321))


def sun_year(weather: Weather) -> SunYear:
    """The sun's positions over the intervals of a weather; its direct light is that of the interval."""
    count = max(round(STEPS_A_DAY * weather.step_h / 24), 1)
    minutes = (np.arange(count) + 0.5) / count * 60 * weather.step_h
    starts = weather.times - pd.Timedelta(hours=weather.step_h)
    times = pd.DatetimeIndex((starts.to_numpy()[:, None] + pd.to_timedelta(minutes, unit="min").to_numpy()).ravel())
    directions = sun_at(weather, times)
    up = is_up(directions)
    sky = annual_sky(weather, 1, sun=False)
    illuminance = np.repeat(sky.whole_year(np.asarray(sky.illuminance, dtype=float)), count)
    shines = np.repeat(weather.direct_normal >= SUNSHINE, count)
    return SunYear(times[up], directions[up], shines[up], illuminance[up], weather.step_h / count)
