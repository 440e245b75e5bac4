"""The 128 cases of chapter 4: our room and EnergyPlus' hours side by side.

4 fenestration systems, 8 orientations, 4 climates, free floating; the first seven days are left
out, as in the dissertation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from tests.validation import reference_room, reference_systems
from tests.validation.energyplus_program import room_model, run_energyplus
from tests.validation.facade_sun import FacadeSun, facade_sun, sun_steps
from tests.validation.reference_systems import Optics
from thermal.balance import ZoneResult, simulate
from thermal.blackbox import Fenestration
from thermal.climate import Climate

FloatArray = NDArray[np.float64]
STEPS = 6  # per hour
FIRST_HOUR = 7 * 24
EPW_FILES = {
    "Frankfurt": "DEU_Frankfurt.am.Main.106370_IWEC.epw",
    "Alicante": "ESP_Alicante.083600_SWEC.epw",
    "Houlton": "USA_ME_Houlton.Intl.AP.727033_TMY3.epw",
    "Singapore": "SGP_Singapore.486980_IWEC.epw",
}
LIVE_FILES = {  # climates outside the reference set: EnergyPlus runs here and now
    "Reykjavik": "ISL_Reykjavik.040300_IWEC.epw",
    "Sydney": "AUS_NSW.Sydney.947670_IWEC.epw",
    "Malaga": "ESP_Malaga.084820_SWEC.epw",
    "Lyon": "FRA_Lyon.074810_IWEC.epw",
}
ALL_FILES = EPW_FILES | LIVE_FILES
WALLS = ("T_facade", "T_wall_x0", "T_wall_x4", "T_back", "T_floor", "T_ceiling")
QUANTITIES = ("air", "wall", "window")


@dataclass(frozen=True, slots=True)
class Site:
    """A climate, ready to be simulated."""

    name: str
    weather: Weather
    climate: Climate
    suns: dict[str, FacadeSun]  # by orientation


@dataclass(frozen=True, slots=True)
class EnergyPlusCase:
    """Temperatures of one case and model [H] [degC]."""

    climate: str
    system: str
    orientation: str
    model: str
    air: FloatArray
    wall: FloatArray  # mean of the six walls
    window: FloatArray  # inner face
    floor: FloatArray
    operative: FloatArray  # the program's own
    centre: FloatArray  # operative at the room's centre by the dissertation's approximation


def site(name: str, epw: Path, orientations: Iterable[str] = reference_room.ORIENTATIONS) -> Site:
    """Weather and facade sun of one climate."""
    weather = read_epw(epw)
    steps = sun_steps(weather, STEPS)
    suns = {o: facade_sun(steps, reference_room.facade_normal(o)) for o in orientations}
    return Site(name, weather, reference_room.climate(weather), suns)


def centre_operative(air: FloatArray, surfaces: FloatArray, floor: FloatArray) -> FloatArray:
    """(MRT + air)/2 with MRT = (plain mean of the surfaces + floor)/2 (dissertation, 4.8)."""
    return 0.5 * (0.5 * (surfaces.mean(axis=1) + floor) + air)


def reference_case(name: str, system: str, orientation: str, table: pd.DataFrame) -> EnergyPlusCase:
    """EnergyPlus' hours of one case from its table."""
    walls = table[list(WALLS)].to_numpy(dtype=float)
    air, window = (table[c].to_numpy(dtype=float) for c in ("T_air", "T_win_in"))
    floor, own = (table[c].to_numpy(dtype=float) for c in ("T_floor", "T_op"))
    faces = np.column_stack([walls, window])
    centre = centre_operative(air, faces, floor)
    wall = walls.mean(axis=1)
    return EnergyPlusCase(name, system, orientation, "EnergyPlus", air, wall, window, floor, own, centre)


def our_case(
    place: Site,
    orientation: str,
    system_name: str,
    system: reference_systems.System,
    light: reference_room.RoomLight,
    model: str,
) -> EnergyPlusCase:
    """Our hours of one case."""
    result = simulate_case(place, orientation, system, light)
    walls, window = result.surface_in_c, result.window_inner_c
    floor = walls[:, 4]
    centre = centre_operative(result.air_c, np.column_stack([walls, window]), floor)
    return EnergyPlusCase(
        place.name,
        system_name,
        orientation,
        model,
        result.air_c,
        walls.mean(axis=1),
        window[:, 0],
        floor,
        result.operative_c,
        centre,
    )


def simulate_case(
    place: Site,
    orientation: str,
    system: reference_systems.System,
    light: reference_room.RoomLight,
    *,
    steps: int = STEPS,
) -> ZoneResult:
    """The year of the room with one system; the site's sun has as many steps an hour."""
    sun = place.suns[orientation]
    fenestration: Fenestration = system.fenestration
    zone = reference_room.zone(orientation, fenestration)
    solar = reference_room.solar(sun, system, light)
    return simulate(zone, place.climate, solar, step_s=3600.0 / steps)


def clear_double_year(weather: Weather, orientation: str, **changes: Any) -> ZoneResult:
    """The year of the room with clear double glazing; changes: fields of its `Zone`."""
    system = reference_systems.clear_double()
    zone = replace(reference_room.zone(orientation, system.fenestration), **changes)
    sun = facade_sun(sun_steps(weather, STEPS), reference_room.facade_normal(orientation))
    solar = reference_room.solar(sun, system, reference_room.RoomLight())
    return simulate(zone, reference_room.climate(weather), solar, step_s=3600.0 / STEPS)


def pairs(
    reference: Path,
    epw: Path,
    *,
    closures: Sequence[str],
    climates: Sequence[str] = tuple(EPW_FILES),
    orientations: Sequence[str] = tuple(reference_room.ORIENTATIONS),
    systems: Sequence[str] = reference_systems.SYSTEMS,
    progress: Callable[[float], None] | None = None,
) -> Iterator[tuple[EnergyPlusCase, list[EnergyPlusCase]]]:
    """EnergyPlus' case and ours with every closure, case by case."""
    light = reference_room.RoomLight()
    models = {
        (name, closure): reference_systems.system(reference, name, closure) for name in systems for closure in closures
    }
    done, total = 0, len(climates) * len(orientations) * len(systems)
    for name in climates:
        place = site(name, epw / ALL_FILES[name], orientations)
        hours = _reference_hours(reference, epw, name)
        for orientation in orientations:
            for system in systems:
                theirs = reference_case(name, system, orientation, hours(system, orientation))
                ours = [our_case(place, orientation, system, models[(system, c)], light, c) for c in closures]
                yield theirs, ours
                done += 1
                if progress:
                    progress(done / total)


def _reference_hours(reference: Path, epw: Path, climate: str) -> Callable[[str, str], pd.DataFrame]:
    """EnergyPlus' table of a system and orientation: stored, or run now."""
    if climate in LIVE_FILES:
        return lambda system, orientation: run_energyplus(room_model(orientation, system), epw / LIVE_FILES[climate])
    table = pd.read_parquet(reference / f"ep_{climate}.parquet")
    tables = dict(list(table.groupby(["cfs", "ori"], observed=True)))
    return lambda system, orientation: tables[(system, orientation)]


def with_g(optics: Optics, g: FloatArray, diffuse_g: FloatArray) -> Optics:
    """The same optics with another g per direction [K] and for sky and ground light [2]."""
    diffuse = optics.diffuse.copy()
    diffuse[:, 2] = diffuse_g
    return Optics(optics.theta, optics.phi, optics.tau, optics.rho, g, diffuse, optics.scatter, optics.back)


def errors(ours: EnergyPlusCase, theirs: EnergyPlusCase) -> dict[str, FloatArray]:
    """Our temperature less EnergyPlus' [H - 168] [K] for every quantity."""
    return {q: (getattr(ours, q) - getattr(theirs, q))[FIRST_HOUR:] for q in QUANTITIES}
