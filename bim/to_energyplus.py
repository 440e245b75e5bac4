"""Rooms as an EnergyPlus input (epJSON): one zone each, walls by layer, windows by U and g.

Each window becomes a rectangle of its glass area in a parent surface of the size of its opening,
which stands for the frame.  Faces towards other rooms are adiabatic: a room can be run alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.defaults import WINDOW_FRAME
from bim.model import Building, Construction, Face, Space, Window
from bim.planes import merged_polygons, plane_through
from mitsuba_cfs.files import write_text

VERSION = "25.2"
THINNEST = 0.003  # thinner layers have no mass worth a conduction transfer function [m]
BOUNDARY = {"outside": "Outdoors", "ground": "Ground"}  # all others: adiabatic
SURFACE_TYPE = {"floor": "Floor", "ceiling": "Ceiling", "roof": "Roof"}
DEFAULT_U, DEFAULT_G = 1.3, 0.6  # double glazing with low emissivity [W/(m2 K)], [-]
UAndG = tuple[float | None, float | None]  # of a window; None: not known


def write_epjson(
    building: Building,
    path: str | PathLike[str],
    *,
    spaces: Sequence[Space] | None = None,
    u_value: float | None = None,
    g_value: float | None = None,
    known: Mapping[str, UAndG] | None = None,
    air_changes: float = 0.5,
) -> None:
    """Write the rooms (by default all) as free-floating zones with hourly air temperatures.

    Args:
        u_value, g_value: of every window; by default those that are known or the file states.
        known: U and g of windows, by GUID, before what the file states.
    """
    model = _frame(building)
    given = (u_value, g_value)
    for number, space in enumerate(building.spaces if spaces is None else spaces):
        _zone(model, f"Z{number} {_name(space.label)}", space, given, known or {}, air_changes)
    write_text(path, json.dumps(model, indent=1))


def _frame(building: Building) -> dict:
    """All that is not of one zone."""
    return {
        "Version": {"Version 1": {"version_identifier": VERSION}},
        "Building": {
            _name(building.name): {"north_axis": 0.0, "terrain": "Suburbs",
                                   "solar_distribution": "FullExterior"}
        },
        "GlobalGeometryRules": {
            "rules": {"starting_vertex_position": "UpperLeftCorner",
                      "vertex_entry_direction": "Counterclockwise", "coordinate_system": "World"}
        },
        "SimulationControl": {
            "control": {"do_zone_sizing_calculation": "No",
                        "run_simulation_for_sizing_periods": "No",
                        "run_simulation_for_weather_file_run_periods": "Yes"}
        },
        "RunPeriod": {
            "year": {"begin_month": 1, "begin_day_of_month": 1, "end_month": 12,
                     "end_day_of_month": 31, "day_of_week_for_start_day": "Monday"}
        },
        "Timestep": {"steps": {"number_of_timesteps_per_hour": 4}},
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:Constant": {"always": {"hourly_value": 1.0, "schedule_type_limits_name": "any"}},
        "Output:Variable": {
            "air": {"key_value": "*", "variable_name": "Zone Mean Air Temperature",
                    "reporting_frequency": "Hourly"}
        },
        "Zone": {}, "Material": {}, "Material:NoMass": {}, "Construction": {},
        "BuildingSurface:Detailed": {}, "FenestrationSurface:Detailed": {},
        "WindowMaterial:SimpleGlazingSystem": {}, "ZoneInfiltration:DesignFlowRate": {},
    }  # fmt: skip


def _zone(
    model: dict,
    zone: str,
    space: Space,
    given: UAndG,
    known: Mapping[str, UAndG],
    air_changes: float,
) -> None:
    model["Zone"][zone] = {"volume": space.volume, "floor_area": max(space.floor_area, 0.01)}
    model["ZoneInfiltration:DesignFlowRate"][f"{zone} air"] = {
        "zone_or_zonelist_or_space_or_spacelist_name": zone,
        "schedule_name": "always",
        "design_flow_rate_calculation_method": "AirChanges/Hour",
        "air_changes_per_hour": air_changes,
    }
    for index, face in enumerate(space.faces):
        if face.kind == "window frame":
            continue
        for part, ring in enumerate(_rings(face)):
            _surface(model, f"{zone} F{index}.{part}", zone, face, ring)
    for index, window in enumerate(space.windows):
        u, g = known.get(window.guid, (None, None))
        _window(
            model, f"{zone} W{index}", zone, window,
            given[0] or u or window.u_value or DEFAULT_U,
            given[1] or g or window.g_value or DEFAULT_G,
        )  # fmt: skip


def _rings(face: Face) -> list[NDArray[np.float64]]:
    """Outline [N, 3] of a face; its triangles where it has holes."""
    plane = plane_through(face.triangles[0, 0], face.normal)
    rings = []
    for polygon in merged_polygons(plane.to_plane(face.triangles)[..., :2]):
        if polygon.interiors:
            return list(face.triangles)
        outline = shapely.orient_polygons(polygon.simplify(0.001))
        rings.append(plane.to_world(np.asarray(outline.exterior.coords)[:-1]))
    return rings


def _surface(model: dict, name: str, zone: str, face: Face, ring: NDArray[np.float64]) -> None:
    outside = BOUNDARY.get(face.adjacency, "Adiabatic")
    exposed = "SunExposed" if outside == "Outdoors" else "NoSun"
    kind = SURFACE_TYPE.get(face.kind, "Wall")
    if kind == "Ceiling" and outside == "Outdoors":
        kind = "Roof"
    model["BuildingSurface:Detailed"][name] = {
        "surface_type": kind,
        "construction_name": _construction(model, face.construction, face),
        "zone_name": zone,
        "outside_boundary_condition": outside,
        "sun_exposure": exposed,
        "wind_exposure": exposed.replace("Sun", "Wind"),
        "vertices": _vertices(ring),
    }


def _window(model: dict, name: str, zone: str, window: Window, u: float, g: float) -> None:
    """A rectangle of glass in a parent of the size of the opening."""
    glass, opening = (
        _rectangle(window, window.area),
        _rectangle(window, window.opening_area * 1.001),
    )
    tilt = window.normal[2]
    frame = _construction(model, WINDOW_FRAME, None)
    model["BuildingSurface:Detailed"][f"{name} frame"] = {
        "surface_type": "Roof" if tilt > 0.5 else "Wall",
        "construction_name": frame,
        "zone_name": zone,
        "outside_boundary_condition": "Outdoors",
        "sun_exposure": "SunExposed",
        "wind_exposure": "WindExposed",
        "vertices": _vertices(opening),
    }
    system = f"Glazing U {u:.3f} g {g:.3f}"
    model["WindowMaterial:SimpleGlazingSystem"][system] = {
        "u_factor": u,
        "solar_heat_gain_coefficient": g,
    }
    model["Construction"][system] = {"outside_layer": system}
    model["FenestrationSurface:Detailed"][name] = {
        "surface_type": "Window",
        "construction_name": system,
        "building_surface_name": f"{name} frame",
        "number_of_vertices": 4,
        **{
            f"vertex_{k + 1}_{axis}_coordinate": float(value)
            for k, corner in enumerate(glass)
            for axis, value in zip("xyz", corner, strict=True)
        },
    }


def _rectangle(window: Window, area: float) -> NDArray[np.float64]:
    """Upright rectangle [4, 3] round the window's middle, of its proportions and of that area."""
    plane = plane_through(window.triangles[0, 0], window.normal)
    flat = plane.to_plane(window.triangles.reshape(-1, 3))[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    half = (high - low) / 2 * np.sqrt(max(area, window.area) / np.prod(high - low))
    corners = np.array([[-1, 1], [-1, -1], [1, -1], [1, 1]]) * half + (low + high) / 2
    return plane.to_world(corners)


def _construction(model: dict, construction: Construction, face: Face | None) -> str:
    """Name of the construction with the face's absorptance, its materials written."""
    absorptance = 0.5 if face is None else 1 - face.total_reflectance("solar")
    layers = []
    for layer in construction.layers:
        thermal = f"{layer.thickness:.4f} {layer.conductivity:.4g} {layer.density:.4g}"
        name = f"{_name(layer.name)} {thermal} {layer.heat_capacity:.4g} a{absorptance:.3f}"
        optical = {"solar_absorptance": absorptance, "visible_absorptance": absorptance}
        if layer.thickness < THINNEST:
            model["Material:NoMass"][name] = {
                "roughness": "MediumRough",
                "thermal_resistance": max(layer.resistance, 0.001),
                **optical,
            }
        else:
            model["Material"][name] = {
                "roughness": "MediumRough",
                "thickness": float(layer.thickness),
                "conductivity": float(layer.conductivity),
                "density": float(layer.density),
                "specific_heat": float(layer.heat_capacity),
                **optical,
            }
        layers.append(name)
    keys = ["outside_layer", *(f"layer_{k}" for k in range(2, len(layers) + 1))]
    entry = dict(zip(keys, layers[:10], strict=False))  # EnergyPlus takes ten layers
    name = f"C{len(model['Construction'])}"
    for known, other in model["Construction"].items():
        if other == entry:
            return known
    model["Construction"][name] = entry
    return name


def _vertices(ring: NDArray[np.float64]) -> list[dict[str, float]]:
    return [
        {f"vertex_{axis}_coordinate": float(value) for axis, value in zip("xyz", p, strict=True)}
        for p in ring
    ]


def _name(text: str) -> str:
    """A name that EnergyPlus takes: no commas, semicolons or exclamation marks, 60 letters."""
    return "".join(" " if c in ",;!\n\r" else c for c in text)[:60] or "unnamed"
