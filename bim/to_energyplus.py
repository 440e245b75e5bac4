"""Rooms as an EnergyPlus input (epJSON): one zone each, walls by layer, windows by U and g.

Each window becomes a rectangle of its glass area in a parent surface of the size of its opening,
which stands for the frame.  Faces towards other rooms are adiabatic: a room can be run alone.
`bim.energyplus_twin` writes the whole model of a study: schedules, coupling, BSDF, ground.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike

from bim.defaults import WINDOW_FRAME
from bim.energyplus_parts import (
    MOST_LAYERS,
    FaceFinish,
    Model,
    model_frame,
    object_name,
    opaque_construction,
    opaque_surface,
    outlines,
    write_window,
)
from bim.model import Building, Construction, Face, Space, Window
from mitsuba_cfs.files import write_text
from thermal.zone import OUTSIDE_ABSORPTANCE, Layer

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
    model = model_frame(building.name) | {"WindowMaterial:SimpleGlazingSystem": {}}
    given = (u_value, g_value)
    for number, space in enumerate(building.spaces if spaces is None else spaces):
        _zone(
            model, f"Z{number} {object_name(space.label)}", space, given, known or {}, air_changes
        )
    write_text(path, json.dumps(model, indent=1))


def _zone(
    model: Model,
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
        for part, ring in enumerate(outlines(face)):
            kind = SURFACE_TYPE.get(face.kind, "Wall")
            outside = BOUNDARY.get(face.adjacency, "Adiabatic")
            if kind == "Ceiling" and outside == "Outdoors":
                kind = "Roof"
            model["BuildingSurface:Detailed"][f"{zone} F{index}.{part}"] = opaque_surface(
                kind, _construction(model, face.construction, face), zone, outside, ring
            )
    for index, window in enumerate(space.windows):
        u, g = known.get(window.guid, (None, None))
        _window(
            model, f"{zone} W{index}", zone, window,
            given[0] or u or window.u_value or DEFAULT_U,
            given[1] or g or window.g_value or DEFAULT_G,
        )  # fmt: skip


def _window(model: Model, name: str, zone: str, window: Window, u: float, g: float) -> None:
    """A rectangle of glass in a parent of the size of the opening."""
    frame = _construction(model, WINDOW_FRAME, None)
    system = f"Glazing U {u:.3f} g {g:.3f}"
    model["WindowMaterial:SimpleGlazingSystem"][system] = {
        "u_factor": u,
        "solar_heat_gain_coefficient": g,
    }
    model["Construction"][system] = {"outside_layer": system}
    write_window(model, name, zone, window, frame=frame, glazing=system)


def _construction(model: Model, construction: Construction, face: Face | None) -> str:
    """Name of the construction with the face's absorptance inside, the usual one outside."""
    absorptance = 0.5 if face is None else 1 - face.total_reflectance("solar")
    layers = [
        Layer(one.thickness, one.conductivity, one.density, one.heat_capacity)
        for one in construction.layers[:MOST_LAYERS]
    ]
    return opaque_construction(
        model, layers, FaceFinish(OUTSIDE_ABSORPTANCE), FaceFinish(absorptance), construction.name
    )
