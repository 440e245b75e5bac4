"""What the sun's disc gives sensors straight through the windows, in the hours of a sky."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import States, in_state
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.sun.direct import direct_sun_matrix
from mitsuba_cfs.trace.sun.specular_paths import shining

SUN_BATCHES = 4  # of C_ds


def exact_sun(
    traced: PhaseScene,
    systems: Sequence[States],
    suns: NDArray[np.float64],
    progress: Progress = silent,
) -> list[Estimate | None]:
    """C_ds [G, S, Q] of the hours in which the sun shines on a window, in each state [J].

    None where it never does, or the method has no exact sun.

    Args:
        systems: states of each window group [G].
        suns: directions [Q, 3] of the sun in these hours.
    """
    count = max(map(len, systems))
    if not traced.five_phase or not len(suns):
        return [None] * count
    scene, chosen = traced.scene, traced.sampling
    found: list[Estimate | None] = []
    for j in range(count):
        ways = [o.scattering for o in in_state(systems, [j] * len(scene.groups))]
        found.append(
            direct_sun_matrix(
                scene.interior, scene.exterior, scene.groups, ways, *scene.sensors(),
                suns=suns,
                window_points=max(chosen.sun_points // SUN_BATCHES, 1),
                stopping=Stopping(batches=SUN_BATCHES), seed=chosen.seed, by_group=True,
                progress=part(progress, j / count, (j + 1) / count, "daylight"),
                cache=traced.cache, scenes=traced.scenes,
            )
        )  # fmt: skip
    return found


def shining_hours(traced: PhaseScene, sky: AnnualSky) -> NDArray[np.int64]:
    """The hours L in which the sun stands before a window."""
    scene, lit = traced.scene, sky.illuminance > 0
    facing = np.stack([g.frame[2] for g in scene.groups])
    if scene.exterior.glossy:
        outside = traced.scenes.scene(scene.exterior, scene.groups)
        return np.flatnonzero(shining(outside, facing, sky.direction) & lit)
    return np.flatnonzero(np.any(sky.direction @ facing.T > 0, axis=1) & lit)
