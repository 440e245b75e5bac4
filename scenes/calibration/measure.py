"""Measuring what the methods cost on this machine."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import numpy as np

from bim.shoebox import shoebox
from mitsuba_cfs.files import scratch_folder
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, part, silent
from scenes.calibration.costs import GLARE, HEAT, Calibration, machine_name
from scenes.cost.measure import Cost
from scenes.cost.reference import reference_costs
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import read_system
from scenes.input_files import read_weather
from scenes.room.inputs import skies_for
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room
from scenes.room.windows import in_all_windows

PHASES = ("three-phase", "five-phase")


def calibrated(size: int, *, progress: Progress = silent) -> Calibration:
    """The costs of this machine, measured now: a few minutes.

    Args: size: pixels of a side of the pictures.
    """
    options = {"size": size, "metrics": GLARE}
    glare = reference_costs(progress=part(progress, 0.0, 0.7), **options)
    options = {"size": size, "methods": ["point-in-time"], "metrics": ["illuminance"]}
    paths = reference_costs(progress=part(progress, 0.7, 0.8), **options)
    rooms = room_costs(part(progress, 0.8, 1.0))
    made = datetime.now().astimezone().isoformat(timespec="seconds")
    return Calibration(machine_name(), made, size, (*glare, *paths, *rooms))


def room_costs(progress: Progress = silent, options: RoomOptions | None = None) -> list[Cost]:
    """Illuminance of a year by the phase methods, and heat, of a room as a study computes it.

    The first system of a room has all traced, another one finds V and D; what it takes is shared
    out over the lit hours.
    """
    options = options or RoomOptions()
    weather, system = read_weather(WEATHER), read_system(VENETIAN_BLIND)
    building = shoebox(3.65, 4.6, 3.0)
    space, result = building.spaces[0], []
    darker = replace(system.visible, transmission_front=0.9 * np.asarray(system.visible.transmission_front))
    systems = (system, system, replace(system, visible=darker))
    for number, method in enumerate(PHASES):
        chosen = replace(options, method=method)
        skies = skies_for(weather, chosen.sampling)
        with scratch_folder() as folder:
            cold, warm = MatrixCache(folder / "cold"), MatrixCache(folder / "warm")
            timed = [
                compute_room(
                    building,
                    space,
                    in_all_windows(space, each),
                    weather,
                    chosen,
                    skies=skies,
                    cache=cache,
                    pictures=False,
                ).seconds
                for each, cache in zip(systems, (cold, warm, warm), strict=True)
            ]
        _, first, again = timed  # the very first compiles kernels
        stages = {"daylight": (method, "illuminance")}
        if method == PHASES[-1]:
            stages["thermal"] = HEAT
        for stage, name in stages.items():
            once = max(first[stage] - again[stage], 0.0)
            result.append(Cost(*name, once, 0.0, again[stage] / len(skies.lit)))
        progress("calibration", (number + 1) / len(PHASES))
    return result
