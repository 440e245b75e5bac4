"""Processor seconds and compiled kernels of each room of a building as `cfs run --quick` has it.

    python -m tests.benchmarks rooms_of_building BUILDING.ifc --weather CITY.epw \
        --cfs SYSTEM.xml --space 111 --space 103 [--results FILE.npz]

No matrix is kept.  Kernels that Dr.Jit has on disk (`~/.drjit`) count as known: with another HOME
the figures are those of a first run.  To compare two states run the same file with each in
PYTHONPATH; `--results` keeps what the rooms give.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mitsuba_cfs import variants
from scenes.inputs import read_inputs
from scenes.quick import ROOM
from scenes.room.inputs import skies_for
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room
from scenes.run.options import JobOptions


def main(building: Path, *, weather: Path, cfs: Path, space: Sequence[str] = (), results: Path | None = None) -> None:
    """Print a line for each room."""
    room = RoomOptions.of(**ROOM, picture_hours=("06-21 12",))
    options = JobOptions(building, weather, cfs, spaces=tuple(space), quick=True, room=room)
    inputs = read_inputs(options)
    variants.activate()
    skies = skies_for(inputs.weather, room.sampling, **room.sky)
    kept = {}
    for space in inputs.spaces:
        seconds, compiled, result = _timed(inputs, space, room, skies)
        print(f"{space.label}: {seconds:.1f} s of the processor, {compiled} kernels", flush=True)
        kept[f"{space.name} illuminance"] = result.daylight.illuminance
        kept[f"{space.name} air"] = result.heat.temperatures["air_c"].to_numpy()
        kept[f"{space.name} picture"] = result.glare.pictures[0].luminance
    if results is not None:
        np.savez(results, **kept)


def _timed(inputs, space, room, skies):
    """Processor seconds, kernels that were not known, and the room's year."""
    import drjit as dr

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        start = time.process_time()
        result = compute_room(inputs.building, space, inputs.systems, inputs.weather, room, skies=skies)
        seconds = time.process_time() - start
        kernels = dr.kernel_history([dr.KernelType.JIT])
    return seconds, sum(not kernel["cache_hit"] for kernel in kernels), result
