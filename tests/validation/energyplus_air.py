"""Leaks by wind and temperature, a fan with heat recovery and an ideal plant, against EnergyPlus.

    python -m tests.validation energyplus_air

Table 15's room with clear double glazing in Chicago.  In EnergyPlus an energy recovery ventilator
brings the air, at a constant mass flow; ours is given the air changes of that mass flow.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from tests.benchmarks.thermal_year import EPW, energyplus_room, glazing
from tests.validation import reference_room
from tests.validation.energyplus_cases import STEPS
from tests.validation.energyplus_ideal_loads import IDEAL, ideal_loads
from tests.validation.energyplus_model import Model, hourly_outputs, run_energyplus
from tests.validation.facade_sun import facade_sun, sun_steps
from thermal.balance import ZoneResult, simulate
from thermal.emitters import IdealLoads
from thermal.ventilation import BLAST, DOE2, Leakage, SupplyAir

LEAKS = {"DOE-2": DOE2, "BLAST": BLAST}
LEAK_ACH, SUPPLY_ACH, RECOVERY = 0.5, 1.0, 0.75
HEATING_C, COOLING_C = 20.0, 26.0
FAN_M3_S = SUPPLY_ACH * 60.0 / 3600.0  # at EnergyPlus' standard density, into 60 m3
STANDARD_DENSITY = 98934.0 / (287.055 * 293.15)  # [kg/m3] dry at 20 degC and O'Hare's 201 m
OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "air",
    "IDEAL:Zone Ideal Loads Zone Sensible Heating Rate": "heating",
    "IDEAL:Zone Ideal Loads Zone Sensible Cooling Rate": "cooling",
}


def our_year(leaks: str, orientation: str, recovery: float) -> tuple[Weather, ZoneResult]:
    """The year by `thermal`."""
    weather, system = read_epw(EPW), glazing()
    density = weather.pressure_pa / (287.055 * (weather.dry_bulb_c + 273.15))
    zone = replace(
        reference_room.zone(orientation, system.fenestration),
        infiltration_ach=LEAK_ACH,
        leakage=Leakage(LEAKS[leaks]),
        supply=SupplyAir(SUPPLY_ACH * STANDARD_DENSITY / density, recovery=recovery),
        loads=IdealLoads(HEATING_C, COOLING_C),
    )
    sun = facade_sun(sun_steps(weather, STEPS), reference_room.facade_normal(orientation))
    solar = reference_room.solar(sun, system, reference_room.RoomLight())
    outdoors = reference_room.climate(weather)
    return weather, simulate(zone, outdoors, solar, step_s=3600.0 / STEPS)


def energyplus_model(leaks: str, orientation: str, recovery: float) -> Model:
    """The same room in EnergyPlus."""
    model = energyplus_room(orientation) | hourly_outputs(OUTPUTS)
    for name, value in (("HEATING", HEATING_C), ("COOLING", COOLING_C), ("DUAL", 4)):
        data = ["Through: 12/31", "For: AllDays", "Until: 24:00", value]
        model["Schedule:Compact"][name] = {"data": [{"field": one} for one in data]}
    names = ("constant_term", "temperature_term", "velocity_term", "velocity_squared_term")
    model["ZoneInfiltration:DesignFlowRate"]["AIR"] |= {"air_changes_per_hour": LEAK_ACH} | {
        f"{name}_coefficient": value for name, value in zip(names, LEAKS[leaks], strict=True)
    }
    return with_ventilator(model | ideal_loads("HEATING", "COOLING", "DUAL"), recovery)


def with_ventilator(model: Model, recovery: float) -> Model:
    """The model with a ventilator beside its ideal system, served before it."""
    fans = {"SUPPLY FAN": ("HX SUPPLY", "ERV SUPPLY"), "EXHAUST FAN": ("HX EXHAUST", "ERV RELIEF")}
    model["Fan:OnOff"] = {name: _fan(*nodes) for name, nodes in fans.items()}
    model["HeatExchanger:AirToAir:SensibleAndLatent"] = {
        "EXCHANGER": {
            "availability_schedule_name": "ON",
            "nominal_supply_air_flow_rate": FAN_M3_S,
            "sensible_effectiveness_at_100_heating_air_flow": recovery,
            "sensible_effectiveness_at_100_cooling_air_flow": recovery,
            "latent_effectiveness_at_100_heating_air_flow": 0.0,
            "latent_effectiveness_at_100_cooling_air_flow": 0.0,
            "supply_air_inlet_node_name": "ERV OUTDOORS",
            "supply_air_outlet_node_name": "HX SUPPLY",
            "exhaust_air_inlet_node_name": "ERV EXHAUST",
            "exhaust_air_outlet_node_name": "HX EXHAUST",
            "economizer_lockout": "No",
            "frost_control_type": "None",
        }
    }
    model["ZoneHVAC:EnergyRecoveryVentilator"] = {
        "ERV": {
            "availability_schedule_name": "ON",
            "heat_exchanger_name": "EXCHANGER",
            "supply_air_flow_rate": FAN_M3_S,
            "exhaust_air_flow_rate": FAN_M3_S,
            "supply_air_fan_name": "SUPPLY FAN",
            "exhaust_air_fan_name": "EXHAUST FAN",
        }
    }
    model["OutdoorAir:NodeList"] = {"OUT": {"nodes": [{"node_or_nodelist_name": "ERV OUTDOORS"}]}}
    inlets = [{"node_name": name} for name in ("ERV SUPPLY", "SUPPLY")]
    model["NodeList"] = {"INLETS": {"nodes": inlets}}
    model["ZoneHVAC:EquipmentConnections"]["CONNECTIONS"] |= {
        "zone_air_inlet_node_or_nodelist_name": "INLETS",
        "zone_air_exhaust_node_or_nodelist_name": "ERV EXHAUST",
    }
    kinds = {"ERV": "ZoneHVAC:EnergyRecoveryVentilator", "IDEAL": IDEAL}
    model["ZoneHVAC:EquipmentList"]["EQUIPMENT"]["equipment"] = [
        {
            "zone_equipment_object_type": kind,
            "zone_equipment_name": name,
            "zone_equipment_cooling_sequence": number,
            "zone_equipment_heating_or_no_load_sequence": number,
        }
        for number, (name, kind) in enumerate(kinds.items(), 1)
    ]
    return model


def _fan(inlet: str, outlet: str) -> dict[str, Any]:
    """A fan without heat: its pressure is next to none."""
    return {
        "availability_schedule_name": "ON",
        "fan_total_efficiency": 1.0,
        "pressure_rise": 1e-3,
        "maximum_flow_rate": FAN_M3_S,
        "motor_efficiency": 1.0,
        "motor_in_airstream_fraction": 0.0,
        "air_inlet_node_name": inlet,
        "air_outlet_node_name": outlet,
    }


def compare(leaks: str, orientation: str, recovery: float = RECOVERY) -> dict[str, Any]:
    """Air RMSE and bias [K], heating and cooling of a year of both [kWh]."""
    model = energyplus_model(leaks, orientation, recovery)
    theirs = run_energyplus(model, EPW, outputs=OUTPUTS)
    _, ours = our_year(leaks, orientation, recovery)
    gap: NDArray[np.float64] = ours.air_c - theirs["air"].to_numpy()
    row: dict[str, Any] = {"leaks": leaks, "facing": orientation, "recovery": recovery}
    row |= {"air rmse K": np.sqrt(np.mean(gap**2)), "air bias K": gap.mean()}
    for load in ("heating", "cooling"):
        row[f"{load} kWh"] = getattr(ours, load).sum() / 1e3
        row[f"EnergyPlus {load} kWh"] = theirs[load].sum() / 1e3
    return row


if __name__ == "__main__":
    cases = [(leaks, facing, RECOVERY) for leaks in LEAKS for facing in ("S", "N")]
    table = pd.DataFrame([compare(*case) for case in (*cases, ("DOE-2", "N", 0.0))])
    sys.stdout.write(table.round(3).to_string(index=False) + "\n")
