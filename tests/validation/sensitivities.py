"""Derivatives of `--sensitivities` against central differences of converged runs.

    python -m tests.validation sensitivities

The shoebox of `bim.shoebox` (4 x 6 x 3 m, a window of 3 x 1.8 m to the south) in Chicago with the
repository's blind and with a clear double glazing: `simulate(..., sensitivities=True)` with the samples of a
usual run, and the same with many more and each input a step higher and lower.  Figures that count are
the smoothed ones of the table in all runs.  U is moved in the system, as the option `--u` does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd

from bim.shoebox import shoebox
from mitsuba_cfs.sky.annual import with_albedo
from mitsuba_cfs.sky.weather import Weather
from scenes import read_system, read_weather, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem

GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
REFLECTANCE = {"floor": 0.2, "wall": 0.5, "ceiling": 0.7}
STEPS = {"floor": 0.05, "wall": 0.05, "ceiling": 0.05, "ground": 0.05, "u": 0.1}
KEYS = {
    "floor": "reflectance_floor",
    "wall": "reflectance_walls",
    "ceiling": "reflectance_ceiling",
    "ground": "reflectance_ground",
    "u": "u_value",
}
LIGHT = ("mean_illuminance_lx", "da300", "sda300_50")
HEAT = ("mean_air_c", "highest_operative_c", "degree_hours_26")


def table_of(
    weather: Weather, system: FenestrationSystem, moved: str = "", by: float = 0.0, **options: object
) -> pd.DataFrame:
    """The sensitivities of the room with an input moved."""
    values = dict(REFLECTANCE)
    if moved in values:
        values[moved] += by
    if moved == "ground":
        weather = with_albedo(weather, float(np.mean(weather.albedo)) + by)
    if moved == "u":
        system = replace(system, u_value=float(system.u_value or 0.0) + by)
    building = shoebox(reflectance=values)
    chosen = {"picture_size": 16, "picture_count": 1, "sensor_spacing": 1.0, "sensitivities": True} | options
    year = simulate(building.room(building.spaces[0].label), system, weather, cache=False, **chosen)
    assert year.sensitivities is not None
    return year.sensitivities


def lines(samples: int, seeds: int) -> Iterator[str]:
    """The table's lines."""
    weather = with_albedo(read_weather(WEATHER), 0.2)
    for name, path in (("blind", VENETIAN_BLIND), ("glazing", GLAZING)):
        system = read_system(path)
        usual = table_of(weather, system).set_index(["input", "figure"])
        for moved, step in STEPS.items():
            figures = HEAT if moved == "u" else LIGHT
            ends = []
            for sign in (1, -1):
                runs = [
                    table_of(weather, system, moved, sign * step, sensor_samples=samples, seed=1 + seed)
                    for seed in range(seeds)
                ]
                ends.append([run.drop_duplicates("figure").set_index("figure")["figure_value"] for run in runs])
            for figure in figures:
                slopes = [(up[figure] - down[figure]) / (2 * step) for up, down in zip(*ends, strict=True)]
                difference, error = np.mean(slopes), np.std(slopes, ddof=1) / np.sqrt(seeds) if seeds > 1 else 0.0
                row = usual.loc[(KEYS[moved], figure)]
                yield (
                    f"| {name} | {KEYS[moved]} | {figure} | {row['derivative']:.4g} +- {row['standard_error']:.2g} "
                    f"| {difference:.4g} +- {error:.2g} | {row['derivative'] / difference:.3f} |"
                )


def main(*, samples: int = 1 << 18, seeds: int = 3) -> None:
    """Print the table.

    Args: samples: of a sensor, in the runs that are compared; seeds: of these.
    """
    print("| system | input | figure | derivative | central difference | ratio |")
    print("|---|---|---|---|---|---|")
    for line in lines(samples, seeds):
        print(line, flush=True)
