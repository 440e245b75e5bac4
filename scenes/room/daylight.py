"""Stage 3 of a room: illuminance of the sensors over the year, and daylight metrics."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.methods.light import (
    SeasonalLight,
    daylight_coefficients,
    direct_sun,
    illuminance_with_noise,
    relative_error_of_mean,
)
from mitsuba_cfs.methods.phase_light import PhaseLight, with_sensor_light
from mitsuba_cfs.methods.standard_error import relative_error_under
from mitsuba_cfs.methods.sun_by_patches import sunny_hour_error
from mitsuba_cfs.metrics.autonomy import daylight_autonomy_noise
from mitsuba_cfs.metrics.lm83 import spatial_daylight_autonomy_error
from mitsuba_cfs.metrics.noise import Noise
from mitsuba_cfs.metrics.room import daylight_factor, room_metrics
from mitsuba_cfs.metrics.schedules import Mask, daylight_hours, lm83_hours
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.weather import Weather
from scenes.provision_levels import level_number
from scenes.results import SUNNY_HOUR_ERROR, DaylightResult, GridDaylight
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight, picture_light


def room_daylight(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    *,
    sunny_hours: bool = True,
    progress: Progress = silent,
) -> DaylightResult:
    """Illuminance of the year with the shading states of each hour [H, G], and its metrics.

    Args: sunny_hours: with the three-phase method, state its error in hours with sun.
    """
    progress("daylight", 0.0)
    lights, lit_state, points = light.light, light.states(state), light.scene.points
    traced = picture_light(room, light)
    lit, noise = illuminance_with_noise(traced, lit_state, progress=part(progress, 0.9, 1.0, "daylight"))
    illuminance = room.skies.whole_year(lit.astype(np.float32)).T
    error = relative_error_of_mean(lit, noise)
    autonomy_noise = daylight_autonomy_noise(
        illuminance,
        room.skies.once(lm83_hours, room.weather),
        lambda weights: noise(weights[lights.sky.lit].T),
        relative_error=error,
    )
    blurred = None
    if room.options.method == "three-phase" and sunny_hours:
        blurred = 100.0 * sunny_hour_error(lights, lit_state, lit)
    # LM-83's direct sun and the daylight factor are those of open blinds
    direct = direct_sun(lights)
    direct = None if direct is None else room.skies.whole_year(direct.astype(np.float32)).T
    factor, factor_error = overcast_factor(lights), overcast_factor_error(lights)

    def metrics_of(sensors: slice) -> tuple[pd.DataFrame, dict[str, float]]:
        sun = None if direct is None else direct[:, sensors]
        table, of_room = daylight_metrics(
            points[sensors],
            illuminance[:, sensors],
            factor[sensors],
            room.weather,
            sun,
            autonomy_noise=autonomy_noise.part(sensors),
            half=room.skies.once(daylight_hours, room.weather),
        )
        table["daylight_factor_standard_error"] = 100.0 * factor_error[sensors]
        if blurred is not None:
            table[SUNNY_HOUR_ERROR] = blurred[sensors]
        return table, of_room

    counts = [len(grid.points) for grid in room.file_sensors.grids]
    plane = slice(0, len(points) - room.other_sensors)
    ends = np.cumsum([plane.stop, *counts])
    grids = []
    for grid, first, last in zip(room.file_sensors.grids, ends[:-1], ends[1:], strict=True):
        table, of_grid = metrics_of(slice(first, last))
        table["relative_standard_error"] = error[first:last]
        grids.append(GridDaylight(grid.name, grid.directions, table, of_grid))
    result = DaylightResult(points[plane], illuminance[:, plane], error[plane], *metrics_of(plane), tuple(grids))
    progress("daylight", 1.0)
    return result


def overcast_factor(light: PhaseLight | SeasonalLight) -> NDArray[np.float64]:
    """Daylight factor of the sensors [S] (0 to 1) with every window in its first state.

    With trees that change over the year: of the season with the most leaves.
    """
    overcast = cie_patches("overcast", ReinhartSky(light.sampling.subdivision), 1.0)
    return daylight_factor(daylight_coefficients(light) @ overcast, 1.0)


def overcast_factor_error(light: PhaseLight | SeasonalLight) -> NDArray[np.float64]:
    """Standard error of `overcast_factor` by the noise of V and D [S] (0 to 1)."""
    first = light.lights[0] if isinstance(light, SeasonalLight) else light
    if not isinstance(first, PhaseLight):
        raise ValueError("path tracing has no matrices: expected the light of a phase method")
    overcast = cie_patches("overcast", ReinhartSky(light.sampling.subdivision), 1.0)
    relative = relative_error_under(with_sensor_light(first), overcast)
    return relative * overcast_factor(light)


SENSOR_COLUMNS = {  # column of a run: column of the library
    "da300": "daylight_autonomy",
    "cda300": "continuous_daylight_autonomy",
    **{
        name: name
        for name in (
            "udi_below_100",
            "udi_100_300",
            "udi_300_3000",
            "udi_above_3000",
            "udi_100_2000",
            "mean_illuminance_lx",
        )
    },
}
ROOM_COLUMNS = {
    **SENSOR_COLUMNS,
    "sda300_50": "spatial_daylight_autonomy",
    "en17037_target_lx": "en17037_target_lx",
    "en17037_minimum_lx": "en17037_minimum_lx",
}


def daylight_metrics(
    points: NDArray[np.float64],
    illuminance: NDArray[np.float32],
    daylight_factor: NDArray[np.float64],
    weather: Weather,
    direct: NDArray[np.float32] | None = None,
    *,
    autonomy_noise: Noise,
    half: Mask | None = None,
) -> tuple[pd.DataFrame, dict[str, float]]:
    """Metrics by sensor (a table with the positions) and of the room, shares in per cent.

    Args:
        points: [S, 3]; illuminance: [H, S] [lx]; daylight_factor: [S] 0 to 1.
        direct: [H, S] [lx] straight from the sun, for annual sunlight exposure.
        autonomy_noise: [S] of DA.
        half: [H] EN 17037's daylight hours, where they are known.
    """
    metrics = room_metrics(illuminance, weather, direct_illuminance=direct, daylight_hours=half)
    by_sensor = metrics.by_sensor()
    table = pd.DataFrame(points, columns=["x", "y", "z"]).rename_axis("sensor")
    for column, source in SENSOR_COLUMNS.items():
        table[column] = by_sensor[source].to_numpy()
    table["da300_standard_error"] = 100.0 * autonomy_noise.standard_error()
    if metrics.sunlit_hours is not None:
        table["sunlit_hours"] = metrics.sunlit_hours
    table["daylight_factor"] = 100.0 * daylight_factor
    of_room = metrics.of_room()
    room = {column: of_room[source] for column, source in ROOM_COLUMNS.items()}
    room["sda300_50_standard_error"] = 100.0 * spatial_daylight_autonomy_error(
        metrics.daylight_autonomy / 100.0, autonomy_noise, areas=metrics.areas
    )
    if metrics.annual_sunlight_exposure is not None:
        room["ase1000_250"] = metrics.annual_sunlight_exposure
    room["daylight_factor"] = 100.0 * float(np.mean(daylight_factor))
    room["en17037_level"] = float(level_number(metrics.daylight_provision))
    return table, room
