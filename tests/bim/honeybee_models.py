"""A small honeybee model, made here: two rooms of different size with a window, a glass door, a
door between them, shades, constructions and modifiers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

LOW, HIGH = 0.0, 3.0
WEEKDAYS = ("monday", "tuesday", "wednesday", "thursday", "friday")


def box_faces(room: str, x0: float, x1: float, depth: float, *, beside: dict[str, str]) -> list:
    """The six faces of a box from x0 to x1, y 0 to depth; beside: its neighbour by side."""
    a, b, c, d = ([x0, 0.0], [x1, 0.0], [x1, depth], [x0, depth])
    rings = {
        "south": ([*a, LOW], [*b, LOW], [*b, HIGH], [*a, HIGH]),
        "east": ([*b, LOW], [*c, LOW], [*c, HIGH], [*b, HIGH]),
        "north": ([*c, LOW], [*d, LOW], [*d, HIGH], [*c, HIGH]),
        "west": ([*d, LOW], [*a, LOW], [*a, HIGH], [*d, HIGH]),
        "floor": ([*d, LOW], [*c, LOW], [*b, LOW], [*a, LOW]),
        "ceiling": ([*a, HIGH], [*b, HIGH], [*c, HIGH], [*d, HIGH]),
    }
    kinds = {"floor": "Floor", "ceiling": "RoofCeiling"}
    faces = []
    for side, ring in rings.items():
        condition: dict[str, Any] = {"type": "Ground" if side == "floor" else "Outdoors"}
        if side in beside:
            other = {"east": "west", "west": "east"}[side]
            pair = [f"{beside[side]}_{other}", beside[side]]
            condition = {"type": "Surface", "boundary_condition_objects": pair}
        faces.append(
            {
                "type": "Face",
                "identifier": f"{room}_{side}",
                "properties": _no_properties(),
                "face_type": kinds.get(side, "Wall"),
                "boundary_condition": condition,
                "geometry": {"type": "Face3D", "boundary": [list(p) for p in ring]},
            }
        )
    return faces


def _no_properties() -> dict:
    return {"energy": {}, "radiance": {}}


def opening(name: str, ring: list, **more: Any) -> dict:
    """An aperture or door in a wall."""
    return {
        "type": "Aperture",
        "identifier": name,
        "properties": _no_properties(),
        "geometry": {"type": "Face3D", "boundary": ring},
        "boundary_condition": {"type": "Outdoors"},
        **more,
    }


def two_rooms() -> dict:
    """Office, 5 x 8 x 3 m, and hall, 4 x 8 x 3 m east of it: 40 and 32 m2, 120 and 96 m3."""
    office = box_faces("Office", 0.0, 5.0, 8.0, beside={"east": "Hall"})
    hall = box_faces("Hall", 5.0, 9.0, 8.0, beside={"west": "Office"})
    window = [[1.0, 0.0, 0.9], [4.0, 0.0, 0.9], [4.0, 0.0, 2.4], [1.0, 0.0, 2.4]]
    office[0]["apertures"] = [opening("Window", window)]
    office[0]["apertures"][0]["outdoor_shades"] = [
        {
            "type": "Shade",
            "identifier": "Overhang",
            "properties": _no_properties(),
            "geometry": {
                "type": "Face3D",
                "boundary": [[1.0, 0.0, 2.5], [4.0, 0.0, 2.5], [4.0, -1.0, 2.5], [1.0, -1.0, 2.5]],
            },
        }
    ]
    glass_door = [[6.0, 0.0, 0.0], [7.0, 0.0, 0.0], [7.0, 0.0, 2.0], [6.0, 0.0, 2.0]]
    hall[0]["doors"] = [opening("Glass door", glass_door, type="Door", is_glass=True)]
    leaf = [[5.0, 2.0, 0.0], [5.0, 3.0, 0.0], [5.0, 3.0, 2.0], [5.0, 2.0, 2.0]]
    between = {"type": "Surface"}
    office[1]["doors"] = [opening("Leaf", leaf, type="Door", boundary_condition=between)]
    hall[3]["doors"] = [opening("Leaf back", leaf[::-1], type="Door", boundary_condition=between)]
    rooms = [
        {"type": "Room", "identifier": name, "properties": _no_properties(), "faces": faces}
        for name, faces in (("Office", office), ("Hall", hall))
    ]
    return {
        "type": "Model",
        "identifier": "two_rooms",
        "units": "Meters",
        "rooms": rooms,
        "properties": {"energy": _energy(), "radiance": _radiance()},
    }


def _energy() -> dict:
    mass = {"type": "EnergyMaterial", "thermal_absorptance": 0.85}
    materials = [
        mass
        | {
            "identifier": "Brick",
            "thickness": 0.2,
            "conductivity": 0.9,
            "density": 1900.0,
            "specific_heat": 800.0,
            "solar_absorptance": 0.6,
            "visible_absorptance": 0.65,
        },
        mass
        | {
            "identifier": "Board",
            "thickness": 0.0125,
            "conductivity": 0.25,
            "density": 900.0,
            "specific_heat": 1000.0,
            "solar_absorptance": 0.3,
            "visible_absorptance": 0.25,
        },
        {"type": "EnergyMaterialNoMass", "identifier": "Wool", "r_value": 3.0},
        {"type": "EnergyWindowMaterialSimpleGlazSys", "identifier": "Unit", "u_factor": 1.1, "shgc": 0.5, "vt": 0.7},
    ]
    return {
        "global_construction_set": {
            "type": "GlobalConstructionSet",
            "wall_set": {"exterior_construction": "Wall", "interior_construction": "Partition"},
            "aperture_set": {"window_construction": "Glazing"},
            "door_set": {"exterior_glass_construction": "Glazing"},
            "materials": materials,
            "constructions": [
                {"type": "OpaqueConstructionAbridged", "identifier": "Wall", "materials": ["Brick", "Wool", "Board"]},
                {
                    "type": "OpaqueConstructionAbridged",
                    "identifier": "Partition",
                    "materials": ["Board", "Wool", "Board"],
                },
                {"type": "WindowConstructionAbridged", "identifier": "Glazing", "materials": ["Unit"]},
            ],
        }
    }


def _radiance() -> dict:
    colours = {f"{c}_reflectance": 0.45 for c in "rgb"}
    return {
        "modifiers": [{"type": "plastic", "identifier": "paint", "specularity": 0.02, **colours}],
        "global_modifier_set": {
            "type": "GlobalModifierSet",
            "wall_set": {"exterior_modifier": "paint", "interior_modifier": "paint"},
        },
    }


def used_model() -> dict:
    """Two rooms with a program, the office's own lamps, an ideal system in the office alone."""
    model = two_rooms()

    def day(name, times, values, **more):
        return {"type": "ScheduleDay", "identifier": name, "times": times, "values": values} | more

    weekday = day("work", [[0, 0], [8, 30], [18, 0]], [0.1, 1.0, 0.2])
    summer = day("summer", [[0, 0]], [0.5])
    schedules = [
        {
            "type": "ScheduleRulesetAbridged",
            "identifier": "occupied",
            "day_schedules": [weekday, summer, day("free", [[0, 0]], [0.0])],
            "default_day_schedule": "free",
            "holiday_schedule": "free",
            "schedule_rules": [
                {"schedule_day": "summer", "apply_monday": True, "start_date": [7, 1], "end_date": [8, 31]},
                {"schedule_day": "work"} | {f"apply_{d}": True for d in WEEKDAYS},
            ],
        },
        {
            "type": "ScheduleRulesetAbridged",
            "identifier": "warm",
            "day_schedules": [day("21", [[0, 0]], [21.0])],
            "default_day_schedule": "21",
        },
        {"type": "ScheduleFixedIntervalAbridged", "identifier": "cool", "timestep": 2, "values": [24.0, 26.0] * 8760},
    ]
    program = {
        "type": "ProgramTypeAbridged",
        "identifier": "Office",
        "people": {"people_per_area": 0.1, "occupancy_schedule": "occupied", "latent_fraction": 0.25},
        "lighting": {"watts_per_area": 8.0, "schedule": "occupied", "radiant_fraction": 0.4},
        "electric_equipment": {"watts_per_area": 5.0, "schedule": "occupied"},
        "gas_equipment": {"watts_per_area": 2.0, "schedule": "occupied", "lost_fraction": 0.5},
        "infiltration": {
            "flow_per_exterior_area": 3e-4,
            "schedule": "occupied",
            "velocity_coefficient": 0.2,
            "constant_coefficient": 0.6,
        },
        "ventilation": {"flow_per_person": 0.01, "flow_per_area": 1e-4},
        "setpoint": {"heating_schedule": "warm", "cooling_schedule": "cool"},
    }
    energy = model["properties"]["energy"]
    energy |= {
        "schedules": schedules,
        "program_types": [program],
        "hvacs": [
            {
                "type": "IdealAirSystemAbridged",
                "identifier": "ideal",
                "economizer_type": "NoEconomizer",
                "sensible_heat_recovery": 0.7,
                "heating_limit": 900.0,
            }
        ],
    }
    for room in model["rooms"]:
        room["properties"]["energy"]["program_type"] = "Office"
    own = model["rooms"][0]["properties"]["energy"]
    own |= {
        "hvac": "ideal",
        "lighting": {"watts_per_area": 3.0, "schedule": "occupied"},
        "service_hot_water": {"flow_per_area": 0.1},
    }
    return model


def write(model: dict, folder: Path, name: str = "two_rooms.hbjson") -> Path:
    """The model as a file."""
    path = folder / name
    path.write_text(json.dumps(model))
    return path
