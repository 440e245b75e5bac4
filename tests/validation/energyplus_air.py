"""Leaks by wind and temperature, a fan with heat recovery and an ideal plant, against EnergyPlus.

    python -m tests.validation energyplus_air

Table 15's room with clear double glazing in Chicago.  In EnergyPlus an energy recovery ventilator
brings the air, at a constant mass flow; ours has the air changes of that mass flow.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_cases import clear_double_year
from tests.validation.energyplus_program import Model, room_model, run_energyplus
from thermal.emitters import IdealLoads
from thermal.ventilation import BLAST, DOE2, Leakage, SupplyAir

LEAKS = {"DOE-2": DOE2, "BLAST": BLAST}
LEAK_ACH, SUPPLY_ACH, RECOVERY = 0.5, 1.0, 0.75
HEATING_C, COOLING_C = 20.0, 26.0
STANDARD_DENSITY = 98934.0 / (287.055 * 293.15)  # [kg/m3] dry at 20 degC and O'Hare's 201 m
OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "air",
    "IDEAL:Zone Ideal Loads Zone Sensible Heating Rate": "heating",
    "IDEAL:Zone Ideal Loads Zone Sensible Cooling Rate": "cooling",
}


def energyplus_model(leaks: str, orientation: str, recovery: float) -> Model:
    """The room in EnergyPlus."""
    model = room_model(orientation, "clear_double", "leaks_and_recovery", outputs=OUTPUTS)
    names = ("constant_term", "temperature_term", "velocity_term", "velocity_squared_term")
    model["ZoneInfiltration:DesignFlowRate"]["AIR"] |= {
        f"{name}_coefficient": value for name, value in zip(names, LEAKS[leaks], strict=True)
    }
    model["HeatExchanger:AirToAir:SensibleAndLatent"]["EXCHANGER"] |= {
        f"sensible_effectiveness_at_100_{load}_air_flow": recovery for load in ("heating", "cooling")
    }
    return model


def compare(leaks: str, orientation: str, recovery: float = RECOVERY) -> dict[str, Any]:
    """Air RMSE and bias [K], heating and cooling of a year of both [kWh]."""
    theirs = run_energyplus(energyplus_model(leaks, orientation, recovery), WEATHER, outputs=OUTPUTS)
    weather = read_epw(WEATHER)
    density = weather.pressure_pa / (287.055 * (weather.dry_bulb_c + 273.15))
    ours = clear_double_year(
        weather,
        orientation,
        infiltration_ach=LEAK_ACH,
        leakage=Leakage(LEAKS[leaks]),
        supply=SupplyAir(SUPPLY_ACH * STANDARD_DENSITY / density, recovery=recovery),
        loads=IdealLoads(HEATING_C, COOLING_C),
    )
    row: dict[str, Any] = {"leaks": leaks, "facing": orientation, "recovery": recovery}
    row["air rmse K"], row["air bias K"] = rmse_and_bias(ours.air_c, theirs["air"])
    for load in ("heating", "cooling"):
        row[f"{load} kWh"] = getattr(ours, load).sum() / 1e3
        row[f"EnergyPlus {load} kWh"] = theirs[load].sum() / 1e3
    return row


def main() -> pd.DataFrame:
    """A row for both laws of leaks, south and north, and one without recovery."""
    cases = [(leaks, facing, RECOVERY) for leaks in LEAKS for facing in ("S", "N")]
    return pd.DataFrame([compare(*case) for case in (*cases, ("DOE-2", "N", 0.0))])
