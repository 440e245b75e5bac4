"""A room in every hour and every shading state, as the explorer shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.light import eye_illuminance, illuminance, with_pictures, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.picture_year.year import picture_year
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.trace.kernels.scattering import through_beams
from scenes.results import ExploredRoom
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight

LARGEST = 400  # pixels of a side of its pictures


def explored_room(
    room: RoomInputs,
    room_light: RoomLight,
    state: NDArray[np.int64],
    *,
    sensors: int,
    progress: Progress = silent,
) -> ExploredRoom:
    """Pictures, illuminances and the sun's beam of all lit hours in all states.

    The outdoors must be the same all year.

    Args:
        state: [H] of the shading in each hour.
        sensors: number of sensors of the work plane, the first of the scene's.
    """
    light, scene, sky = room_light.light, room_light.scene, room.skies
    progress = part(progress, 0.0, 1.0, "explorer")
    names = [system.name for system in max(room.windows.systems, key=len)]
    L, J = len(sky.lit), light.states
    small, pictures, through = _small(light, progress), [], []
    hours, ones = np.arange(L), np.ones(L, dtype=np.int64)
    for j in range(J):
        of_groups = [min(j, len(states) - 1) for states in light.systems]
        steps = part(progress, j / J, (j + 1) / J)
        made = pictures_in_state(small, hours, of_groups)
        pictures.append(picture_year(made, seed=light.sampling.seed, progress=steps))
        optics = [states[k] for states, k in zip(light.systems, of_groups, strict=True)]
        scattering = [one.scattering for one in optics]
        through.append(through_beams(scene.groups, scattering, sky.direction))
    triangles = [np.concatenate([w.triangles for w in g.windows]) for g in scene.groups]
    return ExploredRoom(
        tuple(names[:J]),
        state,
        sky.lit,
        tuple(pictures),
        tuple(illuminance(light, j * ones)[:sensors].astype(np.float32) for j in range(J)),
        np.stack([eye_illuminance(light, j * ones) for j in range(J)]).astype(np.float32),
        np.stack(through).astype(np.float32),
        np.maximum(sky.illuminance, 0).astype(np.float32),
        tuple(triangles),
    )


def _small(light: PhaseLight, progress: Progress) -> PhaseLight:
    """The light of the same hours for pictures of at most `LARGEST` pixels a side."""
    view = light.scene.eye
    if max(view.width, view.height) <= LARGEST:
        return with_pictures(light, progress=progress)
    share = LARGEST / max(view.width, view.height)
    size = {"width": round(view.width * share), "height": round(view.height * share)}
    return with_pictures(with_view(light, replace(view, **size)), progress=progress)
