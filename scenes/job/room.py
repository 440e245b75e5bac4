"""One room from Python objects to all of its results; no file is read or written.

weather = read_weather(Path("city.epw"))
system = read_system(Path("blind.xml"))                 # scenes.job.inputs
building = read_ifc("house.ifc")                        # or bim.shoebox.shoebox(...)
space = building.spaces[0]
variants.activate()
result = compute_room(building, space, everywhere(space, system), weather, RoomOptions())
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from bim.model import Building, Space
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.weather import Weather
from scenes.job.daylight import room_daylight, room_matrices, room_scene, state_light
from scenes.job.glare import default_hours, room_glare, wanted_hours
from scenes.job.options import RoomOptions
from scenes.job.pictures import picture_maker
from scenes.job.skies import Skies, year_of_skies
from scenes.job.thermal import room_thermal
from scenes.job.windows import States
from scenes.results import GlareResults, SpaceResult

T = TypeVar("T")


def skies_for(weather: Weather, options: RoomOptions) -> Skies:
    """The year's skies as the method of the options needs them; the same for every room."""
    with_sun = options.method != "three-phase"
    return year_of_skies(weather, options.sky_subdivision, with_sun=with_sun)


def compute_room(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    weather: Weather,
    options: RoomOptions,
    *,
    skies: Skies | None = None,
    cache: MatrixCache | None = None,
    pictures: bool = True,
    progress: Progress = silent,
) -> SpaceResult:
    """Daylight, glare, temperatures and comfort of one room, with one method.

    A Mitsuba variant must be active (`mitsuba_cfs.variants.activate()`).

    Args:
        building: what stands around the room is its `elements`.
        systems: by window GUID the `System` in each shading state, from open to closed; one tuple
            of one system is the usual case, see `scenes.job.windows.everywhere`.
        options: method, hours of pictures, sensors, samples, seed; `RoomOptions()` is a full run.
        skies: `skies_for(weather, options)`, where several rooms share them.
        cache: where traced matrices are kept and found again, `MatrixCache.of_user()`.  Systems
            and weather do not enter V and D: variants of them cost only algebra.
        pictures: False leaves the luminance pictures and their glare out.

    Raises: `ValueError` for a room that cannot be computed (no work plane, no system for a window).
    """
    skies = skies or skies_for(weather, options)
    hours = wanted_hours(options.picture_hours, weather.midpoints, skies.lit)
    seconds: dict[str, float] = {}

    def timed(stage: str, work: Callable[[], T]) -> T:
        start = time.monotonic()
        result = work()
        seconds[stage] = round(time.monotonic() - start, 2)
        return result

    scene = room_scene(building, space, systems, options)

    def light():
        matrices = room_matrices(scene, options, cache, part(progress, 0.0, 0.6, "daylight"))
        J = scene.windows.states
        lights = [
            state_light(
                scene, matrices, j, skies, options, cache,
                part(progress, 0.6 + 0.3 * j / J, 0.6 + 0.3 * (j + 1) / J, "daylight"),
            )
            for j in range(J)
        ]  # fmt: skip
        state = np.zeros(len(skies.lit), dtype=np.int64)
        steps = part(progress, 0.9, 1.0, "daylight")
        result = room_daylight(scene, lights, state, skies, weather, options, steps)
        progress("daylight", 1.0)
        return matrices, lights, state, result

    matrices, lights, state, daylight = timed("daylight", light)

    def glare() -> GlareResults:
        if not pictures:
            return GlareResults(scene.view, ())
        maker = picture_maker(
            scene, matrices, lights, state, skies, options, part(progress, 0.0, 0.5, "pictures")
        )
        eye = np.stack([li.eye for li in lights])[state, np.arange(len(state))]
        chosen = hours or default_hours(weather.midpoints, skies.lit, eye)
        return room_glare(maker, chosen, part(progress, 0.5, 1.0, "pictures"))

    rated = timed("glare", glare)
    heat = timed(
        "thermal",
        lambda: room_thermal(
            building, space, scene, matrices.daylight, skies.whole_year(state), skies, weather,
            options, cache, progress,
        ),
    )  # fmt: skip
    return SpaceResult(space, daylight, rated, heat, seconds)
