"""The main job from its files to the results of every room."""

from __future__ import annotations

import platform
import time
import weakref
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.doorways import panes_between, source_rooms
from bim.energyplus_twin import EnergyPlusTwin, TwinAir
from bim.model import Space
from bim.report.issue import Issue, issue_note
from bim.sensors import model_grids
from bim.templates import same_hues, template_rooms
from bim.to_thermal import same_surfaces, shared_constructions
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import scratch_folder, sha256
from mitsuba_cfs.matrices.cache import MatrixCache, digest
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.source_code import code_version
from mitsuba_cfs.stored_arrays import PassedArrays, StoredArrays
from scenes.cluster import Requirements
from scenes.head import Head
from scenes.input_files import InputFiles
from scenes.inputs import Inputs, read_inputs
from scenes.language.catalogue import N_
from scenes.quick import NOTE
from scenes.results import RoomYear, RunResult, method_figures, method_notes
from scenes.room.control_groups import same_control
from scenes.room.energyplus import twin_of_rooms
from scenes.room.heat import DaylitRoom, OnZones, coupled_years
from scenes.room.inputs import skies_for
from scenes.room.operation import SharedYear
from scenes.room.operation_tables import OperationTables
from scenes.room.room import RoomChoices, compute_room, lit_room
from scenes.room.series import RoomSeries, moved_light, moved_result
from scenes.room.shared_states import with_shared_states
from scenes.room.zone import RoomZone
from scenes.run.first_plan import FROM, OnPlan, first_plan, options_for_error
from scenes.run.options import JobOptions
from scenes.run.together import RoomsTogether
from scenes.workers import Tasks, processes_for

OnLight = Callable[[DaylitRoom], None]  # called with the light of each room, before its heat
OnRoom = Callable[[RoomYear], None]  # called with each room as soon as it is computed


@dataclass(frozen=True, slots=True)
class Workers:
    """Processes or cluster that compute the rooms of a run in parallel."""

    processes: int | None = 1  # on this machine, a room each; None: as many as `processes_for` has
    scheduler: str | None = None  # address of a Dask scheduler; its workers replace the processes

    def for_rooms(self, rooms: int) -> Workers | None:
        """The same for a number of rooms; None: this process computes them."""
        processes = processes_for(rooms, self.processes)
        return None if processes == 1 and self.scheduler is None else Workers(processes, self.scheduler)


def computed_rooms(
    inputs: Inputs,
    skies: AnnualSky,
    options: JobOptions,
    progress: Progress,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    on_zones: OnZones | None = None,
    workers: Workers | None = None,
) -> tuple[Sequence[RoomYear], list[Issue], list[str]]:
    """The years of the rooms in their order, issues of rooms left out, notes.

    Rooms that exchange heat are balanced together, after the light of all of them.
    """
    coupled = balanced_together(inputs, options)
    spaces = run_spaces(inputs, options)
    operation = with_shared_states(
        inputs.operation,
        inputs.building,
        spaces,
        inputs.systems,
        inputs.weather,
        options.room,
        skies=skies,
        cache=MatrixCache.of_user() if options.cache else None,
        inner=options.inner_glass,
        progress=progress,
    )
    if operation is not inputs.operation:
        inputs = replace(inputs, operation=operation)
    store = StoredArrays() if len(spaces) > 1 else None
    with scratch_folder() as folder:
        equal = template_rooms(spaces)
        if workers is not None:
            workers = workers.for_rooms(len(equal))
        together = RoomsTogether(inputs, equal, skies, options, folder)
        work = RoomWork(inputs, spaces, skies, options, together, with_heat=not coupled)
        series = RoomSeries(
            inputs.building,
            spaces,
            equal,
            inputs.systems,
            options.room.sampling,
            MatrixCache.of_user() if options.cache else None,
            work,
            moved_light if coupled else moved_result,
            options.building,
            partial(_interchangeable, inputs, options),
            on_room=(on_light if coupled else on_room) or _ignore,
            shared=N_("daylight, glare and solar gains") if coupled else N_("results"),
            parallel=None if workers is None else partial(work.parallel, workers=workers),
            stored=_unchanged if store is None else store.stored,
        )
        results, issues, notes = series.results(progress)
    if not coupled:
        return _read_back(results, store), issues, notes
    years: list[RoomYear] = []
    if results:
        tables = OperationTables() if inputs.operation is None else inputs.operation.tables
        years, coupling = coupled_years(
            results,
            inputs.weather,
            options.room.heat_step_s,
            tables,
            progress,
            store=store,
            seed=options.room.sampling.seed,
            on_zones=on_zones,
        )
        variants.return_memory()
        notes += coupling if len(years) > 1 else []
    rooms = _read_back(years, store)
    for room in rooms if on_room is not None else ():
        on_room(room)
    return rooms, issues, notes


def balanced_together(inputs: Inputs, options: JobOptions) -> bool:
    """Whether the heat of a run's rooms is balanced after the light of all: it flows between them."""
    return options.coupled_heat and (len(inputs.spaces) > 1 or options.energyplus)


def run_spaces(inputs: Inputs, options: JobOptions) -> Sequence[Space]:
    """The rooms of a run; in coupled rooms both sides of a wall have the same construction."""
    if not balanced_together(inputs, options):
        return inputs.spaces
    return list(shared_constructions(inputs.spaces))


def _interchangeable(inputs: Inputs, options: JobOptions, one: Space, other: Space) -> bool:
    """Whether the results of one of two rooms of equal shape and light are those of the other."""
    building, operation = inputs.building, inputs.operation
    rooms = (one, other)
    if options.inner_glass and any(source_rooms(building, room) for room in rooms):
        return False  # their light depends on their neighbours
    if any(model_grids(building, room) for room in rooms):
        return False
    if not same_control(None if operation is None else operation.tables, building, one, other):
        return False
    if options.colour and not same_hues(one, other):
        return False
    if not balanced_together(inputs, options):
        return True
    if any(panes_between(building.spaces, room) for room in rooms):
        return False  # sun passes to the rooms beyond
    return same_surfaces(one, other)


def _read_back(rooms: list[RoomYear], store: StoredArrays | None) -> Sequence[RoomYear]:
    """The rooms, each read from disk and released again where they are stored there."""
    return tuple(rooms) if store is None else PassedArrays(store, rooms)


def _ignore(room: object) -> None:
    """No reaction to a room."""


def _unchanged(room: RoomYear | DaylitRoom) -> RoomYear | DaylitRoom:
    """A result in memory."""
    return room


@dataclass(frozen=True, slots=True)
class RoomWork:
    """The computation of each room of a run."""

    inputs: Inputs
    spaces: Sequence[Space]  # `run_spaces`
    skies: AnnualSky
    options: JobOptions
    together: RoomsTogether  # traces the matrices of several rooms at once
    with_heat: bool  # False: light alone, the heat of all rooms is balanced together

    def __call__(self, space: Space, progress: Progress = silent) -> RoomYear | DaylitRoom:
        """The result of a room."""
        inputs, options = self.inputs, self.options
        cache = self.together.cache_for(space, progress)
        choices: RoomChoices = {
            "operation": inputs.operation,
            "skies": self.skies,
            "cache": cache,
            "explore": options.explore,
            "colour": options.colour,
            "inner": options.inner_glass,
            "progress": progress,
        }
        room = inputs.building, space, inputs.systems, inputs.weather, options.room
        result: RoomYear | DaylitRoom
        if self.with_heat:
            result = compute_room(*room, **choices)
        else:
            choices["together"] = [one.guid for one in self.spaces]
            result = lit_room(*room, **choices)
            progress("heat", 1.0)
        variants.return_memory()
        return result

    def parallel(
        self, spaces: Sequence[Space], *, workers: Workers
    ) -> Generator[tuple[Space, RoomYear | DaylitRoom | BaseException]]:
        """Each room with its result or its error, in any order."""
        rooms = {space.guid: space for space in spaces}
        here = workers.scheduler is None
        run = "" if here else _identity(self.options, self.inputs)
        together = self.together.for_processes()
        compute = _Here(replace(self, together=together)) if here else self._from_files(run)
        left = Counter(together.set_of(guid) for guid in rooms)
        tasks = Tasks(
            list(rooms),
            compute,
            _failed,
            key=lambda guid: f"{run}{guid}",
            scene=together.set_of if here else lambda guid: guid,  # a cluster has no common folder
            needs=Requirements() if here else _requirements(self.inputs),
        )
        with closing(tasks.results(**asdict(workers))) as results:
            for guid, result in results:
                yield rooms[guid], result
                number = together.set_of(guid)
                left[number] -= 1
                if not left[number]:
                    together.remove(number)

    def _from_files(self, run: str) -> _FromFiles:
        operation = self.inputs.operation
        return _FromFiles(self.with_heat, self.options, run, {} if operation is None else operation.shared)

    def of(self, guid: str) -> RoomYear | DaylitRoom:
        """The result of the room with a GUID."""
        return self(next(space for space in self.spaces if space.guid == guid))


@dataclass(frozen=True, slots=True)
class _Here:
    """Computes a room by its GUID, from inputs in memory."""

    work: RoomWork

    def __call__(self, guid: str) -> tuple[str, RoomYear | DaylitRoom]:
        variants.activate()
        return guid, self.work.of(guid)


@dataclass(frozen=True, slots=True)
class _FromFiles:
    """Computes a room by its GUID, from files read on the worker, once in each process.

    Raises: `DataError` for a worker with other files or another version of the program.
    """

    with_heat: bool
    options: JobOptions
    run: str  # `_identity` of the run
    shared: Mapping[str, SharedYear]  # states of groups of several rooms

    def __call__(self, guid: str) -> tuple[str, RoomYear | DaylitRoom]:
        variants.activate()
        inputs, together, spaces, skies = _read(self.options, self.run)
        if inputs.operation is not None:
            inputs = replace(inputs, operation=replace(inputs.operation, shared=self.shared))
        work = RoomWork(inputs, spaces, skies, self.options, together, with_heat=self.with_heat)
        return guid, work.of(guid)


@lru_cache(maxsize=1)
def _read(options: JobOptions, run: str) -> tuple[Inputs, RoomsTogether, Sequence[Space], AnnualSky]:
    inputs, room = read_inputs(options, inner=options.inner_glass), options.room
    if _identity(options, inputs) != run:
        message = "a worker has other input files or another version of the program"
        raise DataError(message, field="--scheduler")
    skies = skies_for(inputs.weather, room.sampling, **room.sky)
    spaces, folder = run_spaces(inputs, options), ExitStack()
    place = folder.enter_context(scratch_folder())
    together = RoomsTogether(inputs, template_rooms(spaces), skies, options, place)
    weakref.finalize(together, folder.close)  # with the next run, and at the end
    return inputs, together, spaces, skies


def _failed(guid: str, error: BaseException) -> tuple[str, BaseException]:
    return guid, error


def _identity(options: JobOptions, inputs: Inputs) -> str:
    """Hash of options, program and contents of the files, before the keys of a run's rooms."""
    files = [sha256(path) for path in inputs.files.values()]
    return digest(repr(options), code_version(__name__), files)[:16] + "-"


def _requirements(inputs: Inputs) -> Requirements:
    return Requirements.of(__name__, {path: sha256(path) for path in inputs.files.values()})


OnHead = Callable[[Head], None]  # called as soon as all inputs are read


def run_job(
    options: JobOptions,
    progress: Progress = silent,
    files: InputFiles | None = None,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    on_head: OnHead | None = None,
    on_plan: OnPlan | None = None,
    workers: Workers | None = None,
) -> RunResult:
    """Daylight, glare, temperatures and comfort of the chosen rooms.

    Args:
        files: of `scenes.run.files.read_files`; read now by default.
        on_room: called with each room as soon as it is computed, in the rooms' order.
        on_light: called with the light of each room as soon as it is computed, if the rooms' heat
            is balanced together.
        on_head: called with what was left out and assumed, before anything is traced.
        on_plan: called with first figures of all rooms where these are many, before the rest.
        workers: compute several rooms at a time; None: this process, room by room.

    Raises: `DataError` for a file that cannot be used, before anything is traced.
    """
    start = time.monotonic()
    inputs = read_inputs(options, files, progress, inner=options.inner_glass, heat_of=options.room)
    if on_head is not None:
        on_head(inputs.head)
    return run_inputs(
        inputs, options, progress, on_room=on_room, on_light=on_light, on_plan=on_plan, workers=workers, start=start
    )


def run_inputs(
    inputs: Inputs,
    options: JobOptions,
    progress: Progress = silent,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    on_plan: OnPlan | None = None,
    workers: Workers | None = None,
    start: float | None = None,
) -> RunResult:
    """Daylight, glare, temperatures and comfort of the rooms of `inputs`.

    Args:
        options: of the run; its files are named in the manifest only.
        start: when the run began, by `time.monotonic`; now by default.
    """
    start = time.monotonic() if start is None else start
    building, weather = inputs.building, inputs.weather
    head = inputs.head
    sun = sun_directions(weather)
    variant = variants.activate()
    if options.error is not None or (on_plan is not None and len(inputs.spaces) >= FROM):
        plan = first_plan(inputs, run_spaces(inputs, options), options, progress)
        if options.error is not None:
            room = options_for_error(options.room, plan, options.error)
            options = replace(options, room=room)
        if on_plan is not None and plan:
            on_plan(plan)
    progress("sky", 0.0)
    room = options.room
    skies = skies_for(weather, room.sampling, **room.sky)
    progress("sky", 1.0)
    twins: list[EnergyPlusTwin] = []

    def twin(zones: Sequence[RoomZone], links: NDArray[np.float64]) -> None:
        terrain = (OperationTables() if inputs.operation is None else inputs.operation.tables).terrain
        of = inputs.building, zones, inputs.systems, weather
        steps = round(3600.0 / room.heat_step_s)
        twins.append(twin_of_rooms(*of, air=TwinAir(links), terrain=terrain, steps=steps))

    results, issues, notes = computed_rooms(
        inputs,
        skies,
        options,
        progress,
        on_room=on_room,
        on_light=on_light,
        on_zones=twin if options.energyplus else None,
        workers=workers,
    )
    if not results:
        raise DataError("none of its rooms could be computed", file=options.building)
    leaks = [issue for result in results for issue in result.issues]
    manifest = _manifest(options, variant, inputs, results) | {"head": head.record}
    manifest["seconds"] = round(time.monotonic() - start, 1)
    notes = [
        *([NOTE] if options.quick else []),
        *head.notes,
        *notes,
        *method_notes(map(method_figures, results)),
        *(result.borrowed for result in results if result.borrowed),
        *map(issue_note, leaks),
        *(f"model.epJSON: {note}." for one in twins for note in one.notes),
    ]
    return RunResult(
        building,
        weather.midpoints,
        sun,
        results,
        (*head.issues, *issues, *leaks),
        manifest,
        tuple(dict.fromkeys(notes)),
        room.method,
        head,
        twins[0] if twins else None,
    )


def _manifest(options: JobOptions, variant: str, inputs: Inputs, results: Sequence[RoomYear]) -> dict[str, Any]:
    """Inputs, options, versions and seed: the data to reproduce the results."""
    packages = ("mitsuba-cfs", "mitsuba", "drjit", "numpy", "ifcopenshell", "pvlib")
    return {
        "quick": options.quick,
        "inputs": {name: {"path": str(path), "sha256": sha256(path)} for name, path in inputs.files.items()},
        "building": inputs.building.name,
        "site": inputs.weather.site,
        "weather_notes": list(inputs.weather.notes),
        "system": ", ".join(dict.fromkeys(used_system.name for used_system in inputs.used_systems)),
        "fenestration": inputs.sources,
        "options": {
            key: str(value)
            if isinstance(value, Path)
            else [str(file) for file in value]
            if key in ("surroundings", "linked")
            else value
            for key, value in options.named().items()
        },
        "seed": options.room.sampling.seed,
        "variant": variant,
        "versions": {"python": platform.python_version(), **{name: metadata.version(name) for name in packages}},
        "rooms": {result.space.guid: result.seconds for result in results},
    }
