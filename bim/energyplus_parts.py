"""Parts that the EnergyPlus inputs (epJSON) of a building share: frame, outlines, materials."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Face, MaterialLayer, Window
from bim.planes import merged_polygons, newell_normal, plane_through, triangulated
from mitsuba_cfs.errors import DataError
from thermal.zone import Layer

VERSION = "25.2"
MOST_LAYERS = 10  # of a construction in EnergyPlus and in honeybee
LEAST_SURFACE = 1e-3  # [m2]
NEAR = 0.015  # EnergyPlus takes corners within a centimetre for one [m]
Model = dict[str, dict[str, Any]]  # objects by class and name
Ring = NDArray[np.float64]  # [N, 2] or [N, 3] corners, counter-clockwise


@dataclass(frozen=True, slots=True)
class FaceFinish:
    """What one side of a construction looks like to the sun and to longwave."""

    absorptance: float  # solar
    emissivity: float = 0.9
    roughness: str = "MediumRough"


def model_frame(name: str) -> Model:
    """All that is not of one zone: version, geometry rules, the year."""
    return {
        "Version": {"Version 1": {"version_identifier": VERSION}},
        "Building": {
            object_name(name): {"north_axis": 0.0, "terrain": "Suburbs", "solar_distribution": "FullExterior"}
        },
        "GlobalGeometryRules": {
            "rules": {
                "starting_vertex_position": "UpperLeftCorner",
                "vertex_entry_direction": "Counterclockwise",
                "coordinate_system": "World",
            }
        },
        "SimulationControl": {
            "control": {
                "do_zone_sizing_calculation": "No",
                "run_simulation_for_sizing_periods": "No",
                "run_simulation_for_weather_file_run_periods": "Yes",
            }
        },
        "RunPeriod": {
            "year": {
                "begin_month": 1,
                "begin_day_of_month": 1,
                "end_month": 12,
                "end_day_of_month": 31,
                "day_of_week_for_start_day": "Monday",
            }
        },
        "Timestep": {"steps": {"number_of_timesteps_per_hour": 4}},
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:Constant": {"always": {"hourly_value": 1.0, "schedule_type_limits_name": "any"}},
        "Output:Variable": {
            "air": {"key_value": "*", "variable_name": "Zone Mean Air Temperature", "reporting_frequency": "Hourly"}
        },
        "Zone": {},
        "Material": {},
        "Material:NoMass": {},
        "Construction": {},
        "BuildingSurface:Detailed": {},
        "FenestrationSurface:Detailed": {},
        "ZoneInfiltration:DesignFlowRate": {},
    }


def layer_keys(count: int) -> tuple[str, ...]:
    """Fields of a construction's layers, outside to inside."""
    return ("outside_layer", *(f"layer_{k}" for k in range(2, count + 1)))


def opaque_construction(model: Model, layers: list[Layer], outside: FaceFinish, inside: FaceFinish, name: str) -> str:
    """Name of the construction of some layers, outermost first, each face with its own finish.

    A single layer becomes two halves, as a material has one absorptance for both of its faces.

    Raises: `DataError` where EnergyPlus takes no construction of so many layers.
    """
    if len(layers) == 1:
        (one,) = layers
        half = Layer(one.thickness / 2, one.conductivity, one.density, one.heat_capacity)
        layers = [half, half]
    if len(layers) > MOST_LAYERS:
        message = f"{len(layers)} layers; EnergyPlus takes {MOST_LAYERS}"
        raise DataError(message, element=name)
    buried = FaceFinish(0.5)
    finishes = [outside, *[buried] * (len(layers) - 2), inside]
    names = [_material(model, *pair) for pair in zip(layers, finishes, strict=True)]
    entry = dict(zip(layer_keys(len(names)), names, strict=True))
    for known, other in model["Construction"].items():
        if other == entry:
            return known
    key = f"C{len(model['Construction'])}"
    model["Construction"][key] = entry
    return key


def at_most_layers(layers: Sequence[MaterialLayer]) -> tuple[MaterialLayer, ...]:
    """At most ten layers: the thinnest neighbours are merged, with their resistance and mass."""
    result = list(layers)
    while len(result) > MOST_LAYERS:
        widths = [a.thickness + b.thickness for a, b in itertools.pairwise(result)]
        at = widths.index(min(widths))
        pair = result[at : at + 2]
        width, mass = widths[at], sum(one.thickness * one.density for one in pair)
        heat = sum(one.thickness * one.density * one.heat_capacity for one in pair)
        result[at : at + 2] = [
            MaterialLayer(
                " + ".join(one.name for one in pair),
                width,
                width / sum(one.thickness / one.conductivity for one in pair),
                mass / width,
                heat / mass if mass else pair[0].heat_capacity,
            )
        ]
    return tuple(result)


def _material(model: Model, layer: Layer, finish: FaceFinish) -> str:
    """Name of a layer's material, written once."""
    optical = {
        "roughness": finish.roughness,
        "thermal_absorptance": float(finish.emissivity),
        "solar_absorptance": float(finish.absorptance),
        "visible_absorptance": float(finish.absorptance),
    }
    if not layer.density:
        kind = "Material:NoMass"
        resistance = layer.thickness / layer.conductivity
        entry = {"thermal_resistance": max(resistance, 0.001), **optical}
    else:
        kind = "Material"
        entry = {
            "thickness": float(layer.thickness),
            "conductivity": float(layer.conductivity),
            "density": float(layer.density),
            "specific_heat": float(layer.heat_capacity),
            **optical,
        }
    for known, other in model[kind].items():
        if other == entry:
            return known
    name = f"M{len(model['Material']) + len(model['Material:NoMass'])}"
    model[kind][name] = entry
    return name


def outlines(face: Face, *, gap: float = 0.001, convex: bool = False) -> list[Ring]:
    """Outlines [N, 3] of a face without its holes; triangles where it has some.

    Args: gap: corners may move by this [m]; convex: triangles too where an outline is not convex.
    """
    plane = plane_through(face.triangles[0, 0], face.normal)
    rings = []
    for polygon in merged_polygons(plane.to_plane(face.triangles)[..., :2]):
        rings += [plane.to_world(ring) for ring in flat_outlines(polygon, gap, convex=convex)]
    return rings


def flat_outlines(polygon: shapely.Polygon, gap: float, *, convex: bool) -> list[Ring]:
    """Outlines [N, 2] of a polygon; triangles where it has holes (or is not convex)."""
    simple = polygon.simplify(gap)
    if simple.is_empty or not simple.is_valid:
        simple = polygon
    bent = convex and simple.area < (1 - 1e-6) * simple.convex_hull.area
    if simple.interiors or bent:
        return list(triangulated(simple))
    return [np.asarray(shapely.orient_polygons(simple).exterior.coords)[:-1]]


def is_drawable(ring: Ring) -> bool:
    """Whether EnergyPlus, which merges corners within a centimetre, keeps a polygon [N, 3]."""
    edges = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    area = float(np.linalg.norm(newell_normal(ring)))
    return area > LEAST_SURFACE and area > NEAR * edges.max()


def rectangle(triangles: NDArray[np.float64], normal: NDArray[np.float64], area: float) -> NDArray[np.float64]:
    """Upright rectangle [4, 3] round the triangles' middle, of their proportions and that area."""
    plane = plane_through(triangles[0, 0], normal)
    flat = plane.to_plane(triangles.reshape(-1, 3))[:, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    half = (high - low) / 2 * np.sqrt(area / np.prod(high - low))
    corners = np.array([[-1, 1], [-1, -1], [1, -1], [1, 1]]) * half + (low + high) / 2
    return plane.to_world(corners)


def window_rectangles(window: Window) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The glass and what carries it, of the size of the opening, as rectangles [4, 3]."""
    opening = max(window.opening_area, window.area) * 1.001
    return tuple(rectangle(window.triangles, window.normal, area) for area in (window.area, opening))


def opaque_surface(kind: str, construction: str, zone: str, outside: str, ring: NDArray[np.float64]) -> dict[str, Any]:
    """A surface; `outside` is EnergyPlus' boundary condition."""
    exposed = "SunExposed" if outside == "Outdoors" else "NoSun"
    return {
        "surface_type": kind,
        "construction_name": construction,
        "zone_name": zone,
        "outside_boundary_condition": outside,
        "sun_exposure": exposed,
        "wind_exposure": exposed.replace("Sun", "Wind"),
        "vertices": vertices(ring),
    }


def write_window(model: Model, name: str, zone: str, window: Window, *, frame: str, glazing: str) -> None:
    """Write a window: a rectangle of glass in one of the opening, which stands for the frame.

    Args: frame, glazing: their constructions.
    """
    glass, opening = window_rectangles(window)
    kind, parent = "Roof" if window.normal[2] > 0.5 else "Wall", f"{name} frame"
    model["BuildingSurface:Detailed"][parent] = opaque_surface(kind, frame, zone, "Outdoors", opening)
    model["FenestrationSurface:Detailed"][name] = _window_surface(glazing, parent, glass)


def _window_surface(construction: str, parent: str, glass: NDArray[np.float64]) -> dict[str, Any]:
    """A window [4, 3] in its parent surface."""
    return {
        "surface_type": "Window",
        "construction_name": construction,
        "building_surface_name": parent,
        "number_of_vertices": 4,
        **{
            f"vertex_{k + 1}_{axis}_coordinate": float(value)
            for k, corner in enumerate(glass)
            for axis, value in zip("xyz", corner, strict=True)
        },
    }


def vertices(ring: NDArray[np.float64]) -> list[dict[str, float]]:
    """The corners [N, 3] of a surface."""
    return [{f"vertex_{axis}_coordinate": float(value) for axis, value in zip("xyz", p, strict=True)} for p in ring]


def object_name(text: str) -> str:
    """A name that EnergyPlus takes: no commas, semicolons or exclamation marks, 60 letters."""
    return "".join(" " if c in ",;!\n\r" else c for c in text)[:60] or "unnamed"
