"""The main job from its files to the results of every room."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TypeVar

from bim.model import Space
from bim.report.issue import Issue, issue_text
from bim.sensors import model_grids
from bim.templates import same_hues
from bim.to_thermal import same_surfaces
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.stored_arrays import PassedArrays, StoredArrays
from scenes.head import Head
from scenes.input_files import InputFiles, sha256
from scenes.inputs import Inputs, read_inputs
from scenes.quick import NOTE
from scenes.results import RoomYear, RunResult
from scenes.room.heat import DaylitRoom, coupled_years
from scenes.room.inner_glass import source_rooms
from scenes.room.operation_tables import OperationTables
from scenes.room.room import compute_room, lit_room
from scenes.room.series import RoomSeries, moved_light, moved_result
from scenes.room.skies import skies_for
from scenes.run.options import JobOptions
from scenes.run.rooms_apart import RoomWork, Workers, balanced_together, run_spaces

R = TypeVar("R")

OnLight = Callable[[DaylitRoom], None]  # called with each room's light where its heat comes later
OnRoom = Callable[[RoomYear], None]  # called with each room as soon as it is computed
OnHead = Callable[[Head], None]  # called as soon as all inputs are read


def run_job(
    options: JobOptions,
    progress: Progress = silent,
    files: InputFiles | None = None,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    on_head: OnHead | None = None,
    workers: Workers | None = None,
) -> RunResult:
    """Daylight, glare, temperatures and comfort of the chosen rooms.

    Args:
        files: of `scenes.run.files.read_files`; read now by default.
        on_room: called with each room as soon as it is computed, in the rooms' order.
        on_light: called with the light of each room as soon as that is there, where rooms'
            heat is balanced together.
        on_head: called with what was left out and assumed, before anything is traced.
        workers: that the rooms' light comes from; None: this process, room by room.

    Raises: `DataError` for a file that cannot be used, before anything is traced.
    """
    start = time.monotonic()
    inputs = read_inputs(options, files, progress, inner=options.inner_glass)
    if on_head is not None:
        on_head(inputs.head)
    return run_inputs(
        inputs, options, progress,
        on_room=on_room, on_light=on_light, workers=workers, start=start,
    )  # fmt: skip


def run_inputs(
    inputs: Inputs,
    options: JobOptions,
    progress: Progress = silent,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    workers: Workers | None = None,
    start: float | None = None,
) -> RunResult:
    """Daylight, glare, temperatures and comfort of the rooms of `inputs`.

    Args:
        options: what was chosen; its files are named in the manifest only.
        start: when the run began, by `time.monotonic`; now by default.
    """
    start = time.monotonic() if start is None else start
    building, weather = inputs.building, inputs.weather
    head = inputs.head
    sun = sun_directions(weather)
    variant = variants.activate()
    progress("sky", 0.0)
    room = options.room
    skies = skies_for(weather, room.method, room.sampling, **room.sky)
    progress("sky", 1.0)
    heard = {"on_room": on_room, "on_light": on_light, "workers": workers}
    results, issues, notes = _rooms(inputs, skies, options, progress, **heard)
    if not results:
        raise DataError("none of its rooms could be computed", file=options.building)
    holes = [issue for result in results for issue in result.issues]
    manifest = _manifest(options, variant, inputs, results) | {"head": head.record}
    manifest["seconds"] = round(time.monotonic() - start, 1)
    notes = [
        *([NOTE] if options.quick else []),
        *head.notes,
        *notes,
        *(result.borrowed for result in results if result.borrowed),
        *(f"{issue_text(hole, 'command').line}." for hole in holes),
    ]
    return RunResult(
        building,
        weather.midpoints,
        sun,
        results,
        (*building.issues, *issues, *holes),
        manifest,
        tuple(dict.fromkeys(notes)),
        room.method,
    )


def _rooms(
    inputs: Inputs,
    skies: AnnualSky,
    options: JobOptions,
    progress: Progress,
    *,
    on_room: OnRoom | None = None,
    on_light: OnLight | None = None,
    workers: Workers | None = None,
) -> tuple[Sequence[RoomYear], list[Issue], list[str]]:
    """The results of the rooms in their order, what was left out, and what was given twice."""
    spaces = run_spaces(inputs, options)
    store = StoredArrays() if len(spaces) > 1 else None
    if not balanced_together(inputs, options):
        alone = RoomWork(compute_room, inputs, spaces, skies, options)
        series = _series(alone, workers, alone, moved_result, store)
        series = replace(series, on_room=on_room or (lambda room: None))
        found, issues, notes = series.results(progress)
        return _passed(found, store), issues, notes

    def compute_light(space: Space, steps: Progress) -> DaylitRoom:
        found = light(space, steps)
        steps("heat", 1.0)
        return found

    light = RoomWork(lit_room, inputs, spaces, skies, options)
    together = _series(light, workers, compute_light, moved_light, store, same_surfaces)
    heard = on_light or (lambda room: None)
    together = replace(together, on_room=heard, shared="daylight, glare and sun are")
    lit, issues, notes = together.results(progress)
    years, said = _coupled(lit, inputs, options, progress, store)
    found = _passed(years, store)
    for room in found if on_room is not None else ():
        on_room(room)
    return found, issues, [*notes, *said]


def _passed(rooms: list[RoomYear], store: StoredArrays | None) -> Sequence[RoomYear]:
    """The rooms, out of memory once they are passed where they are held on disk."""
    return tuple(rooms) if store is None else PassedArrays(store, rooms)


def _coupled(
    rooms: list[DaylitRoom],
    inputs: Inputs,
    options: JobOptions,
    progress: Progress,
    store: StoredArrays | None = None,
) -> tuple[list[RoomYear], tuple[str, ...]]:
    """The years of rooms balanced together, and what that means in words."""
    if not rooms:
        return [], ()
    tables = OperationTables() if inputs.operation is None else inputs.operation.tables
    step_s = options.room.heat_step_s
    years, said = coupled_years(rooms, inputs.weather, step_s, tables, progress, store=store)
    variants.return_memory()
    return years, (said,) if len(years) > 1 else ()


def _series(
    work: RoomWork[R],
    workers: Workers | None,
    compute: Callable[[Space, Progress], R],
    move: Callable[[R, Space], R],
    store: StoredArrays | None,
    alike: Callable[[Space, Space], bool] = lambda one, other: True,
) -> RoomSeries[R]:
    """The rooms of a run.

    Args: store: of their arrays; alike: whether one of two equal rooms may stand for the other.
    """
    inputs, options = work.inputs, work.options

    def borrows(*spaces: Space) -> bool:
        """Whether what a room gets depends on a neighbour: then none stands for another."""
        return options.inner_glass and any(source_rooms(inputs.building, space) for space in spaces)

    return RoomSeries(
        inputs.building,
        work.spaces,
        inputs.systems,
        options.room.sampling,
        MatrixCache.of_user() if options.cache else None,
        compute,
        move,
        options.building,
        lambda one, other: (
            not borrows(one, other)
            and not any(model_grids(inputs.building, space) for space in (one, other))
            and _operated_alike(inputs, one, other)
            and (not options.colour or same_hues(one, other))
            and alike(one, other)
        ),
        parallel=None if workers is None else partial(work.parallel, workers=workers),
        stored=(lambda result: result) if store is None else store.kept,
    )


def _operated_alike(inputs: Inputs, one: Space, other: Space) -> bool:
    if inputs.operation is None:
        return True
    tables, building = inputs.operation.tables, inputs.building
    return tables.of_room(building, one) == tables.of_room(building, other)


def _manifest(
    options: JobOptions,
    variant: str,
    inputs: Inputs,
    results: Sequence[RoomYear],
) -> dict:
    """What a reader needs to make the same numbers again."""
    packages = ("mitsuba-cfs", "mitsuba", "drjit", "numpy", "ifcopenshell", "pvlib")
    return {
        "quick": options.quick,
        "inputs": {
            name: {"path": str(path), "sha256": sha256(path)} for name, path in inputs.files.items()
        },
        "building": inputs.building.name,
        "site": inputs.weather.site,
        "weather_notes": list(inputs.weather.notes),
        "system": ", ".join(dict.fromkeys(one.name for one in inputs.used_systems)),
        "fenestration": inputs.sources,
        "options": {
            key: str(value)
            if isinstance(value, Path)
            else [str(file) for file in value]
            if key == "surroundings"
            else value
            for key, value in options.named().items()
        },
        "seed": options.room.sampling.seed,
        "variant": variant,
        "versions": {
            "python": platform.python_version(),
            **{name: metadata.version(name) for name in packages},
        },
        "rooms": {result.space.guid: result.seconds for result in results},
    }
