"""Rooms as an EnergyPlus input (epJSON): one zone each, walls by layer, windows by BSDF or U and g.

Each window becomes a rectangle of its glass area in a parent surface of the size of its opening,
which stands for the frame.  Faces towards other rooms are adiabatic: a room can be run alone.
`bim.energyplus_twin` writes the whole model of a study: schedules, coupling, gains, ground.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from os import PathLike

import numpy as np

from bim.defaults import WINDOW_FRAME
from bim.energyplus_parts import (
    NEAR,
    FaceFinish,
    Model,
    at_most_layers,
    is_drawable,
    model_frame,
    object_name,
    opaque_construction,
    opaque_surface,
    outlines,
    write_window,
)
from bim.energyplus_windows import complex_state
from bim.exported_glazing import ExportedGlazing, Glazings, glazing_of, left_out
from bim.model import Building, Construction, Face, Space, Window
from bim.planes import newell_normal
from bim.to_thermal import layers_of
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import check_number
from mitsuba_cfs.files import json_text, write_text
from thermal.zone import OUTSIDE_ABSORPTANCE

BOUNDARY = {"outside": "Outdoors", "ground": "Ground"}  # all others: adiabatic
SURFACE_TYPE = {"floor": "Floor", "ceiling": "Ceiling", "roof": "Roof"}
TURNED = 0.02  # difference of the axes from which a BSDF is turned in its window
DEFAULT_GROUND_C = 18.0  # of EnergyPlus
DEFAULT_U, DEFAULT_G = 1.3, 0.6  # double glazing with low emissivity [W/(m2 K)], [-]
MONTHS = (
    "january",
    "february",
    "march",
    "april",
    "may",
    "june",
    "july",
    "august",
    "september",
    "october",
    "november",
    "december",
)


def write_epjson(
    building: Building,
    path: str | PathLike[str],
    *,
    spaces: Sequence[Space] | None = None,
    u_value: float | None = None,
    g_value: float | None = None,
    glazing: Glazings | None = None,
    ground_c: Sequence[float] | None = None,
    air_changes: float = 0.5,
) -> tuple[str, ...]:
    """Write the rooms (by default all) as free-floating zones; what EnergyPlus is not told.

    Args:
        u_value, g_value: of every window; by default those that are known or the file states.
        glazing: of windows by GUID, in place of what the file states; a window with `optics` is
            written as `Construction:ComplexFenestrationState` unless u_value or g_value is given.
        ground_c: [12] monthly temperature below floors and outside walls in the ground [degC];
            without it EnergyPlus takes 18 degC.

    Returns: a sentence on each thing that is left out or assumed.
    """
    for name, value in (("u_value", u_value), ("g_value", g_value)):
        if value is not None:
            check_number(name, value, 1e-3, 1.0 if name == "g_value" else 100.0)
    check_number("air_changes", air_changes, 0.0)
    model = model_frame(building.name)
    if ground_c is not None:
        if len(ground_c) != len(MONTHS):
            raise ValueError(f"ground_c: expected 12 monthly values, got {len(ground_c)}")
        model["Site:GroundTemperature:BuildingSurface"] = {
            "ground": {
                f"{month}_ground_temperature": float(value) for month, value in zip(MONTHS, ground_c, strict=True)
            }
        }
    windows = _Windows(model, (u_value, g_value), glazing or {})
    chosen = building.spaces if spaces is None else spaces
    dropped: list[float] = []
    for number, space in enumerate(chosen):
        name = f"Z{number} {object_name(space.label)}"
        dropped += _zone(model, name, space, windows, air_changes)
    write_text(path, json_text(model, indent=1))
    return (*_losses(chosen, dropped, ground=ground_c is None), *windows.notes)


def _losses(spaces: Sequence[Space], dropped: Sequence[float], *, ground: bool) -> Iterator[str]:
    """Sentences on surfaces that are left out, and on the ground where it has no temperature."""
    if dropped:
        yield (
            f"EnergyPlus: {len(dropped)} surfaces of {sum(dropped):.2g} m2 in all are left out: it "
            "merges corners within a centimetre"
        )
    kept = f"has no given temperature: EnergyPlus takes {DEFAULT_GROUND_C:g} C all year"
    yield from left_out(spaces, "EnergyPlus", kept if ground else "has the given monthly temperatures")


def _zone(model: Model, zone: str, space: Space, windows: _Windows, air_changes: float) -> list[float]:
    """Write a room; the areas of surfaces that are too narrow for EnergyPlus [m2]."""
    model["Zone"][zone] = {"volume": space.volume, "floor_area": max(space.floor_area, 0.01)}
    model["ZoneInfiltration:DesignFlowRate"][f"{zone} air"] = {
        "zone_or_zonelist_or_space_or_spacelist_name": zone,
        "schedule_name": "always",
        "design_flow_rate_calculation_method": "AirChanges/Hour",
        "air_changes_per_hour": air_changes,
    }
    dropped: list[float] = []
    for index, face in enumerate(space.faces):
        if face.kind == "window frame":
            continue
        for part, ring in enumerate(outlines(face, gap=NEAR, convex=True)):
            if not is_drawable(ring):
                dropped.append(float(np.linalg.norm(newell_normal(ring))))
                continue
            kind = SURFACE_TYPE.get(face.kind, "Wall")
            outside = BOUNDARY.get(face.adjacency, "Adiabatic")
            if kind == "Ceiling" and outside == "Outdoors":
                kind = "Roof"
            model["BuildingSurface:Detailed"][f"{zone} F{index}.{part}"] = opaque_surface(
                kind, _construction(model, face.construction, face), zone, outside, ring
            )
    for index, window in enumerate(space.windows):
        frame = _construction(model, WINDOW_FRAME, None)
        construction = windows.construction(window)
        write_window(model, f"{zone} W{index}", zone, window, frame=frame, glazing=construction)
    return dropped


class _Windows:
    """The constructions of glazings, each written once."""

    def __init__(self, model: Model, overrides: tuple[float | None, float | None], glazing: Glazings) -> None:
        self._model, self._overrides, self.glazing = model, overrides, glazing
        self._complex: dict[int, str] = {}  # by the id of the optics
        self.notes: dict[str, None] = {}

    def construction(self, window: Window) -> str:
        """Name of the construction: by its BSDF, else a simple glazing."""
        known = glazing_of(window, self.glazing)
        if known.optics is None or any(value is not None for value in self._overrides):
            return self._simple(known)
        frames = window_frame(window.normal), window_frame(window.normal, window.up)
        if np.abs(frames[0] - frames[1]).max() > TURNED:
            note = "EnergyPlus: the BSDF is written upright; its up vector turns it"
            self.notes[f"{window.name or window.guid}: {note}"] = None
        key = id(known.optics)
        if key not in self._complex:
            self._complex[key] = f"System {len(self._complex)}"
            complex_state(self._model, self._complex[key], known.optics, panes=True)
        return self._complex[key]

    def _simple(self, known: ExportedGlazing) -> str:
        u = self._overrides[0] or known.u_value or DEFAULT_U
        g = self._overrides[1] or known.g_value or DEFAULT_G
        name = f"Glazing U {u:.3f} g {g:.3f}"
        fields: dict[str, float] = {"u_factor": u, "solar_heat_gain_coefficient": g}
        if known.visible_transmittance:
            name += f" tau {known.visible_transmittance:.3f}"
            fields["visible_transmittance"] = known.visible_transmittance
        self._model.setdefault("WindowMaterial:SimpleGlazingSystem", {})[name] = fields
        self._model["Construction"][name] = {"outside_layer": name}
        return name


def _construction(model: Model, construction: Construction, face: Face | None) -> str:
    """Name of the construction with the face's absorptance inside, the usual one outside."""
    absorptance = 0.5 if face is None else 1 - face.total_reflectance("solar")
    layers = layers_of(replace(construction, layers=at_most_layers(construction.layers)))
    finishes = FaceFinish(OUTSIDE_ABSORPTANCE), FaceFinish(absorptance)
    return opaque_construction(model, list(layers), *finishes, construction.name)
