"""Loads of design days: steady cold without sun and gains, and the year's hot and sunny days."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.weather import Weather
from scenes.room.zone import RoomZone, climate, per_window
from thermal.balance import BalanceOptions, simulate_zones
from thermal.climate import Climate, no_sun
from thermal.ventilation import AirTransfer
from thermal.zone import Gains, Zone

FloatArray = NDArray[np.float64]
T = TypeVar("T")
COLD = 0.4  # percent of the hours that are colder: ASHRAE's 99.6 % heating design temperature
CANDIDATES = 3  # hottest days by outdoor mean, as many by the rooms' sun


def design_loads(
    rooms: Sequence[RoomZone],
    weather: Weather,
    *,
    outdoor_c: float | None,
    step_s: float,
    air_links: FloatArray | None = None,
    transfers: Sequence[AirTransfer] = (),
    terrain: str = "suburbs",
) -> pd.DataFrame:
    """Peak loads of rooms, each day repeated until it ends as it began, without limits.

    Args: outdoor_c: of the cold day; None: the weather's, that 0.4 % of the hours lie below.

    Returns: one row per room and case: day, outdoor mean and extreme [degC], peak [W] and its hour.
    """
    whole, hours, day_rows = climate(weather), len(weather.times), weather.per_day
    zones = [_unlimited(room.zone) for room in rooms]
    row_s = 3600.0 * weather.step_h
    options = {"step_s": min(step_s, row_s), "row_s": row_s, "air_links": air_links}
    options["options"] = BalanceOptions(terrain=terrain)
    cold = float(np.percentile(weather.dry_bulb_c, COLD)) if outdoor_c is None else outdoor_c
    first = np.arange(day_rows)
    used = day_rows * _aired_day(zones, hours, day_rows) + first
    calm = [replace(of_hours(zone, used, hours), gains=Gains(), loads=_warmest(zone)) for zone in zones]
    dark = [no_sun(day_rows, len(zone.surfaces), len(zone.windows)) for zone in zones]
    moved = [of_hours(one, used, hours) for one in transfers]
    results = simulate_zones(calm, _steady(whole, cold, day_rows), dark, transfers=moved, **options)
    rows = [
        {
            "room": r.name,
            "case": "heating",
            "day": "",
            "outdoor_mean_c": cold,
            "outdoor_extreme_c": cold,
            "peak_w": r.heating.max() + r.slab.max() + r.coil.max(),
            "peak_hour": float("nan"),
        }
        for r in results
    ]
    best: dict[str, dict[str, Any]] = {}
    for day in _hot_days(rooms, weather, day_rows):
        chosen = day_rows * day + first
        suns = [of_hours(per_window(r.solar, r.zone), chosen, hours) for r in rooms]
        results = simulate_zones(
            [of_hours(zone, chosen, hours) for zone in zones],
            of_hours(whole, chosen, hours),
            suns,
            transfers=[of_hours(one, chosen, hours) for one in transfers],
            controls=[of_hours(room.control, chosen, hours) for room in rooms],
            **options,
        )
        outdoor = weather.dry_bulb_c[chosen]
        for r in results:
            load = r.cooling + np.maximum(-r.slab, 0.0)
            if r.name not in best or load.max() > best[r.name]["peak_w"]:
                best[r.name] = {
                    "room": r.name,
                    "case": "cooling",
                    "day": weather.midpoints[chosen[0]].strftime("%m-%d"),
                    "outdoor_mean_c": outdoor.mean(),
                    "outdoor_extreme_c": outdoor.max(),
                    "peak_w": load.max(),
                    "peak_hour": float(np.argmax(load) + 1) * weather.step_h,
                }
    table = pd.DataFrame([*rows, *best.values()])
    area = {room.zone.name: room.space.floor_area for room in rooms}
    return table.assign(peak_w_m2=table["peak_w"] / table["room"].map(area))


def of_hours(value: T, chosen: NDArray[np.int64], hours: int) -> T:
    """Frozen data with the chosen hours of every array over the hours [H, ...] in it."""
    if isinstance(value, np.ndarray):
        return value[chosen] if value.shape[:1] == (hours,) else value
    if isinstance(value, tuple):
        return tuple(of_hours(one, chosen, hours) for one in value)
    if is_dataclass(value) and not isinstance(value, type):
        parts = {f.name: getattr(value, f.name) for f in fields(value) if f.init}
        return replace(value, **{k: of_hours(v, chosen, hours) for k, v in parts.items()})
    return value


def _aired_day(zones: Sequence[Zone], hours: int, rows: int) -> int:
    """The first day on which fans bring most: the year may begin with a holiday without."""
    air = np.zeros(hours)
    for zone in zones:
        if zone.supply is not None:
            air += zone.volume * np.broadcast_to(zone.supply.ach, hours)
    days = hours // rows
    return int(np.argmax(air[: rows * days].reshape(days, rows).sum(axis=1)))


def _hot_days(rooms: Sequence[RoomZone], weather: Weather, rows: int) -> list[int]:
    """The days with the warmest means and those with most sun in the rooms."""
    days = len(weather.times) // rows
    warm = weather.dry_bulb_c[: rows * days].reshape(days, rows).mean(axis=1)
    sun = sum(room.solar.inside.sum(axis=1) for room in rooms)[: rows * days]
    sunny = sun.reshape(days, rows).sum(axis=1)
    candidates = [*np.argsort(-warm)[:CANDIDATES], *np.argsort(-sunny)[:CANDIDATES]]
    return sorted({int(day) for day in candidates})


def _unlimited(zone: Zone) -> Zone:
    loads = replace(zone.loads, heating_limit=np.inf, cooling_limit=np.inf)
    return replace(zone, loads=loads)


def _warmest(zone: Zone):
    """The zone's plant with its highest heating set point all day, and no cooling."""
    return replace(zone.loads, heating_c=float(np.max(zone.loads.heating_c)), cooling_c=float("inf"))


def _steady(whole: Climate, outdoor_c: float, rows: int) -> Climate:
    """A day of one temperature, overcast, with the year's mean wind."""
    one = np.ones(rows)
    return Climate(
        outdoor_c=outdoor_c * one,
        sky_c=outdoor_c * one,
        wind_speed=whole.wind_speed.mean() * one,
        wind_direction_deg=0.0 * one,
        ground_c=whole.ground_c.min() * one,
        pressure=whole.pressure.mean() * one,
    )
