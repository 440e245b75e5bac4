"""Sun through a glazed partition into the room behind, beside EnergyPlus' interior windows.

    python -m tests.validation inner_sun [--beam]

A room of 4 m by 3 m with clear double glazing to the south; in its back wall a pane of 6 mm float
to a second room, 5 m deep, without a window: Table 15's room, a winter garden and a double skin.
EnergyPlus runs here and now, with full interior and exterior distribution.  The year's sums [kWh],
and their share [%] of what the window transmits; the sun of each room is what its opaque surfaces
absorb.  With `--beam` the weather has no diffuse light and the ground is black.
"""

from __future__ import annotations

import tempfile
from calendar import month_name
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from bim import shoebox
from bim.fenestration import pane_transmissivity
from bim.model import Building, Construction, Face, MaterialLayer, Space, Window
from bim.shoebox import WindowRectangle
from mitsuba_cfs.gloss import pane_shares
from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.fenestration.resolver import StatedValues, glazing_system
from scenes.room.inputs import room_inputs
from scenes.room.options import RoomOptions
from scenes.room.solar import GLASS_INDEX, SOLAR_CLEAR, seasonal_outdoors, solar_gains
from scenes.room.windows import in_all_windows
from scenes.room.zone import zone_surfaces
from tests.validation import reference_room
from tests.validation.energyplus_program import Model, merged, room_model, run_energyplus
from tests.validation.reference_systems import clear_double

Rectangle = tuple[float, float, float, float]  # x, sill, width, height [m]
CASES: dict[str, tuple[float, Rectangle, Rectangle]] = {  # depth [m], window, inner pane
    "room": (5.0, (0.5, 1.0, 3.0, 1.5), (0.5, 0.3, 3.0, 2.4)),
    "winter garden": (2.5, (0.1, 0.1, 3.8, 2.8), (0.5, 0.1, 3.0, 2.4)),
    "double skin": (0.6, (0.1, 0.1, 3.8, 2.8), (0.1, 0.1, 3.8, 2.8)),
}
FLOAT = Construction("float", (MaterialLayer("float", 0.006, 1.0, 2500.0, 840.0),))
GLASS_EMISSIVITY = 0.84
REAR_DEPTH = TABLE_DEPTH = 5.0  # of the room behind, and of Table 15's room [m]
REFLECTANCE = {"wall": 0.5, "floor": 0.2, "ceiling": 0.7}  # as in the models' materials
FRONT = ("FACADE", "X0", "X4", "BACK", "FLOOR", "CEILING")
REAR = ("FRONT", "R0", "R4", "NORTH", "REAR FLOOR", "REAR CEILING")
ABSORBED = "Surface Inside Face Solar Radiation Heat Gain Rate"
PASSING = tuple(
    f"Enclosure Interior Windows Total Transmitted {kind} Solar Radiation Rate" for kind in ("Beam", "Diffuse")
)
ENTERING = "Surface Window Transmitted Solar Radiation Rate"


def two_rooms(reflectance: dict[str, float], case: str = "room", rear: dict[str, float] | None = None) -> Building:
    """The two rooms, joined by wall and pane; layers are those of EnergyPlus' models.

    Args: rear: reflectances of the room behind; those of the front room without.
    """
    depth, window, pane = CASES[case]
    wall, slab = _construction("left"), _construction("floor")
    inside = {"left": wall, "right": wall, "floor": slab, "ceiling": slab}
    lit = shoebox(
        4.0,
        depth,
        3.0,
        windows=(WindowRectangle(*window), WindowRectangle(*pane, "back")),
        reflectance=reflectance,
        name="front",
        adjacency={"back": "space"},
        constructions=inside | {"front": _construction("facade"), "back": wall},
    )
    dark = shoebox(
        4.0,
        REAR_DEPTH,
        3.0,
        windows=(WindowRectangle(*pane, "front"),),
        reflectance=reflectance if rear is None else rear,
        name="rear",
        adjacency={"front": "space", "back": "outside"},
        constructions=inside | {"front": wall, "back": _construction("facade")},
    )
    (front,) = lit.spaces
    behind = _moved(dark.spaces[0], depth)
    front, behind = (
        replace(
            space,
            windows=space.windows[:-1],
            faces=(*(_towards(face, other.guid) for face in space.faces), _pane(space.windows[-1], other.guid)),
        )
        for space, other in ((front, behind), (behind, front))
    )
    return replace(lit, spaces=(front, behind))


def _construction(surface: str) -> Construction:
    """The layers of a surface of Table 15's room."""
    (one,) = (s for s in reference_room.zone("S", clear_double().fenestration).surfaces if s.name == surface)
    layers = (
        MaterialLayer(f"{surface} {number}", x.thickness, x.conductivity, x.density, x.heat_capacity)
        for number, x in enumerate(one.layers)
    )
    return Construction(surface, tuple(layers))


def _towards(face: Face, beyond: str) -> Face:
    return replace(face, neighbour=beyond) if face.adjacency == "space" else face


def _moved(space: Space, north: float) -> Space:
    step = np.array([0.0, north, 0.0])
    return replace(
        space,
        guid="rear",
        name="rear",
        faces=tuple(replace(f, triangles=f.triangles + step) for f in space.faces),
        windows=tuple(replace(w, triangles=w.triangles + step) for w in space.windows),
    )


def _pane(window: Window, beyond: str) -> Face:
    same = replace(window, guid="inner", solar_transmittance=SOLAR_CLEAR)
    return Face(
        "inner pane",
        "wall",
        window.triangles,
        "space",
        FLOAT,
        0.15,
        0.15,
        emissivity=GLASS_EMISSIVITY,
        neighbour=beyond,
        pane=same,
    )


def ours(case: str, patch_samples: int, weather: Path = WEATHER, albedo: float = 0.2) -> dict[str, float]:
    """Sun through window and pane, in both rooms' opaque surfaces and on the rear floor [kWh].

    What enters by the pane is what a black room behind it absorbs.
    """
    sky = (patch_samples, weather, albedo)
    black = _sums(two_rooms(REFLECTANCE, case, dict.fromkeys(REFLECTANCE, 0.0)), *sky)
    sums = _sums(two_rooms(REFLECTANCE, case), *sky)
    return {"through the window": sums.pop("through the window"), "through the pane": black["rear room"], **sums}


def _sums(building: Building, patch_samples: int, weather_file: Path, albedo: float) -> dict[str, float]:
    weather = replace(read_epw(weather_file), albedo=albedo)
    front, rear = building.spaces
    glazing = glazing_system(StatedValues(0.81, 0.70, 0.76, 2.7, 2), "clear double")
    sampling = replace(RoomOptions().sampling, patch_samples=patch_samples)
    room = room_inputs(
        building,
        front,
        in_all_windows(front, glazing),
        weather,
        RoomOptions(sampling=sampling),
        together=[front.guid, rear.guid],
    )
    surfaces = zone_surfaces(room)
    state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    solar, gains, beyond = solar_gains(
        room, seasonal_outdoors(room), surfaces.room, surfaces.outer, state, thermals=surfaces.thermals
    )
    dark = [i for i, face in enumerate(rear.faces) if face.pane is None]
    floor = [i for i in dark if rear.faces[i].kind == "floor"]
    sums = {
        "through the window": gains["transmitted_w"],
        "front room": solar.inside.sum(axis=1),
        "rear room": sum(beyond[rear.guid, i] for i in dark),
        "of it floor": sum(beyond[rear.guid, i] for i in floor),
    }
    return {name: float(values.sum()) / 1000.0 for name, values in sums.items()}


def energyplus(case: str, weather: Path = WEATHER, albedo: float = 0.2) -> dict[str, float]:
    """The same by EnergyPlus [kWh]; by the pane the beam alone."""
    outputs = {f"{name}:{ABSORBED}": name for name in (*FRONT, *REAR)}
    outputs[f"WINDOW:{ENTERING}"] = "WINDOW"
    outputs |= {f"REAR:{name}": name for name in PASSING}
    ground = {f"{month.lower()}_ground_reflectance": albedo for month in month_name[1:]}
    model = energyplus_model(case, outputs) | {"Site:GroundReflectance": {"ground": ground}}
    hours = run_energyplus(model, weather, outputs=outputs)
    sums = hours.sum() / 1000.0
    return {
        "through the window": float(sums["WINDOW"]),
        "through the pane": float(sums[list(PASSING)].sum()),
        "front room": float(sums[list(FRONT)].sum()),
        "rear room": float(sums[list(REAR)].sum()),
        "of it floor": float(sums["REAR FLOOR"]),
    }


def energyplus_model(case: str, outputs: dict[str, str], *changes: str) -> Model:
    """The two rooms with an interior window, and changes by name (`room_model`)."""
    depth, window, inner_pane = CASES[case]
    cosine = np.ones(1)
    inner = pane_transmissivity(SOLAR_CLEAR, GLASS_INDEX)
    rho = float(pane_shares(cosine, GLASS_INDEX, inner)[1][0])
    glass = {"optical_data_type": "SpectralAverage", "thickness": 0.006, "conductivity": 1.0}
    glass |= {f"{band}_transmittance_at_normal_incidence": SOLAR_CLEAR for band in ("solar", "visible")}
    glass |= {
        f"{side}_side_{band}_reflectance_at_normal_incidence": rho
        for side in ("front", "back")
        for band in ("solar", "visible")
    }
    corners = _corners(inner_pane)
    patch = {
        "WindowMaterial:Glazing": {"INNER PANE": glass},
        "Construction": {"INNER GLASS": {"outside_layer": "INNER PANE"}},
        "FenestrationSurface:Detailed": {
            "INNER BACK": _interior_window("BACK", "INNER FRONT") | _vertices(corners[::-1], TABLE_DEPTH),
            "INNER FRONT": _interior_window("FRONT", "INNER BACK") | _vertices(corners, TABLE_DEPTH),
            "WINDOW": _vertices(_corners(window), 0.0),
        },
        "Zone": {"ROOM": {"volume": 12.0 * depth}},
    }
    model = merged(room_model("S", "clear_double", "second_room", *changes, outputs=outputs), patch)
    return {kind: {name: _deep(one, depth) for name, one in objects.items()} for kind, objects in model.items()}


def _deep(one: dict, depth: float) -> dict:
    """An object whose y coordinates are those of a front room of another depth."""
    moved = {
        key: value + (depth - TABLE_DEPTH if value >= TABLE_DEPTH else 0.0)
        for key, value in one.items()
        if key.endswith("y_coordinate")
    }
    for key in ("vertices",) if "vertices" in one else ():
        moved[key] = [_deep(vertex, depth) for vertex in one[key]]
    return one | moved


def _corners(rectangle: Rectangle) -> list[tuple[float, float]]:
    """Upper left, lower left, lower right, upper right: x and z [m], seen from the south."""
    x, sill, width, height = rectangle
    return [(x, sill + height), (x, sill), (x + width, sill), (x + width, sill + height)]


def _vertices(corners: list[tuple[float, float]], y: float) -> dict:
    return {
        f"vertex_{i}_{axis}_coordinate": value
        for i, (x, z) in enumerate(corners, 1)
        for axis, value in zip("xyz", (x, y, z), strict=True)
    }


def _interior_window(wall: str, other: str) -> dict:
    return {
        "surface_type": "Window",
        "construction_name": "INNER GLASS",
        "building_surface_name": wall,
        "outside_boundary_condition_object": other,
        "number_of_vertices": 4,
    }


def without_fields(folder: Path, *fields: int) -> Path:
    """The weather file with zero in fields of every hour: EPW's 16 is diffuse radiation."""
    lines = WEATHER.read_text("latin-1").splitlines()
    hours = [line.split(",") for line in lines[8:]]
    dark = (",".join("0" if n in fields else x for n, x in enumerate(h, 1)) for h in hours)
    path = folder / "changed.epw"
    path.write_text("\n".join([*lines[:8], *dark]) + "\n", "latin-1")
    return path


def compare(patch_samples: int, weather: Path, albedo: float) -> pd.DataFrame:
    """The sums of both programs [kWh], and their share [%] of what the window transmits."""
    tables = []
    for case in CASES:
        table = pd.DataFrame(
            {"mitsuba-cfs": ours(case, patch_samples, weather, albedo), "EnergyPlus": energyplus(case, weather, albedo)}
        )
        share = table / table.loc["through the window"] * 100.0
        table["mitsuba-cfs %"], table["EnergyPlus %"] = share["mitsuba-cfs"], share["EnergyPlus"]
        table.insert(0, "sun", table.index)
        table.insert(0, "case", case)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def main(*, beam: bool = False, patch_samples: int = 4096) -> pd.DataFrame:
    """The comparison."""
    if not beam:
        return compare(patch_samples, WEATHER, 0.2)
    with tempfile.TemporaryDirectory() as folder:
        return compare(patch_samples, without_fields(Path(folder), 16), 0.0)
