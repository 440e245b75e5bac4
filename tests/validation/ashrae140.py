"""ASHRAE 140-2020 envelope cases against the range of the standard's example programs.

python -m tests.validation ashrae140 --reference DIR --out DIR
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from tests.validation import ashrae140_cases, ashrae140_sun, ashrae140_sunspace
from tests.validation.facade_sun import SunSteps, sun_steps
from tests.validation.reference_room import climate
from thermal.balance import BalanceOptions, ZoneResult, simulate
from thermal.climate import Climate

WEATHER = "725650TYCST.epw"
RANGES = "bestest_ranges.json"
STEPS = 6
OPTIONS = BalanceOptions(terrain="country")
LOADS = {"heating": "B8-1", "cooling": "B8-2", "peak heating": "B8-3", "peak cooling": "B8-4"}


def ground_climate(weather: Weather) -> Climate:
    """The weather with the standard's ground temperature."""
    return replace(climate(weather), ground_c=np.full(len(weather.times), ashrae140_cases.GROUND_C))


def run_case(
    case: ashrae140_cases.TestCase, climate: Climate, steps: SunSteps
) -> tuple[ZoneResult, tuple[ashrae140_sun.Transmitted, ...]]:
    """The year of a single-zone case, and the light through its windows."""
    pane = ashrae140_sun.glass(case.glazing)
    zone = ashrae140_cases.case_zone(case, pane.fenestration)
    solar, light = ashrae140_sun.zone_solar(zone, case.openings, steps, pane)
    return simulate(zone, climate, solar, step_s=3600.0 / STEPS, options=OPTIONS), light


def figures(name: str, result: ZoneResult) -> dict[str, float]:
    """The standard's outputs of a case: MWh and kW, or degC where it floats."""
    if name.endswith("FF"):
        air = result.air_c
        return {"maximum": air.max(), "minimum": air.min(), "average": air.mean()}
    return {
        "heating": result.heating.sum() / 1e6,
        "cooling": result.cooling.sum() / 1e6,
        "peak heating": result.heating.max() / 1e3,
        "peak cooling": result.cooling.max() / 1e3,
    }


def compare(reference: Path, only: Sequence[str] = ()) -> pd.DataFrame:
    """One row per case and output: ours, and the range of the example programs."""
    weather = read_epw(reference / WEATHER)
    steps, outdoors = sun_steps(weather, STEPS), ground_climate(weather)
    ranges = json.loads((reference / RANGES).read_text())
    rows: list[dict[str, object]] = []
    for name, case in ashrae140_cases.cases().items():
        if only and name not in only:
            continue
        result, light = run_case(case, outdoors, steps)
        rows += judged_figures(name, figures(name, result), ranges)
        rows += _transmitted_rows(name, case, light, ranges)
    if not only or "960" in only:
        back, sunspace = ashrae140_sunspace.run(outdoors, steps, OPTIONS, 3600.0 / STEPS)
        rows += [_row("960", k, v, ranges) for k, v in figures("960", back).items()]
        floating = figures("960FF", sunspace)
        rows += [_row("960 Sunspace", k, v, ranges) for k, v in floating.items()]
    return pd.DataFrame([row for row in rows if row])


def judged_figures(name: str, found: dict[str, float], ranges: dict) -> list[dict[str, object]]:
    """A row for each output of a case that the standard's tables have."""
    rows = (_row(name, output, value, ranges) for output, value in found.items())
    return [row for row in rows if row]


def _row(name: str, output: str, value: float, ranges: dict) -> dict[str, object]:
    table = LOADS.get(output, "B8-5")
    for title, row in ranges[table]["rows"].items():
        bare = title.removeprefix(f"{output} | ")
        fits = bare.split()[0] == name or bare == name
        if fits and (table != "B8-5" or title.startswith(f"{output} |")):
            return _judged(name, output, value, row["min"], row["max"])
    return {}


def _judged(name: str, output: str, value: float, low: float, high: float) -> dict[str, object]:
    inside = bool(low <= value <= high)
    return {"case": name, "output": output, "mitsuba-cfs": float(value), "low": low, "high": high, "inside": inside}


def _transmitted_rows(
    name: str, case: ashrae140_cases.TestCase, light: tuple[ashrae140_sun.Transmitted, ...], ranges: dict
):
    """Annual transmitted sun [kWh/m2] of the facades that the standard lists."""
    rows = []
    for opening, through in zip(case.openings, light, strict=True):
        title = f"{name} {opening.facade.capitalize()}"
        for table in ("B8-14", "B8-15"):
            row = ranges[table]["rows"].get(title)
            if row:
                value = (through.beam + through.diffuse).sum() / STEPS / 1e3
                rows.append(_judged(name, "transmitted sun", value, row["min"], row["max"]))
    return rows


def main(*, reference: Path, out: Path, cases: Sequence[str] = ()) -> pd.DataFrame:
    """Run the cases and write `ashrae140.csv`."""
    table = compare(reference, cases)
    out.mkdir(parents=True, exist_ok=True)
    table.to_csv(out / "ashrae140.csv", index=False)
    return table.round(3)
