"""Heating and cooling of Table 15's room (20 and 26 degC, ideal) against EnergyPlus.

python -m tests.validation energyplus_loads --reference DIR --epw DIR
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from tests.validation import reference_room, reference_systems
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_cases import EPW_FILES, STEPS, site
from thermal.balance import simulate
from thermal.emitters import IdealLoads

SET_POINTS = IdealLoads(heating_c=20.0, cooling_c=26.0)


def annual_loads(reference: Path, epw: Path, climates: Sequence[str], closure: str = "films") -> pd.DataFrame:
    """One row per case: heating and cooling [kWh], ours and EnergyPlus'."""
    light, rows = reference_room.RoomLight(), []
    systems = {name: reference_systems.system(reference, name, closure) for name in reference_systems.SYSTEMS}
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


def main(
    *, reference: Path, epw: Path, closure: str = "films", climates: Sequence[str] = tuple(EPW_FILES)
) -> pd.DataFrame:
    """Mean of EnergyPlus, bias and RMS difference [kWh] by system."""
    rows = []
    table = annual_loads(reference, epw, climates, closure)
    for system, cases in table.groupby("system", sort=False):
        row: dict[str, object] = {"system": system}
        for load in ("heating", "cooling"):
            row[f"{load} mean"] = cases[f"EnergyPlus {load}"].mean()
            rms, bias = rmse_and_bias(cases[load], cases[f"EnergyPlus {load}"])
            row |= {f"{load} bias": bias, f"{load} rms": rms}
        rows.append(row)
    return pd.DataFrame(rows).round(1)
