"""Rooms equal in shape that also get the same light: computed once, given for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.seasons import seasons
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.surfaces import Surfaces
from scenes.fenestration.systems import States
from scenes.results import RoomYear
from scenes.room.heated import DaylitRoom
from scenes.room.holes import moved_issue

R = TypeVar("R", RoomYear, DaylitRoom)
BANDS = ("visible", "solar")
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


class OutdoorLight:
    """The daylight matrices of a room's windows in both bands: what it sees of the outdoors.

    They are traced with the same random numbers for all rooms: where the same things stand outdoors
    those of equal rooms differ by rounding only.  Sums over rows and columns alone are kept.
    """

    def __init__(
        self, building: Building, space: Space, sampling: Sampling, cache: MatrixCache | None
    ) -> None:
        """Nothing is traced before it is asked for."""
        self.building, self.space, self.sampling, self.cache = building, space, sampling, cache

    def same(self, other: OutdoorLight) -> bool:
        """Whether an equal room sees the same outdoors."""
        # sums differ by no more than what they are of: most rooms are told apart by them
        return all(
            alike(one, theirs) for one, theirs in zip(self._sums, other._sums, strict=True)
        ) and all(alike(self._daylight(band), other._daylight(band)) for band in BANDS)

    @cached_property
    def _sums(self) -> list[NDArray[np.float64]]:
        return [self._daylight(band).sum(axis=axis) for band in BANDS for axis in (-1, -2)]

    def _daylight(self, band: str) -> NDArray[np.float64]:
        """D of every season [.., K, P], one after the other."""
        found, groups = [], window_groups(self.space)
        for season in seasons(self.building):
            exterior = exterior_surfaces(season.building, self.space, band)
            scene = DaylightScene(Surfaces.none(), exterior, groups)
            if found:
                traced = found[0].before(scene)
            else:
                traced = PhaseScene(scene, self.sampling, cache=self.cache)
            found.append(traced)
        return np.concatenate([traced.daylight.values for traced in found])


def alike(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether no more than `SAME_LIGHT` of the light comes another way."""
    if one.shape != other.shape:
        return False
    return bool(np.abs(one - other).sum() <= SAME_LIGHT * one.sum())


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
        issues=tuple(moved_issue(issue, space, name) for issue in result.issues),
        template=name,
    )


def corner(space: Space) -> NDArray[np.float64]:
    """The lowest corner [3] of a room."""
    return space.shell.reshape(-1, 3).min(axis=0)
