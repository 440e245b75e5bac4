"""Glare of some hours with other systems in the windows, from the same matrices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import Light, SeasonalLight
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_light import PhaseLight, phase_light
from mitsuba_cfs.methods.point_in_time import PathLight


def glare_with(
    light: Light,
    systems: Sequence[States],
    hours: NDArray[np.int64],
    metric: str = "DGP",
    *,
    options: GlareOptions | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """DGP and illuminance at the eye [lx] of some hours [n] of the light, in the first states.

    Args: systems: [G][J] optics of each window group, as of the light.
    """
    dgp, eye = np.zeros(len(hours)), np.zeros(len(hours))
    for changed, columns in _with_systems(light, systems, hours):
        rated = hourly_glare(changed, metric, options=options)
        dgp[columns], eye[columns] = rated.dgp, rated.Ev
    return dgp, eye


def bright_hours(dgp: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Hours [n] to try a change on: half of them of the highest DGP, the rest evenly below."""
    order = np.argsort(-dgp, kind="stable")
    top, rest = order[: count // 2], order[count // 2 :]
    steps = np.unique(np.linspace(0, len(rest) - 1, count // 2).astype(np.int64))
    return np.sort(np.concatenate([top, rest[steps] if len(rest) else rest]))


def _with_systems(
    light: Light, systems: Sequence[States], hours: NDArray[np.int64]
) -> Iterator[tuple[PhaseLight | PathLight, NDArray[np.int64]]]:
    """The light of hours [n] with the systems, season by season, and which of the hours it has."""
    every = np.arange(len(light.sky.lit))
    seasons = light.seasons() if isinstance(light, SeasonalLight) else [(light, every)]
    for one, of_season in seasons:
        columns = np.flatnonzero(np.isin(hours, of_season))
        if not len(columns):
            continue
        sky = one.sky.part(np.searchsorted(of_season, hours[columns]))
        if isinstance(one, PhaseLight):
            yield phase_light(one.matrices, systems, sky, needs=()), columns
        else:
            yield replace(one, systems=systems, sky=sky), columns
