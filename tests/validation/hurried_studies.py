"""Three study files as a user in a hurry types them, against EnergyPlus models of the same words.

    python -m tests.validation hurried_studies FOLDER --reference ../shared/reference/energyplus \
        --weather DIR

What the study leaves out is the default that its head names.  EnergyPlus' models are written here
from the description, with EnergyPlus' own defaults (TARP, DOE-2, its sun), not exported: an
unheated attic over a heated storey, a heated cellar in the ground (Kiva, with a sunlit ground and
a dark one: ISO 13370 has no sun on the ground), a corner office behind an exterior shade known by
BSDF, U and g, whose windows are opened.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bim.defaults import CEILING_SLAB, EXTERIOR_WALL, GROUND_FLOOR, INTERIOR_WALL, ROOF, ROOM_REFLECTANCE, UPPER_FLOOR
from bim.energyplus_parts import layer_keys
from bim.model import Construction
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_by_study import known_window, our_year
from tests.validation.energyplus_program import MODELS, Model, merged, run_written
from thermal.zone import OUTSIDE_ABSORPTANCE

SETTLED = 7 * 24  # hours left out of the temperatures at the start
OUTDOORS, INDOORS = "Outdoors", "Adiabatic"
SIDES = ("front", "right", "back", "left", "floor", "ceiling")
CELLS = {
    "Oklahoma": "USA_OK_Oklahoma.City-Will.Rogers.World.AP.723530_TMY3.epw",
    "Boulder": "USA_CO_Boulder-Broomfield-Jefferson.County.AP.724699_TMY3.epw",
    "Las Vegas": "USA_NV_Las.Vegas-McCarran.Intl.AP.723860_TMY3.epw",
}
ATTIC = """
[box]
width = 8
depth = 6
height = 2.4
facing_deg = 200
[box.adjacency]
left = "outside"
right = "outside"
back = "outside"
ceiling = "outside"
floor = "space"
[[box.window]]
x = 3
sill = 0.8
width = 1.4
height = 1.2
[[system]]
[[system.layers]]
thickness = 0.006
conductivity = 0.9
solar = [0.775, 0.071, 0.071]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.006
conductivity = 0.9
emissivity = [0.05, 0.84]
solar = [0.60, 0.22, 0.17]
[gains]
persons = 0
equipment_w_m2 = 0
[air]
infiltration_ach = 0.7
[[envelope.neighbour]]
faces = ["floor"]
temperature_c = 20
"""
CELLAR = """
[box]
width = 5
depth = 4
height = 2.4
[box.adjacency]
front = "ground"
left = "ground"
right = "ground"
back = "ground"
floor = "ground"
ceiling = "space"
[envelope.ground]
kind = "basement"
depth = 2.4
perimeter = 18
soil = "clay"
[gains]
persons = 0
equipment_w_m2 = 4
[air]
infiltration_ach = 0.2
[loads]
heating_c = 18
"""
OFFICE = """
[box]
width = 5
depth = 6
height = 2.8
facing_deg = 260
adjacency = { left = "outside" }
[[box.window]]
x = 1
sill = 0.9
width = 3
height = 1.5
[[system]]
bsdf = "%s"
u_value = %.3g
g_value = %.3g
[gains]
persons = 2
equipment_w_m2 = 6
[air]
infiltration_ach = 0.3
[air.windows]
share = 0.1
[loads]
heating_c = 20
"""


@dataclass(frozen=True, slots=True)
class Box:
    """EnergyPlus' box of a description."""

    size: tuple[float, float, float]  # width, depth, height [m]
    facing_deg: float
    beyond: dict[str, str | tuple[str, str]]  # by side: a boundary condition, and its object
    layers: dict[str, Construction]
    window: tuple[float, float, float, float] | None  # x, sill, width, height [m]
    infiltration_ach: float
    gain_w: float  # from 8 to 18 h, half of it radiant
    heating_c: float | None = None
    more: Model = field(default_factory=dict)

    def model(self) -> Model:
        """The whole model."""
        room = json.loads((MODELS / "room.epJSON").read_text("utf-8"))
        kept = (
            "Version",
            "SimulationControl",
            "Timestep",
            "RunPeriod",
            "GlobalGeometryRules",
            "ShadowCalculation",
            "OutputControl:Files",
            "Building",
        )
        zone = {"zone_or_zonelist_or_space_or_spacelist_name": "ROOM"}
        model: Model = {name: room[name] for name in kept}
        model["Building"]["main"]["north_axis"] = self.facing_deg - 180.0
        model["Zone"] = {"ROOM": {}}
        model["Schedule:Compact"] = {name: room["Schedule:Compact"][name] for name in ("WORK", "ON")}
        if self.window is not None:
            for name in ("WindowMaterial:Glazing", "WindowMaterial:GasMixture"):
                model[name] = room[name]
            model["Construction"] = {"GLAZING": room["Construction"]["GLAZING"]}
            model["FenestrationSurface:Detailed"] = {"WINDOW": self._glass(*self.window)}
        for side in SIDES:
            model = merged(model, self._side(side))
        model["ZoneInfiltration:DesignFlowRate"] = {
            "AIR": zone
            | {
                "schedule_name": "ON",
                "design_flow_rate_calculation_method": "AirChanges/Hour",
                "air_changes_per_hour": self.infiltration_ach,
                "constant_term_coefficient": 1.0,
            }
        }
        model["ElectricEquipment"] = {
            "GAINS": zone
            | {
                "schedule_name": "WORK",
                "design_level_calculation_method": "EquipmentLevel",
                "design_level": self.gain_w,
                "fraction_radiant": 0.5,
            }
        }
        if self.heating_c is not None:
            held = json.loads((MODELS / "ideal_loads_20_26.epJSON").read_text("utf-8"))
            for name, value in (("HEATED", self.heating_c), ("COOLED", 90.0)):
                held["Schedule:Compact"][name]["data"][-1]["field"] = value
            model = merged(model, held)
        names = (
            "Zone Mean Air Temperature",
            "Zone Operative Temperature",
            "Zone Ideal Loads Zone Sensible Heating Rate",
        )
        model["Output:Variable"] = {
            name: {"key_value": "*", "variable_name": name, "reporting_frequency": "Hourly"} for name in names
        }
        return merged(model, self.more)

    def _side(self, side: str) -> Model:
        w, d, h = self.size
        ends = {
            "front": ((0, 0), (w, 0)),
            "right": ((w, 0), (w, d)),
            "back": ((w, d), (0, d)),
            "left": ((0, d), (0, 0)),
        }
        if side in ends:
            (a, b), (c, e) = ends[side]
            corners = [(a, b, h), (a, b, 0), (c, e, 0), (c, e, h)]
        elif side == "floor":
            corners = [(0, 0, 0), (0, d, 0), (w, d, 0), (w, 0, 0)]
        else:
            corners = [(0, d, h), (0, 0, h), (w, 0, h), (w, d, h)]
        layers, beyond = self.layers[side].layers, self.beyond[side]
        materials = {
            f"{side} {k}": {
                "roughness": "MediumRough",
                "thickness": one.thickness,
                "conductivity": one.conductivity,
                "density": one.density,
                "specific_heat": one.heat_capacity,
                "thermal_absorptance": 0.9,
                "solar_absorptance": OUTSIDE_ABSORPTANCE
                if k < len(layers) - 1
                else 1.0 - ROOM_REFLECTANCE.get(side, ROOM_REFLECTANCE["wall"]),
            }
            for k, one in enumerate(layers)
        }
        keys = layer_keys(len(layers))
        free, upright = beyond == OUTDOORS, side in ends
        face: dict[str, Any] = {
            "surface_type": "Wall" if upright else side.capitalize(),
            "construction_name": side,
            "zone_name": "ROOM",
            "outside_boundary_condition": beyond if isinstance(beyond, str) else beyond[0],
            "sun_exposure": "SunExposed" if free else "NoSun",
            "wind_exposure": "WindExposed" if free else "NoWind",
            "vertices": [
                {f"vertex_{axis}_coordinate": value for axis, value in zip("xyz", p, strict=True)} for p in corners
            ],
        }
        if side == "ceiling" and free:
            face["surface_type"] = "Roof"
        if not isinstance(beyond, str):
            face["outside_boundary_condition_object"] = beyond[1]
        return {
            "Material": materials,
            "Construction": {side: dict(zip(keys, materials, strict=True))},
            "BuildingSurface:Detailed": {side.upper(): face},
        }

    def _glass(self, x: float, sill: float, width: float, height: float) -> dict[str, Any]:
        top = sill + height
        corners = [(x, 0, top), (x, 0, sill), (x + width, 0, sill), (x + width, 0, top)]
        return {
            "surface_type": "Window",
            "construction_name": "GLAZING",
            "building_surface_name": "FRONT",
            "number_of_vertices": 4,
        } | {
            f"vertex_{k}_{axis}_coordinate": value
            for k, p in enumerate(corners, 1)
            for axis, value in zip("xyz", p, strict=True)
        }


def attic() -> Box:
    """Over a storey at 20 degC, behind a film of 0.13 m2 K/W."""
    below = {
        "combined_convective_radiative_film_coefficient": 1.0 / 0.13,
        "constant_temperature": 20.0,
        "constant_temperature_coefficient": 1.0,
        "external_dry_bulb_temperature_coefficient": 0.0,
    }
    return Box(
        (8.0, 6.0, 2.4),
        200.0,
        dict.fromkeys(SIDES, OUTDOORS) | {"floor": ("OtherSideCoefficients", "BELOW")},
        dict.fromkeys(SIDES, EXTERIOR_WALL) | {"ceiling": ROOF, "floor": UPPER_FLOOR},
        (3.0, 0.8, 1.4, 1.2),
        0.7,
        0.0,
        more={"SurfaceProperty:OtherSideCoefficients": {"BELOW": below}},
    )


def cellar(*, dark: bool) -> Box:
    """With all of its walls in clay; dark: no sun and no sky on the ground."""
    soil = {
        "soil_conductivity": 1.5,
        "soil_density": 2000.0,
        "soil_specific_heat": 1500.0,
        "simulation_timestep": "Timestep",
    }
    if dark:
        soil |= {"ground_solar_absorptivity": 0.0, "ground_thermal_absorptivity": 0.0}
    edge = {
        "surface_name": "FLOOR",
        "total_exposed_perimeter": 18.0,
        "exposed_perimeter_calculation_method": "TotalExposedPerimeter",
    }
    foundation = {"initial_indoor_air_temperature": 18.0, "wall_height_above_grade": 0.0, "wall_depth_below_slab": 0.0}
    return Box(
        (5.0, 4.0, 2.4),
        180.0,
        dict.fromkeys(SIDES, ("Foundation", "F")) | {"ceiling": INDOORS},
        dict.fromkeys(SIDES, EXTERIOR_WALL) | {"ceiling": CEILING_SLAB, "floor": GROUND_FLOOR},
        None,
        0.2,
        80.0,
        18.0,
        {
            "Foundation:Kiva": {"F": foundation},
            "Foundation:Kiva:Settings": {"K": soil},
            "SurfaceProperty:ExposedFoundationPerimeter": {"FLOOR": edge},
        },
    )


def office(*, opened: bool) -> Box:
    """Its windows open above 23 degC from 8 to 18 h, flows by stack and wind as EN 16798-7's.

    EnergyPlus adds these as squares, where the standard takes the greater one.
    """
    airing = {
        "zone_or_space_name": "ROOM",
        "opening_area": 0.45,
        "opening_area_fraction_schedule_name": "WORK",
        # sqrt(0.001)/2 and 0.2 sqrt(2 g 0.493 m/295 K) = sqrt(0.0035 1.5 m)/2
        "opening_effectiveness": 0.0158,
        "height_difference": 0.493,
        "discharge_coefficient_for_opening": 0.2,
        "minimum_indoor_temperature": 23.0,
        "minimum_outdoor_temperature": 10.0,
        "delta_temperature": -100.0,
    }
    more = json.loads((MODELS / "ext_shade.epJSON").read_text("utf-8"))
    if opened:
        more["ZoneVentilation:WindandStackOpenArea"] = {"OPENED": airing}
    return Box(
        (5.0, 6.0, 2.8),
        260.0,
        dict.fromkeys(SIDES, INDOORS) | {"front": OUTDOORS, "left": OUTDOORS},
        dict.fromkeys(SIDES, INTERIOR_WALL)
        | {"front": EXTERIOR_WALL, "left": EXTERIOR_WALL, "ceiling": CEILING_SLAB, "floor": UPPER_FLOOR},
        (1.0, 0.9, 3.0, 1.5),
        0.3,
        330.0,
        20.0,
        more,
    )


def main(folder: Path, *, reference: Path, weather: Path) -> pd.DataFrame:
    """Air and operative temperature [K] and heating [kWh] of each study, EnergyPlus' beside it.

    weather: the folder of the weather files, which come with pyenergyplus-lbnl.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shade = known_window(folder, reference, "ext_shade")
    shaded = OFFICE % (shade.bsdf, shade.u_value, shade.g_normal)
    shut = shaded.replace("[air.windows]\nshare = 0.1\n", "")
    trials = (
        ("attic, unheated", "Oklahoma", ATTIC, attic()),
        ("cellar in the ground, sunlit", "Boulder", CELLAR, cellar(dark=False)),
        ("cellar in the ground, dark", "Boulder", CELLAR, cellar(dark=True)),
        ("office, exterior shade by U, g, BSDF, windows opened", "Las Vegas", shaded, office(opened=True)),
        ("the same, windows shut", "Las Vegas", shut, office(opened=False)),
    )
    rows = []
    for name, place, text, box in trials:
        epw, here = (weather / CELLS[place]).resolve(), folder / name.replace(",", "")
        here.mkdir(exist_ok=True)
        study, model = folder / f"{here.name}.toml", here / "in.epJSON"
        study.write_text(f'weather = "{epw.as_posix()}"{text}', encoding="utf-8")
        model.write_text(json.dumps(box.model()), encoding="utf-8")
        hours, theirs = our_year(study), run_written(model, epw)
        row: dict[str, object] = {"study": name, "weather": place}
        for label, column, key in (
            ("air", "air_c", "ROOM:Zone Mean Air Temperature"),
            ("operative", "operative_c", "ROOM:Zone Operative Temperature"),
        ):
            pair = hours[column].to_numpy()[SETTLED:], theirs[key].to_numpy()[SETTLED:]
            row[label], row[f"{label} bias"] = rmse_and_bias(*pair)
            row[f"{label}, most"] = float(np.abs(pair[0] - pair[1]).max())
        heat = theirs.filter(like="Sensible Heating Rate").to_numpy().sum(axis=1)
        row["heating"], row["heating E+"] = hours["heating_w"].sum() / 1e3, heat.sum() / 1e3
        if box.heating_c is not None:
            row["peak"], row["peak E+"] = hours["heating_w"].max(), heat.max()
        rows.append(row)
    return pd.DataFrame(rows)
