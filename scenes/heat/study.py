"""`cfs thermal`: the year of every room of a study, from its file to tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.read_ifc import read_ifc
from bim.to_thermal import (
    ThermalRoom,
    coupled_rooms,
    door_links,
    shared_constructions,
    thermal_room,
)
from mitsuba_cfs import variants
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.progress import Progress, item, part
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration import fill_windows, source_notes, window_sources
from scenes.heat.box import box_building
from scenes.heat.files import HeatFiles, read_files
from scenes.heat.radiant import RadiantRoom, felt, radiant_room
from scenes.heat.room_sun import RoomLight, illuminances, room_light, state_solar
from scenes.heat.study_file import StudyFile
from scenes.heat.tables import hourly_table, year_summary
from scenes.job.drawn_shades import traced_building
from scenes.job.inputs import States, System, chosen_spaces, named_spaces
from scenes.job.thermal import COMPILING, climate
from scenes.job.thermal_system import ThermalSystem, checked_system
from thermal.balance import ZoneResult, simulate_zones
from thermal.climate import Solar
from thermal.control import (
    always,
    by_cut_off,
    by_glare,
    by_irradiance,
    by_schedule,
    switched,
)
from thermal.gains import dimmed_share, split_gains
from thermal.kernel import advance
from thermal.records import must_compile
from thermal.zone import WindowElement, Zone, work_hours

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RoomYear:
    """One room's year."""

    name: str
    floor_area: float  # [m2]
    hours: pd.DataFrame  # temperatures, loads, state, heat flows by hour
    summary: dict[str, float]
    months: pd.DataFrame  # discomfort in the occupied hours, by band and month


@dataclass(frozen=True, slots=True)
class ReadyRoom:
    """A room traced and controlled: all that its heat balance needs."""

    space: Space
    zone: Zone
    solar: Solar
    state: NDArray[np.int64]  # [H] shading state
    daylight: FloatArray | None  # [H] mean on the work plane [lx]
    radiant: RadiantRoom | None


def run_study(
    study: StudyFile, progress: Progress, files: HeatFiles | None = None
) -> tuple[list[RoomYear], tuple[str, ...]]:
    """The rooms of a study, and what had to be assumed.

    Args: files: what `read_files` has read of the study; read now without.
    """
    files = files or read_files(study)
    weather = files.weather
    building, spaces = rooms_of(study)
    windows = [window for space in spaces for window in space.windows]
    filled = fill_windows(windows, files.given, study.building)
    sources = window_sources(windows, filled)
    building = traced_building(building, filled)
    states = [_room_states(study, space, filled, files) for space in spaces]
    zones = [
        thermal_room(space, thermals[0].fenestration)
        for space, (_, thermals) in zip(spaces, states, strict=True)
    ]
    known = [one for systems, thermals in states for one in (*systems, *thermals)]
    notes = dict.fromkeys([*source_notes(sources), *weather.notes])
    notes |= dict.fromkeys(note for one in known for note in one.notes)
    if study.couple:
        zones, unpaired = coupled_rooms(spaces, zones)
        notes |= dict.fromkeys(unpaired)
    variants.activate()
    skies = _skies(weather, study)
    ready = []
    for i, (space, zone, (systems, thermals)) in enumerate(zip(spaces, zones, states, strict=True)):
        steps = item(progress, "room", i + 1, len(spaces), zone.zone.name)
        room = ready_room(study, building, space, zone, systems, thermals, weather, skies, steps)
        ready.append(room)
        if room.radiant is None and study.trace.view_factors:
            notes[f"{zone.zone.name}: is not closed, its longwave goes through a mean star."] = None
    results = balances(study, ready, weather, progress)
    years = [
        RoomYear(
            room.zone.name,
            room.space.floor_area,
            hourly_table(result, room.state, room.daylight, weather, study.comfort),
            *year_summary(result, weather, study),
        )
        for room, result in zip(ready, results, strict=True)
    ]
    return years, tuple(notes)


def _room_states(
    study: StudyFile, space: Space, filled: Mapping[str, States], files: HeatFiles
) -> tuple[States, tuple[ThermalSystem, ...]]:
    """The systems by state of all windows of a room, and their thermal data."""
    if files.systems:
        return files.systems, files.thermals
    # a room without windows has those of another, which nothing asks for
    states = filled[space.windows[0].guid] if space.windows else next(iter(filled.values()))
    if any(filled[window.guid] is not states for window in space.windows):
        message = "its windows have different systems attached, which `cfs run` takes: give one"
        raise DataError(message, file=study.building, element=f"space {space.label}")
    try:
        study.check_states(len(states))
    except ValueError as error:
        raise DataError(str(error), file=study.building, element=f"space {space.label}") from error
    return states, tuple(checked_system(system, study.building) for system in states)


def balances(
    study: StudyFile, rooms: list[ReadyRoom], weather: Weather, progress: Progress
) -> list[ZoneResult]:
    """The rooms' years: together where the study couples them, else one by one."""
    outdoors, step_s = climate(weather), 60.0 * study.step_minutes
    if must_compile(advance):
        progress(COMPILING, 0.0)
    if study.couple:
        progress("heat balance", 0.0)
        links = door_links([r.space for r in rooms], study.air.door_m3_s)
        found = list(
            simulate_zones(
                [r.zone for r in rooms], outdoors, [r.solar for r in rooms], step_s=step_s,
                air_links=links,
            )
        )  # fmt: skip
    else:
        found = []
        for number, room in enumerate(rooms):
            progress("heat balance", number / len(rooms))
            found += simulate_zones([room.zone], outdoors, [room.solar], step_s=step_s)
    progress("heat balance", 1.0)
    person = study.comfort
    return [
        felt(result, room.radiant, person.mean_radiant, _floor(room.zone), person.air_speed)
        for room, result in zip(rooms, found, strict=True)
    ]


def _floor(zone: Zone) -> int:
    """The biggest of the surfaces that face up."""
    return int(np.argmax([-s.normal[2] * s.area for s in zone.surfaces]))


def rooms_of(study: StudyFile) -> tuple[Building, list[Space]]:
    """The building of a study and the rooms asked for."""
    if study.box is not None:
        building = box_building(study.box)
        return building, list(building.spaces)
    building = read_ifc(study.building, join=study.join)
    if study.couple:
        spaces = named_spaces(building, study.spaces, study.building)
        return building, shared_constructions(spaces)
    return building, chosen_spaces(building, study.spaces, study.building)


def _skies(weather: Weather, study: StudyFile) -> AnnualSky:
    subdivision = study.trace.sky_subdivision
    return annual_sky(weather, subdivision, sun=False, solar=True)


def ready_room(
    study: StudyFile,
    building: Building,
    space: Space,
    room: ThermalRoom,
    systems: Sequence[System],
    thermals: Sequence[ThermalSystem],
    weather: Weather,
    skies: AnnualSky,
    progress: Progress,
) -> ReadyRoom:
    """Trace a room in all its shading states, choose the state of every hour."""
    trace = study.trace
    omega = systems[0].solar.basis_in.projected_solid_angles()
    light = room_light(building, space, room, skies, omega, trace, progress)
    surfaces = len(room.zone.surfaces)
    suns = []
    for j, (system, thermal) in enumerate(zip(systems, thermals, strict=True)):
        steps = part(progress, j / len(systems), (j + 1) / len(systems), "gains")
        suns.append(state_solar(light, system, thermal, skies, surfaces, trace, steps))
    plane, eye = None, None
    lamps = study.gains.lighting_w_m2 > 0
    if space.windows and (study.control.rule == "glare" or lamps):
        plane, eye = illuminances(building, space, systems, skies, trace, progress)
    state = _states(study, space, light, weather, eye, len(systems))
    daylight = None if plane is None else plane[state, np.arange(len(state))]
    radiant = None
    if trace.view_factors:
        radiant = radiant_room(space, room, samples=trace.patch_samples, seed=trace.seed)
    zone = _zone(study, room, space, thermals, len(state), daylight)
    if radiant is not None:
        zone = replace(zone, view_factors=radiant.among)
    return ReadyRoom(space, zone, switched(suns, state), state, daylight, radiant)


def _states(
    study: StudyFile,
    space: Space,
    light: RoomLight,
    weather: Weather,
    eye: FloatArray | None,
    states: int,
) -> NDArray[np.int64]:
    """The shading state of every hour [H]."""
    control, hours = study.control, len(weather.times)
    if not space.windows:
        return always(0, hours)
    if control.rule == "schedule":
        return by_schedule(control.schedule, hours)
    brightest = light.irradiance.max(axis=1)
    if control.rule == "irradiance":
        closed = control.state or states - 1
        return by_irradiance(brightest, control.close_above, control.open_below, closed=closed)
    if control.rule == "glare":
        return by_glare(eye, control.limit_lx)
    if control.rule == "cut-off":
        frame = window_frame(space.windows[0].normal)
        local = sun_directions(weather) @ frame.T
        beam = weather.direct_normal * np.maximum(local[:, 2], 0.0)
        tilts = np.radians(control.slat_tilts_deg)
        return by_cut_off(local, beam, tilts, control.slat_width, control.slat_spacing)
    return always(control.state, hours)


def _zone(
    study: StudyFile,
    room: ThermalRoom,
    space: Space,
    thermals: Sequence[ThermalSystem],
    hours: int,
    daylight: FloatArray | None,
) -> Zone:
    """The room's zone with the study's states, gains, air and set points."""
    gains, air, loads = study.gains, study.air, study.loads
    present = work_hours(*gains.occupied, hours=hours)
    power = gains.equipment_w_m2 * space.floor_area + gains.persons * gains.person_w
    lamps = gains.lighting_w_m2 * space.floor_area * present
    if daylight is not None:
        lamps = lamps * dimmed_share(daylight, gains.lighting_target_lx)
    states = tuple(t.fenestration for t in thermals)
    windows = tuple(
        WindowElement(w.name, w.area, w.normal, states, w.glazing_height, height=w.height)
        for w in room.zone.windows
    )
    return Zone(
        room.zone.name,
        room.zone.volume,
        room.zone.surfaces,
        windows,
        infiltration_ach=air.infiltration_ach + air.night_ach * work_hours(*air.night, hours=hours),
        gains=split_gains(power * present, gains.radiant_share, (lamps, gains.radiant_share)),
        loads=loads.ideal(),
    )
