"""Daylight metrics of a room as the tables of a run: names of columns, shares in per cent."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.metrics.room import room_metrics
from mitsuba_cfs.sky.weather import Weather
from scenes.provision_levels import level_number

SENSOR_COLUMNS = {  # column of a run: (column of the library, factor)
    "da300": ("daylight_autonomy", 100.0),
    "cda300": ("continuous_daylight_autonomy", 100.0),
    "udi_below_100": ("udi_below_100", 100.0),
    "udi_100_300": ("udi_100_300", 100.0),
    "udi_300_3000": ("udi_300_3000", 100.0),
    "udi_above_3000": ("udi_above_3000", 100.0),
    "udi_100_2000": ("udi_100_2000", 100.0),
    "mean_illuminance_lx": ("mean_illuminance_lx", 1.0),
}
ROOM_COLUMNS = {
    **SENSOR_COLUMNS,
    "sda300_50": ("spatial_daylight_autonomy", 100.0),
    "en17037_target_lx": ("en17037_target_lx", 1.0),
    "en17037_minimum_lx": ("en17037_minimum_lx", 1.0),
}


def daylight_metrics(
    points: NDArray[np.float64],
    illuminance: NDArray[np.float32],
    daylight_factor: NDArray[np.float64],
    weather: Weather,
    direct: NDArray[np.float32] | None = None,
) -> tuple[pd.DataFrame, dict[str, float]]:
    """Metrics by sensor (a table with the positions) and of the room, shares in per cent.

    Args:
        points: [S, 3]; illuminance: [H, S] [lx]; daylight_factor: [S] 0 to 1.
        direct: [H, S] [lx] straight from the sun, for annual sunlight exposure.
    """
    metrics = room_metrics(illuminance, weather, direct_illuminance=direct)
    found = metrics.by_sensor()
    table = pd.DataFrame(points, columns=["x", "y", "z"]).rename_axis("sensor")
    for column, (source, factor) in SENSOR_COLUMNS.items():
        table[column] = factor * found[source].to_numpy()
    if metrics.sunlit_hours is not None:
        table["sunlit_hours"] = metrics.sunlit_hours
    table["daylight_factor"] = 100.0 * daylight_factor
    of_room = metrics.of_room()
    room = {column: factor * of_room[source] for column, (source, factor) in ROOM_COLUMNS.items()}
    if metrics.annual_sunlight_exposure is not None:
        room["ase1000_250"] = 100.0 * metrics.annual_sunlight_exposure
    room["daylight_factor"] = 100.0 * float(np.mean(daylight_factor))
    room["en17037_level"] = float(level_number(metrics.daylight_provision))
    return table, room
