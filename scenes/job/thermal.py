"""Heat of a room: the sun on its windows and walls, temperatures of a year, adaptive comfort."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.to_thermal import ThermalRoom, thermal_room
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.phase_scene import BATCHES, PhaseScene
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.absorption_matrix import absorption_matrix
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix, sky_irradiance_matrix
from mitsuba_cfs.trace.estimate import Stopping
from scenes.job.inputs import System
from scenes.job.options import RoomOptions
from scenes.job.thermal_system import ThermalSystem, thermal_system
from scenes.job.windows import RoomWindows
from scenes.results import ThermalResult
from thermal.balance import ZoneResult, simulate
from thermal.climate import Climate, Solar, sky_temperature, undisturbed_ground
from thermal.comfort import adaptive_comfort, hours_between, running_mean, summarise
from thermal.control import switched
from thermal.kernel import advance
from thermal.records import must_compile
from thermal.zone import Gains, Zone, work_hours

BANDS = {"within_90": "ASHRAE 55 90 %", "within_80": "ASHRAE 55 80 %"}
COMPILING = "compiling the heat balance, once: about 10 s"
RADIANT_SHARE = 0.5  # of the heat of people and equipment


def room_thermal(
    building: Building,
    space: Space,
    windows: RoomWindows,
    traced: PhaseScene,
    state: NDArray[np.int64],
    skies: AnnualSky,
    weather: Weather,
    options: RoomOptions,
    progress: Progress,
    *,
    thermal_of: Callable[[System], ThermalSystem] | None = None,
    operate: Callable[[Zone], Zone] | None = None,
) -> tuple[ThermalResult, ZoneResult]:
    """Temperatures of a year and adaptive comfort, and the balance they come from.

    Args:
        traced: D of the visible band is used again where the solar reflectances are the same.
        state: [H] shading state of the room's windows.
        thermal_of: thermal data of a system; `thermal_system` by default.
        operate: gives the zone its gains, air and set points; those of the options by default.
    """
    thermal_of = thermal_of or thermal_system
    thermals = [[thermal_of(s) for s in states] for states in windows.systems]
    first = thermals[windows.group[0]][0]
    room = thermal_room(
        space,
        first.fenestration,
        infiltration_ach=options.infiltration_ach,
        gains=internal_gains(space, skies.hours, options),
    )
    zone = with_states(room.zone, [thermals[g] for g in windows.group])
    zone = zone if operate is None else operate(zone)
    sun = room_sun(building, space, traced, skies, room, part(progress, 0.0, 0.8, "heat"))
    suns = [solar_of_state(sun, windows, thermals, j, skies) for j in range(windows.states)]
    solar = switched([s for s, _ in suns], state)
    gains = {
        name: np.stack([sums[name] for _, sums in suns])[state, np.arange(len(state))]
        for name in suns[0][1]
    }
    if must_compile(advance):
        progress(COMPILING, 0.0)
    result = simulate(zone, climate(weather), per_window(solar, zone), step_s=options.heat_step_s)
    progress("heat", 1.0)
    times = weather.midpoints
    comfort, summary = _comfort(result, weather, options)
    found = ThermalResult(
        _temperatures(result, room, weather),
        pd.DataFrame(gains, index=times).rename_axis("time"),
        comfort,
        summary,
        tuple(fenestration_table(windows, thermals)),
    )
    return found, result


def with_states(zone: Zone, thermals: Sequence[Sequence[ThermalSystem]]) -> Zone:
    """The zone whose windows W have their fenestration in every state."""
    windows = tuple(
        replace(window, states=tuple(t.fenestration for t in states))
        for window, states in zip(zone.windows, thermals, strict=True)
    )
    return replace(zone, windows=windows)


def per_window(solar: Solar, zone: Zone) -> Solar:
    """The sun with the state of each window: one with fewer states ends with its last."""
    most = np.array([len(window.states) - 1 for window in zone.windows])
    return replace(solar, state=np.minimum(solar.state, most))


def fenestration_table(
    windows: RoomWindows, thermals: Sequence[Sequence[ThermalSystem]]
) -> Iterator[dict[str, float | str]]:
    """What the windows are, group by group and state by state, at normal incidence."""
    seen = set()
    for states, heats in zip(windows.systems, thermals, strict=True):
        for system, heat in zip(states, heats, strict=True):
            if id(system) in seen:
                continue
            seen.add(id(system))
            visible = system.visible
            yield {
                "system": system.name,
                "source": system.source,
                "u_value": heat.fenestration.u_value,
                "g_value": float(heat.g_value[0]),
                "solar_transmittance": float(heat.transmittance[0]),
                "solar_reflectance": float(heat.reflectance[0]),
                "visible_transmittance": float(
                    visible.direct_hemispherical(visible.transmission_front)[0]
                ),
            }


def internal_gains(space: Space, hours: int, options: RoomOptions) -> Gains:
    """Heat of people and equipment during the occupied hours."""
    power = space.floor_area * (
        options.equipment_w_m2 + options.person_w / options.floor_per_person
    )
    present = work_hours(*options.occupied, hours=hours)
    return Gains((1 - RADIANT_SHARE) * power * present, RADIANT_SHARE * power * present)


def climate(weather: Weather) -> Climate:
    """Outdoor conditions of the heat balance."""
    return Climate(
        outdoor_c=weather.dry_bulb_c,
        sky_c=sky_temperature(weather.horizontal_infrared),
        wind_speed=weather.wind_speed,
        wind_direction_deg=np.mod(weather.wind_direction_deg, 360.0),
        ground_c=undisturbed_ground(weather.dry_bulb_c),
        pressure=weather.pressure_pa,
    )


@dataclass(frozen=True, slots=True)
class RoomSun:
    """The sun outside a room and what its surfaces do with it, whatever fills the windows."""

    incident: NDArray[np.float64]  # [G, K, L] irradiance by direction [W/m2]
    facade: NDArray[np.float64]  # [H, F] on the outside of the zone's surfaces [W/m2]
    absorbed: Callable[[NDArray[np.float64]], NDArray[np.float64]]  # see `room_sun`


def room_sun(
    building: Building,
    space: Space,
    traced: PhaseScene,
    skies: AnnualSky,
    room: ThermalRoom,
    progress: Progress,
) -> RoomSun:
    """Trace what the solar gains of a room need.

    `absorbed` of the result gives for the windows' diffuse reflectance from the room [G] where a
    unit of flux of each window patch is absorbed [G, K, F + G].
    """
    exterior = exterior_surfaces(building, space, "solar")
    chosen, groups, daylight = traced.sampling, traced.scene.groups, None
    tracing = {
        "samples": max(chosen.patch_samples // BATCHES, 1),
        "stopping": Stopping(batches=BATCHES),
        "seed": chosen.seed,
        "cache": traced.cache,
    }
    if np.array_equal(exterior.reflectance, traced.scene.exterior.reflectance):
        daylight = traced.daylight
    else:
        daylight = daylight_matrix(
            exterior,
            groups,
            subdivision=chosen.subdivision,
            progress=part(progress, 0.0, 0.4),
            **tracing,
        )
    omega = KLEMS_FULL.projected_solid_angles()
    incident = phases.window_radiance(daylight.values, skies.solar) * omega[:, None]
    facade = np.zeros((skies.hours, len(room.zone.surfaces)))
    if len(room.outdoor):
        matrix = sky_irradiance_matrix(
            exterior,
            room.outdoor_points,
            room.outdoor_normals,
            subdivision=chosen.subdivision,
            progress=part(progress, 0.4, 0.6),
            **tracing,
        )
        facade[:, room.outdoor] = skies.whole_year(matrix.values @ skies.solar).T
    interior = _gathered(interior_surfaces(space, "solar"), room.surface_of_face)
    known: dict[bytes, NDArray[np.float64]] = {}

    def absorbed(reflectance: NDArray[np.float64]) -> NDArray[np.float64]:
        key = reflectance.tobytes()
        if key not in known:
            known[key] = absorption_matrix(
                interior,
                groups,
                window_reflectance=reflectance,
                progress=part(progress, 0.6, 1.0),
                **tracing,
            ).values
        return known[key]

    return RoomSun(incident, facade, absorbed)


def solar_of_state(
    sun: RoomSun,
    windows: RoomWindows,
    thermals: Sequence[Sequence[ThermalSystem]],
    state: int,
    skies: AnnualSky,
) -> tuple[Solar, dict[str, NDArray[np.float64]]]:
    """Sun absorbed by window layers, room surfaces and facades in one state, and its sums [H]."""
    group = windows.group
    heats = [states[min(state, len(states) - 1)] for states in thermals]
    omega = KLEMS_FULL.projected_solid_angles()
    T = windows.of_state(state, lambda system: system.solar.transmission_matrix() / omega)
    entering = np.stack([t @ i for t, i in zip(T, sun.incident, strict=True)])
    area = np.array([g.area for g in windows.groups])
    entering *= omega[:, None] * area[:, None, None]  # [G, K, L] flux into the room [W]
    back = np.array([heat.back_reflectance for heat in heats])
    taken = np.einsum("gkf,gkl->lf", sun.absorbed(back), entering, optimize=True)  # [L, F + G]
    F = sun.facade.shape[1]
    outer, inner = (
        np.einsum("gk,gkl->lg", np.stack([part(h) for h in heats]), sun.incident, optimize=True)
        for part in (lambda h: h.absorptances.outer, lambda h: h.absorptances.inner)
    )
    kept = np.array([h.back_absorptance / max(1.0 - h.back_reflectance, 1e-9) for h in heats])

    def year(values: NDArray) -> NDArray:
        return skies.whole_year(np.ascontiguousarray(values.T)).T

    solar = Solar(
        absorbed_outer=year(outer[:, group]),
        absorbed_inner=year(inner[:, group]),
        inside=year(taken[:, :F]),
        facade=sun.facade,
        window_inside=year((kept * taken[:, F:] / area)[:, group]),
    )
    sums = {
        "incident_w": year((sun.incident.sum(axis=1).T @ area)[:, None])[:, 0],
        "transmitted_w": year(entering.sum(axis=(0, 1))[:, None])[:, 0],
        "absorbed_outer_w": year((outer @ area)[:, None])[:, 0],
        "absorbed_inner_w": year((inner @ area)[:, None])[:, 0],
        "absorbed_room_w": year(taken[:, :F].sum(axis=1)[:, None])[:, 0],
    }
    return solar, sums


def _gathered(surfaces: Surfaces, surface_of_face: NDArray[np.int64]) -> Surfaces:
    """The room's triangles numbered by the surfaces of the zone."""
    return Surfaces(surfaces.triangles, surfaces.reflectance, surface_of_face[surfaces.surface])


def _temperatures(result: ZoneResult, room: ThermalRoom, weather: Weather) -> pd.DataFrame:
    """Table of the year's temperatures [degC]."""
    columns = {
        "outdoor_c": weather.dry_bulb_c,
        "air_c": result.air_c,
        "mrt_c": result.mrt_c,
        "operative_c": result.operative_c,
    }
    for i, surface in enumerate(room.zone.surfaces):
        columns[f"{surface.name} ({surface.outside})_c"] = result.surface_in_c[:, i]
    for i, window in enumerate(room.zone.windows):
        columns[f"window {window.name} inside_c"] = result.window_inner_c[:, i]
        columns[f"window {window.name} outside_c"] = result.window_outer_c[:, i]
    return pd.DataFrame(columns, index=weather.midpoints).rename_axis("time")


def _comfort(
    result: ZoneResult, weather: Weather, options: RoomOptions
) -> tuple[pd.DataFrame, dict[str, float]]:
    """Adaptive comfort (ASHRAE 55) of every hour, and its shares of the occupied ones."""
    mean = running_mean(weather.dry_bulb_c)
    occupied = hours_between(*options.occupied, hours=len(mean))
    table = {"occupied": occupied, "running_mean_c": mean}
    summary: dict[str, float] = {}
    for name, band in BANDS.items():
        comfort = adaptive_comfort(result.operative_c, mean, band)
        table.setdefault("comfort_c", (comfort.low_c + comfort.high_c) / 2)
        table.setdefault("applicable", comfort.applicable)
        table[name] = comfort.comfortable
        counted = summarise(comfort, occupied, weather.midpoints.month.to_numpy())
        summary[name] = 100.0 * counted.comfortable / counted.hours
    summary["too_warm_hours"] = float(counted.too_warm)
    summary["too_cold_hours"] = float(counted.too_cold)
    summary["outside_the_model_hours"] = float(counted.not_applicable)
    frame = pd.DataFrame(table, index=weather.midpoints).rename_axis("time")
    return frame, summary
