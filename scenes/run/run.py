"""The main job from its files to the results of every room."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path

from bim.report.issue import issue_note
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import sun_directions
from scenes.head import Head
from scenes.input_files import InputFiles, sha256
from scenes.inputs import Inputs, read_inputs
from scenes.quick import NOTE
from scenes.results import RoomYear, RunResult
from scenes.room.skies import skies_for
from scenes.run.options import JobOptions
from scenes.run.rooms import OnLight, OnRoom, Workers, computed_rooms

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
        on_light: called with the light of each room as soon as it is computed, if the rooms' heat
            is balanced together.
        on_head: called with what was left out and assumed, before anything is traced.
        workers: compute several rooms at a time; None: this process, room by room.

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
        options: of the run; its files are named in the manifest only.
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
    results, issues, notes = computed_rooms(
        inputs, skies, options, progress, on_room=on_room, on_light=on_light, workers=workers
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
        *(result.borrowed for result in results if result.borrowed),
        *map(issue_note, leaks),
    ]
    return RunResult(
        building,
        weather.midpoints,
        sun,
        results,
        (*building.issues, *issues, *leaks),
        manifest,
        tuple(dict.fromkeys(notes)),
        room.method,
    )


def _manifest(
    options: JobOptions,
    variant: str,
    inputs: Inputs,
    results: Sequence[RoomYear],
) -> dict:
    """Inputs, options, versions and seed: the data to reproduce the results."""
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
