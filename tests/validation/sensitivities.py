"""Derivatives of `--sensitivities` against central differences of converged runs.

    python -m tests.validation sensitivities

The shoebox of `bim.shoebox` (4 x 6 x 3 m, a window of 3 x 1.8 m to the south) in Chicago with the
repository's blind: `simulate(..., sensitivities=True)`, and the same with each input a step higher and lower, of
several seeds.  Figures that count are the smoothed ones of the table in all runs.  U is moved in the
system, as the option `--u` does.  Tilt, width and reflectance of slats: the library's blind at 45 degrees outside a
double glazing, and whole runs with systems of other slats, written by `cfs bsdf system` with another seed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import tomlkit

from bim.shoebox import shoebox
from mitsuba_cfs.sky.annual import with_albedo
from mitsuba_cfs.sky.weather import Weather
from scenes import read_operation, read_system, read_weather, simulate
from scenes.cli import run
from scenes.demo import FOLDER, VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem
from scenes.toml_file import read_table

REFLECTANCE = {"floor": 0.2, "wall": 0.5, "ceiling": 0.7}
STEPS = {"floor": 0.05, "wall": 0.05, "ceiling": 0.05, "ground": 0.01, "u": 0.1}
KEYS = {
    "floor": "reflectance_floor",
    "wall": "reflectance_walls",
    "ceiling": "reflectance_ceiling",
    "ground": "reflectance_ground",
    "u": "u_value",
}
SLATS = {  # key of the table, step, key in the layers and its unit there
    "tilt": ("tilt_deg", 3.0, {"tilt_deg": 1.0}),
    "width": ("slat_width_mm", 2.0, {"width": 1e-3}),
    "slats": ("slat_reflectance", 0.05, {"visible": 1.0, "solar": 1.0}),
}
BLIND = ("--glazing", "double low-e", "--shade", "venetian 80 mm, 45 deg")
PATHS = 131_072  # of the slats of whole runs
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


def _run(*arguments: object) -> None:
    """Run `cfs`."""
    if run([str(one) for one in arguments]) != 0:
        raise RuntimeError(f"cfs {arguments[0]} {arguments[1]} failed")


def moved_blind(blind: Path, name: str, by: float, out: Path, *, paths: int = PATHS) -> Path:
    """The system of a file with an input of its slats moved, traced anew; without the recipe."""
    table = read_table(blind.with_suffix(".toml"))
    slats = next(layer["slats"] for layer in table["layers"] if "slats" in layer)
    slats.setdefault("solar", slats["visible"])
    for key, unit in SLATS[name][2].items():
        slats[key] += unit * by
    source = out.with_suffix(".layers.toml")
    source.write_text(tomlkit.dumps(table), "utf-8")
    _run("bsdf", "system", source, "--paths", paths, "--seed", 7, "--out", out)
    for key in ("visible", "solar"):  # a system of which the run knows no recipe: nothing is moved there
        slats.pop(key)
    out.with_suffix(".toml").write_text(tomlkit.dumps(table), "utf-8")
    return out


def slat_rows(
    folder: Path, inputs: Sequence[str], *, paths: int = PATHS, **options: object
) -> Iterator[tuple[str, str, float, float]]:
    """Input, figure, derivative and central difference of whole runs, of a room with the library's blind.

    Args: paths: of the slats of whole runs.
    """
    blind, weather = folder / "blind.xml", read_weather(WEATHER)
    _run("bsdf", "library", *BLIND, "--out", blind)
    building, operation = shoebox(), read_operation(FOLDER / "loads.toml")
    chosen = {"quick": True, "picture_count": 1, "sensor_spacing": 1.0, "sensitivities": True} | options

    def table(system: Path) -> pd.DataFrame:
        room = building.room(building.spaces[0].label)
        year = simulate(room, system, weather, operation=operation, **chosen)
        assert year.sensitivities is not None
        return year.sensitivities

    derived = table(blind).set_index(["input", "figure"])["derivative"]
    for name in inputs or SLATS:
        key, step, _ = SLATS[name]
        up, down = (
            table(moved_blind(blind, name, sign * step, folder / f"{name}{sign}.xml", paths=paths))
            .drop_duplicates("figure")
            .set_index("figure")["figure_value"]
            for sign in (1, -1)
        )
        for figure, value in derived[key].items():
            yield key, str(figure), float(value), float(up[figure] - down[figure]) / (2 * step)


def lines(samples: int, seeds: int, inputs: Sequence[str]) -> Iterator[str]:
    """The table's lines."""
    weather, system = with_albedo(read_weather(WEATHER), 0.2), read_system(VENETIAN_BLIND)
    options = [{"sensor_samples": samples, "seed": 1 + seed} for seed in range(seeds)]
    middle = [table_of(weather, system, **chosen).set_index(["input", "figure"])["derivative"] for chosen in options]
    for moved in inputs or STEPS:
        step, ends = STEPS[moved], []
        for sign in (1, -1):
            tables = [table_of(weather, system, moved, sign * step, **chosen) for chosen in options]
            ends.append([one.drop_duplicates("figure").set_index("figure")["figure_value"] for one in tables])
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

    Args:
        samples: of a sensor; seeds: of each run.
        only: one input, such as floor; tilt, width or slats, or blind for all three, with all figures.
    """
    print("| input | figure | derivative | central difference | ratio |")
    print("|---|---|---|---|---|")
    if only in (*SLATS, "blind"):
        more = {"sensor_samples": samples, "annual_glare": True, "spectral": True}
        with TemporaryDirectory() as folder:
            for key, figure, value, difference in slat_rows(Path(folder), () if only == "blind" else (only,), **more):
                ratio = value / difference if difference else float("nan")
                print(f"| {key} | {figure} | {value:.4g} | {difference:.4g} | {ratio:.3f} |", flush=True)
        return
    for line in lines(samples, seeds, (only,) if only else ()):
        print(line, flush=True)
