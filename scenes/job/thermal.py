"""Heat of a room: the sun on its windows and walls, temperatures of a year, adaptive comfort."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.to_thermal import ThermalRoom, thermal_room
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.absorption_matrix import absorption_matrix
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix, sky_irradiance_matrix
from mitsuba_cfs.trace.estimate import Stopping
from scenes.job.daylight import BATCHES, RoomScene, Skies
from scenes.job.inputs import System
from scenes.job.options import JobOptions
from scenes.results import ThermalResult
from thermal.balance import ZoneResult, simulate
from thermal.blackbox import Fenestration, LayerAbsorptances, layer_absorptances
from thermal.climate import Climate, Solar, sky_temperature, undisturbed_ground
from thermal.comfort import adaptive_comfort, hours_between, running_mean, summarise
from thermal.gvalue import thermal_data
from thermal.zone import Gains, work_hours

BANDS = {"within_90": "ASHRAE 55 90 %", "within_80": "ASHRAE 55 80 %"}
RADIANT_SHARE = 0.5  # of the heat of people and equipment
STEP_S = 600.0  # of the heat balance


@dataclass(frozen=True, slots=True)
class ThermalSystem:
    """A fenestration system as the heat balance needs it, and what had to be assumed."""

    fenestration: Fenestration
    absorptances: LayerAbsorptances  # [K]
    transmittance: NDArray[np.float64]  # [K] solar, direction to hemisphere
    reflectance: NDArray[np.float64]  # [K] from outside
    g_value: NDArray[np.float64]  # [K]
    back_reflectance: float  # diffuse, from the room
    back_absorptance: float  # diffuse, from the room
    notes: tuple[str, ...]


def thermal_system(system: System) -> ThermalSystem:
    """U, g and layer absorptances by direction of a system."""
    solar = system.solar
    tau = solar.direct_hemispherical(solar.transmission_front)
    rho = solar.direct_hemispherical(solar.reflection_front)
    rho = np.minimum(rho, 1.0 - tau)
    data = thermal_data(tau, rho, u_value=system.u_value, g_normal=system.g_value)
    g_value = data.g_value if system.g_by_patch is None else system.g_by_patch
    back_rho, back_tau = (
        _diffuse(solar, block) for block in (solar.reflection_back, solar.transmission_back)
    )
    return ThermalSystem(
        Fenestration(system.name, data.u_value),
        layer_absorptances(tau, rho, g_value, data.u_value, item=system.name),
        tau,
        rho,
        g_value,
        back_rho,
        max(1.0 - back_rho - back_tau, 0.0),
        data.assumptions,
    )


def _diffuse(solar: KlemsBsdf, block: NDArray[np.float64]) -> float:
    """Hemispherical value for diffuse light."""
    weight = solar.basis_in.projected_solid_angles()
    return float(weight @ solar.direct_hemispherical(block) / weight.sum())


def room_thermal(
    building: Building,
    space: Space,
    scene: RoomScene,
    system: System,
    thermal: ThermalSystem,
    skies: Skies,
    weather: Weather,
    options: JobOptions,
    progress: Progress,
) -> ThermalResult:
    """Free-floating temperatures of a year and adaptive comfort."""
    room = thermal_room(
        space,
        thermal.fenestration,
        infiltration_ach=options.infiltration_ach,
        gains=internal_gains(space, skies.hours, options),
    )
    solar, gains = _sun(
        building, space, scene, system, thermal, room, skies, options, part(progress, 0.0, 0.7)
    )
    result = simulate(room.zone, climate(weather), solar, step_s=STEP_S)
    progress("heat", 1.0)
    times = weather.midpoints
    comfort, summary = _comfort(result, weather, options)
    return ThermalResult(
        _temperatures(result, room, weather),
        pd.DataFrame(gains, index=times).rename_axis("time"),
        comfort,
        summary,
        {
            "u_value": thermal.fenestration.u_value,
            "g_value": float(thermal.g_value[0]),
            "solar_transmittance": float(thermal.transmittance[0]),
            "solar_reflectance": float(thermal.reflectance[0]),
            "visible_transmittance": float(
                system.visible.direct_hemispherical(system.visible.transmission_front)[0]
            ),
        },
    )


def internal_gains(space: Space, hours: int, options: JobOptions) -> Gains:
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


def _sun(
    building: Building,
    space: Space,
    scene: RoomScene,
    system: System,
    thermal: ThermalSystem,
    room: ThermalRoom,
    skies: Skies,
    options: JobOptions,
    progress: Progress,
) -> tuple[Solar, dict[str, NDArray[np.float64]]]:
    """Sun absorbed by window layers, room surfaces and facades, and its sums for the report."""
    exterior = exterior_surfaces(building, space, "solar")
    tracing = {"stopping": Stopping(batches=BATCHES), "seed": options.seed}
    samples = max(options.patch_samples // BATCHES, 1)
    daylight = daylight_matrix(
        exterior,
        scene.groups,
        subdivision=options.sky_subdivision,
        samples=samples,
        progress=part(progress, 0.0, 0.4, "heat"),
        **tracing,
    )
    absorbed = absorption_matrix(
        _gathered(interior_surfaces(space, "solar"), room.surface_of_face),
        scene.groups,
        window_reflectance=np.full(len(scene.groups), thermal.back_reflectance),
        samples=samples,
        progress=part(progress, 0.4, 0.7, "heat"),
        **tracing,
    ).values
    omega = system.solar.basis_in.projected_solid_angles()
    incident = phases.window_radiance(daylight.values, skies.solar)  # [G, K, L]
    incident *= omega[:, None]  # now irradiance by direction
    transmission = [system.solar.transmission_matrix() / omega] * len(scene.groups)
    entering = np.stack([t @ i for t, i in zip(transmission, incident, strict=True)])
    area = np.array([group.area for group in scene.groups])
    entering *= omega[:, None] * area[:, None, None]  # [G, K, L] flux into the room [W]
    taken = np.einsum("gkf,gkl->lf", absorbed, entering, optimize=True)  # [L, F + G]

    group = _group_of_window(space, scene)
    F = len(room.zone.surfaces)
    outer = np.einsum("k,gkl->lg", thermal.absorptances.outer, incident, optimize=True)
    inner = np.einsum("k,gkl->lg", thermal.absorptances.inner, incident, optimize=True)
    kept = thermal.back_absorptance / max(1.0 - thermal.back_reflectance, 1e-9)
    facade = _facade(exterior, room, skies, options, part(progress, 0.7, 1.0, "heat"))

    def year(values: NDArray) -> NDArray:
        return skies.whole_year(np.ascontiguousarray(values.T)).T

    solar = Solar(
        absorbed_outer=year(outer[:, group]),
        absorbed_inner=year(inner[:, group]),
        inside=year(taken[:, :F]),
        facade=facade,
        window_inside=year(kept * (taken[:, F:] / area)[:, group]),
    )
    sums = {
        "incident_w": year((incident.sum(axis=1).T @ area)[:, None])[:, 0],
        "transmitted_w": year(entering.sum(axis=(0, 1))[:, None])[:, 0],
        "absorbed_outer_w": year((outer @ area)[:, None])[:, 0],
        "absorbed_inner_w": year((inner @ area)[:, None])[:, 0],
        "absorbed_room_w": year(taken[:, :F].sum(axis=1)[:, None])[:, 0],
    }
    return solar, sums


def _gathered(surfaces: Surfaces, surface_of_face: NDArray[np.int64]) -> Surfaces:
    """The room's triangles numbered by the surfaces of the zone."""
    return Surfaces(surfaces.triangles, surfaces.reflectance, surface_of_face[surfaces.surface])


def _group_of_window(space: Space, scene: RoomScene) -> NDArray[np.int64]:
    """Group of each window of the space [W]."""
    return np.array(
        [
            next(
                g
                for g, group in enumerate(scene.groups)
                if any(np.array_equal(w.triangles, window.triangles) for w in group.windows)
            )
            for window in space.windows
        ]
    )


def _facade(
    exterior: Surfaces, room: ThermalRoom, skies: Skies, options: JobOptions, progress: Progress
) -> NDArray[np.float64]:
    """Irradiance on the outside of the room's surfaces [H, F] [W/m2], 0 of those indoors."""
    facade = np.zeros((skies.hours, len(room.zone.surfaces)))
    if len(room.outdoor):
        matrix = sky_irradiance_matrix(
            exterior,
            room.outdoor_points,
            room.outdoor_normals,
            subdivision=options.sky_subdivision,
            samples=max(options.patch_samples // BATCHES, 1),
            stopping=Stopping(batches=BATCHES),
            seed=options.seed,
            progress=progress,
        )
        facade[:, room.outdoor] = skies.whole_year(matrix.values @ skies.solar).T
    return facade


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
    result: ZoneResult, weather: Weather, options: JobOptions
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
