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

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from scenes.demo import WEATHER
from tests.validation.energyplus_cases import EPW_FILES, WALLS
from tests.validation.energyplus_program import OUTPUTS, room_model, run_energyplus
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
    model = room_model(orientation, system, outputs=HOURLY)
    table = run_energyplus(model, epw, outputs=HOURLY)
    table = table.round({name: 2 if name.startswith("T_") else 1 for name in table})
    table = table.astype(np.float32)
    table.insert(0, "cfs", system)
    table.insert(1, "ori", orientation)
    table.insert(2, "hour", np.arange(1, len(table) + 1, dtype=np.int16))
    return table


def loads(patches: Sequence[str], orientation: str, epw: Path) -> dict[str, float]:
    """Heating and cooling of one case's year [kWh]; patches: of its window, see `room_model`."""
    return {name: float(hours.sum()) for name, hours in load_hours(patches, orientation, epw).items()}


def load_hours(patches: Sequence[str], orientation: str, epw: Path) -> pd.DataFrame:
    """Heating and cooling of every hour [kWh]."""
    model = room_model(orientation, *patches, "ideal_loads_20_26", outputs=LOADS)
    return run_energyplus(model, epw, outputs=LOADS) / JOULES


def write_climate(name: str, epw: Path, systems: Sequence[str], orientations: Sequence[str], out: Path) -> None:
    """Run every case of a climate and write both files."""
    cases = [(system, orientation) for system in systems for orientation in orientations]
    table = pd.concat([hours(*case, epw) for case in cases], ignore_index=True)
    table = table.astype({"cfs": "category", "ori": "category"})
    rows = [
        {"climate": name, "cfs": system, "ori": orientation} | loads((system,), orientation, epw)
        for system, orientation in cases
    ]
    out.mkdir(parents=True, exist_ok=True)
    table.to_parquet(out / f"ep_{name}.parquet", compression="zstd")
    (out / f"summary_{name}.json").write_text(json.dumps(rows, indent=1))


def write_demo(out: Path) -> Path:
    """Hours of air, mean wall and window's inside face [degC] in the demo's climate."""
    tables = []
    for orientation in DEMO_ORIENTATIONS:
        table = run_energyplus(room_model(orientation, "clear_double"), WEATHER)
        kept = {"T_air": table["T_air"], "T_wall": table[list(WALLS)].mean(axis=1)}
        tables.append(pd.DataFrame({"ori": orientation, **kept, "T_win_in": table["T_win_in"]}))
    out.mkdir(parents=True, exist_ok=True)
    whole = pd.concat(tables)
    # without a time stamp in its head the file is the same every time
    plain = {"method": "gzip", "mtime": 0}
    whole.to_csv(out / DEMO_FILE, index=False, float_format="%.2f", compression=plain)
    return out / DEMO_FILE


def main(
    *,
    out: Path,
    epw: Path | None = None,
    demo: bool = False,
    climates: Sequence[str] = tuple(EPW_FILES),
    systems: Sequence[str] = SYSTEMS,
    orientations: Sequence[str] = tuple(ORIENTATIONS),
) -> str:
    """Write the demo's climate, or the climates NAME[=FILE] of the folder `epw`."""
    if demo or epw is None:
        return str(write_demo(out))
    for climate in climates:
        name, _, file = climate.partition("=")
        write_climate(name, epw / (file or EPW_FILES[name]), systems, orientations, out)
    return "\n".join(str(path) for path in sorted(out.glob("ep_*.parquet")))
