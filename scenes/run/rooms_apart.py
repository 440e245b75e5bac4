"""Rooms of a run computed in this process, in parallel processes, or on a Dask cluster."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Generic, TypeVar

from bim.model import Space
from bim.to_thermal import shared_constructions
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.source_code import code_version
from scenes.input_files import sha256
from scenes.inputs import Inputs, read_inputs
from scenes.room.skies import skies_for
from scenes.run.options import JobOptions
from scenes.workers import Tasks

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Workers:
    """Processes or cluster that compute the rooms of a run in parallel."""

    processes: int = 1  # on this machine, a room each
    scheduler: str | None = None  # address of a Dask scheduler; its workers replace the processes


@dataclass(frozen=True, slots=True)
class RoomWork(Generic[R]):
    """The computation of each room of a run."""

    function: Callable[..., R]  # `compute_room` or `lit_room`
    inputs: Inputs
    spaces: Sequence[Space]  # `run_spaces`
    skies: AnnualSky
    options: JobOptions

    def __call__(self, space: Space, progress: Progress = silent) -> R:
        """The result of a room."""
        inputs, options = self.inputs, self.options
        cache = MatrixCache.of_user() if options.cache else None
        return self.function(
            inputs.building, space, inputs.systems, inputs.weather, options.room,
            operation=inputs.operation, skies=self.skies, cache=cache, explore=options.explore,
            colour=options.colour, inner=options.inner_glass, progress=progress,
        )  # fmt: skip

    def parallel(
        self, spaces: Sequence[Space], *, workers: Workers
    ) -> Generator[tuple[Space, R | BaseException]]:
        """Each room with its result or its error, in any order."""
        rooms = {space.guid: space for space in spaces}
        here = workers.scheduler is None
        run = "" if here else _identity(self.options, self.inputs)
        compute = _Here(self) if here else _FromFiles(self.function, self.options, run)
        tasks = Tasks(
            list(rooms), compute, _failed, key=lambda guid: f"{run}{guid}", scene=lambda guid: guid
        )
        with closing(tasks.results(**asdict(workers))) as results:
            for guid, result in results:
                yield rooms[guid], result

    def of(self, guid: str) -> R:
        """The result of the room with a GUID."""
        return self(next(space for space in self.spaces if space.guid == guid))


@dataclass(frozen=True, slots=True)
class _Here(Generic[R]):
    """Computes a room by its GUID, from inputs in memory."""

    work: RoomWork[R]

    def __call__(self, guid: str) -> tuple[str, R]:
        variants.activate()
        return guid, self.work.of(guid)


@dataclass(frozen=True, slots=True)
class _FromFiles(Generic[R]):
    """Computes a room by its GUID, from files read on the worker, once in each process.

    Raises: `DataError` for a worker with other files or another version of the program.
    """

    function: Callable[..., R]
    options: JobOptions
    run: str  # `_identity` of the run

    def __call__(self, guid: str) -> tuple[str, R]:
        variants.activate()
        return guid, RoomWork(self.function, *_read(self.options, self.run), self.options).of(guid)


@lru_cache(maxsize=1)
def _read(options: JobOptions, run: str) -> tuple[Inputs, Sequence[Space], AnnualSky]:
    inputs, room = read_inputs(options, inner=options.inner_glass), options.room
    if _identity(options, inputs) != run:
        message = "a worker has other input files or another version of the program"
        raise DataError(message, field="--scheduler")
    skies = skies_for(inputs.weather, room.method, room.sampling, **room.sky)
    return inputs, run_spaces(inputs, options), skies


def balanced_together(inputs: Inputs, options: JobOptions) -> bool:
    """Whether heat flows between the rooms of a run."""
    return options.coupled_heat and len(inputs.spaces) > 1


def run_spaces(inputs: Inputs, options: JobOptions) -> Sequence[Space]:
    """The rooms of a run; of those balanced together two sides of a wall are built alike."""
    if not balanced_together(inputs, options):
        return inputs.spaces
    return list(shared_constructions(inputs.spaces))


def _failed(guid: str, error: BaseException) -> tuple[str, BaseException]:
    return guid, error


def _identity(options: JobOptions, inputs: Inputs) -> str:
    """Hash of options, program and contents of the files, before the keys of a run's rooms."""
    parts = [repr(options), code_version(__name__)]
    parts += map(sha256, inputs.files.values())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16] + "-"
