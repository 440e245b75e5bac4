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

from bim.model import Building, Space, seasons
from bim.report.issue import Effect, Issue
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices, with_outdoors
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, Stage, item, silent
from mitsuba_cfs.surfaces import Surfaces
from scenes.fenestration.systems import States
from scenes.language.catalogue import N_
from scenes.results import RoomYear
from scenes.room.heat import DaylitRoom
from scenes.room.leaks import moved_issue

R = TypeVar("R")
Moved = TypeVar("Moved", RoomYear, DaylitRoom)
BANDS = ("visible", "solar")
SAME_LIGHT = 0.005  # greatest share of D by which two rooms with the same outdoors differ
NEAR = 0.01  # [m] between the positions of windows in their rooms


def same_systems(a: Space, b: Space, systems: Mapping[str, States]) -> bool:
    """Whether windows at equal positions in two equal rooms have the same systems."""
    positions = np.array([window.centre - corner(a) for window in a.windows])
    for window in b.windows:
        distance = np.linalg.norm(positions - (window.centre - corner(b)), axis=1)
        nearest = int(distance.argmin())
        if distance[nearest] > NEAR:
            return False
        pair = systems[a.windows[nearest].guid], systems[window.guid]
        if len({tuple(map(id, states)) for states in pair}) > 1:
            return False
    return True


class OutdoorLight:
    """Daylight matrices of a room's windows in both bands.

    They are traced with the same random numbers for all rooms: those of equal rooms with equal
    outdoors differ by rounding only. Only sums over rows and columns stay in memory.
    """

    def __init__(self, building: Building, space: Space, sampling: Sampling, cache: MatrixCache | None) -> None:
        """Matrices are traced at their first use."""
        self.building, self.space, self.sampling, self.cache = building, space, sampling, cache

    def same(self, other: OutdoorLight) -> bool:
        """Whether an equal room has the same outdoors."""
        # sums differ no more than the matrices: they are enough to tell most rooms apart
        return all(same_matrix(a, b) for a, b in zip(self._sums, other._sums, strict=True)) and all(
            same_matrix(self._daylight(band), other._daylight(band)) for band in BANDS
        )

    @cached_property
    def _sums(self) -> list[NDArray[np.float64]]:
        return [self._daylight(band).sum(axis=axis) for band in BANDS for axis in (-1, -2)]

    def _daylight(self, band: str) -> NDArray[np.float64]:
        """D of every season [.., K, P], one after the other."""
        matrices: list[PhaseMatrices] = []
        groups = window_groups(self.space)
        for season in seasons(self.building):
            exterior = exterior_surfaces(season.building, self.space, band)
            scene = DaylightScene(Surfaces.none(), exterior, groups)
            if matrices:
                matrices.append(with_outdoors(matrices[0], scene))
            else:
                matrices.append(phase_matrices(scene, self.sampling, five_phase=False, needs=(), cache=self.cache))
        return np.concatenate([matrix.daylight.values for matrix in matrices])


def same_matrix(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether two matrices differ by at most the share `SAME_LIGHT` of their sum."""
    if a.shape != b.shape:
        return False
    return bool(np.abs(a - b).sum() <= SAME_LIGHT * a.sum())


def moved_light(room: DaylitRoom, space: Space) -> DaylitRoom:
    """The light of a template room for an equal room, its zone between that room's neighbours."""
    return replace(moved_result(room, space), zone=room.zone.moved_to(space))


def moved_result(result: Moved, space: Space) -> Moved:
    """The results of a template room for an equal room, moved to its position."""
    shift = corner(space) - corner(result.space)
    daylight, glare = result.daylight, result.glare
    table = daylight.sensor_metrics.copy()
    table[["x", "y", "z"]] += shift
    name = result.space.label
    eye = tuple((np.asarray(glare.view.position) + shift).tolist())
    explored = result.explored
    if explored is not None:
        explored = replace(explored, windows=tuple(one + shift for one in explored.windows))
    plan = result.glare_map and result.glare_map.moved(shift)
    return replace(
        result,
        space=space,
        glare_map=plan,
        daylight=replace(daylight, points=daylight.points + shift, sensor_metrics=table),
        glare=replace(glare, view=replace(glare.view, position=eye)),
        seconds={},
        explored=explored,
        issues=tuple(moved_issue(issue, space, name) for issue in result.issues),
        template=name,
    )


def corner(space: Space) -> NDArray[np.float64]:
    """The lowest corner [3] of a room."""
    return space.shell.reshape(-1, 3).min(axis=0)


# From rooms to the result or the error of each, in any order
Parallel = Callable[[Sequence[Space]], Generator[tuple[Space, R | BaseException]]]


@dataclass(frozen=True, slots=True)
class RoomSeries(Generic[R]):
    """A computation for each of several rooms."""

    building: Building
    spaces: Sequence[Space]
    equal: Sequence[tuple[Space, ...]]  # `template_rooms`
    systems: Mapping[str, States]  # by window GUID
    sampling: Sampling
    cache: MatrixCache | None
    compute: Callable[[Space, Progress], R]
    move: Callable[[R, Space], R]  # the result of a template for an equal room
    file: Path | None = None  # named in messages
    alike: Callable[[Space, Space], bool] = lambda one, other: True  # besides shape and light
    on_room: Callable[[R], None] = lambda result: None  # called with each result, in order
    shared: str = N_("results")  # that the note on an equal room names
    parallel: Parallel[R] | None = None  # computes several rooms at a time, in place of `compute`
    stored: Callable[[R], R] = lambda result: result  # puts a result on disk

    def results(self, progress: Progress = silent) -> tuple[list[R], list[Issue], list[str]]:
        """The results in the rooms' order, issues of rooms left out, notes on equal rooms.

        Raises: `DataError` where the only room cannot be computed.
        """
        templates = _Templates(self)
        with closing(self._ahead(templates, progress)) as ahead:
            return self._in_turn(templates, ahead, progress)

    def _in_turn(
        self, templates: _Templates, ahead: Iterator[tuple[str, R | BaseException]], progress: Progress
    ) -> tuple[list[R], list[Issue], list[str]]:
        results: list[R] = []
        issues: list[Issue] = []
        notes: list[str] = []
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
                        result = self.stored(result)
                    computed[guid] = result
                result = computed[wanted]
                if isinstance(result, BaseException):
                    raise result
                if twin is not None:
                    result = self.move(result, space)
                    notes.append(
                        Note(
                            "Room {room} is equal to {template} in shape, orientation, materials, "
                            "windows and surroundings; it has the same {shared}.",
                            room=space.label,
                            template=twin.label,
                            shared=Note(self.shared),
                        )
                    )
            except RoomError as error:
                templates.drop(space)
                if len(self.spaces) == 1:
                    where = f"space {space.label}"
                    raise DataError(str(error), file=self.file, element=where) from error
                values = {"room": space.label, "reason": str(error)}
                issues.append(Issue("room-not-simulated", space.guid, values, Effect("room")))
                continue
            results.append(result)
            self.on_room(result)
        return results, issues, notes

    def _ahead(self, templates: _Templates, progress: Progress) -> Generator[tuple[str, R | BaseException]]:
        """Results of rooms that are computed in parallel, as they become ready."""
        if self.parallel is None:
            return
        rooms = []
        for number, space in enumerate(self.spaces, 1):
            if templates.of(space) is None:
                rooms.append(space)
            progress("equal rooms", number / len(self.spaces))
        progress(Stage("", "room", 1, len(rooms)), 0.0)
        with closing(self.parallel(rooms)) as ready:
            for done, (space, result) in enumerate(ready, 1):
                yield space.guid, result
                progress(Stage("", "room", min(done + 1, len(rooms)), len(rooms)), 0.0)


class _Templates:
    """Equal rooms: for each room the earlier room of the same shape and light."""

    def __init__(self, series: RoomSeries[R]) -> None:
        self._series = series
        self._group: dict[str, list[OutdoorLight]] = {}  # templates, by GUID
        for group in series.equal:
            templates: list[OutdoorLight] = []
            self._group |= dict.fromkeys((space.guid for space in group), templates)
        self._template: dict[str, Space | None] = {}

    def of(self, space: Space) -> Space | None:
        """An earlier equal room with the same light; None: the room is computed itself."""
        if space.guid not in self._template:
            series, group = self._series, self._group[space.guid]
            light = OutdoorLight(series.building, space, series.sampling, series.cache)
            twin = next((one.space for one in group if self._same(one, light)), None)
            if twin is None:
                group.append(light)
            self._template[space.guid] = twin
        return self._template[space.guid]

    def _same(self, one: OutdoorLight, other: OutdoorLight) -> bool:
        series, rooms = self._series, (one.space, other.space)
        return same_systems(*rooms, series.systems) and series.alike(*rooms) and one.same(other)

    def drop(self, space: Space) -> None:
        """Let no room be a copy of this one, which could not be computed."""
        group = self._group[space.guid]
        group[:] = [light for light in group if light.space.guid != space.guid]
        self._template = {
            guid: twin for guid, twin in self._template.items() if twin is None or twin.guid != space.guid
        }
