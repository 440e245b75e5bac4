"""Rooms of an IFC file that has no spaces: the voids that its walls, slabs and roofs enclose."""

from __future__ import annotations

import uuid

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import numpy as np
from numpy.typing import NDArray

from bim.enclosure import GAP, rooms_enclosed_by
from bim.ifc.shapes import read_shapes
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.model import Problem
from bim.rooms import room_solid

BOUNDING = (
    "IfcWall",
    "IfcSlab",
    "IfcRoof",
    "IfcCovering",
    "IfcCurtainWall",
    "IfcPlate",
    "IfcMember",
    "IfcColumn",
    "IfcBeam",
    "IfcFooting",
    "IfcWindow",
    "IfcDoor",
)
WIDER = 0.1  # gaps closed in a second attempt [m]
CAP = 0.2  # thickness of a floor or roof that is put in where the file has none [m]
Body = NDArray[np.float64]


def found_rooms(source: Source) -> tuple[list[SpaceRecord], list[Problem]]:
    """Rooms between the building elements, and what had to be closed to find them."""
    bodies = _uncut_bodies(source)
    where, lacks = source.path.name, _lack_of_spaces(source)
    if not bodies:
        return [], [Problem(where, f"{lacks} and no walls", "no room is found", "room")]
    upright = [body for name, body in bodies if name.startswith(("IfcWall", "IfcCurtain"))]
    meshes = [body for _, body in bodies]
    low, high = _box([body for _, body in bodies])
    wall_low, wall_high = _box(upright or meshes)
    floor = _slab(low, high, wall_low[2] - CAP)
    roof = _slab(low, high, wall_high[2])
    attempts = (
        (meshes, GAP, ""),
        (meshes, WIDER, f"gaps up to {WIDER * 1000:.0f} mm closed"),
        ([*meshes, floor], GAP, "a floor put under the walls"),
        ([*meshes, floor, roof], GAP, "a floor and a flat roof put to the walls"),
    )
    found = ((rooms_enclosed_by(parts, gap), repair) for parts, gap, repair in attempts)
    rooms, repair = next(((rooms, repair) for rooms, repair in found if rooms), ([], ""))
    if not rooms:
        what = f"{lacks}, and its walls enclose nothing"
        done = f"no room is found; gaps up to {WIDER} m were closed"
        return [], [Problem(where, what, done, "room")]
    levels = _storeys(source)
    records = [_record(source, number, room, levels) for number, room in enumerate(rooms, 1)]
    what = f"{lacks}: {len(rooms)} room(s) found between its walls and slabs"
    done = repair or "rooms joined by openings without doors are one"
    return records, [Problem(where, what, done)]


def _lack_of_spaces(source: Source) -> str:
    drawn = len(source.model.by_type("IfcSpace"))
    return f"none of its {drawn} space(s) is a room" if drawn else "has no spaces"


def _uncut_bodies(source: Source) -> list[tuple[str, Body]]:
    """Class and triangles of the bounding elements, openings not cut, in the world."""
    filling = {
        relation.RelatedBuildingElement.id()
        for relation in source.model.by_type("IfcRelFillsElement")
    }  # the walls that host them are closed without them
    wanted = {
        key for key, shape in source.shapes.items() if shape.ifc_class.startswith(BOUNDING)
    } - filling
    everything = {one.id() for one in source.model.by_type("IfcProduct")}
    shapes, _ = read_shapes(source.model, without=everything - wanted, cut_openings=False)
    return [(s.ifc_class, source.placed.to_world(s.triangles)) for s in shapes.values()]


def _box(bodies: list[Body]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    corners = np.concatenate([body.reshape(-1, 3) for body in bodies])
    return corners.min(axis=0), corners.max(axis=0)


def _slab(low: NDArray[np.float64], high: NDArray[np.float64], bottom: float) -> Body:
    """A slab over the whole building, `CAP` thick."""
    x0, y0, x1, y1 = low[0] - 1, low[1] - 1, high[0] + 1, high[1] + 1
    c = np.array([[x, y, z] for z in (bottom, bottom + CAP) for x, y in
                  ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])  # fmt: skip
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return c[[corner for a, b, d, e in quads for corner in ((a, b, d), (a, d, e))]]


def _storeys(source: Source) -> list[tuple[float, str]]:
    """Height in the world and name of each storey, rising."""
    unit = ifcopenshell.util.unit.calculate_unit_scale(source.model)
    levels = []
    for storey in source.model.by_type("IfcBuildingStorey"):
        if storey.ObjectPlacement is None:
            continue
        matrix = ifcopenshell.util.placement.get_local_placement(storey.ObjectPlacement)
        z = source.placed.to_world(np.asarray(matrix)[:3, 3] * unit)[2]
        levels.append((float(z), storey.Name or ""))
    return sorted(levels)


def _record(source: Source, number: int, room, levels: list[tuple[float, str]]) -> SpaceRecord:
    """A found room as if it had been drawn; its GUID depends on where it lies only."""
    box = np.round(room.bounding_box(), 3)
    name = f"Room {number}"
    seed = f"{source.path.name} {box.tolist()}"
    guid = ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_URL, seed).hex)
    below = [label for z, label in levels if z <= box[2] + 0.5]
    storey = below[-1] if below else (levels[0][1] if levels else "")
    solid = room_solid(guid, name, room.as_original())
    return SpaceRecord(solid, name, "", storey, room.volume(), None, None)
