"""Daylight of a room: its scene, the illuminance of its year, and the metrics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.path_light import PathSystems
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.metrics.daylight_factor import daylight_factor
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.weather import Weather
from scenes.results import DaylightResult
from scenes.room.inner_glass import InnerGlass
from scenes.room.metrics import daylight_metrics
from scenes.room.options import SensorGrid
from scenes.room.windows import RoomWindows


def room_scene(
    building: Building,
    space: Space,
    windows: RoomWindows,
    grids: Sequence[SensorGrid],
    picture_size: int,
    inner: InnerGlass | None = None,
) -> DaylightScene:
    """Triangles, window groups, sensors and view of a room in the visible band.

    Args:
        grids: of the sensors, one after the other.
        picture_size: pixels of a side of the view.
        inner: the glass to other rooms that gives light; without it that is opaque.
    """
    points = np.concatenate([grid_points(space, grid) for grid in grids])
    position, direction = view_point(space)
    return DaylightScene(
        furnished_surfaces(space, "visible") if inner is None else inner.interior,
        exterior_surfaces(building, space, "visible"),
        [*windows.groups, *(() if inner is None else inner.groups)],
        points,
        np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        fisheye(position, direction, picture_size),
        () if inner is None else inner.beyond,
    )


def grid_points(space: Space, grid: SensorGrid) -> NDArray[np.float64]:
    """Sensors [S, 3] of a grid in a room [m]."""
    return sensor_grid(space, spacing=grid.spacing, height=grid.height, margin=grid.margin)[0]


def room_daylight(
    light: PhaseLight,
    state: NDArray[np.int64],
    weather: Weather,
    method: str,
    progress: Progress,
) -> DaylightResult:
    """Illuminance of the year with the state of each hour, and its metrics.

    Args: state: [L] which one holds in each lit hour.
    """
    sky, traced = light.sky, light.filled.traced
    scene, sampling = traced.scene, traced.sampling
    if method == "point-in-time":
        filled = PathSystems(scene, light.filled.systems, sampling)
        lit, error = filled.light(sky, progress=progress).estimate(state)
    else:
        lit, error = light.illuminance(state), light.relative_error(state)
    illuminance = sky.whole_year(lit.astype(np.float32)).T
    # LM-83's direct sun and the daylight factor are those of open blinds
    direct = light.direct_sun()
    direct = None if direct is None else sky.whole_year(direct.astype(np.float32)).T
    factor = overcast_factor(light)
    table, of_room = daylight_metrics(scene.points, illuminance, factor, weather, direct)
    return DaylightResult(scene.points, illuminance, error, table, of_room)


def overcast_factor(light: PhaseLight) -> NDArray[np.float64]:
    """Daylight factor of the sensors [S] (0 to 1) with every window in its first state."""
    subdivision = light.filled.traced.sampling.subdivision
    overcast = cie_patches("overcast", ReinhartSky(subdivision), 1.0)
    return daylight_factor(light.filled.coefficients() @ overcast, 1.0)


def illuminance_table(result: DaylightResult, times: pd.DatetimeIndex) -> pd.DataFrame:
    """Illuminance [H, S] with the sensors' numbers as columns."""
    columns = [f"sensor_{i}" for i in range(len(result.points))]
    return pd.DataFrame(result.illuminance, index=times, columns=columns).rename_axis("time")
