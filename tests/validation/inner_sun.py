"""Sun through a glazed partition into the room behind, beside EnergyPlus' interior windows.

    python -m tests.validation inner_sun

Table 15's room with clear double glazing to the south; in its back wall a pane of 6 mm float, 3.0 m
by 2.4 m, to a second room of the same size without a window.  EnergyPlus runs here and now, with
full interior and exterior distribution.  The year's sums [kWh], and their share [%] of what the
window transmits; the sun of each room is what its opaque surfaces absorb.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from bim import shoebox
from bim.defaults import default_construction
from bim.model import Building, Face, Space, Window
from bim.shoebox import WindowRectangle
from mitsuba_cfs.gloss import pane_shares, transmissivity
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.fenestration.resolver import StatedValues, glazing_system
from scenes.room.inputs import room_inputs
from scenes.room.options import RoomOptions
from scenes.room.solar import GLASS_INDEX, SOLAR_CLEAR, seasonal_outdoors, solar_gains
from scenes.room.windows import in_all_windows
from scenes.room.zone import zone_surfaces
from tests.validation.energyplus_program import Model, merged, room_model, run_energyplus

WINDOW = WindowRectangle(0.5, 1.0, 3.0, 1.5)
PANE = (0.5, 0.3, 3.0, 2.4)  # x, sill, width, height of the inner pane [m]
DEPTH = 5.0
REFLECTANCE = {"wall": 0.5, "floor": 0.2, "ceiling": 0.7}  # as in the models' materials
FRONT = ("FACADE", "X0", "X4", "BACK", "FLOOR", "CEILING")
REAR = ("FRONT", "R0", "R4", "NORTH", "REAR FLOOR", "REAR CEILING")
ABSORBED = "Surface Inside Face Solar Radiation Heat Gain Rate"
ENTERING = "Surface Window Transmitted Solar Radiation Rate"


def two_rooms(reflectance: dict[str, float]) -> Building:
    """The two rooms, joined by the pane."""
    x, sill, width, height = PANE
    lit = shoebox(
        4.0, DEPTH, 3.0, windows=(WINDOW, WindowRectangle(x, sill, width, height, "back")),
        reflectance=reflectance, name="front",
    )  # fmt: skip
    dark = shoebox(
        4.0, DEPTH, 3.0, windows=(WindowRectangle(x, sill, width, height, "front"),),
        reflectance=reflectance, name="rear",
    )  # fmt: skip
    (front,), (rear,) = lit.spaces, dark.spaces
    rear = _moved(rear)
    front = replace(
        front, windows=front.windows[:1],
        faces=(*front.faces, _pane(front.windows[1], rear.guid, reflectance)),
    )  # fmt: skip
    rear = replace(
        rear, windows=(), faces=(*rear.faces, _pane(rear.windows[0], front.guid, reflectance))
    )
    return replace(lit, spaces=(front, rear))


def _moved(space: Space) -> Space:
    step = np.array([0.0, DEPTH, 0.0])
    return replace(
        space, guid="rear", name="rear",
        faces=tuple(replace(f, triangles=f.triangles + step) for f in space.faces),
        windows=tuple(replace(w, triangles=w.triangles + step) for w in space.windows),
    )  # fmt: skip


def _pane(window: Window, beyond: str, reflectance: dict[str, float]) -> Face:
    same = replace(window, guid="inner", solar_transmittance=SOLAR_CLEAR)
    return Face(
        "inner pane", "wall", window.triangles, "space", default_construction("wall", "space"),
        0.15, 0.15, neighbour=beyond, pane=same,
    )  # fmt: skip


def ours(reflectance: dict[str, float], patch_samples: int) -> dict[str, float]:
    """Sun through the window, in both rooms' opaque surfaces and on the rear floor [kWh]."""
    weather, building = read_epw(WEATHER), two_rooms(reflectance)
    front, rear = building.spaces
    glazing = glazing_system(StatedValues(0.81, 0.70, 0.76, 2.7, 2), "clear double")
    sampling = replace(RoomOptions().sampling, patch_samples=patch_samples)
    room = room_inputs(
        building, front, in_all_windows(front, glazing), weather,
        RoomOptions(sampling=sampling), together=[front.guid, rear.guid],
    )  # fmt: skip
    surfaces = zone_surfaces(room)
    state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    solar, gains, beyond = solar_gains(
        room, seasonal_outdoors(room), surfaces.room, surfaces.outer, state,
        thermals=surfaces.thermals,
    )  # fmt: skip
    dark = [i for i, face in enumerate(rear.faces) if face.pane is None]
    floor = [i for i in dark if rear.faces[i].kind == "floor"]
    sums = {
        "through the window": gains["transmitted_w"],
        "front room": solar.inside.sum(axis=1),
        "rear room": sum(beyond[rear.guid, i] for i in dark),
        "of it floor": sum(beyond[rear.guid, i] for i in floor),
    }
    return {name: float(values.sum()) / 1000.0 for name, values in sums.items()}


def energyplus() -> dict[str, float]:
    """The same by EnergyPlus [kWh]."""
    outputs = {f"{name}:{ABSORBED}": name for name in (*FRONT, *REAR)}
    outputs[f"WINDOW:{ENTERING}"] = "WINDOW"
    hours = run_energyplus(energyplus_model(outputs), WEATHER, outputs=outputs)
    sums = hours.sum() / 1000.0
    return {
        "through the window": float(sums["WINDOW"]),
        "front room": float(sums[list(FRONT)].sum()),
        "rear room": float(sums[list(REAR)].sum()),
        "of it floor": float(sums["REAR FLOOR"]),
    }


def energyplus_model(outputs: dict[str, str]) -> Model:
    """The two rooms with an interior window."""
    cosine = np.ones(1)
    inner = transmissivity(SOLAR_CLEAR, GLASS_INDEX)
    rho = float(pane_shares(cosine, GLASS_INDEX, inner)[1][0])
    glass = {"optical_data_type": "SpectralAverage", "thickness": 0.006, "conductivity": 1.0}
    glass |= {
        f"{band}_transmittance_at_normal_incidence": SOLAR_CLEAR for band in ("solar", "visible")
    }
    glass |= {
        f"{side}_side_{band}_reflectance_at_normal_incidence": rho
        for side in ("front", "back")
        for band in ("solar", "visible")
    }
    x, sill, width, height = PANE
    corners = [(x, sill + height), (x, sill), (x + width, sill), (x + width, sill + height)]
    patch = {
        "WindowMaterial:Glazing": {"INNER PANE": glass},
        "Construction": {"INNER GLASS": {"outside_layer": "INNER PANE"}},
        "FenestrationSurface:Detailed": {
            "INNER BACK": _interior_window("BACK", "INNER FRONT", corners[::-1]),
            "INNER FRONT": _interior_window("FRONT", "INNER BACK", corners),
        },
    }
    return merged(room_model("S", "clear_double", "second_room", outputs=outputs), patch)


def _interior_window(wall: str, other: str, corners: list[tuple[float, float]]) -> dict:
    places = {
        f"vertex_{i}_{axis}_coordinate": value
        for i, (x, z) in enumerate(corners, 1)
        for axis, value in zip("xyz", (x, DEPTH, z), strict=True)
    }
    return {
        "surface_type": "Window", "construction_name": "INNER GLASS",
        "building_surface_name": wall, "outside_boundary_condition_object": other,
        "number_of_vertices": 4, **places,
    }  # fmt: skip


def compare(patch_samples: int = 4096) -> pd.DataFrame:
    """The sums of both programs [kWh], and ours over EnergyPlus' [%]."""
    table = pd.DataFrame({"ours": ours(REFLECTANCE, patch_samples), "EnergyPlus": energyplus()})
    share = table / table.loc["through the window"] * 100.0
    table["ours %"], table["EnergyPlus %"] = share["ours"], share["EnergyPlus"]
    return table


def main() -> pd.DataFrame:
    """The comparison."""
    return compare()
