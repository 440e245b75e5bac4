"""EnergyPlus' hours and loads of Table 15's room, as the comparisons read them.

    python -m tests.validation energyplus_reference --epw DIR --out DIR

Needs `pyenergyplus-lbnl` alone.  For each climate `ep_NAME.parquet` (system, orientation, hour 1 to
8760, temperatures [degC] with two decimals, irradiance on the window [W/m2] and flows [W] with one)
and `summary_NAME.json` (heating and cooling of the same room kept between 20 and 26 degC by ideal
loads [kWh]).  Weather files are named as in `energyplus_cases`, or by `--climates NAME=FILE`.

    python -m tests.validation energyplus_reference --demo --out DIR

writes `chicago.csv.gz`: the same room with clear double glazing in the demo's climate, facing
south, east and north; what tests/reference/energyplus_chicago holds.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from tests.benchmarks.thermal_year import EPW, energyplus_room
from tests.validation.energyplus_cases import EPW_FILES, WALLS
from tests.validation.energyplus_ideal_loads import ideal_loads
from tests.validation.energyplus_loads import SET_POINTS
from tests.validation.energyplus_model import (
    OUTPUTS,
    Model,
    hourly_outputs,
    room_model,
    run_energyplus,
)
from tests.validation.reference_room import ORIENTATIONS
from tests.validation.reference_systems import SYSTEMS

SUN = "WINDOW:Surface Outside Face Incident"
HOURLY = OUTPUTS | {
    f"{SUN} Beam Solar Radiation Rate per Area": "I_beam",
    f"{SUN} Sky Diffuse Solar Radiation Rate per Area": "I_sky",
    "WINDOW:Surface Window Heat Gain Rate": "Q_gain",
    "WINDOW:Surface Window Heat Loss Rate": "Q_loss",
}
LOADS = {  # [J] of each hour
    "IDEAL:Zone Ideal Loads Zone Sensible Heating Energy": "Q_heat_kWh",
    "IDEAL:Zone Ideal Loads Zone Sensible Cooling Energy": "Q_cool_kWh",
}
DEMO_FILE, DEMO_ORIENTATIONS = "chicago.csv.gz", ("S", "E", "N")
JOULES = 3.6e6  # of a kWh


def hours(system: str, orientation: str, epw: Path) -> pd.DataFrame:
    """One case's year [H rows] of the room without heating or cooling."""
    model = room_model(system, orientation, hourly=False) | hourly_outputs(HOURLY)
    table = run_energyplus(model, epw, outputs=HOURLY)
    table = table.round({name: 2 if name.startswith("T_") else 1 for name in table})
    table = table.astype(np.float32)
    table.insert(0, "cfs", system)
    table.insert(1, "ori", orientation)
    table.insert(2, "hour", np.arange(1, len(table) + 1, dtype=np.int16))
    return table


def loads(system: str, orientation: str, epw: Path) -> dict[str, float]:
    """Heating and cooling of one case's year [kWh]."""
    model = room_model(system, orientation, hourly=False) | hourly_outputs(LOADS)
    model = _with_ideal_loads(model)
    table = run_energyplus(model, epw, outputs=LOADS)
    return {name: float(table[name].sum()) / JOULES for name in LOADS.values()}


def _with_ideal_loads(model: Model) -> Model:
    """The model with an unlimited, sensible ideal system in its room."""

    def always(value: float) -> dict[str, object]:
        fields = ["Through: 12/31", "For: AllDays", "Until: 24:00", value]
        return {"data": [{"field": field} for field in fields]}

    schedules = {
        "HEATED": always(float(SET_POINTS.heating_c)),
        "COOLED": always(float(SET_POINTS.cooling_c)),
        "DUAL": always(4.0),  # control type 4: two set points
    }
    return model | {
        "Schedule:Compact": model["Schedule:Compact"] | schedules,
        **ideal_loads("HEATED", "COOLED", "DUAL"),
    }


def write_climate(
    name: str, epw: Path, systems: Sequence[str], orientations: Sequence[str], out: Path
) -> None:
    """Run every case of a climate and write both files."""
    cases = [(system, orientation) for system in systems for orientation in orientations]
    table = pd.concat([hours(*case, epw) for case in cases], ignore_index=True)
    table = table.astype({"cfs": "category", "ori": "category"})
    rows = [
        {"climate": name, "cfs": system, "ori": orientation} | loads(system, orientation, epw)
        for system, orientation in cases
    ]
    out.mkdir(parents=True, exist_ok=True)
    table.to_parquet(out / f"ep_{name}.parquet", compression="zstd")
    (out / f"summary_{name}.json").write_text(json.dumps(rows, indent=1))


def write_demo(out: Path) -> Path:
    """Hours of air, mean wall and window's inside face [degC] in the demo's climate."""
    tables = []
    for orientation in DEMO_ORIENTATIONS:
        table = run_energyplus(energyplus_room(orientation), EPW)
        kept = {"T_air": table["T_air"], "T_wall": table[list(WALLS)].mean(axis=1)}
        tables.append(pd.DataFrame({"ori": orientation, **kept, "T_win_in": table["T_win_in"]}))
    out.mkdir(parents=True, exist_ok=True)
    whole = pd.concat(tables)
    # without a time stamp in its head the file is the same every time
    plain = {"method": "gzip", "mtime": 0}
    whole.to_csv(out / DEMO_FILE, index=False, float_format="%.2f", compression=plain)
    return out / DEMO_FILE


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the climates asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--epw", type=Path, help="folder of weather files")
    source.add_argument("--demo", action="store_true", help="the demo's climate")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--climates", nargs="+", default=list(EPW_FILES), metavar="NAME[=FILE]")
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS), choices=SYSTEMS)
    parser.add_argument(
        "--orientations", nargs="+", default=list(ORIENTATIONS), choices=list(ORIENTATIONS)
    )
    options = parser.parse_args(arguments)
    if options.demo:
        sys.stdout.write(f"{write_demo(options.out)}\n")
        return 0
    for climate in options.climates:
        name, _, file = climate.partition("=")
        epw = options.epw / (file or EPW_FILES[name])
        write_climate(name, epw, options.systems, options.orientations, options.out)
        sys.stdout.write(f"{name}: {options.out / f'ep_{name}.parquet'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
