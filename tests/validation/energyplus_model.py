"""Table 15's room as an EnergyPlus model (epJSON), and its year run by EnergyPlus itself.

Only the peer program runs here (pyenergyplus); parameters are those of `reference_room`.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import pandas as pd

from tests.validation.energyplus_run import run_model
from tests.validation.reference_room import ORIENTATIONS

Model = dict[str, dict[str, dict[str, Any]]]
OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "T_air",
    "ROOM:Zone Mean Radiant Temperature": "T_mrt",
    "ROOM:Zone Operative Temperature": "T_op",
    "FACADE:Surface Inside Face Temperature": "T_facade",
    "X0:Surface Inside Face Temperature": "T_wall_x0",
    "X4:Surface Inside Face Temperature": "T_wall_x4",
    "BACK:Surface Inside Face Temperature": "T_back",
    "FLOOR:Surface Inside Face Temperature": "T_floor",
    "CEILING:Surface Inside Face Temperature": "T_ceiling",
    "WINDOW:Surface Inside Face Temperature": "T_win_in",
    "WINDOW:Surface Outside Face Temperature": "T_win_out",
    "WINDOW:Surface Outside Face Incident Solar Radiation Rate per Area": "I_inc",
    "WINDOW:Surface Window Transmitted Solar Radiation Rate": "Q_trans",
}
_BOX = {  # vertices counter-clockwise from outside, upper left first
    "FACADE": ("Wall", [(0, 0, 3), (0, 0, 0), (4, 0, 0), (4, 0, 3)]),
    "X0": ("Wall", [(0, 5, 3), (0, 5, 0), (0, 0, 0), (0, 0, 3)]),
    "X4": ("Wall", [(4, 0, 3), (4, 0, 0), (4, 5, 0), (4, 5, 3)]),
    "BACK": ("Wall", [(4, 5, 3), (4, 5, 0), (0, 5, 0), (0, 5, 3)]),
    "FLOOR": ("Floor", [(0, 0, 0), (0, 5, 0), (4, 5, 0), (4, 0, 0)]),
    "CEILING": ("Ceiling", [(0, 5, 3), (0, 0, 3), (4, 0, 3), (4, 5, 3)]),
}
_WINDOW = [(0.5, 0, 2.5), (0.5, 0, 1.0), (3.5, 0, 1.0), (3.5, 0, 2.5)]


def room_model(system: str, orientation: str, *, steps: int = 6, hourly: bool = True) -> Model:
    """The epJSON of one case; systems and orientations as in the reference set."""
    model = _control(ORIENTATIONS[orientation] - 180.0, steps)
    model |= _constructions() | _surfaces() | _gains()
    model |= _shading(system)
    return model | hourly_outputs(OUTPUTS) if hourly else model


def hourly_outputs(outputs: dict[str, str]) -> Model:
    """The request for some outputs of every hour."""
    names = sorted({key.split(":", 1)[1] for key in outputs})
    return {
        "Output:Variable": {
            f"out {i}": {"key_value": "*", "variable_name": name, "reporting_frequency": "Hourly"}
            for i, name in enumerate(names)
        }
    }


def detailed_surface(
    kind: str, construction: str, zone: str, outside: str, vertices: list, partner: str = ""
) -> dict[str, Any]:
    """A surface; `outside` is "Outdoors", "Adiabatic" or "Surface" (then `partner` is its name)."""
    outdoors = outside == "Outdoors"
    surface = {
        "surface_type": kind,
        "construction_name": construction,
        "zone_name": zone,
        "outside_boundary_condition": outside,
        "sun_exposure": "SunExposed" if outdoors else "NoSun",
        "wind_exposure": "WindExposed" if outdoors else "NoWind",
        "view_factor_to_ground": "Autocalculate",
        "vertices": [
            {f"vertex_{axis}_coordinate": c for axis, c in zip("xyz", v, strict=True)}
            for v in vertices
        ],
    }
    return surface | ({"outside_boundary_condition_object": partner} if partner else {})


def _control(north_axis: float, steps: int) -> Model:
    one = "main"
    return {
        "Version": {one: {"version_identifier": "25.2"}},
        "SimulationControl": {
            one: {
                "do_zone_sizing_calculation": "No",
                "do_system_sizing_calculation": "No",
                "do_plant_sizing_calculation": "No",
                "run_simulation_for_sizing_periods": "No",
                "run_simulation_for_weather_file_run_periods": "Yes",
            }
        },
        "Building": {
            one: {
                "north_axis": north_axis,
                "terrain": "Suburbs",
                "loads_convergence_tolerance_value": 0.01,
                "temperature_convergence_tolerance_value": 0.01,
                "solar_distribution": "FullInteriorAndExterior",
                "maximum_number_of_warmup_days": 200,
                "minimum_number_of_warmup_days": 6,
            }
        },
        "Timestep": {one: {"number_of_timesteps_per_hour": steps}},
        "RunPeriod": {
            "year": {
                "begin_month": 1,
                "begin_day_of_month": 1,
                "end_month": 12,
                "end_day_of_month": 31,
                "use_weather_file_daylight_saving_period": "No",
                "use_weather_file_holidays_and_special_days": "No",
                "use_weather_file_rain_indicators": "No",
                "use_weather_file_snow_indicators": "No",
            }
        },
        "SurfaceConvectionAlgorithm:Inside": {one: {"algorithm": "TARP"}},
        "SurfaceConvectionAlgorithm:Outside": {one: {"algorithm": "DOE-2"}},
        "HeatBalanceAlgorithm": {one: {"algorithm": "ConductionTransferFunction"}},
        "ShadowCalculation": {
            one: {
                "shading_calculation_method": "PolygonClipping",
                "shading_calculation_update_frequency_method": "Periodic",
                "shading_calculation_update_frequency": 1,
            }
        },
        "GlobalGeometryRules": {
            one: {
                "starting_vertex_position": "UpperLeftCorner",
                "vertex_entry_direction": "Counterclockwise",
                "coordinate_system": "Relative",
            }
        },
        "OutputControl:Files": {
            one: {"output_csv": "Yes", "output_mtr": "No", "output_eso": "Yes"}
        },
    }


def _constructions() -> Model:
    solid = {
        "FINISH": (0.01, 0.25, 900, 1050),
        "EXTERIOR": (0.05, 2.3, 2300, 1000),
        "INSULATION": (0.14, 0.03, 35, 840),
        "MASSIVE": (0.19, 2.3, 2300, 1000),
        "THIN": (0.05, 2.3, 2300, 1000),
    }
    materials = {name: _material(*values, 0.5) for name, values in solid.items()}
    materials["FLOOR FINISH"] = _material(*solid["FINISH"], 0.8)
    materials["CEILING FINISH"] = _material(*solid["FINISH"], 0.3)
    layers = {
        "FACADE": ["EXTERIOR", "INSULATION", "MASSIVE", "FINISH"],
        "WALL": ["FINISH", "THIN", "FINISH"],
        "FLOOR": ["FLOOR FINISH", "MASSIVE", "FLOOR FINISH"],
        "CEILING": ["CEILING FINISH", "MASSIVE", "CEILING FINISH"],
        "GLAZING": ["CLEAR", "GAP", "LOWE"],
    }
    return {
        "Material": materials,
        "WindowMaterial:Glazing": {
            "CLEAR": pane(0.775, 0.071, 0.071, 0.84),
            "LOWE": pane(0.600, 0.220, 0.170, 0.05),
        },
        "WindowMaterial:GasMixture": {
            "GAP": {
                "thickness": 0.016,
                "number_of_gases_in_mixture": 2,
                "gas_1_type": "Argon",
                "gas_1_fraction": 0.9,
                "gas_2_type": "Air",
                "gas_2_fraction": 0.1,
            }
        },
        "Construction": {name: _construction(names) for name, names in layers.items()},
    }


def _material(
    thickness: float, conductivity: float, density: float, heat: float, absorptance: float
) -> dict[str, Any]:
    return {
        "roughness": "MediumRough",
        "thickness": thickness,
        "conductivity": conductivity,
        "density": density,
        "specific_heat": heat,
        "thermal_absorptance": 0.9,
        "solar_absorptance": absorptance,
        "visible_absorptance": absorptance,
    }


def pane(tau: float, front: float, back: float, emissivity: float) -> dict[str, Any]:
    """EnergyPlus' material of a pane of 6 mm."""
    return {
        "optical_data_type": "SpectralAverage",
        "thickness": 0.006,
        "solar_transmittance_at_normal_incidence": tau,
        "front_side_solar_reflectance_at_normal_incidence": front,
        "back_side_solar_reflectance_at_normal_incidence": back,
        "visible_transmittance_at_normal_incidence": tau,
        "front_side_visible_reflectance_at_normal_incidence": front,
        "back_side_visible_reflectance_at_normal_incidence": back,
        "infrared_transmittance_at_normal_incidence": 0.0,
        "front_side_infrared_hemispherical_emissivity": emissivity,
        "back_side_infrared_hemispherical_emissivity": 0.84,
        "conductivity": 0.9,
    }


def _construction(layers: list[str]) -> dict[str, Any]:
    keys = ["outside_layer"] + [f"layer_{i}" for i in range(2, len(layers) + 1)]
    return dict(zip(keys, layers, strict=True))


def _surfaces() -> Model:
    walls: dict[str, dict[str, Any]] = {}
    for name, (kind, vertices) in _BOX.items():
        construction = name if name in ("FACADE", "FLOOR", "CEILING") else "WALL"
        outside = "Outdoors" if name == "FACADE" else "Adiabatic"
        walls[name] = detailed_surface(kind, construction, "ROOM", outside, vertices)
    window = {
        "surface_type": "Window",
        "construction_name": "GLAZING",
        "building_surface_name": "FACADE",
        "number_of_vertices": 4,
    }
    for i, vertex in enumerate(_WINDOW, 1):
        window |= {f"vertex_{i}_{a}_coordinate": c for a, c in zip("xyz", vertex, strict=True)}
    return {
        "Zone": {"ROOM": {"volume": 60.0}},
        "BuildingSurface:Detailed": walls,
        "FenestrationSurface:Detailed": {"WINDOW": window},
    }


def _gains() -> Model:
    def daily(*pairs: tuple[str, float]) -> dict[str, Any]:
        data = ["Through: 12/31", "For: AllDays"]
        for until, value in pairs:
            data += [f"Until: {until}", value]
        return {"data": [{"field": value} for value in data]}

    zone = "zone_or_zonelist_or_space_or_spacelist_name"
    return {
        "Schedule:Compact": {
            "WORK": daily(("08:00", 0.0), ("18:00", 1.0), ("24:00", 0.0)),
            "ON": daily(("24:00", 1.0)),
            "SEATED": daily(("24:00", 75.0)),
        },
        "ZoneInfiltration:DesignFlowRate": {
            "AIR": {
                zone: "ROOM",
                "schedule_name": "ON",
                "design_flow_rate_calculation_method": "AirChanges/Hour",
                "air_changes_per_hour": 0.5,
                "constant_term_coefficient": 1.0,
            }
        },
        "ElectricEquipment": {
            "COMPUTERS": {
                zone: "ROOM",
                "schedule_name": "WORK",
                "design_level_calculation_method": "EquipmentLevel",
                "design_level": 160.0,
                "fraction_radiant": 0.5,
            }
        },
        "People": {
            "PERSON": {
                zone: "ROOM",
                "number_of_people_schedule_name": "WORK",
                "number_of_people_calculation_method": "People",
                "number_of_people": 1.0,
                "fraction_radiant": 0.5,
                "sensible_heat_fraction": 1.0,
                "activity_level_schedule_name": "SEATED",
            }
        },
    }


def _shading(system: str) -> Model:
    if system == "dgu":
        return {}
    outside = system.startswith("ext")
    device: Model
    if system == "ext_blind":
        device = {"WindowMaterial:Blind": {"DEVICE": _blind()}}
        kind = "ExteriorBlind"
    else:
        device = {"WindowMaterial:Shade": {"DEVICE": _shade(0.1 if outside else 0.05)}}
        kind = "ExteriorShade" if outside else "InteriorShade"
    control = {
        "zone_name": "ROOM",
        "shading_type": kind,
        "shading_device_material_name": "DEVICE",
        "shading_control_type": "AlwaysOn",
        "multiple_surface_control_type": "Sequential",
        "fenestration_surfaces": [{"fenestration_surface_name": "WINDOW"}],
    }
    return device | {"WindowShadingControl": {"CONTROL": control}}


def _shade(distance: float) -> dict[str, Any]:
    shade = {
        "solar_transmittance": 0.10,
        "solar_reflectance": 0.55,
        "visible_transmittance": 0.10,
        "visible_reflectance": 0.55,
        "infrared_hemispherical_emissivity": 0.9,
        "infrared_transmittance": 0.0,
        "thickness": 0.0005,
        "conductivity": 0.15,
        "shade_to_glass_distance": distance,
        "airflow_permeability": 0.0,
    }
    return (
        shade
        | {f"{s}_opening_multiplier": 1.0 for s in ("top", "bottom")}
        | {f"{s}_side_opening_multiplier": 1.0 for s in ("left", "right")}
    )


def _blind() -> dict[str, Any]:
    slat = {
        "slat_orientation": "Horizontal",
        "slat_width": 0.08,
        "slat_separation": 0.072,
        "slat_thickness": 0.00045,
        "slat_angle": 45.0,
        "slat_conductivity": 221.0,
        "blind_to_glass_distance": 0.1,
        "slat_infrared_hemispherical_transmittance": 0.0,
        "minimum_slat_angle": 0.0,
        "maximum_slat_angle": 180.0,
    }
    for light in ("beam", "diffuse"):
        for band in ("solar", "visible"):
            slat[f"slat_{light}_{band}_transmittance"] = 0.0
            for side in ("front", "back"):
                slat[f"{side}_side_slat_{light}_{band}_reflectance"] = 0.55
    for side in ("front", "back"):
        slat[f"{side}_side_slat_infrared_hemispherical_emissivity"] = 0.9
        slat[
            f"{'top' if side == 'front' else 'bottom'}_opening_multiplier".replace(
                "top_opening", "blind_top_opening"
            ).replace("bottom_opening", "blind_bottom_opening")
        ] = 1.0
    return slat | {f"blind_{s}_side_opening_multiplier": 1.0 for s in ("left", "right")}


def run_energyplus(
    model: Model, epw: Path, folder: Path | None = None, *, outputs: dict[str, str] | None = None
) -> pd.DataFrame:
    """Hourly results [H rows] of EnergyPlus' own run, columns as in the reference set.

    outputs: columns by EnergyPlus' name of an output ("KEY:Variable"); the reference set's without.
    """
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary) if folder is None else folder
        place.mkdir(parents=True, exist_ok=True)
        written = place / "in.epJSON"
        written.write_text(json.dumps(model))
        return _read(run_model(written, epw), OUTPUTS if outputs is None else outputs)


def _read(path: Path, outputs: dict[str, str]) -> pd.DataFrame:
    table = pd.read_csv(path)
    columns = {}
    for column in table.columns:
        bare = column.split(" [")[0].strip()
        if bare in outputs:
            columns[outputs[bare]] = table[column].to_numpy(dtype=float)
    missing = sorted(set(outputs.values()) - set(columns))
    if missing:
        raise RuntimeError(f"EnergyPlus wrote no {', '.join(missing)}")
    return pd.DataFrame(columns)
