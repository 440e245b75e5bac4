"""The envelope of a room by its tables: ground, neighbours, thermal bridges, frames, slab."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bim.model import Building, Face, Space, Window
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import GroundTable, NeighbourTable, OperationTables
from thermal.errors import ThermalInputError
from thermal.ground import (
    SOILS,
    Footprint,
    GroundElement,
    Soil,
    basement,
    harmonic,
    over_unheated_basement,
    slab_on_ground,
    suspended_floor,
)
from thermal.zone import Layer, OpaqueSurface, Zone

FILMS = 0.17  # [m2 K/W] both films of a frame, ISO 10077-1
DOWNWARDS = -0.7  # z of a floor's normal


def enveloped(
    room: ThermalRoom, building: Building, space: Space, tables: OperationTables, weather: Weather
) -> ThermalRoom:
    """The room with ground, neighbours, bridges, frames and slab of its tables.

    Raises: `DataError` that names the room and the table.
    """
    envelope = tables.envelope
    faces = [
        [face for face, at in zip(space.faces, room.surface_of_face, strict=True) if at == number]
        for number in range(len(room.zone.surfaces))
    ]
    surfaces = [
        one if one.outside != "outdoor" or own[0].kind == "window frame" else replace(
            one, absorptance_out=envelope.outside_absorptance,
            roughness=envelope.outside_roughness,
        ) for one, own in zip(room.zone.surfaces, faces, strict=True)
    ]  # fmt: skip
    try:
        if envelope.frame_u is not None:
            layer = Layer(1.0, 1.0 / (1.0 / envelope.frame_u - FILMS), 0.0, 0.0)
            surfaces = [
                replace(one, layers=(layer,)) if own[0].kind == "window frame" else one
                for one, own in zip(surfaces, faces, strict=True)
            ]
        if envelope.ground is not None:
            surfaces = _grounded(surfaces, envelope.ground, weather)
        hours = OperationHours(tables, weather)
        for number, table in enumerate(envelope.neighbour):
            place = f"envelope.neighbour.{number}"
            beyond = hours.value(table, "temperature_c", place)
            for i in _named(table, faces, building, place):
                surfaces[i] = _next_to(surfaces[i], table, beyond)
    except ThermalInputError as error:
        raise DataError(
            error.message, file=building.file, element=space.label, field="envelope"
        ) from None
    edges = sum(glass_edge(window) for window in space.windows)
    bridges = sum(one.conductance for one in envelope.bridge) + envelope.frame_psi * edges
    if bridges < 0:
        raise DataError("the bridges' sum is negative", element=space.label, field="envelope")
    zone = replace(room.zone, surfaces=tuple(surfaces), bridges=bridges)
    return replace(room, zone=_heated(zone, faces, hours, space))


def glass_edge(window: Window) -> float:
    """Length of the edges of a window's glass [m]: triangle sides that only one triangle has."""
    sides: Counter[tuple[tuple[float, ...], ...]] = Counter()
    for triangle in np.round(window.triangles, 6):
        for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            sides[tuple(sorted((tuple(start), tuple(end))))] += 1
    edges = [np.subtract(*pair) for pair, count in sides.items() if count == 1]
    return float(sum(np.linalg.norm(side) for side in edges))


def _grounded(
    surfaces: Sequence[OpaqueSurface], table: GroundTable, weather: Weather
) -> list[OpaqueSurface]:
    """The surfaces, those on the ground with soil and virtual layer (ISO 13370)."""
    days = weather.midpoints
    hours = (days.day_of_year.to_numpy() - 1) * 24.0 + days.hour.to_numpy() + days.minute / 60.0
    year = harmonic(weather.dry_bulb_c, hours)
    wind = float(np.mean(weather.wind_speed))
    floors = [s for s in surfaces if s.outside == "ground" and s.normal[2] < DOWNWARDS]
    area = table.area or sum(s.area for s in floors)
    grounded = []
    for one in surfaces:
        if one.outside != "ground":
            grounded.append(one)
            continue
        element = _element(one, floors, table, area, wind)
        grounded.append(
            replace(
                one,
                layers=element.layers(one.layers),
                outside="known",
                beyond_c=element.temperature(table.indoor_c, *year, hours),
            )
        )
    return grounded


def _element(
    one: OpaqueSurface, floors: Sequence[OpaqueSurface], table: GroundTable, area: float,
    wind: float,
) -> GroundElement:  # fmt: skip
    """The floor or wall by ISO 13370."""
    soil = SOILS[table.soil]
    soil = Soil(table.conductivity or soil.conductivity, table.heat_capacity or soil.heat_capacity)
    if not floors and table.area is None:
        raise ThermalInputError("ground", "area: is needed where a room has no floor on the ground")
    footprint = Footprint(area, table.perimeter, table.wall_thickness, soil)
    resistance = sum(layer.resistance for layer in one.layers)
    is_floor = one.normal[2] < DOWNWARDS
    if table.kind == "basement":
        floor = sum(layer.resistance for layer in floors[0].layers) if floors else resistance
        if is_floor:
            return basement(footprint, resistance, table.wall_resistance, table.depth)[0]
        return basement(footprint, floor, resistance, table.depth)[1]
    if not is_floor:
        raise ThermalInputError(
            "ground", f"{one.name}: a wall below ground needs kind = 'basement' and its depth"
        )
    if table.kind == "slab":
        vertical = table.edge_lies == "vertical"
        return slab_on_ground(footprint, resistance, edge=table.edge, vertical=vertical)
    if table.kind == "suspended":
        return suspended_floor(
            footprint, resistance, height=table.height, wall_u=table.wall_u, vents=table.vents,
            wind=wind, shield=table.shield, ground_resistance=table.below_resistance,
        )  # fmt: skip
    return over_unheated_basement(
        footprint, resistance, depth=table.depth, height=table.height, wall_u=table.wall_u,
        floor_resistance=table.below_resistance, wall_resistance=table.wall_resistance,
    )  # fmt: skip


def _named(
    table: NeighbourTable, faces: Sequence[Sequence[Face]], building: Building, place: str
) -> list[int]:
    """The surfaces that a neighbour's table names."""
    guids = {building.room(name).space.guid for name in table.spaces}
    named = [
        number
        for number, own in enumerate(faces)
        if any(
            face.neighbour in guids or face.name in table.faces or face.kind in table.faces
            for face in own
            if face.kind not in ("window frame", "reveal")
        )
    ]
    known = {name for own in faces for face in own for name in (face.name, face.kind)}
    unknown = sorted(set(table.faces) - known)
    if unknown:
        there = ", ".join(sorted(known))
        raise DataError(
            f"no face {unknown[0]!r}; there are {there}", file=building.file, field=f"{place}.faces"
        )
    return named


def _next_to(one: OpaqueSurface, table: NeighbourTable, beyond) -> OpaqueSurface:
    """The surface with the neighbour's film and temperature on its far side."""
    layers = one.layers
    if table.film > 0:
        layers = (Layer(1.0, 1.0 / table.film, 0.0, 0.0), *layers)
    return replace(one, layers=layers, outside="known", beyond_c=beyond)


def _heated(
    zone: Zone, faces: Sequence[Sequence[Face]], hours: OperationHours, space: Space
) -> Zone:
    """The zone with its heated slab, in the largest surface that its table names."""
    table = hours.tables.loads.slab
    if table is None:
        return zone
    named = [
        surface
        for surface, own in zip(zone.surfaces, faces, strict=True)
        if any(face.name in table.faces or face.kind in table.faces for face in own)
    ]
    if not named:
        raise DataError(
            f"has no face {' or '.join(table.faces)}", element=space.label, field="loads.slab.faces"
        )
    surface = max(named, key=lambda one: one.area)
    return replace(zone, slab=hours.slab(surface.name, surface.area))
