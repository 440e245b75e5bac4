"""Each control of a room by study files of `cfs thermal` with shorter and shorter time steps.

    python -m tests.validation time_steps FOLDER --epw CITY.epw

Writes a study file for each control and step into FOLDER and computes it as `cfs thermal` does.
The control with rain runs by `--controls` alone, with a file that states rain.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import pandas as pd

from mitsuba_cfs.progress import silent
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study
from thermal.comfort import degree_hours

TWO_PANES = """
[[system]]
[[system.layers]]
thickness = 0.006
conductivity = 0.9
solar = [%s]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.006
conductivity = 0.9
emissivity = [0.05, 0.84]
solar = [0.60, 0.22, 0.17]
"""
GLAZING = TWO_PANES % "0.775, 0.071, 0.071"
ROOM = """weather = "{epw}"
step_minutes = {minutes}
[box]
width = 4.0
depth = 5.0
height = 3.0
facing_deg = 180.0
[box.adjacency]
left = "space"
right = "space"
back = "space"
floor = "space"
ceiling = "space"
[[box.window]]
x = 0.5
sill = 0.9
width = 3.0
height = 1.5
[gains]
persons = 2
equipment_w_m2 = 10
occupied = [8, 18]
[trace]
sky_subdivision = 1
"""
AIR, LOADS = "[air]\ninfiltration_ach = 0.2\n", "[loads]\nheating_c = 20\ncooling_c = 26\n"
FAN = f"{AIR}ventilation_ach = 2\nheat_recovery = 0.8\n"
HEATED = "[loads]\nheating_c = 20\n"
SLAB = (
    '[loads.slab]\nfaces = ["floor"]\ndepth = 0.05\nheating_c = 21\nheating_w_m2 = 60\n'
    "cooling_c = 25\ncooling_w_m2 = 40\n"
)
WINDOWS = "[air.windows]\nshare = 0.1\nopen_above_c = 24\nclose_below_c = 22\n"
TINTED = TWO_PANES % "0.08, 0.07, 0.07"  # a second state: the outer pane (electrochromic)
SHADED = """
[control]
rule = "all"
parts = [{{ rule = "irradiance", close_above = 100 }},
         {{ rule = "{}", close_above_c = 23.5, open_below_c = 22.5 }}]
"""
COMBINED = """
[control]
rule = "any"
open_delay_h = 2
hold_h = 3
[[control.parts]]
rule = "outdoor temperature"
close_above_c = 28
[[control.parts]]
rule = "all"
hold_h = 2
parts = [{ rule = "irradiance", close_above = 100 },
         { rule = "operative temperature", close_above_c = 24.5, open_below_c = 23.5 }]
"""
RAIN = "windows by night, shut in rain"
CONTROLS = {
    "none": AIR,
    "set points": AIR + LOADS,
    "set points with limits": f"{AIR}{LOADS}heating_limit_w = 300\ncooling_limit_w = 400\n",
    "radiant heating": f"{AIR}{LOADS}heating_radiant = 0.6\n",
    "opened windows": AIR + WINDOWS + HEATED,
    "hybrid ventilation": (f"{FAN}{WINDOWS}hybrid = true\nnight_share = 0.03\n{LOADS}"),
    "opened windows, operative": f'{AIR}{WINDOWS}temperature = "operative"\n{HEATED}',
    "shading, air": AIR + LOADS + TINTED + SHADED.format("air temperature"),
    "shading, operative": AIR + LOADS + TINTED + SHADED.format("operative temperature"),
    "shading that waits": AIR
    + LOADS
    + TINTED
    + SHADED.format("operative temperature")
    .replace("23.5", "25.0")
    .replace("22.5", "24.9, open_delay_h = 2, hold_h = 3"),
    "combined shading that waits": AIR + LOADS + TINTED + COMBINED,
    RAIN: AIR + WINDOWS + 'when = "always"\nnight_share = 0.02\nclosed_in_rain = true\n[loads]\nheating_c = 20\n',
    "shading and windows": AIR + WINDOWS + HEATED + TINTED + SHADED.format("operative temperature"),
    "air by night": f"{AIR}night_ach = 3\nnight = [22, 6]\n{LOADS}",
    "heat recovery": FAN + LOADS,
    "heat recovery with bypass": f"{FAN}bypass_above_c = 23\n{HEATED}",
    "supply air heated to 18 degC": f"{FAN}bypass_above_c = 23\nleast_supply_c = 18\n{HEATED}",
    "bypass and heated slab": f"{FAN}bypass_above_c = 23\n[loads]\n{SLAB}",
    "bypass, windows and slab": f"{FAN}bypass_above_c = 22.5\n{WINDOWS}[loads]\n{SLAB}",
    "door to a room at 18 degC": (f"{AIR}[[air.neighbour]]\ntemperature_c = 18\nwidth = 0.9\nheight = 2.0\n{LOADS}"),
    "leaks by wind and temperature": (
        f"[air]\n[air.leakage]\narea_cm2 = 300\nstack = 0.000145\nwind = 0.000174\n{LOADS}"
    ),
}
FIGURES = {"heating": "kWh", "cooling": "kWh", "peak heating": "W", "peak cooling": "W", "above 26 degC": "K h"}


def main(
    folder: Path,
    *,
    epw: Path,
    minutes: Sequence[int] = (20, 10, 5),
    controls: Annotated[Sequence[str], tuple(CONTROLS)] = tuple(one for one in CONTROLS if one != RAIN),
) -> pd.DataFrame:
    """Figures at the second step, and their change from step to step [%]."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for control in controls:
        tables = CONTROLS[control]
        years = []
        for step in minutes:
            study = folder / f"{control} {step}.toml"
            text = ROOM.format(epw=epw.resolve().as_posix(), minutes=step) + GLAZING + tables
            study.write_text(text, encoding="utf-8")
            years.append(_figures(study))
        row: dict[str, object] = {"control": control}
        for name, unit in FIGURES.items():
            values = [year[name] for year in years]
            row[f"{name} [{unit}]"] = f"{values[1]:.0f}"
            changes = [
                f"{100.0 * (fine - coarse) / fine:+.1f}" if fine > 1.0 else "-" for coarse, fine in pairwise(values)
            ]
            row[f"{name} [%]"] = ", ".join(changes)
        rows.append(row)
    return pd.DataFrame(rows)


def _figures(study: Path) -> dict[str, float]:
    (year,), _ = run_study(read_study(study), silent)
    hours = year.hours
    slab = hours["heated_slab_w"]
    heat, cold = hours["heating_w"] + slab.clip(lower=0), hours["cooling_w"] - slab.clip(upper=0)
    return {
        "heating": float(heat.sum()) / 1e3,
        "cooling": float(cold.sum()) / 1e3,
        "peak heating": float(heat.max()),
        "peak cooling": float(cold.max()),
        "above 26 degC": float(degree_hours(hours["operative_c"].to_numpy(), 26.0, step_h=1.0)),
    }
