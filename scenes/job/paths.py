"""The point-in-time method for a year: every lit hour path-traced for itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.estimate import Stopping
from mitsuba_cfs.trace.lit_room import Room, Sky
from mitsuba_cfs.trace.picture_paths import point_in_time_picture
from mitsuba_cfs.trace.point_in_time import point_in_time
from mitsuba_cfs.trace.systems import lit_system
from scenes.job.options import RoomOptions
from scenes.job.skies import Skies

if TYPE_CHECKING:
    from scenes.job.daylight import RoomScene

BATCHES = 4


def path_illuminance(
    scene: RoomScene,
    state: NDArray[np.int64],
    skies: Skies,
    options: RoomOptions,
    progress: Progress,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance [L, S] of the work plane, and the relative error [S] of its annual mean.

    Args: state: [L] that holds in each lit hour.
    """
    up = np.tile([0.0, 0.0, 1.0], (len(scene.points), 1))
    lit = np.zeros((len(skies.lit), len(scene.points)))
    variance = np.zeros(len(scene.points))
    rooms: dict[int, Room] = {}
    for hour, j in enumerate(state.tolist()):
        progress("point in time", hour / len(state))
        room = rooms.get(j) or rooms.setdefault(j, lit_room(scene, j))
        found = point_in_time(
            room,
            sky_of_hour(skies, hour),
            scene.points,
            up,
            samples=max(options.path_samples // BATCHES, 1),
            stopping=Stopping(batches=BATCHES),
            seed=options.seed * len(skies.lit) + hour,  # hours scatter independently
        )
        lit[hour] = found.values
        variance += found.standard_error**2
    total = lit.sum(axis=0)
    return lit, np.divide(np.sqrt(variance), total, out=np.zeros_like(total), where=total > 0)


def path_picture(
    scene: RoomScene, state: int, hour: int, skies: Skies, options: RoomOptions, progress: Progress
) -> NDArray[np.float32]:
    """Luminance picture [ny, nx] of one lit hour (its number among them)."""
    return point_in_time_picture(
        lit_room(scene, state),
        sky_of_hour(skies, hour),
        scene.view,
        samples=2 * options.picture_samples,  # nothing is averaged over hours here
        seed=options.seed,
        progress=progress,
    )


def lit_room(scene: RoomScene, state: int) -> Room:
    """The room with its systems of a state."""
    systems = scene.windows.of_state(state, lambda system: lit_system(system.fine))
    return Room(scene.interior, scene.exterior, scene.groups, systems)


def sky_of_hour(skies: Skies, hour: int) -> Sky:
    """Sky and sun of a lit hour."""
    sun = skies.sun
    patches = np.maximum(skies.visible[:, hour] - sun.patches[:, hour], 0.0)
    return Sky(patches, sun.direction[hour], sun.illuminance[hour] / SUN_SOLID_ANGLE)
