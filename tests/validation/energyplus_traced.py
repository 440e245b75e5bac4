"""Chapter 4's cases with the sun traced from sky to walls, as every study of rooms has it.

    python -m tests.validation energyplus_traced --reference DIR --epw DIR

The reference room of docs/tutorials/energyplus_room.toml, turned to each orientation, with the four
systems of the reference set by their BSDF and layers: daylight matrices, the sun on the facade and
what becomes of it indoors are traced, the window is ISO 15099 layer by layer.  EnergyPlus' hours
are the set's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import series_matrix, sky_series
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import FenestrationSystem
from scenes.fenestration.thermal_system import ThermalSystem, thermal_system
from scenes.heat.box import box_building
from scenes.heat.study_file import StudyFile, read_study
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.room.zone import RoomZone, balances
from tests.validation.energyplus_cases import (
    EPW_FILES,
    EnergyPlusCase,
    centre_operative,
    reference_case,
)
from tests.validation.energyplus_statistics import case_row, pooled
from tests.validation.energyplus_study import STUDY
from tests.validation.reference_room import ORIENTATIONS
from tests.validation.reference_systems import SYSTEMS, Optics, layers, read_optics
from thermal.closure import Closure

FloatArray = NDArray[np.float64]
FLOOR = 0.9  # z of a floor's normal, downwards
SEEN = 1e-3  # [rad] between the directions of a patch in both lists


@dataclass(frozen=True, slots=True)
class Place:
    """A climate and its skies."""

    name: str
    weather: Weather
    skies: AnnualSky
    sun: NDArray[np.floating]  # [P, L] the sun alone [W/m2/sr]


def traced_system(name: str, optics: Optics) -> FenestrationSystem:
    """A system of the reference set as a study has it: its BSDF, and its layers for U and g."""
    theta, phi = KLEMS_FULL.centres()
    omega = KLEMS_FULL.projected_solid_angles()
    even = np.ones((KLEMS_FULL.size, KLEMS_FULL.size)) / np.pi
    if optics.phi is None:
        table = AngularTable(optics.theta, optics.tau, optics.rho)
        tau = table.patch_means(KLEMS_FULL)
        rho = table.patch_means(KLEMS_FULL, optics.rho, 1.0)
        front = np.diag(tau / omega) if name == "dgu" else even * tau
    else:
        order = _patches(optics, theta, phi)
        rho = optics.rho[order]
        front = optics.scatter[np.ix_(order, order)] / omega[:, None]
    back_tau, back_rho = optics.back["tau_back"], optics.back["rho_back"]
    klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, front, even * back_tau, even * rho, even * back_rho)
    return FenestrationSystem(name, klems, klems, closure=Closure("layers", unit=layers(name)))


def _patches(optics: Optics, theta: FloatArray, phi: FloatArray) -> NDArray[np.int64]:
    """Where each patch of the Klems basis stands in the set's own list."""
    mine, theirs = (
        np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
        for t, p in ((theta, phi), (optics.theta, optics.phi))
    )
    angle = np.arccos(np.clip(mine @ theirs.T, -1.0, 1.0))
    if angle.min(axis=1).max() > SEEN:
        raise ValueError("the set's patches are not those of the Klems basis")
    return angle.argmin(axis=1)


def traced_case(
    study: StudyFile,
    place: Place,
    orientation: str,
    system: FenestrationSystem,
    cache: MatrixCache | None,
    *,
    one_diffuse: bool = False,
) -> EnergyPlusCase:
    """Our hours of a case, traced; one_diffuse: see `with_one_diffuse`."""
    turned = study.box.model_copy(update={"facing_deg": float(ORIENTATIONS[orientation])})
    building = box_building(turned)
    (space,) = building.spaces

    def under(solar: NDArray[np.floating]) -> RoomZone:
        room = room_inputs(
            building, space, in_all_windows(space, system), place.weather, study.options,
            operation=study, skies=replace(place.skies, solar=solar), cache=cache,
        )  # fmt: skip
        return operated_zone(room)

    whole = place.skies.solar
    room = under(whole)
    if one_diffuse:
        rest = under(np.maximum(whole - place.sun, 0.0))
        room = with_one_diffuse(room, under(place.sun), rest, thermal_system(system))
    step_s = study.options.heat_step_s
    (result,) = balances([room], place.weather, step_s, terrain=study.terrain)
    walls, window = result.surface_in_c, result.window_inner_c
    (floor,) = (k for k, one in enumerate(room.zone.surfaces) if one.normal[2] < -FLOOR)
    faces = np.column_stack([walls, window])
    return EnergyPlusCase(
        place.name, system.name, orientation, "traced", result.air_c, walls.mean(axis=1),
        window[:, 0], walls[:, floor], result.operative_c,
        centre_operative(result.air_c, faces, walls[:, floor]),
    )  # fmt: skip


def with_one_diffuse(
    room: RoomZone, beam: RoomZone, rest: RoomZone, system: ThermalSystem
) -> RoomZone:
    """A room whose windows pass and absorb light of sky and ground as EnergyPlus' do.

    One hemispherical value holds wherever it comes from; the beam keeps its angle.

    Args: beam, rest: the room under the sun alone, and without it.
    """
    omega = KLEMS_FULL.projected_solid_angles()
    falls, sun, sky = rest.gains["incident_w"], beam.solar, rest.solar

    def scaled(values: FloatArray, name: str, by_patch: FloatArray) -> FloatArray:
        own = rest.gains[name]
        share = np.divide(falls * (omega @ by_patch / omega.sum()), own, np.zeros_like(own),
                          where=own > 0)  # fmt: skip
        return values * share[:, None]

    outer = system.absorptances.outer
    inner = system.absorptances.inner + system.absorptances.air
    passed = ("transmitted_w", system.transmittance)
    solar = replace(
        room.solar,
        absorbed_outer=sun.absorbed_outer + scaled(sky.absorbed_outer, "absorbed_outer_w", outer),
        absorbed_inner=sun.absorbed_inner + scaled(sky.absorbed_inner, "absorbed_inner_w", inner),
        absorbed_air=sun.absorbed_air + scaled(sky.absorbed_air, "absorbed_inner_w", inner),
        inside=sun.inside + scaled(sky.inside, *passed),
        window_inside=sun.window_inside + scaled(sky.window_inside, *passed),
    )
    return replace(room, solar=solar)


def compare(
    reference: Path,
    epw: Path,
    climates: Sequence[str],
    orientations: Sequence[str],
    names: Sequence[str] = SYSTEMS,
    *,
    one_diffuse: bool = False,
) -> pd.DataFrame:
    """A row of errors for every case; one_diffuse: see `with_one_diffuse`."""
    variants.activate()
    study, cache, rows = read_study(STUDY), MatrixCache.of_user(), []
    systems = [traced_system(name, read_optics(reference, name)) for name in names]
    for name in climates:
        weather = read_epw(epw / EPW_FILES[name])
        options = study.options
        skies = skies_for(weather, options.sampling, cache, **options.sky)
        series = sky_series(weather, "solar")
        sun = series_matrix(series, skies.lit, options.sampling.subdivision, "sun")
        place = Place(name, weather, skies, sun.astype(np.float32))
        hours = pd.read_parquet(reference / f"ep_{name}.parquet")
        tables = dict(list(hours.groupby(["cfs", "ori"], observed=True)))
        for orientation in orientations:
            for system in systems:
                theirs = reference_case(
                    name, system.name, orientation, tables[(system.name, orientation)]
                )
                ours = traced_case(
                    study, place, orientation, system, cache, one_diffuse=one_diffuse
                )
                rows.append(case_row(ours, theirs))
    return pd.DataFrame(rows)


def main(
    *,
    reference: Path,
    epw: Path,
    climates: Sequence[str] = tuple(EPW_FILES),
    orientations: Sequence[str] = tuple(ORIENTATIONS),
    systems: Sequence[str] = SYSTEMS,
    one_diffuse: bool = False,
) -> dict[str, pd.DataFrame]:
    """Errors by system, by orientation and by climate; one_diffuse: see `with_one_diffuse`."""
    cases = compare(reference, epw, climates, orientations, systems, one_diffuse=one_diffuse)
    groups = (["system"], ["system", "orientation"], ["system", "climate"])
    return {" and ".join(by): pooled(cases, by) for by in groups}
