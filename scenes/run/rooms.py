"""The rooms of a building in turn: equal ones computed once, impossible ones left out."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from bim.model import Building, Space
from bim.report.issue import Effect, Issue
from bim.templates import template_rooms
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.progress import Progress, Stage, item, silent
from scenes.fenestration.systems import States
from scenes.room.equal_rooms import OutdoorLight, same_systems

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

    def results(self, progress: Progress = silent) -> tuple[list[R], list[Issue], list[str]]:
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
    ) -> tuple[list[R], list[Issue], list[str]]:
        found, issues, notes = [], [], []
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
                values = {"room": space.label, "reason": str(error)}
                issues.append(Issue("room-not-simulated", space.guid, values, Effect("room")))
                continue
            found.append(result)
            self.on_room(result)
        return found, issues, notes

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
