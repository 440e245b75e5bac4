"""Rooms equal in shape that also get the same light: computed once, given for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.surfaces import Surfaces
from scenes.fenestration.systems import States
from scenes.results import RoomYear
from scenes.room.heated import DaylitRoom
from scenes.room.holes import moved_problem

R = TypeVar("R", RoomYear, DaylitRoom)
SAME_LIGHT = 0.005  # share of the light from anywhere that may come another way
NEAR = 0.01  # [m] between the places of windows in their rooms


def same_systems(a: Space, b: Space, systems: Mapping[str, States]) -> bool:
    """Whether the windows at the same places of two equal rooms have the same systems."""
    places = np.array([window.centre - corner(a) for window in a.windows])
    for window in b.windows:
        distance = np.linalg.norm(places - (window.centre - corner(b)), axis=1)
        nearest = int(distance.argmin())
        if distance[nearest] > NEAR:
            return False
        pair = systems[a.windows[nearest].guid], systems[window.guid]
        if len({tuple(map(id, states)) for states in pair}) > 1:
            return False
    return True


def same_light(
    building: Building, a: Space, b: Space, sampling: Sampling, cache: MatrixCache | None
) -> bool:
    """Whether two equal rooms see the same outdoors, by their daylight matrices in both bands.

    The matrices are traced with the same random numbers: where the same things stand outdoors they
    differ by rounding only.
    """
    for band in ("visible", "solar"):
        one, other = (_daylight(building, s, band, sampling, cache) for s in (a, b))
        if one.shape != other.shape:
            return False
        if np.abs(one - other).sum() > SAME_LIGHT * one.sum():
            return False
    return True


def moved_light(room: DaylitRoom, space: Space) -> DaylitRoom:
    """The light of a template room for one equal to it, its zone between that one's neighbours."""
    inputs = room.inputs
    return replace(
        moved_result(room, space), inputs=replace(inputs, zone=inputs.zone.moved_to(space))
    )


def moved_result(result: R, space: Space) -> R:
    """The results of a template room for one equal to it, moved to where that stands."""
    shift = corner(space) - corner(result.space)
    daylight, glare = result.daylight, result.glare
    table = daylight.sensor_metrics.copy()
    table[["x", "y", "z"]] += shift
    name = result.space.label
    place = tuple((np.asarray(glare.view.position) + shift).tolist())
    return replace(
        result,
        space=space,
        daylight=replace(daylight, points=daylight.points + shift, sensor_metrics=table),
        glare=replace(glare, view=replace(glare.view, position=place)),
        seconds={},
        explored=None,  # the template's serves both
        problems=tuple(moved_problem(problem, space, name) for problem in result.problems),
        template=name,
    )


def corner(space: Space) -> NDArray[np.float64]:
    """The lowest corner [3] of a room."""
    return space.shell.reshape(-1, 3).min(axis=0)


def _daylight(
    building: Building, space: Space, band: str, sampling: Sampling, cache: MatrixCache | None
) -> NDArray[np.float64]:
    scene = DaylightScene(
        Surfaces.none(), exterior_surfaces(building, space, band), window_groups(space)
    )
    return PhaseScene(scene, sampling, cache=cache).daylight.values
