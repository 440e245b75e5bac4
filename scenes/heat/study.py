"""`cfs thermal`: the year of every room of a study, from its file to tables."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Construction, MaterialLayer, Space
from bim.read_ifc import read_ifc
from bim.shoebox import WindowRectangle, shoebox
from bim.to_thermal import ThermalRoom, thermal_room
from mitsuba_cfs import variants
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.matrix import sky_matrix, sun_up
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.heat.room_sun import RoomLight, illuminances, room_light, state_solar
from scenes.heat.study_file import BoxTable, ComfortTable, StudyFile, SystemTable
from scenes.job.daylight import Skies
from scenes.job.inputs import System, chosen_spaces, read_system, read_weather
from scenes.job.thermal import ThermalSystem, climate, thermal_system
from thermal.balance import ZoneResult, simulate
from thermal.blackbox import (
    Fenestration,
    layer_absorptances,
    linear_u,
    with_realised_films,
)
from thermal.climate import Solar
from thermal.comfort import (
    ADAPTIVE_BANDS,
    adaptive_comfort,
    hours_between,
    pmv_ppd,
    running_mean,
    running_mean_en16798,
    standard_effective_temperature,
    summarise,
)
from thermal.control import (
    always,
    by_cut_off,
    by_glare,
    by_irradiance,
    by_schedule,
    switched,
)
from thermal.gains import dimmed_share, split_gains
from thermal.zone import IdealLoads, WindowElement, Zone, work_hours

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RoomYear:
    """One room's year."""

    name: str
    floor_area: float  # [m2]
    hours: pd.DataFrame  # temperatures, loads, state, heat flows by hour
    summary: dict[str, float]
    months: pd.DataFrame  # discomfort in the occupied hours, by band and month


def run_study(study: StudyFile, progress: Progress) -> tuple[list[RoomYear], tuple[str, ...]]:
    """The rooms of a study, and what had to be assumed."""
    weather = read_weather(study.weather)
    systems = [read_system(s.bsdf, u_value=s.u_value, g_value=s.g_value) for s in study.system]
    thermals = [state_of(s, t) for s, t in zip(systems, study.system, strict=True)]
    building, spaces = rooms_of(study)
    variants.activate()
    skies = _skies(weather, study)
    rooms = []
    for i, space in enumerate(spaces):
        share = part(progress, i / len(spaces), (i + 1) / len(spaces))
        rooms.append(_room_year(study, building, space, systems, thermals, weather, skies, share))
    notes = {note: None for t in (*systems, *thermals) for note in t.notes}
    return rooms, tuple(notes)


def state_of(system: System, table: SystemTable) -> ThermalSystem:
    """A shading state's thermal data with the closure that its table asks for."""
    plain = thermal_system(system)
    fenestration = plain.fenestration
    if table.u_model == "linear":
        fenestration = replace_resistance(fenestration)
    inner, outer = table.realised_inner_resistance, table.realised_outer_resistance
    if inner is None and outer is None:
        return replace(plain, fenestration=fenestration)
    closed = with_realised_films(fenestration, r_inner_realised=inner, r_outer_realised=outer)
    absorptances = layer_absorptances(
        plain.transmittance, plain.reflectance, plain.g_value, closed.u_value,
        r_outer=closed.r_outer, r_inner=closed.r_inner, item=system.name,
    )  # fmt: skip
    return replace(plain, fenestration=closed, absorptances=absorptances)


def replace_resistance(fenestration: Fenestration) -> Fenestration:
    """The fenestration with U linear in the mean temperature of its layers."""
    return Fenestration(
        fenestration.name,
        fenestration.u_value,
        fenestration.r_outer,
        fenestration.r_inner,
        linear_u(fenestration.u_value),
        emissivity_in=fenestration.emissivity_in,
        emissivity_out=fenestration.emissivity_out,
    )


def rooms_of(study: StudyFile) -> tuple[Building, list[Space]]:
    """The building of a study and the rooms asked for."""
    if study.box is not None:
        building = box_building(study.box)
        return building, list(building.spaces)
    building = read_ifc(study.building)
    return building, chosen_spaces(building, study.spaces, study.building)


def box_building(box: BoxTable) -> Building:
    """The box of a study as a building."""
    constructions = {
        side: Construction(
            f"{side} of the study",
            tuple(MaterialLayer(**layer.model_dump()) for layer in layers),
            "study file",
        )
        for side, layers in box.construction.items()
    }
    return shoebox(
        box.width,
        box.depth,
        box.height,
        windows=[WindowRectangle(**w.model_dump()) for w in box.window],
        facing_deg=box.facing_deg,
        recess=box.recess,
        reflectance=box.reflectance or None,
        adjacency=box.adjacency or None,
        constructions=constructions or None,
    )


def _skies(weather: Weather, study: StudyFile) -> Skies:
    subdivision = study.trace.sky_subdivision
    visible, solar = (
        sky_matrix(weather, subdivision, band, sun_up_only=True, dtype=np.float32)
        for band in ("visible", "solar")
    )
    return Skies(visible, solar, np.flatnonzero(sun_up(weather)), len(weather.times))


def _room_year(
    study: StudyFile,
    building: Building,
    space: Space,
    systems: list[System],
    thermals: list[ThermalSystem],
    weather: Weather,
    skies: Skies,
    progress: Progress,
) -> RoomYear:
    label = space.name or space.guid
    room = thermal_room(space, thermals[0].fenestration)
    omega = systems[0].solar.basis_in.projected_solid_angles()
    light = room_light(
        building, space, room, skies, omega, study.trace, part(progress, 0.0, 0.4, label)
    )
    surfaces = len(room.zone.surfaces)
    suns = []
    for j, (system, thermal) in enumerate(zip(systems, thermals, strict=True)):
        steps = part(progress, 0.4 + 0.4 * j / len(systems), 0.4 + 0.4 * (j + 1) / len(systems))
        suns.append(state_solar(light, system, thermal, skies, surfaces, study.trace, steps))
    plane, eye = None, None
    if study.control.rule == "glare" or study.gains.lighting_w_m2 > 0:
        plane, eye = illuminances(
            building, space, systems, skies, study.trace, part(progress, 0.8, 1.0, label)
        )
    state = _states(study, space, light, weather, eye)
    daylight = None if plane is None else plane[state, np.arange(len(state))]
    zone = _zone(study, room, space, thermals, daylight)
    solar: Solar = switched(suns, state)
    result = simulate(zone, climate(weather), solar, step_s=60.0 * study.step_minutes)
    progress(label, 1.0)
    return RoomYear(
        label,
        space.floor_area,
        _hours(result, solar, state, daylight, weather, study.comfort),
        *_summary(result, weather, study),
    )


def _states(
    study: StudyFile, space: Space, light: RoomLight, weather: Weather, eye: FloatArray | None
) -> NDArray[np.int64]:
    """The shading state of every hour [H]."""
    control, hours = study.control, len(weather.times)
    if control.rule == "schedule":
        return by_schedule(control.schedule, hours)
    brightest = light.irradiance.max(axis=1)
    if control.rule == "irradiance":
        closed = control.state or len(study.system) - 1
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
    thermals: list[ThermalSystem],
    daylight: FloatArray | None,
) -> Zone:
    """The room's zone with the study's states, gains, air and set points."""
    gains, air, loads = study.gains, study.air, study.loads
    hours = 8760 if daylight is None else len(daylight)
    present = work_hours(*gains.occupied, hours=hours)
    power = gains.equipment_w_m2 * space.floor_area + gains.persons * gains.person_w
    lamps = np.zeros(hours)
    if gains.lighting_w_m2 > 0 and daylight is not None:
        lamps = gains.lighting_w_m2 * space.floor_area * present
        lamps = lamps * dimmed_share(daylight, gains.lighting_target_lx)
    states = tuple(t.fenestration for t in thermals)
    windows = tuple(
        WindowElement(w.name, w.area, w.normal, states, w.glazing_height, height=w.height)
        for w in room.zone.windows
    )
    infinity = float("inf")
    return Zone(
        room.zone.name,
        room.zone.volume,
        room.zone.surfaces,
        windows,
        infiltration_ach=air.infiltration_ach + air.night_ach * work_hours(*air.night, hours=hours),
        gains=split_gains(power * present, gains.radiant_share, (lamps, gains.radiant_share)),
        loads=IdealLoads(
            -infinity if loads.heating_c is None else loads.heating_c,
            infinity if loads.cooling_c is None else loads.cooling_c,
            loads.heating_limit_w or infinity,
            loads.cooling_limit_w or infinity,
        ),
    )


def _hours(
    result: ZoneResult,
    solar: Solar,
    state: NDArray[np.int64],
    daylight: FloatArray | None,
    weather: Weather,
    person: ComfortTable,
) -> pd.DataFrame:
    about = person.model_dump()
    pmv, ppd = pmv_ppd(result.air_c, result.mrt_c, **about)
    table = {
        "outdoor_c": weather.dry_bulb_c,
        "air_c": result.air_c,
        "mrt_c": result.mrt_c,
        "operative_c": result.operative_c,
        "pmv": pmv,
        "ppd": ppd,
        "set_c": standard_effective_temperature(result.air_c, result.mrt_c, **about),
        "heating_w": result.heating,
        "cooling_w": result.cooling,
        "shading_state": state,
    }
    if daylight is not None:
        table["daylight_lx"] = daylight
    for i in range(result.window_inner_c.shape[1]):
        table[f"window_{i + 1}_inside_c"] = result.window_inner_c[:, i]
        table[f"window_{i + 1}_outside_c"] = result.window_outer_c[:, i]
    for name, flow in result.heat_flow.items():
        table[f"{name.replace(' ', '_')}_w"] = flow
    return pd.DataFrame(table, index=weather.midpoints).rename_axis("time")


def _summary(
    result: ZoneResult, weather: Weather, study: StudyFile
) -> tuple[dict[str, float], pd.DataFrame]:
    occupied = hours_between(*study.gains.occupied, hours=len(result.air_c))
    month = weather.midpoints.month.to_numpy()
    found = {
        "heating_kwh": result.heating.sum() / 1e3,
        "cooling_kwh": result.cooling.sum() / 1e3,
        "peak_heating_w": result.heating.max(),
        "peak_cooling_w": result.cooling.max(),
        "operative_min_c": result.operative_c.min(),
        "operative_max_c": result.operative_c.max(),
    }
    means = {
        "ASHRAE": running_mean(weather.dry_bulb_c),
        "EN": running_mean_en16798(weather.dry_bulb_c),
    }
    months = {}
    for band in ADAPTIVE_BANDS:
        comfort = adaptive_comfort(result.operative_c, means[band.split()[0]], band)
        counted = summarise(comfort, occupied, month)
        found[f"comfortable_h {band}"] = counted.comfortable
        months[f"{band} [h]"] = counted.discomfort_by_month
        found[f"degree_hours_warm {band}"] = counted.degree_hours_warm
        found[f"degree_hours_cold {band}"] = counted.degree_hours_cold
    table = pd.DataFrame(months, index=pd.RangeIndex(1, 13, name="month"))
    return {key: float(value) for key, value in found.items()}, table
