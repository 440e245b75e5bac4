"""Daylight of a room: its matrices, the illuminance of a year by each method, and the metrics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.metrics.daylight_factor import daylight_factor
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
from mitsuba_cfs.trace.direct_sun import Scattering, patch_beams, through_beams
from mitsuba_cfs.trace.estimate import Estimate, Stopping
from mitsuba_cfs.trace.systems import sun_scattering
from mitsuba_cfs.trace.view_matrix import view_matrix
from scenes.job.direct import direct_sun
from scenes.job.metrics import daylight_metrics
from scenes.job.options import RoomOptions
from scenes.job.paths import path_illuminance
from scenes.job.skies import Skies
from scenes.job.windows import RoomWindows, States, room_windows
from scenes.results import DaylightResult

BATCHES = 8  # independent repetitions that the standard errors come from


@dataclass(frozen=True, slots=True)
class RoomScene:
    """What is traced of one room, and from where it is looked at."""

    interior: Surfaces
    exterior: Surfaces
    windows: RoomWindows
    points: NDArray[np.float64]  # [S, 3] work plane
    view: View

    @property
    def groups(self) -> list[WindowGroup]:
        """The window groups (axis G)."""
        return self.windows.groups

    def sensors(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and directions [S + 1, 3]: the work plane, and the eye as one more sensor."""
        up = np.tile([0.0, 0.0, 1.0], (len(self.points), 1))
        return (
            np.concatenate([self.points, np.asarray(self.view.position)[None]]),
            np.concatenate([up, np.asarray(self.view.direction)[None]]),
        )


def room_scene(
    building: Building, space: Space, systems: Mapping[str, States], options: RoomOptions
) -> RoomScene:
    """Triangles, window groups, sensors and view of a room in the visible band.

    Args: systems: what fills each window, by its GUID, in each state.
    """
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
        room_windows(space, systems),
        points,
        fisheye(position, direction, options.picture_size),
    )


@dataclass(frozen=True, slots=True)
class RoomMatrices:
    """What is traced of a room whatever fills its windows."""

    view: Estimate  # V [S + 1, G, K], the eye last
    daylight: Estimate  # D [G, K, P] in the visible band
    view_direct: NDArray[np.float64] | None  # V_d
    daylight_direct: NDArray[np.float64] | None  # D_d


def room_matrices(
    scene: RoomScene, options: RoomOptions, cache: MatrixCache | None, progress: Progress
) -> RoomMatrices:
    """Trace V and D, and for the five-phase method V_d and D_d, which are part of them."""
    points, directions = scene.sensors()

    def daylight(depth: int, progress: Progress) -> Estimate:
        return daylight_matrix(
            scene.exterior,
            scene.groups,
            max_depth=depth,
            progress=progress,
            cache=cache,
            **daylight_options(options),
        )

    def view(depth: int, progress: Progress) -> Estimate:
        return view_matrix(
            scene.interior,
            scene.groups,
            points,
            directions,
            samples=max(options.sensor_samples // BATCHES, 1),
            max_depth=depth,
            stopping=Stopping(batches=BATCHES),
            seed=options.seed,
            progress=progress,
            cache=cache,
        )

    def within(start: float, end: float) -> Progress:
        return part(progress, start, end, "daylight")

    whole = view(32, within(0.3, 0.9)), daylight(16, within(0.0, 0.2))
    if options.method != "five-phase":
        return RoomMatrices(*whole, None, None)
    direct_view = view(1, within(0.9, 1.0)).values
    if not len(scene.exterior.triangles):  # nothing outdoors reflects
        return RoomMatrices(*whole, direct_view, whole[1].values)
    return RoomMatrices(*whole, direct_view, daylight(1, within(0.2, 0.3)).values)


def daylight_options(options: RoomOptions) -> dict:
    """The options of `daylight_matrix` that follow from those of the run."""
    return {
        "subdivision": options.sky_subdivision,
        "samples": max(options.patch_samples // BATCHES, 1),
        "stopping": Stopping(batches=BATCHES),
        "seed": options.seed,
    }


@dataclass(frozen=True, slots=True)
class StateLight:
    """The light of a room in one state of its windows, in the lit hours L."""

    illuminance: NDArray[np.float32]  # [L, S] [lx]
    eye: NDArray[np.float32]  # [L] vertical illuminance at the view point [lx]
    direct: NDArray[np.float32] | None  # [L, S] straight from the sun [lx]
    relative_error: NDArray[np.float64]  # [S] of the annual mean
    window: NDArray[np.float32]  # [G, K, L] luminance towards the room, T D s [cd/m2]
    window_direct: NDArray[np.float32] | None  # [G, K, L] T D_d s_d, the sun alone [cd/m2]
    coefficients: NDArray[np.float64]  # [S, P] V T D: illuminance per unit sky luminance


def state_light(
    scene: RoomScene,
    matrices: RoomMatrices,
    state: int,
    skies: Skies,
    options: RoomOptions,
    cache: MatrixCache | None,
    progress: Progress,
) -> StateLight:
    """Illuminance of a state by the matrix methods; the sun's true disc where the skies have it."""
    T = scene.windows.of_state(state, lambda system: system.visible.transmission_matrix())
    view, D = matrices.view.values, matrices.daylight.values
    window = phases.room_side_radiance(T, D, skies.visible).astype(np.float32)
    lit = np.einsum("sgk,gkl->sl", view, window, optimize=True)
    error = _error(matrices.view, window)
    window_direct, direct = None, None
    if skies.sun is not None:
        ways = scene.windows.of_state(state, lambda system: sun_scattering(system.fine))
        sun = direct_sun(scene, ways, skies, options, cache, progress)
        direct = sun.illuminance.astype(np.float32)
        if matrices.view_direct is not None:
            window_direct = phases.room_side_radiance(
                T, matrices.daylight_direct, skies.sun.patches
            ).astype(np.float32)
            blurred = np.einsum("sgk,gkl->sl", matrices.view_direct, window_direct, optimize=True)
            lit += beam_reflected(scene, matrices, T, ways, skies) - blurred
            lit = np.maximum(lit, 0.0) + sun.illuminance
            error = np.hypot(error, sun.error_of_sum / len(skies.lit))
    mean = lit.mean(axis=1)
    relative = np.divide(error, mean, out=np.zeros_like(error), where=mean > 0)
    through = np.stack([t @ d for t, d in zip(T, D, strict=True)])
    lit = lit.astype(np.float32)
    return StateLight(
        np.ascontiguousarray(lit[:-1].T),
        lit[-1],
        None if direct is None else np.ascontiguousarray(direct[:-1].T),
        relative[:-1],
        window,
        window_direct,
        np.einsum("sgk,gkp->sp", view[:-1], through, optimize=True),
    )


def beam_reflected(
    scene: RoomScene,
    matrices: RoomMatrices,
    T: list[NDArray[np.float64]],
    ways: list[Scattering],
    skies: Skies,
) -> NDArray[np.float64] | float:
    """What the sun's beam, reflected in the room, has more at its own angle [S + 1, L]."""
    beams = patch_beams(ways, KLEMS_FULL)
    if not beams.any():
        return 0.0
    return phases.beam_at_sun_angle(
        matrices.view.values - matrices.view_direct,
        T,
        beams,
        through_beams(scene.groups, ways, skies.sun.direction),
        matrices.daylight_direct,
        skies.sun.patches,
    )


def _error(view: Estimate, luminance: NDArray) -> NDArray[np.float64]:
    """Standard error of each sensor's mean over the lit hours [S + 1], from the tracing of V.

    The errors of different window groups are taken as independent.
    """
    return np.sqrt((view.error_of(luminance.mean(axis=-1)) ** 2).sum(axis=-1))


def room_daylight(
    scene: RoomScene,
    lights: list[StateLight],
    state: NDArray[np.int64],
    skies: Skies,
    weather: Weather,
    options: RoomOptions,
    progress: Progress,
) -> DaylightResult:
    """Illuminance of the year with the state of each hour, and its metrics.

    Args: lights: of each state J; state: [L] which one holds in each lit hour.
    """
    rows = np.arange(len(skies.lit))
    lit = np.stack([light.illuminance for light in lights])[state, rows]
    share = np.bincount(state, minlength=len(lights)) / max(len(state), 1)
    error = sum(w * light.relative_error for w, light in zip(share, lights, strict=True))
    if options.method == "point-in-time":
        lit, error = path_illuminance(scene, state, skies, options, progress)
    illuminance = skies.whole_year(lit.astype(np.float32).T).T
    opened = lights[0]  # LM-83's direct sun and the daylight factor are those of open blinds
    direct = None if opened.direct is None else skies.whole_year(opened.direct.T).T
    overcast = cie_patches("overcast", ReinhartSky(options.sky_subdivision), 1.0)
    factor = daylight_factor(opened.coefficients @ overcast, 1.0)
    table, of_room = daylight_metrics(scene.points, illuminance, factor, weather, direct)
    return DaylightResult(scene.points, illuminance, error, table, of_room)


def illuminance_table(result: DaylightResult, times: pd.DatetimeIndex) -> pd.DataFrame:
    """Illuminance [H, S] with the sensors' numbers as columns."""
    columns = [f"sensor_{i}" for i in range(len(result.points))]
    return pd.DataFrame(result.illuminance, index=times, columns=columns).rename_axis("time")
