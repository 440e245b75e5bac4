"""Heating and cooling of Table 15's room (20 and 26 degC, ideal) against EnergyPlus.

python -m tests.validation energyplus_loads --reference DIR --epw DIR
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from tests.validation import reference_room, reference_systems
from tests.validation.energyplus_cases import EPW_FILES, STEPS, site
from thermal.balance import simulate
from thermal.emitters import IdealLoads

SET_POINTS = IdealLoads(heating_c=20.0, cooling_c=26.0)


def annual_loads(
    reference: Path, epw: Path, climates: Sequence[str], closure: str = "films"
) -> pd.DataFrame:
    """One row per case: heating and cooling [kWh], ours and EnergyPlus'."""
    light, rows = reference_room.RoomLight(), []
    systems = {
        name: reference_systems.system(reference, name, closure)
        for name in reference_systems.SYSTEMS
    }
    for climate in climates:
        place = site(climate, epw / EPW_FILES[climate])
        for case in json.loads((reference / f"summary_{climate}.json").read_text()):
            system = systems[case["cfs"]]
            sun = reference_room.solar(place.suns[case["ori"]], system, light)
            zone = reference_room.zone(case["ori"], system.fenestration, loads=SET_POINTS)
            result = simulate(zone, place.climate, sun, step_s=3600.0 / STEPS)
            rows.append(
                {
                    "climate": climate,
                    "system": case["cfs"],
                    "orientation": case["ori"],
                    "heating": result.heating.sum() / 1e3,
                    "cooling": result.cooling.sum() / 1e3,
                    "EnergyPlus heating": case["Q_heat_kWh"],
                    "EnergyPlus cooling": case["Q_cool_kWh"],
                }
            )
    return pd.DataFrame(rows)


def load_errors(table: pd.DataFrame) -> pd.DataFrame:
    """Mean of EnergyPlus, bias and RMS difference [kWh] by system."""
    rows = []
    for system, cases in table.groupby("system", sort=False):
        row: dict[str, object] = {"system": system}
        for load in ("heating", "cooling"):
            error = (cases[load] - cases[f"EnergyPlus {load}"]).to_numpy()
            row[f"{load} mean"] = cases[f"EnergyPlus {load}"].mean()
            row[f"{load} bias"] = error.mean()
            row[f"{load} rms"] = float(np.sqrt(np.mean(error**2)))
        rows.append(row)
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reference", type=Path, required=True)
    parser.add_argument("--epw", type=Path, required=True)
    parser.add_argument("--closure", default="films", choices=reference_systems.CLOSURES)
    parser.add_argument("--climates", nargs="+", default=list(EPW_FILES))
    options = parser.parse_args(arguments)
    table = annual_loads(options.reference, options.epw, options.climates, options.closure)
    sys.stdout.write(load_errors(table).round(1).to_string(index=False) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
