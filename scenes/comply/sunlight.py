"""Exposure to sunlight of EN 17037: hours of possible sun at the openings of a room on one day."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from mitsuba_cfs.sky.sun import day_of_sun
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.openings import Opening, openings_of
from scenes.comply.outdoors import OutdoorMesh, opaque_room

FloatArray = NDArray[np.float64]
Intervals = list[tuple[float, float]]  # minutes of the day, local standard time

ABOVE_FLOOR, ABOVE_SILL = 1.2, 0.3  # of the reference point, whichever is higher [m]
HALVINGS = 7  # of a minute in which the sun comes or goes: half a second


@dataclass(frozen=True, slots=True)
class SunDay:
    """The sun's way over one day, minute by minute."""

    day: pd.Timestamp
    directions: FloatArray  # [1441, 3] unit vectors to the sun
    least_altitude: float  # below it the sun does not count [rad]

    def at(self, minutes: FloatArray) -> FloatArray:
        """Directions [N, 3] at minutes of the day; within a minute the sun goes straight on."""
        before = np.clip(np.floor(minutes).astype(int), 0, len(self.directions) - 2)
        share = (minutes - before)[:, None]
        direction = (1 - share) * self.directions[before] + share * self.directions[before + 1]
        return direction / np.linalg.norm(direction, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True)
class SunlitOpening:
    """An opening's reference point and when the sun may shine on it."""

    name: str
    guid: str
    point: FloatArray  # [3] [m]
    times: tuple[tuple[float, float], ...]  # minutes of the day, from and to

    @property
    def hours(self) -> float:
        """Hours of sun."""
        return total_hours(self.times)


@dataclass(frozen=True, slots=True)
class SunExposure:
    """The sunlight of a room: each opening's, and the time in which any of them has sun."""

    openings: tuple[SunlitOpening, ...]
    times: tuple[tuple[float, float], ...]  # minutes of the day

    @property
    def hours(self) -> float:
        """Hours with sun at any opening: what comes at the same time counts once."""
        return total_hours(self.times)


def sun_day(weather: Weather, month: int, day: int, least_altitude_deg: float) -> SunDay:
    """The sun over a day of the weather's place and year.

    Args: least_altitude_deg: above the horizon, as the standard gives it for a country.
    """
    date = pd.Timestamp(weather.midpoints[0].year, month, day)
    directions = day_of_sun(weather, date)
    return SunDay(date, directions, float(np.radians(least_altitude_deg)))


def sun_exposure(space: Space, outdoors: OutdoorMesh, day: SunDay) -> SunExposure:
    """Hours of sun at the reference points of a room's openings on a cloudless day.

    The reference point is on the inner surface of the wall in the middle of the opening's width,
    1.2 m above the floor and 0.3 m above the sill at the least; of a rooflight its middle.  The sun
    is a point there; walls, reveals and all that stands outdoors hide it, glazing bars do not.

    Source: EN 17037:2018+A1:2021, 5.3 and annex D.
    """
    room, own = opaque_room(space), outdoors.windows_of(space)
    openings = []
    for opening in openings_of(space):
        point = reference_point(opening, space.floor_level)

        def sees(
            minutes: FloatArray, point: FloatArray = point, normal: FloatArray = opening.normal
        ) -> NDArray[np.bool_]:
            suns = day.at(minutes)
            lit = (suns[:, 2] >= np.sin(day.least_altitude)) & (suns @ normal > 0)
            rays = suns[lit]
            origins = np.tile(point, (len(rays), 1))
            free = ~np.isfinite(room.first_hits(origins, rays)[0])
            free[free] = ~np.isfinite(outdoors.first_hits(origins[free], rays[free], own)[0])
            lit[lit] = free
            return lit

        window = opening.window
        times = tuple(true_intervals(sees, 0.0, float(len(day.directions) - 1)))
        openings.append(SunlitOpening(window.name or window.guid, window.guid, point, times))
    return SunExposure(tuple(openings), tuple(united([one.times for one in openings])))


def reference_point(opening: Opening, floor: float) -> FloatArray:
    """Point [3] [m] of an opening at which its sunlight is counted."""
    if opening.is_horizontal:
        point = opening.centre
    else:
        height = max(floor + ABOVE_FLOOR, opening.sill + ABOVE_SILL)
        point = opening.at(np.zeros(1), np.array([height]))[0]
    return point - opening.recess * opening.normal


def true_intervals(condition: Callable[[FloatArray], NDArray[np.bool_]], start: float, end: float) -> Intervals:
    """When a condition of the minutes [N] holds: looked at each minute, its changes then halved.

    What comes and goes within one minute is not seen.
    """
    minutes = np.arange(start, end + 0.5)
    holds = condition(minutes)
    changes = np.flatnonzero(holds[1:] != holds[:-1])
    low, high = minutes[changes].copy(), minutes[changes + 1].copy()
    for _ in range(HALVINGS if len(changes) else 0):
        middle = 0.5 * (low + high)
        same = condition(middle) == holds[changes]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    edges = [*([start] if holds[0] else []), *(0.5 * (low + high)), *([end] if holds[-1] else [])]
    return [(float(a), float(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def united(parts: Sequence[Sequence[tuple[float, float]]]) -> Intervals:
    """The intervals in which any of some lists of intervals lies."""
    found: Intervals = []
    for start, end in sorted(interval for part in parts for interval in part):
        if found and start <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], end))
        else:
            found.append((start, end))
    return found


def total_hours(times: Sequence[tuple[float, float]]) -> float:
    """Sum of intervals in minutes, in hours."""
    return sum(end - start for start, end in times) / 60.0
