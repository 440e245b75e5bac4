"""A year of operation as a run tells it: shading states, heating, cooling, lamps."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from mitsuba_cfs.sky.weather import Weather
from scenes.results import OperationResult
from scenes.room.zone import RoomZone
from thermal.balance import ZoneResult


def operation_result(
    room: RoomZone, balance: ZoneResult, weather: Weather, states: Sequence[str], rule: str
) -> OperationResult:
    """What control, heating, cooling and lamps did.

    Args: states: names of the shading states; rule: of their control.
    """
    hours = pd.DataFrame(
        {
            "shading_state": room.state,
            "heating_w": balance.heating,
            "cooling_w": balance.cooling,
            "lighting_w": room.lamps,
        },
        index=weather.midpoints,
    ).rename_axis("time")
    summary = {
        "heating_kwh": balance.heating.sum() / 1e3,
        "cooling_kwh": balance.cooling.sum() / 1e3,
        "lighting_kwh": room.lamps.sum() / 1e3,
        "peak_heating_w": balance.heating.max(),
        "peak_cooling_w": balance.cooling.max(),
    }
    summary = {key: float(value) for key, value in summary.items()}
    return OperationResult(tuple(states), hours, summary, rule)
