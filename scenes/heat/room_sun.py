"""Sun, daylight and eye of one room in every shading state, traced once for all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import sensor_grid, view_point
from bim.to_thermal import ThermalRoom
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs import phases
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_light import PhaseSystems
from mitsuba_cfs.methods.phase_scene import BATCHES, PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.absorption_matrix import absorption_matrix
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix, sky_irradiance_matrix
from mitsuba_cfs.trace.estimate import Stopping
from scenes.heat.study_file import TraceTable
from scenes.job.inputs import System
from scenes.job.thermal_system import ThermalSystem
from thermal.climate import Solar

FloatArray = NDArray[np.float64]
EYE_PIXELS = 64  # of the eye's view, of which only place and direction count


@dataclass(frozen=True, slots=True)
class RoomLight:
    """What does not depend on the shading state: light at the windows and at the facade."""

    groups: list[WindowGroup]
    group_of_window: NDArray[np.int64]  # [W]
    interior: Surfaces  # numbered by the surfaces of the zone
    incident: FloatArray  # [G, K, L] solar irradiance of the windows by direction [W/m2]
    facade: FloatArray  # [H, F] on the outside of the zone's surfaces [W/m2]
    irradiance: FloatArray  # [H, G] of the windows [W/m2]


def room_light(
    building: Building,
    space: Space,
    room: ThermalRoom,
    skies: AnnualSky,
    omega: FloatArray,
    trace: TraceTable,
    progress: Progress,
) -> RoomLight:
    """Trace the daylight matrix of a room's windows and the irradiance of its facades."""
    exterior = exterior_surfaces(building, space, "solar")
    groups = window_groups(space)
    options = _options(trace)
    incident = np.zeros((0, len(omega), skies.solar.shape[1]))
    if groups:
        daylight = daylight_matrix(
            exterior, groups, subdivision=trace.sky_subdivision,
            progress=part(progress, 0.0, 0.7, "sun"), **options,
        )  # fmt: skip
        incident = phases.window_radiance(daylight.values, skies.solar) * omega[:, None]
    facade = np.zeros((skies.hours, len(room.zone.surfaces)))
    if len(room.outdoor):
        matrix = sky_irradiance_matrix(
            exterior, room.outdoor_points, room.outdoor_normals,
            subdivision=trace.sky_subdivision, progress=part(progress, 0.7, 1.0, "sun"), **options,
        )  # fmt: skip
        facade[:, room.outdoor] = skies.whole_year(matrix.values @ skies.solar).T
    inside = interior_surfaces(space, "solar")
    interior = Surfaces(inside.triangles, inside.reflectance, room.surface_of_face[inside.surface])
    irradiance = skies.whole_year(incident.sum(axis=1)).T
    return RoomLight(groups, _groups(space, groups), interior, incident, facade, irradiance)


def state_solar(
    light: RoomLight,
    system: System,
    thermal: ThermalSystem,
    skies: AnnualSky,
    surfaces: int,
    trace: TraceTable,
    progress: Progress,
) -> Solar:
    """The sun's work in one shading state [H]."""
    if not light.groups:
        dark = np.zeros((skies.hours, 0))
        return Solar(dark, dark, np.zeros((skies.hours, surfaces)), light.facade)
    omega = system.solar.basis_in.projected_solid_angles()
    groups, group = light.groups, light.group_of_window
    back = np.full(len(groups), thermal.back_reflectance)
    absorbed = absorption_matrix(
        light.interior, groups, window_reflectance=back, progress=progress, **_options(trace)
    ).values
    area = np.array([g.area for g in groups])
    flux = system.solar.transmission_matrix() / omega  # [K, K] onto irradiance by direction
    entering = np.stack([flux @ i for i in light.incident]) * omega[:, None]
    entering *= area[:, None, None]
    taken = np.einsum("gkf,gkl->lf", absorbed, entering, optimize=True)
    outer, inner = (
        np.einsum("k,gkl->lg", a, light.incident, optimize=True)
        for a in (thermal.absorptances.outer, thermal.absorptances.inner)
    )
    kept = thermal.back_absorptance / max(1.0 - thermal.back_reflectance, 1e-9)

    def year(values: FloatArray) -> FloatArray:
        return skies.whole_year(np.ascontiguousarray(values.T)).T

    return Solar(
        absorbed_outer=year(outer[:, group]),
        absorbed_inner=year(inner[:, group]),
        inside=year(taken[:, :surfaces]),
        facade=light.facade,
        window_inside=year(kept * (taken[:, surfaces:] / area)[:, group]),
    )


def illuminances(
    building: Building,
    space: Space,
    systems: list[System],
    skies: AnnualSky,
    trace: TraceTable,
    progress: Progress,
) -> tuple[FloatArray, FloatArray]:
    """Mean illuminance of the work plane and that of the eye [J, H] [lx] in every state."""
    points, _ = sensor_grid(space, spacing=1.0, height=0.8, margin=0.5)
    position, direction = view_point(space)
    scene = DaylightScene(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        window_groups(space),
        points,
        np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        fisheye(position, direction, EYE_PIXELS),
    )
    traced = PhaseScene(
        scene,
        Sampling(
            sensor_samples=trace.sensor_samples,
            patch_samples=trace.patch_samples,
            subdivision=trace.sky_subdivision,
            seed=trace.seed,
        ),
        five_phase=False,
        cache=MatrixCache.of_user(),
        progress=part(progress, 0.0, 1.0, "daylight"),
    )
    states = [BsdfOptics(system.visible, system.fine) for system in systems]
    light = PhaseSystems(traced, [states] * len(scene.groups)).light(skies)
    each = [np.full(len(skies.lit), j) for j in range(len(systems))]
    plane = [light.illuminance(state).mean(axis=0) for state in each]
    eye = [light.eye(state) for state in each]
    return skies.whole_year(np.array(plane)), skies.whole_year(np.array(eye))


def _options(trace: TraceTable) -> dict:
    samples = max(trace.patch_samples // BATCHES, 1)
    return {
        "samples": samples,
        "stopping": Stopping(batches=BATCHES),
        "seed": trace.seed,
        "cache": MatrixCache.of_user(),
    }


def _groups(space: Space, groups: list[WindowGroup]) -> NDArray[np.int64]:
    """Group of each window of the space [W]."""
    return np.array(
        [
            next(
                g
                for g, group in enumerate(groups)
                if any(np.array_equal(w.triangles, window.triangles) for w in group.windows)
            )
            for window in space.windows
        ]
    )
