"""Heat through a glazed partition, and rooms of one air, beside EnergyPlus.

    python -m tests.validation inner_heat

The two rooms of `inner_sun`, empty, with half an air change an hour: the one behind heated to 20
degC, the front one (room, winter garden, double skin) without heating.  EnergyPlus runs here and
now.  First in weather without sun: conduction, longwave radiation and air alone.  "one air": both
rooms as one zone of two spaces, heated to 20 degC; mitsuba-cfs by `scenes.heat.air_nodes`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import WEATHER
from scenes.fenestration.thermal_file import StateTable
from scenes.heat.air_nodes import with_air_nodes
from scenes.heat.study import radiant_room
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.operation import read_state
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.room.zone import RoomZone, balances, coupled
from tests.validation.energyplus_program import Model, merged, run_energyplus
from tests.validation.inner_sun import (
    ABSORBED,
    CASES,
    FLOAT,
    FRONT,
    REAR,
    REFLECTANCE,
    energyplus_model,
    two_rooms,
    without_fields,
)

Hours = NDArray[np.float64]  # [H]
HEATED_C = 20.0
SUN_FIELDS = (14, 15, 16)  # of an EPW: global, direct normal, diffuse
PANE = {"thickness": 0.003048, "conductivity": 1.0, "emissivity": (0.84, 0.84), "solar": (0.834, 0.075, 0.075)}
GLAZING = {"layers": [PANE | {"gap": {"width": 0.012}}, PANE]}  # of `clear_double.epJSON`
EMPTY = {
    "gains": {"equipment_w_m2": 0.0, "persons": 0.0},
    "air": {"infiltration_ach": 0.5},
    "envelope": {"outside_absorptance": 0.5, "outside_roughness": "medium rough"},
}
HEATED = {"loads": {"heating_c": HEATED_C}}
FRONT_AIR, REAR_AIR, HEATING = "front air C", "rear air C", "heating kWh"
PANE_THICKNESS = FLOAT.layers[0].thickness
WEEK = 7 * 24
WINTER = (1, 2, 12)  # months of the sunny week


@dataclass(frozen=True, slots=True)
class Coupled:
    """Rooms as they are balanced together."""

    rooms: Sequence[RoomZone]
    links: NDArray[np.float64]  # [Z, Z] air between them [m3/s]
    weather: Weather

    def hours(self) -> dict[str, Hours]:
        """Air [degC] and heating [kW]."""
        results = balances(self.rooms, self.weather, 600.0, air_links=self.links)
        front, rear = results[0], results[-1]
        return {FRONT_AIR: front.air_c, REAR_AIR: rear.air_c, HEATING: rear.heating / 1000.0}

    def with_sun(self, theirs: dict[str, Hours]) -> Coupled:
        """The rooms with another program's sun [W] in their opaque surfaces; panes keep their own."""
        rooms = []
        for number, room in enumerate(self.rooms):
            inside = room.solar.inside.copy()
            for index, surface in enumerate(room.zone.surfaces):
                if surface.layers[0].thickness == PANE_THICKNESS:
                    continue
                rear = (len(self.rooms) == 2 and number == 1) or "rear" in surface.name
                inside[:, index] = theirs[_their_name(surface.normal, rear=rear)]
            rooms.append(replace(room, solar=replace(room.solar, inside=inside)))
        return replace(self, rooms=rooms)


def _their_name(normal: NDArray[np.float64], *, rear: bool) -> str:
    """EnergyPlus' surface of a room, by its normal."""
    axis = int(np.argmax(np.abs(normal)))
    number = {1: (0, 3), 0: (1, 2), 2: (4, 5)}[axis][int(normal[axis] > 0)]
    return (REAR if rear else FRONT)[number]


def coupled_rooms(case: str, weather_file: Path, *, one_air: bool) -> Coupled:
    """The rooms as `cfs thermal` with `couple`, and `air_nodes`, has them."""
    weather = read_epw(weather_file)
    building = two_rooms(REFLECTANCE, case)
    glazing = in_all_windows(building, read_state(StateTable.model_validate(GLAZING), None))
    options, guids = RoomOptions(), [space.guid for space in building.spaces]
    skies, rooms = skies_for(weather, options.sampling), []
    for space, heated in zip(building.spaces, (one_air, True), strict=True):
        room = room_inputs(
            building,
            space,
            glazing,
            weather,
            options,
            skies=skies,
            together=guids,
            operation=OperationTables.model_validate(EMPTY | (HEATED if heated else {})),
        )
        rooms.append(_radiating(operated_zone(room)))
    rooms, links, notes = coupled(rooms, 0.0)
    if notes:
        raise RuntimeError("; ".join(notes))
    if one_air:
        rooms, links, _ = with_air_nodes(rooms, links, dict.fromkeys(guids, "both"))
    return Coupled(rooms, links, weather)


def _radiating(zone: RoomZone) -> RoomZone:
    """The room with its traced view factors."""
    radiant = radiant_room(zone.space, zone.room)
    if radiant is None:
        raise RuntimeError(f"{zone.space.name} is not closed")
    return zone.with_view_factors(radiant.among)


def energyplus(case: str, weather: Path, *, one_air: bool) -> dict[str, Hours]:
    """The same by EnergyPlus, and the sun in its surfaces [W]."""
    rear = "ROOM" if one_air else "REAR"
    outputs = {
        "ROOM:Zone Mean Air Temperature": FRONT_AIR,
        "IDEAL:Zone Ideal Loads Zone Sensible Heating Rate": HEATING,
    } | ({} if one_air else {"REAR:Zone Mean Air Temperature": REAR_AIR})
    outputs |= {f"{name}:{ABSORBED}": name for name in (*FRONT, *REAR)}
    model = energyplus_model(case, outputs, "ideal_loads_20_26")
    daily = [{"field": "Through: 12/31"}, {"field": "For: AllDays"}, {"field": "Until: 24:00"}]
    patch: Model = {
        "ElectricEquipment": None,
        "People": None,
        "Schedule:Compact": {"COOLED": {"data": [*daily, {"field": 90.0}]}},
        "ZoneControl:Thermostat": {"THERMOSTAT": {"zone_or_zonelist_name": rear}},
        "ZoneHVAC:EquipmentConnections": {"CONNECTIONS": {"zone_name": rear}},
    }  # type: ignore[dict-item]
    model = merged(model, patch)
    if one_air:
        model = _one_zone(model)
    hours = run_energyplus(model, weather, outputs=outputs)
    hours[HEATING] /= 1000.0
    if one_air:
        hours[REAR_AIR] = hours[FRONT_AIR]
    return {name: hours[name].to_numpy() for name in hours}


def _one_zone(model: Model) -> Model:
    """The model with both rooms as spaces of one zone."""
    surfaces = {
        name: {"zone_name": "ROOM", "space_name": "BEHIND" if name in REAR else "BEFORE"}
        for name in model["BuildingSurface:Detailed"]
    }
    volume = sum(zone["volume"] for zone in model["Zone"].values())
    patch: Model = {
        "BuildingSurface:Detailed": surfaces,
        "Zone": {"REAR": None, "ROOM": {"volume": volume}},  # type: ignore[dict-item]
        "Space": {
            name: {"zone_name": "ROOM", "volume": zone["volume"]}
            for name, zone in zip(("BEFORE", "BEHIND"), model["Zone"].values(), strict=True)
        },
        "ZoneInfiltration:DesignFlowRate": {"REAR AIR": None},  # type: ignore[dict-item]
    }
    return merged(model, patch)


def weeks(weather_file: Path) -> dict[str, slice]:
    """The year, its coldest week and the sunniest week of December to February."""
    weather = read_epw(weather_file)
    sun = weather.direct_normal + weather.diffuse_horizontal
    starts = range(0, len(weather.times) - WEEK + 1, WEEK)
    winter = [one for one in starts if weather.times[one].month in WINTER]
    cold = min(starts, key=lambda one: weather.dry_bulb_c[one : one + WEEK].mean())
    sunny = max(winter, key=lambda one: sun[one : one + WEEK].sum())
    return {
        "year": slice(None),
        "coldest week": slice(cold, cold + WEEK),
        "sunny winter week": slice(sunny, sunny + WEEK),
    }


def compare(case: str, weather: Path, *, one_air: bool) -> pd.DataFrame:
    """Both programs' mean air temperatures and heating in each week."""
    rooms = coupled_rooms(case, weather, one_air=one_air)
    theirs = energyplus(case, weather, one_air=one_air)
    programs = {"EnergyPlus": theirs, "mitsuba-cfs": rooms.hours()}
    if weather == WEATHER:
        programs["mitsuba-cfs, EnergyPlus' sun"] = rooms.with_sun(theirs).hours()
    rows = []
    for title, week in weeks(WEATHER).items():
        needed = theirs[HEATING][week].sum()
        for program, hours in programs.items():
            heating = hours[HEATING][week].sum()
            rows.append(
                {
                    "case": case,
                    "rooms": "one air" if one_air else "apart",
                    "sun": "sun" if weather == WEATHER else "none",
                    "time": title,
                    "program": program,
                    FRONT_AIR: hours[FRONT_AIR][week].mean(),
                    REAR_AIR: hours[REAR_AIR][week].mean(),
                    HEATING: heating,
                    "heating %": 100.0 * (heating / needed - 1.0) if needed else np.nan,
                }
            )
    return pd.DataFrame(rows)


def main(cases: Sequence[str] = tuple(CASES)) -> pd.DataFrame:
    """The comparison."""
    with tempfile.TemporaryDirectory() as folder:
        dark = without_fields(Path(folder), *SUN_FIELDS)
        tables = [
            compare(case, weather, one_air=one_air)
            for one_air in (False, True)
            for case in cases
            for weather in (dark, WEATHER)
        ]
    return pd.concat(tables, ignore_index=True).round(2)
