"""The point-in-time method: every hour is path-traced by itself, through the BSDF as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.methods.optics import States, check_systems, combinations, hourly_states, in_state
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.paths.disc import discs_seen, with_discs
from mitsuba_cfs.trace.paths.point_in_time import MAX_DEPTH, sensor_batches
from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

BATCHES = 16  # of the paths of a sensor in an hour
EYE_PATHS = 16  # paths of the eye for each of a sensor: DGP depends on it, and it is a single point
Array = NDArray[np.float64]
State = NDArray[np.int64]


@dataclass(frozen=True)
class PathLight:
    """The light of a scene in the hours L of a sky, path-traced when a function asks for it."""

    scene: DaylightScene
    systems: Sequence[States]  # [G][J] optics of each window group in each of its states
    sky: AnnualSky
    sampling: Sampling = field(default_factory=Sampling)

    def __post_init__(self) -> None:
        check_systems(self.systems, self.scene.groups)
        if self.sky.sun is None:
            raise ValueError("path tracing needs the sky's sun: annual_sky(..., sun=True)")

    @property
    def states(self) -> int:
        """J, how many states the group has that has most."""
        return max(map(len, self.systems))

    def states_of(self, state: State | None) -> State:
        """The state of each group in each hour [G, L]."""
        return hourly_states(state, self.systems, self.sky)


@dataclass(frozen=True)
class PathPicture:
    """A luminance picture of one hour, and the sun's disc and its images, apart from it."""

    bare: NDArray[np.float32]  # [ny, nx] [cd/m2] without the disc and its images in mirrors
    discs: tuple[SunDisc, ...]
    shown: NDArray[np.float32]  # [ny, nx] [cd/m2] with the discs in their pixels


def path_tracing_room(
    scene: DaylightScene, systems: Sequence[States], state: Sequence[int] | None = None
) -> PathTracingScene:
    """The room with each window group in a state [G], the first by default, ready to be traced."""
    state = [0] * len(systems) if state is None else state
    paths = [optics.paths for optics in in_state(systems, state)]
    return PathTracingScene(scene.interior, scene.exterior, scene.groups, paths)


def rooms_by_state(light: PathLight, rows: State) -> dict[tuple[int, ...], PathTracingScene]:
    """The rooms of the combinations of states that occur in some hours [G, n]."""
    states = [state for state, _ in combinations(rows)]
    return {state: path_tracing_room(light.scene, light.systems, state) for state in states}


def path_illuminance(
    light: PathLight, state: State | None = None, *, progress: Progress = silent
) -> tuple[Array, Array]:
    """Illuminance of the scene's sensors [S, L] [lx], and its variance in each hour [S, L] [lx2].

    Args: state: [G, L] of each window group in each hour, or [L] of all; the first by default.
    """
    scene, rows = light.scene, light.states_of(state)
    rooms = rooms_by_state(light, rows)
    lit, variance = np.zeros((2, len(scene.points), rows.shape[1]))
    for hour, now in enumerate(rows.T):
        progress("point in time", hour / rows.shape[1])
        room = rooms[tuple(now.tolist())]
        lit[:, hour], variance[:, hour] = _sensors(light, room, scene.points, scene.normals, hour)
    return lit, variance


def path_eye_illuminance(light: PathLight, hours: NDArray[np.int64], state: State | None = None) -> Array:
    """Illuminance at the view's eye in some hours [n], their numbers among the sky's [lx]."""
    view, rows = light.scene.eye, light.states_of(state)[:, hours]
    point, direction = np.atleast_2d(view.position), np.atleast_2d(view.direction)
    rooms = rooms_by_state(light, rows)
    return np.array(
        [
            float(_sensors(light, rooms[tuple(now.tolist())], point, direction, hour, EYE_PATHS)[0][0])
            for hour, now in zip(hours.tolist(), rows.T, strict=True)
        ]
    )


def path_picture(
    light: PathLight, hour: int, state: Sequence[int] | None = None, **options: Any
) -> NDArray[np.float32]:
    """Luminance picture [ny, nx] of one hour [cd/m2], its number among the sky's.

    Args: options: of `point_in_time_picture`; samples and seed are the sampling's.
    """
    room = path_tracing_room(light.scene, light.systems, state)
    return picture_of_room(light, room, hour, **options)


def picture_of_room(light: PathLight, room: PathTracingScene, hour: int, **options: Any) -> NDArray[np.float32]:
    """The same of a room in its state."""
    chosen = light.sampling
    options = {"samples": chosen.picture_samples, "seed": chosen.seed} | options
    return point_in_time_picture(room, path_sky(light, hour), light.scene.eye, **options)


def discs_of_room(light: PathLight, room: PathTracingScene, hour: int) -> tuple[SunDisc, ...]:
    """The sun's disc and its images in mirrors in the view in one hour."""
    return discs_seen(room, path_sky(light, hour), light.scene.eye)


def picture_with_disc(light: PathLight, room: PathTracingScene, hour: int, **options: Any) -> PathPicture:
    """The picture of one hour, the sun's discs apart and in their pixels."""
    bare = picture_of_room(light, room, hour, disc=False, **options)
    shown = with_discs(bare, room, path_sky(light, hour), light.scene.eye)
    return PathPicture(bare, discs_of_room(light, room, hour), shown)


def path_sky(light: PathLight, hour: int) -> Sky:
    """Sky and sun of one hour."""
    sky = light.sky
    luminance = sky.illuminance[hour] / SUN_SOLID_ANGLE
    return Sky(sky.without_sun(hour), sky.direction[hour], luminance)


def _sensors(
    light: PathLight, room: PathTracingScene, points: Array, directions: Array, hour: int, more: int = 1
) -> tuple[Array, Array]:
    """Illuminance [S] of some sensors in one hour and its variance, from batches.

    Args: more: paths of each for one of `Sampling.hour_samples`.
    """
    chosen = light.sampling
    batch = sensor_batches(
        room,
        path_sky(light, hour),
        np.repeat(points, BATCHES, axis=0),  # all batches in one launch
        np.repeat(directions, BATCHES, axis=0),
        samples=max(more * chosen.hour_samples // BATCHES, 1),
        max_depth=MAX_DEPTH,
        seed=chosen.seed * light.sky.hours + int(light.sky.lit[hour]),  # hours differ
    )
    values = batch(0).reshape(len(points), BATCHES)
    return values.mean(axis=1), values.var(axis=1, ddof=1) / BATCHES
