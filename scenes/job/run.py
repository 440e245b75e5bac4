"""The main job from its three files to the results of every room."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import asdict
from importlib import metadata
from pathlib import Path

import numpy as np

from bim.model import Building, Problem, Space
from bim.read_ifc import read_ifc
from mitsuba_cfs import variants
from mitsuba_cfs.errors import CfsError, DataError
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.matrix import sky_matrix, sun_up
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.job.daylight import Skies, room_daylight, room_scene
from scenes.job.glare import default_hours, room_glare, wanted_hours
from scenes.job.inputs import System, chosen_spaces, read_system, read_weather, sha256
from scenes.job.options import JobOptions
from scenes.job.thermal import ThermalSystem, room_thermal, thermal_system
from scenes.results import RunResult, SpaceResult

FAR_SITE_DEG = 2.0  # a weather station further than this from the building's site is reported


def run_job(options: JobOptions, progress: Progress = silent) -> RunResult:
    """Daylight, glare, temperatures and comfort of the chosen rooms.

    Raises: `DataError` for a file that cannot be used, before anything is traced.
    """
    start = time.monotonic()
    building, weather, system, spaces = _read(options, progress)
    thermal = thermal_system(system)
    sun = sun_directions(weather)
    hours = wanted_hours(options.picture_hours, weather.midpoints, np.flatnonzero(is_up(sun)))
    variant = variants.activate()
    progress("sky", 0.0)
    skies = year_of_skies(weather, options)
    progress("sky", 1.0)
    results, problems = [], list(building.problems)
    for space in spaces:
        label = f"{space.name or space.guid}: "
        try:
            results.append(
                _room(
                    building,
                    space,
                    system,
                    thermal,
                    skies,
                    weather,
                    hours,
                    options,
                    progress,
                    label,
                )
            )
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


def year_of_skies(weather: Weather, options: JobOptions) -> Skies:
    """Sky matrices of the hours with the sun up."""
    visible, solar = (
        sky_matrix(weather, options.sky_subdivision, band, sun_up_only=True, dtype=np.float32)
        for band in ("visible", "solar")
    )
    return Skies(visible, solar, np.flatnonzero(sun_up(weather)), len(weather.times))


def _room(
    building: Building,
    space: Space,
    system: System,
    thermal: ThermalSystem,
    skies: Skies,
    weather: Weather,
    hours: list[int],
    options: JobOptions,
    progress: Progress,
    label: str,
) -> SpaceResult:
    """All results of one room."""
    seconds: dict[str, float] = {}

    def staged(stage: str, fraction: float) -> None:
        progress(label + stage, fraction)

    def timed(stage: str, work: Callable):
        start = time.monotonic()
        result = work()
        seconds[stage] = round(time.monotonic() - start, 2)
        return result

    scene = room_scene(building, space, options)
    daylight, luminance, eye = timed(
        "daylight", lambda: room_daylight(scene, system, skies, weather, options, staged)
    )
    hours = hours or default_hours(weather.midpoints, skies.lit, eye)
    glare = timed("glare", lambda: room_glare(scene, luminance, skies, hours, options, staged))
    heat = timed(
        "thermal",
        lambda: room_thermal(
            building, space, scene, system, thermal, skies, weather, options, staged
        ),
    )
    return SpaceResult(space, daylight, glare, heat, seconds)


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
