"""A year of one room with a Blackbox window against EnergyPlus, alone and in a study.

Table 15's room with clear double glazing, the demo's weather and ten-minute steps on both sides.
EnergyPlus: its run, without starting Python.  Ours: from the weather file to the temperatures;
in the study weather, sky and first hits are shared by the eight orientations.
"""

from __future__ import annotations

import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from tests.benchmarks.harness import Comparison, PeerMissing, Run
from tests.validation import reference_room
from tests.validation.energyplus_cases import STEPS, Site, simulate_case
from tests.validation.energyplus_program import TIME_FILE, room_model, run_energyplus
from tests.validation.facade_sun import facade_sun, sun_steps
from tests.validation.reference_systems import clear_double

ORIENTATIONS = tuple(reference_room.ORIENTATIONS)
REPEAT = 3  # of ours; the fastest counts


class Clock(NamedTuple):
    """Elapsed and processor seconds."""

    elapsed: float
    processor: float


def energyplus_year(orientation: str) -> tuple[Clock, pd.DataFrame]:
    """EnergyPlus' time for one case, and its hours."""
    if find_spec("pyenergyplus") is None:
        raise PeerMissing("EnergyPlus is not installed (pyenergyplus-lbnl)")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        hours = run_energyplus(room_model(orientation, "clear_double"), WEATHER, place)
        elapsed, processor = (place / TIME_FILE).read_text().split()
    return Clock(float(elapsed), float(processor)), hours


def our_years(orientations: tuple[str, ...]) -> tuple[Clock, list[NDArray[np.float64]]]:
    """Our time for some orientations from the weather file on, and their air temperatures."""
    wall, processor = time.perf_counter(), time.process_time()
    light, system = reference_room.RoomLight(), clear_double()
    weather = read_epw(WEATHER)
    steps = sun_steps(weather, STEPS)
    suns = {o: facade_sun(steps, reference_room.facade_normal(o)) for o in orientations}
    place = Site("bench", weather, reference_room.climate(weather), suns)
    air = [simulate_case(place, o, system, light).air_c for o in orientations]
    return Clock(time.perf_counter() - wall, time.process_time() - processor), air


def _fastest(orientations: tuple[str, ...]) -> tuple[Clock, list[NDArray[np.float64]]]:
    our_years(orientations[:1])  # loads the compiled loop
    runs = [our_years(orientations) for _ in range(REPEAT)]
    return min(runs, key=lambda run: run[0].processor)


def compare(orientations: tuple[str, ...], name: str, of: str, progress: Progress) -> Comparison:
    """The years of some orientations by both programs."""
    peers = []
    for i, orientation in enumerate(orientations):
        peers.append(energyplus_year(orientation))
        progress("EnergyPlus", (i + 1) / len(orientations))
    ours, air = _fastest(orientations)
    gaps = [a - hours["T_air"].to_numpy() for a, (_, hours) in zip(air, peers, strict=True)]
    apart = float(np.sqrt(np.mean(np.concatenate(gaps) ** 2)))
    elapsed, processor = (sum(clock[i] for clock, _ in peers) for i in (0, 1))
    return Comparison(
        name,
        of,
        Run("thermal", "tests.benchmarks.thermal_year.our_years", *ours),
        Run("EnergyPlus", "energyplus -w CITY.epw in.epJSON", elapsed, processor),
        f"the two air temperatures differ by {apart:.2f} K rms",
    )


def one_year(progress: Progress) -> Comparison:
    """One room alone."""
    return compare(("S",), "thermal year", "a year of one room, ten-minute steps", progress)


def study(progress: Progress) -> Comparison:
    """Eight rooms that share weather, sky and geometry."""
    of = "the years of eight rooms of one study, ten-minute steps"
    return compare(ORIENTATIONS, "thermal study", of, progress)


BENCHMARKS = {"thermal year": one_year, "thermal study": study}
