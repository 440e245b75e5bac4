"""Summer of a house on the ground by DIN 4108-2's set-up, in EnergyPlus with two models of the ground.

    python -m tests.validation summer_on_ground

`cfs thermal --energyplus` writes bedroom and living room of the FZK house.  EnergyPlus gets the opened windows that
the export leaves out, and the ground either as exported (ISO 13370) or as Foundation:Kiva in place of it: a finite
difference model in two dimensions that shares nothing with ISO 13370, with and without sun on the ground outside.
"""

from __future__ import annotations

import copy
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bim.building_file import read_building_file
from bim.energyplus_parts import MOST_LAYERS, layer_keys
from bim.ground_floor import ground_floor
from bim.planes import newell_normal
from scenes.cli import run
from tests.conftest import REPOSITORY
from tests.validation.energyplus_program import run_written

Model = dict[str, Any]
SHARED = REPOSITORY.parent / "shared" / "data"
HOUSE = SHARED / "ifc" / "buildings" / "AC20-FZK-Haus.ifc"
WEATHER = SHARED / "epw" / "DEU_Mannheim.107290_IWEC.epw"
ROOMS = ("Schlafzimmer", "Wohnen")
STUDY = f"""
weather = "{WEATHER}"
building = "{HOUSE}"
spaces = ["Schlafzimmer", "Wohnen"]
[[system]]
[[system.layers]]
thickness = 0.004
conductivity = 1.0
emissivity = [0.84, 0.84]
solar = [0.85, 0.08, 0.08]
gap = {{ width = 0.016, gas = {{ argon = 0.9, air = 0.1 }} }}
[[system.layers]]
thickness = 0.004
conductivity = 1.0
emissivity = [0.05, 0.84]
solar = [0.60, 0.25, 0.20]
[gains]
persons = 0
equipment_w_m2 = 4.1667
occupied = [0, 24]
[schedules.day]
weekday = [{{ hours = [6, 23], value = 1 }}]
[air]
infiltration_ach = 0.5
[air.windows]
share = "day"
ach = 2.5
open_above_c = 23
close_below_c = 23
least_outdoor_c = -20
[loads]
heating_c = 20
"""
SOIL_LAYERS = 2  # that ISO 13370 puts before a construction: virtual layer and soil


def opened(model: Model) -> Model:
    """The model with windows of 2.5 air changes above 23 degC, from 6 to 23 o'clock."""
    model = copy.deepcopy(model)
    fields = ("Through: 12/31", "For: AllDays", "Until: 6:00", 0.0, "Until: 23:00", 1.0, "Until: 24:00", 0.0)
    day = {"schedule_type_limits_name": "any", "data": [{"field": one} for one in fields]}
    model["Schedule:Compact"] = {"day": day}
    model["ZoneVentilation:DesignFlowRate"] = {
        f"{zone} airing": {
            "zone_or_zonelist_or_space_or_spacelist_name": zone,
            "schedule_name": "day",
            "design_flow_rate_calculation_method": "AirChanges/Hour",
            "air_changes_per_hour": 2.5,
            "ventilation_type": "Natural",
            "minimum_indoor_temperature": 23.0,
            "minimum_outdoor_temperature": -20.0,
            "delta_temperature": 0.0,
            "constant_term_coefficient": 1.0,
        }
        for zone in model["Zone"]
    }
    operative = "Zone Operative Temperature"
    model["Output:Variable"]["operative"] = {
        "key_value": "*",
        "variable_name": operative,
        "reporting_frequency": "Hourly",
    }
    return model


def in_kiva(model: Model, absorptance: float) -> Model:
    """The model whose floors lie on Kiva's ground, with the share of the sun that the ground outside absorbs."""
    model = copy.deepcopy(model)
    area, perimeter = ground_floor(read_building_file(HOUSE))
    model["Foundation:Kiva:Settings"] = {
        "ground": {
            "soil_conductivity": 2.0,
            "soil_density": 1000.0,
            "soil_specific_heat": 2000.0,
            "ground_solar_absorptivity": absorptance,
            "deep_ground_boundary_condition": "ZeroFlux",
            "deep_ground_depth": 20.0,
        }
    }
    for name, surface in model["BuildingSurface:Detailed"].items():
        if "beyond" not in surface.get("outside_boundary_condition_object", ""):
            continue
        construction = model["Construction"][surface["construction_name"]]
        layers = [construction[key] for key in layer_keys(MOST_LAYERS) if key in construction][SOIL_LAYERS:]
        model["Construction"][f"{name} alone"] = dict(zip(layer_keys(len(layers)), layers, strict=True))
        surface |= {
            "construction_name": f"{name} alone",
            "outside_boundary_condition": "Foundation",
            "outside_boundary_condition_object": f"{name} ground",
        }
        corners = np.array([[one[f"vertex_{axis}_coordinate"] for axis in "xyz"] for one in surface["vertices"]])
        area_here = float(np.linalg.norm(newell_normal(corners)))
        kiva = {"wall_height_above_grade": 0.2, "wall_depth_below_slab": 0.0}
        model.setdefault("Foundation:Kiva", {})[f"{name} ground"] = kiva
        model.setdefault("SurfaceProperty:ExposedFoundationPerimeter", {})[f"{name} edge"] = {
            "surface_name": name,
            "exposed_perimeter_calculation_method": "TotalExposedPerimeter",
            "total_exposed_perimeter": area_here * perimeter / area,
        }
    return model


def row(source: str, room: str, operative: np.ndarray, heating: np.ndarray) -> Model:
    """Figures of a room's year."""
    return {
        "room": room,
        "by": source,
        "highest C": round(float(operative.max()), 1),
        "K h > 27 C": round(float(np.maximum(operative - 27.0, 0.0).sum())),
        "July C": round(float(operative[4344:5088].mean()), 2),
        "heating kWh": round(float(heating.sum() / 1e3)),
    }


def main() -> pd.DataFrame:
    """The rooms' summer and heating by mitsuba-cfs and by EnergyPlus on three grounds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.toml").write_text(STUDY)
        out = folder / "out"
        if run(["thermal", str(folder / "study.toml"), "--out", str(out), "--energyplus"]) != 0:
            raise RuntimeError("cfs thermal failed")
        rows = []
        for number, room in enumerate(ROOMS, 1):
            hours = pd.read_csv(out / f"hours_{number}.csv", comment="#")
            rows.append(row("mitsuba-cfs", room, hours["operative_c"].to_numpy(), hours["heating_w"].to_numpy()))
        exported = opened(json.loads((out / "model.epJSON").read_text()))
        models = {
            "EnergyPlus, ISO 13370": exported,
            "EnergyPlus, Kiva, no sun on the ground": in_kiva(exported, 0.0),
            "EnergyPlus, Kiva, bare dark ground": in_kiva(exported, 0.9),
        }
        for source, model in models.items():
            (out / "model.epJSON").write_text(json.dumps(model))
            table = run_written(out / "model.epJSON", WEATHER)
            for room in ROOMS:
                of_room = [column for column in table if room.upper() in column.upper()]
                (operative,) = [column for column in of_room if "Operative" in column]
                (heating,) = [column for column in of_room if "Heating" in column]
                rows.append(row(source, room, table[operative].to_numpy(float), table[heating].to_numpy(float)))
    return pd.DataFrame(rows).sort_values("room", kind="stable")
