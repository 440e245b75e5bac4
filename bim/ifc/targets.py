"""The windows of a model that are meant: by GUID, type, room, storey, facade or a selector."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import ifcopenshell
import numpy as np

from bim.ifc.building import read_ifc
from bim.ifc.corrections import chosen
from bim.ifc.damage import type_of
from bim.ifc.elements import cad_layers_of, material_name
from bim.ifc.project import open_ifc, storey_of
from bim.model import Building, Window
from bim.names import AmbiguousName, UnknownName, item_named, listed
from bim.to_tracer import orientation_name
from mitsuba_cfs.errors import DataError


@dataclass(frozen=True, slots=True)
class ChosenElement:
    """An element of a file as its author would look for it."""

    ifc_class: str
    name: str
    type_name: str
    storey: str
    material: str  # the first of several
    layer: str  # CAD layer, the first of several
    guid: str


def query(path: str | PathLike[str], selector: str) -> list[ChosenElement]:
    """The elements that a selector chooses, by class, storey and name.

    Raises: `DataError` where the file cannot be read or the selector is none.
    """
    model = open_ifc(path)
    elements = [_described(model.by_id(step_id)) for step_id in chosen(model, selector)]
    return sorted(elements, key=lambda one: (one.ifc_class, one.storey, one.name, one.guid))


def _described(element: ifcopenshell.entity_instance) -> ChosenElement:
    kind = type_of(element)
    return ChosenElement(
        element.is_a(),
        element.Name or "",
        (kind.Name or "") if kind is not None else "",
        storey_of(element),
        material_name(element),
        next(iter(cad_layers_of(element)), ""),
        element.GlobalId,
    )


GLAZED = ("IfcWindow", "IfcDoor", "IfcPlate", "IfcCurtainWall")
Entity = ifcopenshell.entity_instance
# facade: from and to, clockwise from north [deg]
FINEST = 0.001  # azimuths are compared to this [deg]; a quarter ends that much before the next
QUARTERS = {
    name: (middle - 45, middle + 45 - FINEST) for name, middle in {"N": 360, "E": 90, "S": 180, "W": 270}.items()
}
EIGHTHS = {name: (middle - 22.5, middle + 22.5) for name, middle in {"NE": 45, "SE": 135, "SW": 225, "NW": 315}.items()}
SECTOR = re.compile(r"^(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)$")


@dataclass(frozen=True, slots=True)
class Targets:
    """Which windows: places narrow each other and the types, GUIDs come besides."""

    windows: Sequence[str] = ()  # GUIDs of windows, doors or glazed panels
    types: Sequence[str] = ()  # names of window types, or of windows' ObjectType
    rooms: Sequence[str] = ()
    storeys: Sequence[str] = ()
    facades: Sequence[str] = ()  # N, NE, E, ..., "roof", or a sector "150-210"
    every_window: bool = False  # all IfcWindow

    @property
    def by_place(self) -> bool:
        """Whether the rooms have to be read to find them."""
        return bool(self.rooms or self.storeys or self.facades)


def target_elements(model: ifcopenshell.file, path: str | Path, targets: Targets) -> list[Entity]:
    """Windows and window types that are meant; `DataError` lists what there is where one is not."""
    elements: dict[int, Entity] = {}
    if targets.every_window:
        elements |= {one.id(): one for one in model.by_type("IfcWindow")}
        if not elements:
            raise DataError("holds no IfcWindow", file=path)
    for guid in targets.windows:
        one = _by_guid(model, guid, path)
        elements[one.id()] = one
    of_types = [one for name in targets.types for one in _of_type(model, name, path)]
    if targets.by_place:
        placed = _placed(model, path, targets)
        if targets.types:
            wanted = {one.id() for one in of_types}
            placed = [one for one in placed if {one.id(), _type_id(one)} & wanted]
        if not placed:
            raise DataError("no window is in all of these places", file=path)
        of_types = placed
    elements |= {one.id(): one for one in of_types}
    if not elements:
        message = "no window chosen: give a GUID, a type, a room, a storey, a facade or all"
        raise DataError(message, file=path)
    return list(elements.values())


def _by_guid(model: ifcopenshell.file, guid: str, path: str | Path) -> Entity:
    try:
        one = model.by_guid(guid)
    except RuntimeError:
        raise DataError(f"no element {guid!r}", file=path) from None
    if not one.is_a().startswith(GLAZED):
        raise DataError(f"is {one.is_a()}, no window", file=path, element=guid)
    return one


def _of_type(model: ifcopenshell.file, name: str, path: str | Path) -> list[Entity]:
    """The window type of that name, else the windows whose ObjectType it is."""
    types = [one for one in model.by_type("IfcTypeProduct") if one.is_a().startswith(GLAZED)]
    windows = model.by_type("IfcWindow")
    matches = [one for one in types if one.Name == name]
    matches = matches or [one for one in windows if one.ObjectType == name]
    if not matches:
        names = [one.Name for one in types] + [one.ObjectType for one in windows]
        there = listed(name, (known for known in names if known))
        message = f"no window type {name!r}; there are: {there or 'none with a name'}"
        raise DataError(message, file=path)
    return matches


def _type_id(element: Entity) -> int:
    kind = type_of(element)
    return -1 if kind is None else kind.id()


def _placed(model: ifcopenshell.file, path: str | Path, targets: Targets) -> list[Entity]:
    """The windows that give light to these rooms, on these storeys, in these facades."""
    building = read_ifc(path)
    rooms = list(building.spaces)
    if targets.rooms:
        rooms = [_room(building, name, path) for name in targets.rooms]
    if targets.storeys:
        storeys = {_storey(building, name, path) for name in targets.storeys}
        rooms = [room for room in rooms if room.storey in storeys]
    windows = [window for room in rooms for window in room.windows]
    if targets.facades:
        sectors = [_sector(name, building, path) for name in targets.facades]
        windows = [w for w in windows if any(_faces(w, sector) for sector in sectors)]
    return [model.by_guid(guid) for guid in dict.fromkeys(window.guid for window in windows)]


def _room(building: Building, name: str, path: str | Path):
    try:
        return item_named(building.spaces, name, "room")
    except (UnknownName, AmbiguousName) as error:
        raise DataError(str(error.args[0]), file=path, field="space") from None


def _storey(building: Building, name: str, path: str | Path) -> str:
    storeys = list(dict.fromkeys(space.storey for space in building.spaces))
    matches = [one for one in storeys if one == name]
    matches = matches or [one for one in storeys if one.casefold() == name.strip().casefold()]
    if len(matches) != 1:
        message = f"no storey {name!r} with rooms; there are: {listed(name, storeys)}"
        raise DataError(message, file=path, field="storey")
    return matches[0]


def _sector(name: str, building: Building, path: str | Path) -> tuple[float, float] | None:
    """From and to of a facade, clockwise from north [deg]; None for the roof."""
    key = name.strip().upper()
    if key == "ROOF":
        return None
    known = QUARTERS | EIGHTHS
    if key in known:
        return known[key]
    match = SECTOR.match(key)
    if match and all(float(edge) <= 360 for edge in match.groups()):
        return float(match[1]), float(match[2])
    there = ", ".join(sorted({orientation_name(window) for window in building.windows}))
    message = (
        f"no facade {name!r}: expected N, NE, E, ..., roof, or azimuths from-to as 150-210; "
        f"windows face: {there or 'nowhere'}"
    )
    raise DataError(message, file=path, field="facade")


def _faces(window: Window, sector: tuple[float, float] | None) -> bool:
    """Whether a window faces into a sector; one in a roof into that only."""
    is_roof = orientation_name(window) == "roof"
    if sector is None or is_roof:
        return sector is None and is_roof
    azimuth = np.degrees(np.arctan2(window.normal[0], window.normal[1]))
    azimuth = round(float(azimuth) / FINEST) * FINEST  # due south is not a hair beside it
    low, high = sector
    span = 360 if high - low >= 360 else (high - low) % 360
    return (azimuth - low + FINEST / 2) % 360 <= span + FINEST
