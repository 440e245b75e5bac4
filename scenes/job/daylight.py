"""Daylight of a room: its three-phase matrices, the illuminance of a year, and the metrics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs import phases
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.metrics.daylight_factor import daylight_factor
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
from mitsuba_cfs.trace.estimate import Estimate, Stopping
from mitsuba_cfs.trace.view_matrix import view_matrix
from scenes.job.inputs import System
from scenes.job.metrics import daylight_metrics
from scenes.job.options import JobOptions
from scenes.results import DaylightResult

BATCHES = 8  # independent repetitions that the standard errors come from


@dataclass(frozen=True, slots=True)
class Skies:
    """The sky of a year in both bands, for the hours when the sun is up."""

    visible: NDArray[np.float32]  # [P, L] luminance [cd/m2]
    solar: NDArray[np.float32]  # [P, L] radiance [W/m2/sr]
    lit: NDArray[np.int64]  # [L] which hours of the year
    hours: int  # H

    def whole_year(self, values: NDArray) -> NDArray:
        """Values [..., L] of the lit hours as values [..., H] of all, dark ones 0."""
        full = np.zeros((*values.shape[:-1], self.hours), dtype=values.dtype)
        full[..., self.lit] = values
        return full


@dataclass(frozen=True, slots=True)
class RoomScene:
    """What is traced of one room, and from where it is looked at."""

    interior: Surfaces
    exterior: Surfaces
    groups: list[WindowGroup]
    points: NDArray[np.float64]  # [S, 3] work plane
    view: View


def room_scene(building: Building, space: Space, options: JobOptions) -> RoomScene:
    """Triangles, window groups, sensors and view of a room in the visible band."""
    points, _ = sensor_grid(
        space,
        spacing=options.sensor_spacing,
        height=options.sensor_height,
        margin=options.sensor_margin,
    )
    position, direction = view_point(space)
    return RoomScene(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        window_groups(space),
        points,
        fisheye(position, direction, options.picture_size),
    )


def room_daylight(
    scene: RoomScene,
    system: System,
    skies: Skies,
    weather: Weather,
    options: JobOptions,
    progress: Progress,
) -> tuple[DaylightResult, NDArray[np.float32], NDArray[np.float32]]:
    """Illuminance of the work plane, room-side window luminance [G, K, L] and eye illuminance [L].

    The eye's vertical illuminance is traced as one more sensor at the view point.
    """
    stopping = Stopping(batches=BATCHES)
    daylight = daylight_matrix(
        scene.exterior,
        scene.groups,
        subdivision=options.sky_subdivision,
        samples=max(options.patch_samples // BATCHES, 1),
        stopping=stopping,
        seed=options.seed,
        progress=part(progress, 0.0, 0.3, "daylight"),
    )
    eye = np.asarray(scene.view.position)[None]
    up = np.tile([0.0, 0.0, 1.0], (len(scene.points), 1))
    view = view_matrix(
        scene.interior,
        scene.groups,
        np.concatenate([scene.points, eye]),
        np.concatenate([up, np.asarray(scene.view.direction)[None]]),
        samples=max(options.sensor_samples // BATCHES, 1),
        stopping=stopping,
        seed=options.seed,
        progress=part(progress, 0.3, 0.9, "daylight"),
    )
    transmission = [system.visible.transmission_matrix()] * len(scene.groups)
    luminance = phases.room_side_radiance(transmission, daylight.values, skies.visible)
    lit = np.einsum("sgk,gkl->sl", view.values, luminance, optimize=True)
    illuminance = skies.whole_year(lit[:-1].astype(np.float32)).T
    coefficients = np.einsum(
        "sgk,gkp->sp",
        view.values[:-1],
        np.stack([t @ d for t, d in zip(transmission, daylight.values, strict=True)]),
        optimize=True,
    )
    table, of_room = daylight_metrics(
        scene.points, illuminance, _daylight_factor(coefficients, options), weather
    )
    error = _relative_error(view, luminance)[:-1]
    result = DaylightResult(scene.points, illuminance, error, table, of_room)
    progress("daylight", 1.0)
    return result, luminance.astype(np.float32), lit[-1].astype(np.float32)


def _daylight_factor(coefficients: NDArray, options: JobOptions) -> NDArray[np.float64]:
    """Daylight factor [S] (0 to 1) under the CIE overcast sky, the ground reflecting 0.2 of it.

    Args: coefficients: [S, P] illuminance per unit luminance of a sky patch, V T D.
    """
    overcast = cie_patches("overcast", ReinhartSky(options.sky_subdivision), 1.0)
    return daylight_factor(coefficients @ overcast, 1.0)


def _relative_error(view: Estimate, luminance: NDArray) -> NDArray[np.float64]:
    """Standard error of each sensor's annual mean [S], relative, from the tracing of V.

    The errors of different window groups are taken as independent.
    """
    mean = luminance.mean(axis=-1)
    value = np.einsum("sgk,gk->s", view.values, mean)
    error = np.sqrt((view.error_of(mean) ** 2).sum(axis=-1))
    return np.divide(error, value, out=np.zeros_like(error), where=value > 0)


def illuminance_table(result: DaylightResult, times: pd.DatetimeIndex) -> pd.DataFrame:
    """Illuminance [H, S] with the sensors' numbers as columns."""
    columns = [f"sensor_{i}" for i in range(len(result.points))]
    return pd.DataFrame(result.illuminance, index=times, columns=columns).rename_axis("time")
