"""The heat of rooms whose light is known: of one alone, or of all that are coupled, together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from bim.report.issue import Issue
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.stored_arrays import StoredArrays
from scenes.results import (
    DaylightResult,
    ExploredRoom,
    GlareResults,
    OperationResult,
    RoomYear,
    ThermalResult,
)
from scenes.room.humidity import felt_by, room_humidity
from scenes.room.operation_tables import OperationTables
from scenes.room.thermal import operated_year, thermal_result
from scenes.room.zone import RoomZone, balances, coupled

Heat = tuple[ThermalResult, OperationResult | None]


@dataclass(frozen=True, slots=True)
class HeatInputs:
    """What the heat of a room comes from, and what its tables name."""

    zone: RoomZone
    fenestration: tuple[dict[str, float | str], ...]  # `fenestration_table` of its windows
    states: tuple[str, ...]  # names of the shading states
    tables: OperationTables | None  # None: not operated


@dataclass(frozen=True, slots=True)
class DaylitRoom:
    """A room with its year of light, before its heat."""

    space: Space
    daylight: DaylightResult
    glare: GlareResults
    inputs: HeatInputs
    seconds: dict[str, float]  # by stage
    annual_glare: pd.DataFrame | None = None
    dgp: AnnualGlare | None = None
    issues: tuple[Issue, ...] = ()
    explored: ExploredRoom | None = None
    template: str = ""
    borrowed: str = ""

    def with_heat(self, heat: Heat) -> RoomYear:
        """The whole year."""
        thermal, ran = heat
        names = (field.name for field in fields(self) if field.name != "inputs")
        return RoomYear(
            heat=thermal, operation=ran, **{name: getattr(self, name) for name in names}
        )


def heat_of(
    rooms: Sequence[HeatInputs],
    weather: Weather,
    step_s: float,
    *,
    terrain: str = "suburbs",
    air_links: NDArray[np.float64] | None = None,
    progress: Progress = silent,
    store: StoredArrays | None = None,
) -> list[Heat]:
    """Temperatures, comfort and loads of rooms that are balanced together.

    Args:
        step_s: of the balance [s].
        air_links: air between them [Z, Z] [m3/s]; None: none.
        store: where the balances and what is found lie; None: in memory.
    """
    zones = [room.zone for room in rooms]
    found = balances(
        zones, weather, step_s, air_links=air_links, terrain=terrain, progress=progress,
        store=store,
    )  # fmt: skip
    passed = iter if store is None else store.each
    moist = room_humidity(zones, passed(found), weather, air_links=air_links)
    heats: list[Heat] = []
    for room, balance, humidity in zip(rooms, passed(found), moist, strict=True):
        tables = room.tables or OperationTables()
        felt = felt_by(tables.comfort, balance, humidity)
        heat = thermal_result(room.zone, balance, weather, felt, iter(room.fenestration))
        ran = None
        if room.tables is not None:
            rule = tables.control.rule
            ran = operated_year(room.zone, balance, weather, room.states, rule)
        heats.append((heat, ran) if store is None else store.kept((heat, ran)))
    return heats


def heat_alone(
    room: HeatInputs, weather: Weather, step_s: float, progress: Progress = silent
) -> Heat:
    """The heat of a room with rooms of its own temperature around it."""
    terrain = (room.tables or OperationTables()).terrain
    (heat,) = heat_of([room], weather, step_s, terrain=terrain, progress=progress)
    progress("heat", 1.0)
    return heat


def coupled_years(
    rooms: Sequence[DaylitRoom],
    weather: Weather,
    step_s: float,
    tables: OperationTables,
    progress: Progress = silent,
    *,
    store: StoredArrays | None = None,
) -> tuple[list[RoomYear], str]:
    """The years of rooms that exchange heat through what lies between them, and that in words.

    Args:
        tables: of all rooms; they say the site's terrain and the air through open doors.
        store: where the rooms' heat lies; None: in memory.
    """
    progress("heat balance", 0.0)
    zones, links, _ = coupled([room.inputs.zone for room in rooms], tables.air.door_m3_s)
    inputs = [replace(r.inputs, zone=zone) for r, zone in zip(rooms, zones, strict=True)]
    found = heat_of(
        inputs, weather, step_s, terrain=tables.terrain, air_links=links, progress=progress,
        store=store,
    )  # fmt: skip
    progress("heat balance", 1.0)
    years = [room.with_heat(heat) for room, heat in zip(rooms, found, strict=True)]
    return years, _said(zones)


def _said(rooms: Sequence[RoomZone]) -> str:
    """What the rooms exchange heat through, and behind what the room itself is taken to lie."""
    through = among = other = 0.0
    guids = {room.space.guid for room in rooms}
    for room in rooms:
        for surface, guid in zip(room.zone.surfaces, room.room.neighbours, strict=True):
            if surface.partner:
                through += surface.area / 2.0
            elif guid in guids:
                among += surface.area
            elif guid is not None and surface.outside == "twin":
                other += surface.area
    text = (
        f"The heat of the {len(rooms)} rooms is balanced together: it flows between them through "
        f"{through:.1f} m2 of walls, floors and doors."
    )
    apart = {
        "towards each other where no face of the other was found": among,
        "towards rooms that are not computed": other,
    }
    behind = " and ".join(f"{area:.1f} m2 {what}" for what, area in apart.items() if area >= 0.05)
    if behind:
        text += f" Behind these sides a room of the same temperature is taken to lie: {behind}."
    return text
