"""Derivatives of `--sensitivities` against central differences of converged runs.

    python -m tests.validation sensitivities

The shoebox of `bim.shoebox` (4 x 6 x 3 m, a window of 3 x 1.8 m to the south) in Chicago with the
repository's blind: `simulate(..., sensitivities=True)`, and the same with each input a step higher and lower, of
several seeds.  Figures that count are the smoothed ones of the table in all runs.  U is moved in the
system, as the option `--u` does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from bim.shoebox import shoebox
from mitsuba_cfs.sky.annual import with_albedo
from mitsuba_cfs.sky.weather import Weather
from scenes import read_system, read_weather, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem

REFLECTANCE = {"floor": 0.2, "wall": 0.5, "ceiling": 0.7}
STEPS = {"floor": 0.05, "wall": 0.05, "ceiling": 0.05, "ground": 0.01, "u": 0.1}
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
    chosen = {
        "quick": True,
        "picture_size": 16,
        "picture_count": 1,
        "sensor_spacing": 1.0,
        "sensitivities": True,
    } | options
    year = simulate(building.room(building.spaces[0].label), system, weather, cache=False, **chosen)
    assert year.sensitivities is not None
    return year.sensitivities


def lines(samples: int, seeds: int, inputs: Sequence[str]) -> Iterator[str]:
    """The table's lines."""
    weather, system = with_albedo(read_weather(WEATHER), 0.2), read_system(VENETIAN_BLIND)
    options = [{"sensor_samples": samples, "seed": 1 + seed} for seed in range(seeds)]
    middle = [table_of(weather, system, **chosen).set_index(["input", "figure"])["derivative"] for chosen in options]
    for moved in inputs or STEPS:
        step, ends = STEPS[moved], []
        for sign in (1, -1):
            runs = [table_of(weather, system, moved, sign * step, **chosen) for chosen in options]
            ends.append([run.drop_duplicates("figure").set_index("figure")["figure_value"] for run in runs])
        for figure in HEAT if moved == "u" else LIGHT:
            slopes = np.array([(up[figure] - down[figure]) / (2 * step) for up, down in zip(*ends, strict=True)])
            own = np.array([one[KEYS[moved], figure] for one in middle])
            errors = [values.std(ddof=1) / np.sqrt(seeds) if seeds > 1 else 0.0 for values in (own, slopes)]
            yield (
                f"| {KEYS[moved]} | {figure} | {own.mean():.4g} +- {errors[0]:.2g} "
                f"| {slopes.mean():.4g} +- {errors[1]:.2g} | {own.mean() / slopes.mean():.3f} |"
            )


def main(*, samples: int = 1 << 16, seeds: int = 2, only: str = "") -> None:
    """Print the table.

    Args: samples: of a sensor; seeds: of each run; only: one input, such as floor.
    """
    print("| input | figure | derivative | central difference | ratio |")
    print("|---|---|---|---|---|")
    for line in lines(samples, seeds, (only,) if only else ()):
        print(line, flush=True)
