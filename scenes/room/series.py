"""The rooms of a building one by one: equal rooms computed once, impossible ones left out."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Problem, Space
from bim.seasons import seasons
from bim.templates import template_rooms
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices, with_outdoors
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, Stage, item, silent
from mitsuba_cfs.surfaces import Surfaces
from scenes.fenestration.systems import States
from scenes.results import RoomYear
from scenes.room.heat import DaylitRoom
from scenes.room.leaks import moved_problem

Moved = TypeVar("Moved", RoomYear, DaylitRoom)
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
        found: list[PhaseMatrices] = []
        groups = window_groups(self.space)
        for season in seasons(self.building):
            exterior = exterior_surfaces(season.building, self.space, band)
            scene = DaylightScene(Surfaces.none(), exterior, groups)
            if found:
                matrices = with_outdoors(found[0], scene)
            else:
                matrices = phase_matrices(
                    scene, self.sampling, five_phase=False, needs=(), cache=self.cache
                )
            found.append(matrices)
        return np.concatenate([matrices.daylight.values for matrices in found])


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


def moved_result(result: Moved, space: Space) -> Moved:
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


R = TypeVar("R")
# Some rooms to what comes of each, in any order: its result or why it has none
Beside = Callable[[Sequence[Space]], Generator[tuple[Space, R | BaseException]]]


@dataclass(frozen=True, slots=True)
class RoomSeries(Generic[R]):
    """What is to be done with each of some rooms."""

    building: Building
    spaces: Sequence[Space]
    systems: Mapping[str, States]  # by window GUID
    sampling: Sampling
    cache: MatrixCache | None
    compute: Callable[[Space, Progress], R]
    move: Callable[[R, Space], R]  # the result of an equal room to where another one is
    file: Path | None = None  # that messages name
    alike: Callable[[Space, Space], bool] = lambda one, other: True  # beside shape and light
    on_room: Callable[[R], None] = lambda result: None  # called with each result in turn
    given: str = "results are"  # what an equal room has of the one that was computed
    beside: Beside[R] | None = None  # computes rooms beside each other in place of `compute`
    kept: Callable[[R], R] = lambda result: result  # what is held of each

    def results(self, progress: Progress = silent) -> tuple[list[R], list[Problem], list[str]]:
        """The results in the rooms' order, what was left out, and what was given twice.

        Raises: `DataError` where the only room cannot be computed.
        """
        templates = _Templates(self)
        with closing(self._ahead(templates, progress)) as ahead:
            return self._in_turn(templates, ahead, progress)

    def _in_turn(
        self,
        templates: _Templates,
        ahead: Iterator[tuple[str, R | BaseException]],
        progress: Progress,
    ) -> tuple[list[R], list[Problem], list[str]]:
        found, problems, notes = [], [], []
        computed: dict[str, R | BaseException] = {}
        for number, space in enumerate(self.spaces, 1):
            steps = item(progress, "room", number, len(self.spaces), space.label)
            try:
                twin = templates.of(space)
                wanted = (twin or space).guid
                while wanted not in computed:
                    guid, result = next(ahead, (space.guid, None))
                    result = self.compute(space, steps) if result is None else result
                    if not isinstance(result, BaseException):
                        result = self.kept(result)
                    computed[guid] = result
                result = computed[wanted]
                if isinstance(result, BaseException):
                    raise result
                if twin is not None:
                    result = self.move(result, space)
                    notes.append(
                        f"Room {space.label} is like {twin.label} in shape, orientation, "
                        f"materials, windows and in what shades it: its {self.given} those."
                    )
            except RoomError as error:
                templates.drop(space)
                if len(self.spaces) == 1:
                    where = f"space {space.label}"
                    raise DataError(str(error), file=self.file, element=where) from error
                problems.append(Problem(space.guid, str(error), "the room was left out of the run"))
                continue
            found.append(result)
            self.on_room(result)
        return found, problems, notes

    def _ahead(
        self, templates: _Templates, progress: Progress
    ) -> Generator[tuple[str, R | BaseException]]:
        """The rooms that are computed beside each other, as they are ready."""
        if self.beside is None:
            return
        rooms = []
        for number, space in enumerate(self.spaces, 1):
            if templates.of(space) is None:
                rooms.append(space)
            progress("equal rooms", number / len(self.spaces))
        progress(Stage("", "room", 1, len(rooms)), 0.0)
        with closing(self.beside(rooms)) as beside:
            for done, (space, result) in enumerate(beside, 1):
                yield space.guid, result
                progress(Stage("", "room", min(done + 1, len(rooms)), len(rooms)), 0.0)


class _Templates:
    """Of which earlier room each is a copy, in shape and in light."""

    def __init__(self, series: RoomSeries[R]) -> None:
        self._series = series
        self._group: dict[str, list[OutdoorLight]] = {}  # by room; of those that stand for others
        for group in template_rooms(series.spaces):
            stand: list[OutdoorLight] = []
            self._group |= dict.fromkeys((space.guid for space in group), stand)
        self._found: dict[str, Space | None] = {}

    def of(self, space: Space) -> Space | None:
        """An earlier room that is equal and gets the same light; None: the room stands itself."""
        if space.guid not in self._found:
            series, group = self._series, self._group[space.guid]
            light = OutdoorLight(series.building, space, series.sampling, series.cache)
            twin = next((one.space for one in group if self._same(one, light)), None)
            if twin is None:
                group.append(light)
            self._found[space.guid] = twin
        return self._found[space.guid]

    def _same(self, one: OutdoorLight, other: OutdoorLight) -> bool:
        series, rooms = self._series, (one.space, other.space)
        return same_systems(*rooms, series.systems) and series.alike(*rooms) and one.same(other)

    def drop(self, space: Space) -> None:
        """Let no room be a copy of this one, which could not be computed."""
        group = self._group[space.guid]
        group[:] = [light for light in group if light.space.guid != space.guid]
        self._found = {
            guid: twin for guid, twin in self._found.items()
            if twin is None or twin.guid != space.guid
        }  # fmt: skip
