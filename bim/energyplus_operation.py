"""What a zone of an EnergyPlus model uses: schedules by the hour, gains, air, an ideal plant."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.energyplus_parts import Model
from thermal.emitters import IdealLoads
from thermal.zone import Gains, Zone

FILE = "schedules.csv"  # beside the epJSON
HOURS = 8760
OFF_C = -60.0, 90.0  # set points that are never reached [degC]
AIR_HEAT = 1.2 * 1006.0  # [J/(m3 K)] for what is a heat flow here and an air flow there
ZONE = "zone_or_zonelist_or_space_or_spacelist_name"
IDEAL = "ZoneHVAC:IdealLoadsAirSystem"


class Schedules:
    """The schedules of a model: constants, and columns of hours in one file."""

    def __init__(self, model: Model) -> None:
        """Of a model that has the schedule types' limits."""
        self.model = model
        self.columns: dict[str, NDArray[np.float64]] = {}

    def name(self, label: str, values: ArrayLike) -> str:
        """Name of the schedule of a number or of hourly values [H], by what the values are.

        Values of shorter steps become the means of their hours.
        """
        array = np.atleast_1d(np.asarray(values, dtype=float))
        if np.ptp(array) == 0:
            return self._constant(float(array[0]))
        hours = array.reshape(HOURS, -1).mean(axis=1)
        for known, other in self.columns.items():
            if np.array_equal(other, hours):
                return known
        self.columns[label] = hours
        self.model.setdefault("Schedule:File", {})[label] = {
            "schedule_type_limits_name": "any",
            "file_name": FILE,
            "column_number": len(self.columns),
            "rows_to_skip_at_top": 1,
            "number_of_hours_of_data": HOURS,
            "column_separator": "Comma",
            "interpolate_to_timestep": "No",
        }
        return label

    def _constant(self, value: float) -> str:
        name = f"always {value:g}"
        self.model["Schedule:Constant"][name] = {
            "hourly_value": value,
            "schedule_type_limits_name": "any",
        }
        return name

    def csv(self) -> str:
        """The file of the columns."""
        if not self.columns:
            return ""
        table = np.stack(list(self.columns.values()), axis=1)
        head = ",".join(name.replace(",", " ") for name in self.columns)
        return "\n".join([head, *(",".join(f"{v:.6g}" for v in row) for row in table)]) + "\n"


def internal_heat(model: Model, zone: str, gains: Gains, schedules: Schedules) -> None:
    """The convective and the radiant heat of all gains, each as equipment of 1 W."""
    for kind, power in (("convective", gains.convective), ("radiant", gains.radiant)):
        if not np.any(power):
            continue
        model.setdefault("OtherEquipment", {})[f"{zone} {kind}"] = {
            "fuel_type": "None",
            ZONE: zone,
            "schedule_name": schedules.name(f"{zone} {kind} W", power),
            "design_level_calculation_method": "EquipmentLevel",
            "design_level": 1.0,
            "fraction_latent": 0.0,
            "fraction_radiant": float(kind == "radiant"),
            "fraction_lost": 0.0,
        }


def outdoor_air(model: Model, zone: str, one: Zone, schedules: Schedules) -> tuple[str, ...]:
    """The outdoor air of a zone; what EnergyPlus is not told of it, in sentences."""
    leak, flows = one.leakage, {}
    factors = dict(zip(("constant_term", "temperature_term", "velocity_term",
                        "velocity_squared_term"), leak.factors, strict=True))  # fmt: skip
    flows["leaks"] = one.infiltration_ach, factors
    flows["other air"] = one.other_air_ach, {"constant_term": 1.0}
    notes = []
    supply = one.supply
    if supply is not None:
        flows["supply"] = supply.ach, {"constant_term": 1.0}
        if supply.temperature_c is not None or supply.recovery or np.isfinite(supply.least_c):
            notes.append("supply air is outdoor air there, without recovery or its own temperature")
    if one.bridges:
        ach = one.bridges / AIR_HEAT / one.volume * 3600.0
        flows["thermal bridges"] = ach, {"constant_term": 1.0}
        notes.append("thermal bridges are an air flow of as much heat per kelvin")
    for label, (ach, terms) in flows.items():
        if not np.any(ach):
            continue
        model["ZoneInfiltration:DesignFlowRate"][f"{zone} {label}"] = {
            ZONE: zone,
            "schedule_name": schedules.name(f"{zone} {label} 1/h", ach),
            "design_flow_rate_calculation_method": "AirChanges/Hour",
            "air_changes_per_hour": 1.0,
            **{f"{term}_coefficient": value for term, value in terms.items()},
        }
    notes += _leakage_area(model, zone, one)
    if one.airing is not None:
        notes.append("opened windows are left out")
    if one.beside:
        notes.append("air exchanged with neighbours of known temperature is left out")
    if one.slab is not None:
        notes.append("its heated slab is left out")
    return tuple(f"{one.name}: {note}" for note in notes)


def _leakage_area(model: Model, zone: str, one: Zone) -> list[str]:
    """Sherman and Grimsrud's flow, of 1000 cm2; a sentence where the exponents are others."""
    leak = one.leakage
    if not leak.stack and not leak.wind:
        return []
    if (leak.stack_exponent, leak.wind_exponent) != (0.5, 1.0):
        return ["the leakage of a pressure test is left out"]
    model.setdefault("ZoneInfiltration:EffectiveLeakageArea", {})[f"{zone} leakage"] = {
        "zone_or_space_name": zone,
        "schedule_name": "always",
        "effective_air_leakage_area": 1000.0,
        "stack_coefficient": leak.stack**2,
        "wind_coefficient": leak.wind**2,
    }
    return []


def ideal_plant(
    model: Model, zone: str, loads: IdealLoads, schedules: Schedules
) -> tuple[str, ...]:
    """Two set points and an ideal plant that holds them; what EnergyPlus is not told of it."""
    heats, cools = np.any(np.isfinite(loads.heating_c)), np.any(np.isfinite(loads.cooling_c))
    if not heats and not cools:
        return ()
    low = np.maximum(loads.heating_c, OFF_C[0])
    high = np.minimum(loads.cooling_c, OFF_C[1])
    name = f"{zone} plant"
    plant: dict[str, Any] = {
        "zone_supply_air_node_name": f"{zone} supply",
        "dehumidification_control_type": "None",
        "humidification_control_type": "None",
    }
    for kind, limit in (("heating", loads.heating_limit), ("cooling", loads.cooling_limit)):
        if np.isfinite(limit):
            key = "sensible" if kind == "heating" else "total"
            plant[f"{kind}_limit"] = "LimitCapacity"
            plant[f"maximum_{key}_{kind}_capacity"] = float(limit)
    objects = {
        "ZoneControl:Thermostat": {
            "zone_or_zonelist_name": zone,
            "control_type_schedule_name": schedules.name("", 4.0),
            "control_1_object_type": "ThermostatSetpoint:DualSetpoint",
            "control_1_name": name,
        },
        "ThermostatSetpoint:DualSetpoint": {
            "heating_setpoint_temperature_schedule_name": schedules.name(f"{zone} heating C", low),
            "cooling_setpoint_temperature_schedule_name": schedules.name(f"{zone} cooling C", high),
        },
        IDEAL: plant,
        "ZoneHVAC:EquipmentList": {
            "equipment": [
                {
                    "zone_equipment_object_type": IDEAL,
                    "zone_equipment_name": name,
                    "zone_equipment_cooling_sequence": 1,
                    "zone_equipment_heating_or_no_load_sequence": 1,
                }
            ]
        },
        "ZoneHVAC:EquipmentConnections": {
            "zone_name": zone,
            "zone_conditioning_equipment_list_name": name,
            "zone_air_inlet_node_or_nodelist_name": f"{zone} supply",
            "zone_air_node_name": f"{zone} air node",
            "zone_return_air_node_or_nodelist_name": f"{zone} return",
        },
    }
    for kind, entry in objects.items():
        model.setdefault(kind, {})[name] = entry
    radiant = max(loads.heating_radiant * heats, loads.cooling_radiant * cools)
    return (f"{zone}: heating and cooling go wholly to the air there",) if radiant else ()
