"""A room in every hour and every shading state, as the explorer shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.light import eye_illuminance, illuminance, with_pictures, with_view
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.phase_pictures import pictures_in_state
from mitsuba_cfs.picture_year.year import picture_year
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.trace.kernels.scattering import through_beams
from scenes.results import ExploredRoom

LARGEST = 400  # pixels of a side of its pictures


def explored_room(
    light: PhaseLight,
    operated: NDArray[np.int64],
    names: Sequence[str],
    progress: Progress,
    *,
    sensors: int,
) -> ExploredRoom:
    """Pictures, illuminances and the sun's beam of all lit hours in all states.

    Args:
        operated: [H] the state that holds in each hour.
        names: [J] of the states.
        sensors: of the work plane, the first of the scene's.
    """
    sky, scene = light.sky, light.scene
    L, J = len(sky.lit), light.states
    small, pictures, through = _small(light, progress), [], []
    hours, ones = np.arange(L), np.ones(L, dtype=np.int64)
    for j in range(J):
        state = [min(j, len(states) - 1) for states in light.systems]
        steps = part(progress, j / J, (j + 1) / J)
        made = pictures_in_state(small, hours, state)
        pictures.append(picture_year(made, seed=light.sampling.seed, progress=steps))
        optics = [states[k] for states, k in zip(light.systems, state, strict=True)]
        ways = [one.scattering for one in optics]
        through.append(through_beams(scene.groups, ways, sky.direction))
    triangles = [np.concatenate([w.triangles for w in g.windows]) for g in scene.groups]
    return ExploredRoom(
        tuple(names[:J]),
        operated,
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
