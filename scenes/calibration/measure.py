"""Measuring what the methods cost on this machine."""

from __future__ import annotations

import tempfile
from datetime import datetime
from pathlib import Path

from bim.shoebox import shoebox
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, part, silent
from scenes.calibration.costs import HEAT, Calibration, machine_name
from scenes.cost.measure import Cost
from scenes.cost.reference import reference_costs
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.job.inputs import read_system, read_weather
from scenes.job.options import RoomOptions
from scenes.job.room import compute_room, skies_for
from scenes.job.windows import everywhere
from scenes.methods.place import Quality

HEAT_OPTIONS = RoomOptions(method="three-phase", sensor_spacing=2.0, sensor_samples=64)


def calibrated(
    size: int, *, quality: Quality | None = None, progress: Progress = silent, **chosen
) -> Calibration:
    """The costs of this machine, measured now: a few minutes.

    Args:
        size: pixels of a side of the pictures; chosen: `methods` and `metrics` of
            `scenes.cost.measure.measure`, all by default.
    """
    costs = reference_costs(size=size, quality=quality, progress=part(progress, 0, 0.9), **chosen)
    heat = heat_cost()
    progress("calibration", 1.0)
    made = datetime.now().astimezone().isoformat(timespec="seconds")
    return Calibration(machine_name(), made, size, (*costs, heat))


def heat_cost(options: RoomOptions = HEAT_OPTIONS) -> Cost:
    """Gains, temperatures and comfort of a room: tracing once, then each year of lit hours."""
    weather, system = read_weather(WEATHER), read_system(VENETIAN_BLIND)
    building = shoebox(3.65, 4.6, 3.0)
    space, skies = building.spaces[0], skies_for(weather, options)
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        cold, warm = MatrixCache(Path(folder) / "cold"), MatrixCache(Path(folder) / "warm")
        for cache in (cold, warm, warm):  # the first compiles kernels
            room = compute_room(
                building, space, everywhere(space, system), weather, options,
                skies=skies, cache=cache, pictures=False,
            )  # fmt: skip
            seconds.append(room.seconds["thermal"])
    _, first, again = seconds
    return Cost(*HEAT, max(first - again, 0.0), 0.0, again / len(skies.lit))
