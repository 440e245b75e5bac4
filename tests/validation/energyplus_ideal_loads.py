"""EnergyPlus' ideal plant of the reference room: two set points by schedule, no humidity."""

from __future__ import annotations

from tests.validation.energyplus_model import Model

IDEAL = "ZoneHVAC:IdealLoadsAirSystem"


def ideal_loads(heating: str, cooling: str, control: str) -> Model:
    """Objects of an unlimited, sensible ideal system in the room.

    Args:
        heating, cooling: schedules of the set points [C].
        control: schedule of the control type: 4, two set points.
    """
    return {
        "ZoneControl:Thermostat": {
            "THERMOSTAT": {
                "zone_or_zonelist_name": "ROOM",
                "control_type_schedule_name": control,
                "control_1_object_type": "ThermostatSetpoint:DualSetpoint",
                "control_1_name": "SET POINTS",
            }
        },
        "ThermostatSetpoint:DualSetpoint": {
            "SET POINTS": {
                "heating_setpoint_temperature_schedule_name": heating,
                "cooling_setpoint_temperature_schedule_name": cooling,
            }
        },
        IDEAL: {
            "IDEAL": {
                "zone_supply_air_node_name": "SUPPLY",
                "dehumidification_control_type": "None",
                "humidification_control_type": "None",
            }
        },
        "ZoneHVAC:EquipmentList": {
            "EQUIPMENT": {
                "equipment": [
                    {
                        "zone_equipment_object_type": IDEAL,
                        "zone_equipment_name": "IDEAL",
                        "zone_equipment_cooling_sequence": 1,
                        "zone_equipment_heating_or_no_load_sequence": 1,
                    }
                ]
            }
        },
        "ZoneHVAC:EquipmentConnections": {
            "CONNECTIONS": {
                "zone_name": "ROOM",
                "zone_conditioning_equipment_list_name": "EQUIPMENT",
                "zone_air_inlet_node_or_nodelist_name": "SUPPLY",
                "zone_air_node_name": "ROOM AIR",
                "zone_return_air_node_or_nodelist_name": "RETURN",
            }
        },
    }
