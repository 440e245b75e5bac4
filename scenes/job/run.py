"""The main job from its three files to the results of every room."""

from __future__ import annotations

import platform
import time
from dataclasses import asdict
from importlib import metadata
from pathlib import Path

import numpy as np

from bim.model import Building, Problem, Space
from bim.read_ifc import read_ifc
from mitsuba_cfs import variants
from mitsuba_cfs.errors import CfsError, DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.job.glare import wanted_hours
from scenes.job.inputs import System, chosen_spaces, read_system, read_weather, sha256
from scenes.job.options import JobOptions
from scenes.job.room import compute_room, skies_for
from scenes.job.thermal import thermal_system
from scenes.job.windows import everywhere
from scenes.results import RunResult, SpaceResult

FAR_SITE_DEG = 2.0  # a weather station further than this from the building's site is reported


def run_job(options: JobOptions, progress: Progress = silent) -> RunResult:
    """Daylight, glare, temperatures and comfort of the chosen rooms.

    Raises: `DataError` for a file that cannot be used, before anything is traced.
    """
    start = time.monotonic()
    building, weather, system, spaces = _read(options, progress)
    thermal = thermal_system(system)
    cache = MatrixCache.of_user() if options.cache else None
    sun = sun_directions(weather)
    wanted_hours(options.picture_hours, weather.midpoints, np.flatnonzero(is_up(sun)))
    variant = variants.activate()
    progress("sky", 0.0)
    skies = skies_for(weather, options)
    progress("sky", 1.0)
    results, problems = [], list(building.problems)
    for space in spaces:
        label = f"{space.name or space.guid}: "
        try:
            results.append(
                compute_room(
                    building, space, everywhere(space, system), weather, options,
                    skies=skies, cache=cache, progress=_labelled(progress, label),
                )
            )  # fmt: skip
        except (CfsError, ValueError) as error:
            if isinstance(error, DataError):
                raise
            if len(spaces) == 1:
                where = f"space {space.name or space.guid}"
                raise DataError(str(error), file=options.building, element=where) from error
            problems.append(Problem(space.guid, str(error), "the room was left out of the run"))
    if not results:
        raise DataError("none of its rooms could be computed", file=options.building)
    manifest = _manifest(options, variant, building, weather, system, results)
    manifest["seconds"] = round(time.monotonic() - start, 1)
    notes = (*system.notes, *thermal.notes, *_site_notes(building, weather))
    return RunResult(
        building, weather.midpoints, sun, tuple(results), tuple(problems), manifest, notes
    )


def _read(options: JobOptions, progress: Progress) -> tuple[Building, Weather, System, list[Space]]:
    """The inputs, the quick ones first."""
    system = read_system(options.system, u_value=options.u_value, g_value=options.g_value)
    weather = read_weather(options.weather)
    progress("inputs", 0.1)
    building = read_ifc(options.building, progress=part(progress, 0.1, 1.0, "inputs"))
    spaces = chosen_spaces(building, options.spaces, options.building)
    progress("inputs", 1.0)
    return building, weather, system, spaces


def _labelled(progress: Progress, label: str) -> Progress:
    """Progress with the room's name before each stage."""
    return lambda stage, fraction: progress(label + stage, fraction)


def _manifest(
    options: JobOptions,
    variant: str,
    building: Building,
    weather: Weather,
    system: System,
    results: list[SpaceResult],
) -> dict:
    """What a reader needs to make the same numbers again."""
    files = {"building": options.building, "weather": options.weather, "system": options.system}
    beside = options.system.with_suffix(".toml")
    if beside.is_file():
        files["system_thermal"] = beside
    packages = ("mitsuba-cfs", "mitsuba", "drjit", "numpy", "ifcopenshell", "pvlib")
    return {
        "inputs": {
            name: {"path": str(path), "sha256": sha256(path)} for name, path in files.items()
        },
        "building": building.name,
        "site": weather.site,
        "system": system.name,
        "options": {
            key: str(value) if isinstance(value, Path) else value
            for key, value in asdict(options).items()
        },
        "seed": options.seed,
        "variant": variant,
        "versions": {
            "python": platform.python_version(),
            **{name: metadata.version(name) for name in packages},
        },
        "rooms": {result.space.guid: result.seconds for result in results},
    }


def _site_notes(building: Building, weather: Weather) -> tuple[str, ...]:
    """A sentence where building and weather lie far apart."""
    if building.latitude_deg is None or building.longitude_deg is None:
        return ()
    north = building.latitude_deg - weather.latitude_deg
    east = (building.longitude_deg - weather.longitude_deg + 180) % 360 - 180
    if max(abs(north), abs(east)) <= FAR_SITE_DEG:
        return ()
    return (
        f"The building's site ({building.latitude_deg:.1f} N, {building.longitude_deg:.1f} E) is "
        f"far from the weather station {weather.site} ({weather.latitude_deg:.1f} N, "
        f"{weather.longitude_deg:.1f} E): the sun is the weather station's.",
    )
