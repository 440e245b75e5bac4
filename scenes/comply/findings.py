"""What was found out about a room, in the form that needs take it: light, view, sun, glare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.glare.classes import exceeded_share, hour_not_exceeded
from mitsuba_cfs.metrics.en17037 import median_diffuse
from mitsuba_cfs.metrics.schedules import daylight_hours, lm83_hours
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.sunlight import SunExposure
from scenes.comply.view_out import ViewOut
from scenes.results import GlareMap

FloatArray = NDArray[np.float64]

EQUINOXES = ((3, 21), (9, 21))
EQUINOX_DAYS = 15  # before and after


@dataclass(frozen=True, slots=True)
class GridLight:
    """The year's light on one grid of sensors."""

    points: FloatArray  # [S, 3] [m]
    open: NDArray[np.float32]  # [H, S] [lx] every window in its open state
    direct: NDArray[np.float32]  # [H, S] [lx] straight from the sun, open
    factor: FloatArray  # [S] daylight factor, 0 to 1, open
    operated: NDArray[np.float32] | None = None  # [H, S] [lx] blinds as LM-83 moves them
    closed: NDArray[np.bool_] | None = None  # [H, G] when the blinds of each group are closed
    free: NDArray[np.bool_] | None = None  # [H, G] when one sees out through each group

    def hours_at_points(self, lux: float, step_h: float) -> FloatArray:
        """Hours [S] in which each point gets an illuminance with every window open."""
        return step_h * np.count_nonzero(self.open >= lux, axis=0)


@dataclass(frozen=True, slots=True)
class Calendar:
    """The hours of a weather file that rules count."""

    daylight: NDArray[np.bool_]  # [H] EN 17037
    ten: NDArray[np.bool_]  # [H] LM-83
    times: pd.DatetimeIndex  # [H] middle of each interval
    clear_days: tuple[pd.Timestamp, ...]  # the clearest round each equinox
    step_h: float
    median_diffuse: float | None  # outdoors in the daylight hours [lx]; None where it is 0
    stated_illuminance: bool = True  # from the weather file, not from its irradiance

    def clear_hours(self, clock: int) -> NDArray[np.int64]:
        """Time steps whose interval begins or ends at a clock hour of the clear days."""
        hours = []
        for day in self.clear_days:
            moment = day + pd.Timedelta(hours=clock)
            near = np.abs((self.times - moment) / pd.Timedelta(hours=1)) <= self.step_h / 2 + 1e-6
            hours.append(np.flatnonzero(near))
        return np.concatenate(hours)


@dataclass(frozen=True, slots=True)
class SeatGlare:
    """Glare of the seats of a room in the hours of use."""

    eyes: FloatArray  # [V, 3] [m]
    directions: FloatArray  # [V, 3] unit vectors
    dgp: FloatArray  # [V, N] daylight glare probability, 0 in the dark
    operated: bool  # blinds moved, else open all year
    plan: GlareMap | None = None  # whose worst seats these are; None: the seats were stated
    pictured: NDArray[np.int64] | None = None  # [V] hours of use rated by pictures; None: all

    def exceeded(self, limit: float) -> float:
        """Share (0 to 1) of the hours above a limit at the seat that has most of them."""
        return max(exceeded_share(row, limit) for row in self.dgp)

    def not_exceeded(self) -> FloatArray:
        """DGP [V] that is exceeded in 5 % of the hours of use."""
        return np.array([hour_not_exceeded(row) for row in self.dgp])


@dataclass(frozen=True, slots=True)
class EyeLight:
    """Illuminance and melanopic EDI [lx] at the eye of a seat, in the direction of its view."""

    daylight: FloatArray  # [2, H]
    lamps: FloatArray | None  # [2] at full power; None where no spectrum of lamps is stated
    occupied: NDArray[np.bool_]  # [H] the hours of use


@dataclass(frozen=True, slots=True)
class RoomHeat:
    """The temperatures of a room without heating and cooling."""

    operative_c: FloatArray  # [H]
    outdoor_c: FloatArray  # [H]
    occupied: NDArray[np.bool_]  # [H] the hours of use


@dataclass(frozen=True, slots=True)
class Findings:
    """What was computed of a room; None is not computed."""

    calendar: Calendar
    light: GridLight | None = None  # on the grid of the rules that look at it
    view: ViewOut | None = None
    sun: SunExposure | None = None
    glare: SeatGlare | None = None
    heat: RoomHeat | None = None
    eye: EyeLight | None = None

    @property
    def daylight_hours(self) -> NDArray[np.bool_]:
        """EN 17037's daylight hours [H]."""
        return self.calendar.daylight

    @property
    def ten_hours(self) -> NDArray[np.bool_]:
        """LM-83's ten hours of every day [H]."""
        return self.calendar.ten

    @property
    def step_h(self) -> float:
        """Length of a time step [h]."""
        return self.calendar.step_h

    @property
    def median_diffuse(self) -> float | None:
        """Median diffuse horizontal illuminance outdoors over the daylight hours [lx]; None where it is 0."""
        return self.calendar.median_diffuse

    def clear_hours(self, clock: int) -> NDArray[np.int64]:
        """Time steps before and after a clock hour on the clear days round the equinoxes."""
        return self.calendar.clear_hours(clock)


def calendar_of(weather: Weather) -> Calendar:
    """The hours that rules count.

    The clear day of an equinox is the one of the 15 days before and after with most direct normal
    irradiation.
    """
    times, daylight = weather.midpoints, daylight_hours(weather)
    year = times[0].year
    days = []
    for month, day in EQUINOXES:
        middle = pd.Timestamp(year, month, day)
        near = np.abs((times.normalize() - middle) / pd.Timedelta(days=1)) <= EQUINOX_DAYS
        sums = pd.Series(weather.direct_normal[near], index=times[near].normalize())
        days.append(sums.groupby(level=0).sum().idxmax())
    diffuse = weather.diffuse_horizontal_illuminance
    median = median_diffuse(sky_series(weather).diffuse_horizontal if diffuse is None else diffuse, daylight)
    hours = lm83_hours(weather)
    return Calendar(daylight, hours, times, tuple(days), weather.step_h, median or None, diffuse is not None)
