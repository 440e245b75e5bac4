"""A year of 1, 10 and 50 rooms in a row that heat flows between, against EnergyPlus.

The room of `thermal_year` with clear double glazing to the south, ten-minute steps on both sides;
each shares its side walls with the next.  EnergyPlus: its run, without starting Python.  Ours: from
the weather file to the temperatures; the rooms share the sun, which is the same on all of them.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from tests.benchmarks.harness import Comparison, PeerMissing, Run
from tests.benchmarks.thermal_year import Clock
from tests.validation import reference_room
from tests.validation.energyplus_cases import STEPS
from tests.validation.energyplus_program import TIME_FILE, Model, room_model, run_energyplus
from tests.validation.facade_sun import facade_sun, sun_steps
from tests.validation.reference_systems import clear_double
from thermal.balance import simulate_zones
from thermal.zone import Zone

WIDTH = 4.0  # of a room [m]
SIDES = {"left": "right", "right": "left"}


def row_of_zones(count: int) -> list[Zone]:
    """Rooms beside each other, from west to east."""
    one = reference_room.zone("S", clear_double().fenestration)
    found = []
    for k in range(count):
        surfaces = []
        for surface in one.surfaces:
            step = int(np.sign(surface.normal[0])) if surface.name in SIDES else 0
            if step and 0 <= k + step < count:
                surface = replace(surface, outside=f"room {k + step}", partner=SIDES[surface.name])
            surfaces.append(surface)
        found.append(replace(one, name=f"room {k}", surfaces=tuple(surfaces)))
    return found


def energyplus_row(count: int, outputs: dict[str, str]) -> Model:
    """EnergyPlus' model of the same rooms."""
    model = room_model("S", "clear_double", outputs=outputs)
    for kind in (
        "Zone",
        "BuildingSurface:Detailed",
        "FenestrationSurface:Detailed",
        "ZoneInfiltration:DesignFlowRate",
        "ElectricEquipment",
        "People",
    ):
        objects = model[kind]
        model[kind] = {f"{name} {k}": _moved(entry, k) for k in range(count) for name, entry in objects.items()}
    walls = model["BuildingSurface:Detailed"]
    for k in range(count - 1):
        for name, partner in ((f"X4 {k}", f"X0 {k + 1}"), (f"X0 {k + 1}", f"X4 {k}")):
            walls[name] |= {"outside_boundary_condition": "Surface", "outside_boundary_condition_object": partner}
    return model


def _moved(entry: dict, k: int) -> dict:
    """An object of the room's own, of room k, and as far to the east."""
    names = ("zone_name", "building_surface_name", "zone_or_zonelist_or_space_or_spacelist_name")
    moved = dict(entry)
    for key, value in entry.items():
        if key in names:
            moved[key] = f"{value} {k}"
        elif key.endswith("_x_coordinate"):
            moved[key] = value + WIDTH * k
        elif key == "vertices":
            moved[key] = [v | {"vertex_x_coordinate": v["vertex_x_coordinate"] + WIDTH * k} for v in value]
    return moved


def our_year(count: int) -> tuple[Clock, NDArray[np.float64]]:
    """Our time from the weather file on, and the air temperatures [H, Z]."""
    wall, processor = time.perf_counter(), time.process_time()
    weather = read_epw(WEATHER)
    sun = facade_sun(sun_steps(weather, STEPS), reference_room.facade_normal("S"))
    solar = reference_room.solar(sun, clear_double(), reference_room.RoomLight())
    zones = row_of_zones(count)
    found = simulate_zones(zones, reference_room.climate(weather), [solar] * count, step_s=3600.0 / STEPS)
    clock = Clock(time.perf_counter() - wall, time.process_time() - processor)
    return clock, np.stack([one.air_c for one in found], axis=1)


def compare(count: int, progress: Progress) -> Comparison:
    """The rooms' year by both programs."""
    if find_spec("pyenergyplus") is None:
        raise PeerMissing("EnergyPlus is not installed (pyenergyplus-lbnl)")
    names = {f"ROOM {k}:Zone Mean Air Temperature": f"air {k}" for k in range(count)}
    model = energyplus_row(count, names)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        theirs = run_energyplus(model, WEATHER, place, outputs=names)
        elapsed, processor = map(float, (place / TIME_FILE).read_text().split())
    progress("EnergyPlus", 1.0)
    our_year(1)  # loads the compiled loop
    ours, air = our_year(count)
    gaps = air - np.stack([theirs[f"air {k}"].to_numpy() for k in range(count)], axis=1)
    return Comparison(
        f"coupled zones, {count}",
        f"a year of {count} rooms in a row, ten-minute steps",
        Run("thermal", "tests.benchmarks.coupled_zones.our_year", *ours),
        Run("EnergyPlus", "energyplus -w CITY.epw in.epJSON", elapsed, processor),
        f"the air temperatures differ by {np.sqrt(np.mean(gaps**2)):.2f} K rms",
    )


COUNTS = (1, 10, 50)
BENCHMARKS = {f"coupled zones, {count}": partial(compare, count) for count in COUNTS}
