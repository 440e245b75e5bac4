"""Direct sun of a year on a room's sensors: its true disc, through what fills the windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.direct_sun import Scattering, direct_sun_matrix
from mitsuba_cfs.trace.estimate import Stopping
from scenes.job.options import RoomOptions
from scenes.job.skies import Skies

if TYPE_CHECKING:
    from scenes.job.daylight import RoomScene

BATCHES = 4


@dataclass(frozen=True, slots=True)
class DirectSun:
    """C_ds s_sun of every lit hour."""

    illuminance: NDArray[np.float64]  # [S + 1, L] [lx]
    error_of_sum: NDArray[np.float64]  # [S + 1] standard error of its sum over the hours [lx]


def direct_sun(
    scene: RoomScene,
    ways: Sequence[Scattering],
    skies: Skies,
    options: RoomOptions,
    cache: MatrixCache | None,
    progress: Progress,
) -> DirectSun:
    """Illuminance straight from the sun at the work plane and the eye.

    Args: ways: how each window group passes it.
    """
    points, directions = scene.sensors()
    sun = skies.sun
    facing = np.any([sun.direction @ g.frame[2] > 0 for g in scene.groups], axis=0)
    shining = np.flatnonzero(facing & (sun.illuminance > 0))
    illuminance = np.zeros((len(points), len(skies.lit)))
    if not len(shining):
        return DirectSun(illuminance, np.zeros(len(points)))
    found = direct_sun_matrix(
        scene.interior,
        scene.exterior,
        scene.groups,
        ways,
        points,
        directions,
        sun.direction[shining],
        window_points=max(options.sun_points // BATCHES, 1),
        stopping=Stopping(batches=BATCHES),
        seed=options.seed,
        progress=progress,
        cache=cache,
    )
    luminance = sun.illuminance[shining] / SUN_SOLID_ANGLE
    illuminance[:, shining] = found.values * luminance
    return DirectSun(illuminance, found.error_of(luminance))
