"""Stage 1 of a room: its scene, the daylight matrices, the light of every lit hour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import sensor_grid, view_point
from bim.to_tracer import exterior_surfaces, furnished_surfaces, reflectance_groups
from mitsuba_cfs.images.view import fisheye, fitted
from mitsuba_cfs.methods.light import SeasonalLight, eye_illuminance, path_light_of, seasonal_light
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_light import PhaseLight, phase_light
from mitsuba_cfs.methods.phase_matrices import DEFAULT_NEEDS, PhaseMatrices, phase_matrices, with_outdoors
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, in_shares, part, silent
from scenes.room.inner_glass import InnerGlass, inner_glass
from scenes.room.inputs import EYE_TURNS, NO_SENSORS, FileSensors, RoomInputs
from scenes.room.options import SensorGrid
from scenes.room.windows import RoomWindows

# Share of the daylight stage that traces the sensors' matrices; those of the view report their own
TRACED = {"daylight": 0.6}


@dataclass(frozen=True, slots=True, weakref_slot=True)
class RoomLight:
    """A room's traced scene and the light of its lit hours in every shading state."""

    scene: DaylightScene  # of the first season, visible band
    matrices: PhaseMatrices  # V and D of that scene
    light: PhaseLight | SeasonalLight
    inner: InnerGlass | None  # glass to other rooms that gives light

    def states(self, state: NDArray[np.int64]) -> NDArray[np.int64]:
        """The states of all window groups in the lit hours [G, L], glass to other rooms included.

        Args: state: [H, G] of the groups to the outdoors in all hours.
        """
        rows = state[self.light.sky.lit].T
        inner = len(self.light.systems) - len(rows)
        return np.pad(rows, ((0, inner), (0, 0)))

    def eye(self, state: NDArray[np.int64]) -> NDArray[np.float32]:
        """Illuminance at the eye in the lit hours [L] [lx]; state: [H, G]."""
        return eye_illuminance(self.light, self.states(state)).astype(np.float32)


def room_light(room: RoomInputs, *, needs: Sequence[str] = DEFAULT_NEEDS, progress: Progress = silent) -> RoomLight:
    """The light of a room's lit hours in every state.

    Args: needs: with "DGP" the view's matrices are traced once for all stages that rate hours.
    """
    scene, inner = _scene(room, room.seasons[0].building)
    matrices = phase_matrices(
        scene,
        room.options.sampling,
        five_phase=room.options.method != "three-phase",
        needs=needs,
        cache=room.cache,
        progress=in_shares(progress, TRACED),
    )
    seasons, optics = [matrices], [_optics(room, inner)]
    for season in room.seasons[1:]:
        outdoors, glass = _scene(room, season.building)
        seasons.append(with_outdoors(matrices, outdoors))
        optics.append(_optics(room, glass))
    steps = part(progress, 0.6, 0.9, "daylight")
    light: PhaseLight | SeasonalLight
    if len(seasons) == 1:
        light = phase_light(matrices, optics[0], room.skies, needs=needs, progress=steps)
    else:
        light = seasonal_light(seasons, optics, room.skies, room.season, needs=needs, progress=steps)
    return RoomLight(scene, matrices, light, inner)


def visible_scene(room: RoomInputs) -> DaylightScene:
    """The room's scene in the visible band, in its first season."""
    return _scene(room, room.seasons[0].building)[0]


def picture_light(room: RoomInputs, light: RoomLight) -> PhaseLight | PathLight | SeasonalLight:
    """The light that the room's pictures are made of."""
    return path_light_of(light.light) if room.options.method == "point-in-time" else light.light


def _scene(room: RoomInputs, building: Building) -> tuple[DaylightScene, InnerGlass | None]:
    """The scene of one season, with the glass to other rooms where light passes through it."""
    glass = inner_glass(building, room.space, room.systems) if room.inner_glass else None
    scene = room_scene(
        building,
        room.space,
        room.windows,
        room.grids,
        room.options.outputs.picture_size,
        inner=glass,
        file_sensors=room.file_sensors,
        sensitivities=room.options.outputs.derives,
    )
    return scene, glass


def turned_eyes(light: RoomLight) -> RoomLight:
    """The light of sensors at the room's eye that look in `EYE_TURNS`.

    They are traced by themselves: sensors that are traced together share paths, and the light of the
    others would change.
    """
    scene = light.scene
    position, direction = (np.asarray(a, dtype=float) for a in (scene.eye.position, scene.eye.direction))
    angle = np.radians(EYE_TURNS)
    x, y, z = direction
    turned = np.stack(
        [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, np.full_like(angle, z)], axis=1
    )
    points = np.tile(position, (len(angle), 1))

    def of_season(one: PhaseLight | PathLight) -> PhaseLight:
        if not isinstance(one, PhaseLight):
            raise ValueError("path tracing has no matrices: expected the light of a phase method")
        own = replace(one.scene, points=points, normals=turned, by_groups=None)
        matrices = replace(one.matrices, scene=own, sensors=None, direct_sensors=None, view=None)
        return phase_light(matrices, one.systems, one.sky, reflected=one.reflected)

    whole: PhaseLight | SeasonalLight
    if isinstance(light.light, SeasonalLight):
        whole = replace(light.light, lights=tuple(map(of_season, light.light.lights)))
    else:
        whole = of_season(light.light)
    return replace(light, scene=replace(scene, points=points, normals=turned), light=whole)


def _optics(room: RoomInputs, inner: InnerGlass | None) -> list[Sequence[SystemOptics]]:
    """Optics of the window groups in their states [G][J]."""
    return [*room.windows.optics(), *(() if inner is None else inner.optics)]


def room_scene(
    building: Building,
    space: Space,
    windows: RoomWindows,
    grids: Sequence[SensorGrid],
    picture_size: int,
    *,
    inner: InnerGlass | None = None,
    file_sensors: FileSensors = NO_SENSORS,
    sensitivities: bool = False,
) -> DaylightScene:
    """Triangles, window groups, sensors and view of a room in the visible band.

    Args:
        grids: sensor grids, one after the other.
        picture_size: pixels of a side of the view.
        inner: glass to other rooms that gives light; None: that glass is opaque.
        file_sensors: of the building's file; its sensors follow those of the grids.
        sensitivities: whether light is derived by the reflectances of the room.
    """
    points = np.concatenate([grid_points(space, grid) for grid in grids])
    upwards = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    position, direction = view_point(space)
    view = fisheye(position, direction, picture_size)
    if file_sensors.view is not None:
        view = fitted(file_sensors.view, picture_size)
    return DaylightScene(
        furnished_surfaces(space, "visible") if inner is None else inner.interior,
        exterior_surfaces(building, space, "visible"),
        [*windows.groups, *(() if inner is None else inner.groups)],
        np.concatenate([points, *(grid.points for grid in file_sensors.grids)]),
        np.concatenate([upwards, *(grid.directions for grid in file_sensors.grids)]),
        view,
        () if inner is None else inner.beyond,
        None if not sensitivities else reflectance_groups(space) if inner is None else inner.by_groups,
    )


def grid_points(space: Space, grid: SensorGrid) -> NDArray[np.float64]:
    """Sensors [S, 3] of a grid in a room [m]."""
    return sensor_grid(space, spacing=grid.spacing, height=grid.height, margin=grid.margin)[0]
