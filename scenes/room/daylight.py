"""Daylight of a room: its scene, the illuminance of its year, and the metrics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.held_sensors import HeldGrid
from bim.model import Building, Space
from bim.sensors import held_grids, held_views, sensor_grid, view_point
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.images.view import View, fisheye, fitted
from mitsuba_cfs.methods.light import (
    SeasonalLight,
    daylight_coefficients,
    direct_sun,
    illuminance_with_error,
    path_light_of,
)
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.metrics.daylight_factor import daylight_factor
from mitsuba_cfs.metrics.room import room_metrics
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.weather import Weather
from scenes.provision_levels import level_number
from scenes.results import DaylightResult, GridDaylight
from scenes.room.inner_glass import InnerGlass
from scenes.room.options import SensorGrid
from scenes.room.windows import RoomWindows


@dataclass(frozen=True, slots=True)
class HeldSensors:
    """What the building's file holds for a room: sensor grids, and the view for glare."""

    grids: tuple[HeldGrid, ...] = ()
    view: View | None = None  # the first fisheye of the whole hemisphere

    @classmethod
    def of(cls, building: Building, space: Space) -> HeldSensors:
        """Those of a room."""
        fisheyes = [one.view for one in held_views(building, space) if one.view.covers_hemisphere]
        return cls(tuple(held_grids(building, space)), fisheyes[0] if fisheyes else None)


NO_SENSORS = HeldSensors()


def room_scene(
    building: Building,
    space: Space,
    windows: RoomWindows,
    grids: Sequence[SensorGrid],
    picture_size: int,
    *,
    inner: InnerGlass | None = None,
    held: HeldSensors = NO_SENSORS,
) -> DaylightScene:
    """Triangles, window groups, sensors and view of a room in the visible band.

    Args:
        grids: of the sensors, one after the other.
        picture_size: pixels of a side of the view.
        inner: the glass to other rooms that gives light; without it that is opaque.
        held: of the building's file: sensors after those of the grids, and the view.
    """
    points = np.concatenate([grid_points(space, grid) for grid in grids])
    upwards = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    position, direction = view_point(space)
    view = fisheye(position, direction, picture_size)
    if held.view is not None:
        view = fitted(held.view, picture_size)
    return DaylightScene(
        furnished_surfaces(space, "visible") if inner is None else inner.interior,
        exterior_surfaces(building, space, "visible"),
        [*windows.groups, *(() if inner is None else inner.groups)],
        np.concatenate([points, *(grid.points for grid in held.grids)]),
        np.concatenate([upwards, *(grid.directions for grid in held.grids)]),
        view,
        () if inner is None else inner.beyond,
    )


def grid_points(space: Space, grid: SensorGrid) -> NDArray[np.float64]:
    """Sensors [S, 3] of a grid in a room [m]."""
    return sensor_grid(space, spacing=grid.spacing, height=grid.height, margin=grid.margin)[0]


def room_daylight(
    light: PhaseLight | SeasonalLight,
    state: NDArray[np.int64],
    weather: Weather,
    method: str,
    progress: Progress,
    *,
    held: HeldSensors = NO_SENSORS,
) -> DaylightResult:
    """Illuminance of the year with the state of each hour, and its metrics.

    Args:
        state: [L] which one holds in each lit hour.
        held: whose grids' sensors come last in the scene.
    """
    sky, scene = light.sky, light.scene
    if method == "point-in-time":
        lit, error = illuminance_with_error(path_light_of(light), state, progress=progress)
    else:
        lit, error = illuminance_with_error(light, state)
    illuminance = sky.whole_year(lit.astype(np.float32)).T
    # LM-83's direct sun and the daylight factor are those of open blinds
    direct = direct_sun(light)
    direct = None if direct is None else sky.whole_year(direct.astype(np.float32)).T
    factor = overcast_factor(light)

    def metrics_of(own: slice) -> tuple[pd.DataFrame, dict[str, float]]:
        sun = None if direct is None else direct[:, own]
        return daylight_metrics(scene.points[own], illuminance[:, own], factor[own], weather, sun)

    counts = [len(grid.points) for grid in held.grids]
    plane = slice(0, len(scene.points) - sum(counts))
    ends = np.cumsum([plane.stop, *counts])
    grids = []
    for grid, first, last in zip(held.grids, ends[:-1], ends[1:], strict=True):
        table, of_grid = metrics_of(slice(first, last))
        table["relative_standard_error"] = error[first:last]
        grids.append(GridDaylight(grid.name, grid.directions, table, of_grid))
    return DaylightResult(
        scene.points[plane], illuminance[:, plane], error[plane], *metrics_of(plane), tuple(grids)
    )


def overcast_factor(light: PhaseLight | SeasonalLight) -> NDArray[np.float64]:
    """Daylight factor of the sensors [S] (0 to 1) with every window in its first state.

    Where the outdoors changes over the year, with most leaves.
    """
    overcast = cie_patches("overcast", ReinhartSky(light.sampling.subdivision), 1.0)
    return daylight_factor(daylight_coefficients(light) @ overcast, 1.0)


def illuminance_table(result: DaylightResult, times: pd.DatetimeIndex) -> pd.DataFrame:
    """Illuminance [H, S] with the sensors' numbers as columns."""
    columns = [f"sensor_{i}" for i in range(len(result.points))]
    return pd.DataFrame(result.illuminance, index=times, columns=columns).rename_axis("time")


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
