"""The ground below a room, stated or assumed, by ISO 13370, and notes on it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from bim.ground_floor import DOWNWARDS, buried_depth, ground_floor
from bim.model import Building, Space
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_tables import GroundTable, OperationTables
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
from thermal.zone import OpaqueSurface

YEAR_DAYS = 360  # of weather that make a year
LEAST_DEPTH = 0.05  # [m] of walls in the ground that make a basement


def grounded(
    surfaces: Sequence[OpaqueSurface],
    table: GroundTable | None,
    building: Building,
    space: Space,
    weather: Weather,
    stated: Collection[int] = (),
) -> list[OpaqueSurface]:
    """The surfaces of a room, those on the ground with what lies below them.

    Args:
        table: that the operation states; None: `default_ground`.
        stated: numbers of surfaces with a stated neighbour, which goes before an assumed ground.

    Raises: `ThermalInputError` for a ground that does not fit the surfaces.
    """
    if table is not None:
        return _on_ground(surfaces, table, weather)
    table = default_ground(building, space, weather)
    if table is None:
        return list(surfaces)
    kept = {i for i, one in enumerate(surfaces) if i in stated or not _in_iso_13370(one, table)}
    return _on_ground(surfaces, table, weather, kept)


def default_ground(building: Building, space: Space, weather: Weather) -> GroundTable | None:
    """The ground below a room of which nothing is stated: ISO 13370 with area and perimeter of the building.

    A room with walls in the ground is a basement as deep as these.  None: undisturbed soil at the outer face, for
    weather of less than a year, and for a building without floors on the ground or outer walls above them.
    """
    on_ground = any(face.adjacency == "ground" for face in space.faces)
    if not on_ground or len(weather.times) * weather.step_h < 24.0 * YEAR_DAYS:
        return None
    area, perimeter = ground_floor(building)
    if min(area, perimeter) <= 0:
        return None
    depth = buried_depth(space)
    kind = {"kind": "basement", "depth": depth} if depth > LEAST_DEPTH else {"kind": "slab"}
    return GroundTable.model_construct(area=area, perimeter=perimeter, **kind)


def _in_iso_13370(surface: OpaqueSurface, table: GroundTable) -> bool:
    """Whether ISO 13370 has the surface: a floor, or a wall of a basement."""
    downwards = surface.normal[2]
    return downwards < DOWNWARDS or (table.kind == "basement" and abs(downwards) < -DOWNWARDS)


def _on_ground(
    surfaces: Sequence[OpaqueSurface], table: GroundTable, weather: Weather, kept: Collection[int] = ()
) -> list[OpaqueSurface]:
    """The surfaces, those on the ground with soil and virtual layer (ISO 13370), but for those that are kept."""
    days = weather.midpoints
    hours = (days.day_of_year.to_numpy() - 1) * 24.0 + days.hour.to_numpy() + days.minute / 60.0
    if weather.dry_bulb_c is None or weather.wind_speed is None:
        raise ThermalInputError("weather", "needs temperature and wind for the ground")
    year = harmonic(weather.dry_bulb_c, hours)
    wind = float(np.mean(weather.wind_speed))
    floors = [s for s in surfaces if s.outside == "ground" and s.normal[2] < DOWNWARDS]
    area = table.area or sum(s.area for s in floors)
    result = []
    for number, surface in enumerate(surfaces):
        if surface.outside != "ground" or number in kept:
            result.append(surface)
            continue
        element = _element(surface, floors, table, area, wind)
        result.append(
            replace(
                surface,
                layers=element.layers(surface.layers),
                outside="known",
                beyond_c=element.temperature(table.indoor_c, *year, hours),
            )
        )
    return result


def _element(
    one: OpaqueSurface, floors: Sequence[OpaqueSurface], table: GroundTable, area: float, wind: float
) -> GroundElement:
    """The floor or wall by ISO 13370."""
    soil = SOILS[table.soil]
    soil = Soil(table.conductivity or soil.conductivity, table.heat_capacity or soil.heat_capacity)
    if not floors and table.area is None:
        raise ThermalInputError("ground", "area: is needed where a room has no floor on the ground")
    footprint = Footprint(area, table.perimeter, table.wall_thickness, soil)
    resistance = sum(layer.resistance for layer in one.layers)
    is_floor, depth = one.normal[2] < DOWNWARDS, table.depth or 0.0
    if table.kind == "basement":
        floor = sum(layer.resistance for layer in floors[0].layers) if floors else resistance
        if is_floor:
            return basement(footprint, resistance, table.wall_resistance, depth)[0]
        return basement(footprint, floor, resistance, depth)[1]
    if not is_floor:
        raise ThermalInputError("ground", f"{one.name}: a wall below ground needs kind = 'basement' and its depth")
    if table.kind == "slab":
        vertical = table.edge_lies == "vertical"
        return slab_on_ground(footprint, resistance, edge=table.edge, vertical=vertical)
    if table.kind == "suspended":
        return suspended_floor(
            footprint,
            resistance,
            height=table.height,
            wall_u=table.wall_u,
            vents=table.vents,
            wind=wind,
            shield=table.shield,
            ground_resistance=table.below_resistance,
        )
    return over_unheated_basement(
        footprint,
        resistance,
        depth=depth,
        height=table.height,
        wall_u=table.wall_u,
        floor_resistance=table.below_resistance,
        wall_resistance=table.wall_resistance,
    )


def ground_note(tables: OperationTables, building: Building) -> tuple[str, ...]:
    """Sentences on the ground that is assumed, and on what the ground around a basement lacks."""
    envelopes = [one.envelope for one in tables.variants]
    grounds = [one.ground for one in envelopes]
    stated = [one.ground is not None or any("floor" in n.faces for n in one.neighbour) for one in envelopes]
    return (*(() if all(stated) else assumed_ground_note(building)), *_basement_note(grounds))


def assumed_ground_note(building: Building) -> tuple[str, ...]:
    """A sentence on the ground below floors of which no `[envelope.ground]` is stated; empty without such floors."""
    area, perimeter = ground_floor(building)
    if min(area, perimeter) <= 0:
        return ()
    note = Note(
        "Floors on the ground without [envelope.ground] are computed by ISO 13370 with {area:.0f} m2 and "
        "{perimeter:.0f} m of outer walls of the building's rooms, walls of 0.3 m, on sand (2 W/(m K)), "
        "without edge insulation.",
        area=area,
        perimeter=perimeter,
    )
    return (note,)


def _basement_note(grounds: Sequence[GroundTable | None]) -> tuple[str, ...]:
    """A sentence on what the ground around a basement lacks; empty without a basement."""
    if not any(one is not None and one.kind.endswith("basement") for one in grounds):
        return ()
    note = Note(
        "Basement by ISO 13370: sun and longwave radiation at the surface of the ground are "
        "neglected. Below bare ground in a sunny climate (Boulder, Colorado) a basement is warmer "
        "than computed, by 0.9 K in the annual mean and up to 3.4 K in summer."
    )
    return (note,)
