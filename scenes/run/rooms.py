"""The rooms of a building in turn: equal ones computed once, impossible ones left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from bim.model import Building, Problem, Space
from bim.templates import template_rooms
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.progress import Progress, item, silent
from scenes.fenestration.systems import States
from scenes.room.equal_rooms import same_light, same_systems

R = TypeVar("R")


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

    def results(self, progress: Progress = silent) -> tuple[list[R], list[Problem], list[str]]:
        """The results in the rooms' order, what was left out, and what was given twice.

        Raises: `DataError` where the only room cannot be computed.
        """
        computed: dict[str, R] = {}
        found, problems, notes = [], [], []
        equal = {s.guid: group for group in template_rooms(self.spaces) for s in group}
        for number, space in enumerate(self.spaces, 1):
            steps = item(progress, "room", number, len(self.spaces), space.label)
            try:
                twin = self._twin(space, equal[space.guid], computed)
                if twin is not None:
                    result = self.move(computed[twin.guid], space)
                    notes.append(
                        f"Room {space.label} is like {twin.label} in shape, orientation, "
                        f"materials, windows and in what shades it: its {self.given} those."
                    )
                else:
                    result = computed[space.guid] = self.compute(space, steps)
            except RoomError as error:
                if len(self.spaces) == 1:
                    where = f"space {space.label}"
                    raise DataError(str(error), file=self.file, element=where) from error
                problems.append(Problem(space.guid, str(error), "the room was left out of the run"))
                continue
            found.append(result)
            self.on_room(result)
        return found, problems, notes

    def _twin(
        self, space: Space, equal: Sequence[Space], computed: Mapping[str, R]
    ) -> Space | None:
        """A computed room that is equal and gets the same light."""
        return next(
            (
                other
                for other in equal
                if other.guid in computed
                and same_systems(other, space, self.systems)
                and self.alike(other, space)
                and same_light(self.building, other, space, self.sampling, self.cache)
            ),
            None,
        )
