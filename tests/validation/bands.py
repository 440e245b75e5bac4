"""Bands of `--bands` against whole computations with drawn inputs.

    python -m tests.validation bands

The shoebox of `bim.shoebox` in Chicago with the repository's blind, heated to 20 and cooled to 26 degC. Each
sample is a whole `simulate(...)` with reflectances, albedo, g, U, gains, leaks, set points and the seed of
tracing drawn together (Latin hypercube of `scipy.stats.qmc`); what the bands say of inputs that no option
changes (light through the windows, of the sky) is set to 0 in `[bands]`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from bim.shoebox import shoebox
from mitsuba_cfs.sky.annual import with_albedo
from scenes import read_operation, read_system, read_weather, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.results import RoomYear
from scenes.uncertain_inputs import INPUTS

REFLECTANCE = {"floor": 0.3, "wall": 0.5, "ceiling": 0.7}
DRAWN = (
    "reflectance_floor",
    "reflectance_walls",
    "reflectance_ceiling",
    "reflectance_ground",
    "g_value",
    "u_value",
    "gains_percent",
    "infiltration_percent",
    "heating_set_c",
    "cooling_set_c",
)
OPERATION = """
[loads]
heating_c = {heating}
cooling_c = {cooling}
[air]
infiltration_ach = {ach}
[gains]
equipment_w_m2 = {equipment}
occupied = [8, 18]
[bands]
transmittance_percent = 0.0
sky_percent = 0.0
"""
EQUIPMENT, ACH, ALBEDO = 13.0, 0.5, 0.2
FEW = {"sensor_spacing": 1.0, "picture_size": 16, "picture_count": 1}


def year_of(folder: Path, moved: dict[str, float], *, seed: int = 0, bands: bool = False) -> RoomYear:
    """The room's year with inputs moved."""
    text = OPERATION.format(
        heating=20.0 + moved["heating_set_c"],
        cooling=26.0 + moved["cooling_set_c"],
        ach=ACH * (1 + moved["infiltration_percent"] / 100),
        equipment=EQUIPMENT * (1 + moved["gains_percent"] / 100),
    )
    operation = folder / "office.toml"
    operation.write_text(text, "utf-8")
    reflectance = {
        "floor": REFLECTANCE["floor"] + moved["reflectance_floor"],
        "wall": REFLECTANCE["wall"] + moved["reflectance_walls"],
        "ceiling": min(REFLECTANCE["ceiling"] + moved["reflectance_ceiling"], 0.99),
    }
    building = shoebox(reflectance=reflectance)
    system = read_system(VENETIAN_BLIND)
    u, g = float(system.u_value or 0.0), float(system.g_value or 0.0)
    system = replace(system, u_value=u + moved["u_value"], g_value=g + moved["g_value"] if g else None)
    weather = with_albedo(read_weather(WEATHER), max(ALBEDO + moved["reflectance_ground"], 0.01))
    room = building.room(building.spaces[0].label)
    options = FEW | {"seed": seed, "bands": bands}
    return simulate(room, system, weather, operation=read_operation(operation), quick=True, **options)


def figures_of(year: RoomYear) -> dict[str, float]:
    """Figures of whole results."""
    assert year.operation is not None
    return {
        "mean_illuminance_lx": float(year.daylight.illuminance.mean()),
        "da300": year.daylight.da,
        "sda300_50": year.daylight.sda,
        "heating_kwh": year.operation.summary["heating_kwh"],
        "cooling_kwh": year.operation.summary["cooling_kwh"],
        "peak_cooling_w": year.operation.summary["peak_cooling_w"],
        "mean_air_c": float(year.heat.air_c.mean()),
        "highest_operative_c": float(year.heat.operative_c.max()),
    }


def lines(samples: int, seed: int) -> Iterator[str]:
    """The table's lines."""
    unmoved = dict.fromkeys(DRAWN, 0.0)
    points = qmc.LatinHypercube(len(DRAWN), rng=np.random.default_rng(seed)).random(samples)
    drawn = ndtri(points) * [INPUTS[key].deviation for key in DRAWN]
    with tempfile.TemporaryDirectory() as folder:
        base = year_of(Path(folder), unmoved, bands=True)
        every = [
            figures_of(year_of(Path(folder), dict(zip(DRAWN, row, strict=True)), seed=1 + number))
            for number, row in enumerate(drawn)
        ]
    assert base.bands is not None
    bands = base.bands.figures.set_index("figure")
    for name in every[0]:
        values, band = np.array([one[name] for one in every]), bands.loc[name]
        low, median, high = np.percentile(values, (5, 50, 95))
        inside = 100 * np.mean((values >= band["p5"]) & (values <= band["p95"]))
        yield (
            f"| {name} | {band['p5']:.4g}, {band['median']:.4g}, {band['p95']:.4g} "
            f"| {low:.4g}, {median:.4g}, {high:.4g} | {inside:.0f} % |"
        )
    for _, row in base.bands.verdicts.iterrows():
        if row["rule"] == "lm83_accepted":
            met = 100 * np.mean([one["sda300_50"] >= 55 for one in every])
            yield f"| sDA at least 55 % | {row['met_percent']:.0f} of 100 | {met:.0f} of 100 | |"


def main(*, samples: int = 100, seed: int = 45) -> None:
    """Print the table.

    Args: samples: whole computations; seed: of the inputs that are drawn.
    """
    print("| figure | bands: 5, 50, 95 % | sampled: 5, 50, 95 % | samples within 5 and 95 % |")
    print("|---|---|---|---|")
    for line in lines(samples, seed):
        print(line, flush=True)
