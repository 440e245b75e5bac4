"""Chapter 4's cases with the sun traced from sky to walls, as every study of rooms has it.

    python -m tests.validation energyplus_traced --reference DIR --epw DIR

The reference room of docs/tutorials/energyplus_room.toml, turned to each orientation, with the four
systems of the reference set by their BSDF and layers: daylight matrices, the sun on the facade and
what becomes of it indoors are traced, the window is ISO 15099 layer by layer.  EnergyPlus' hours
are the set's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import FenestrationSystem
from scenes.heat.box import box_building
from scenes.heat.study_file import StudyFile, read_study
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.room.zone import balances
from tests.validation.energyplus_cases import EPW_FILES, EnergyPlusCase, centre_operative, reference_case
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
    study: StudyFile, place: Place, orientation: str, system: FenestrationSystem, cache: MatrixCache | None
) -> EnergyPlusCase:
    """Our hours of a case, traced."""
    turned = study.box.model_copy(update={"facing_deg": float(ORIENTATIONS[orientation])})
    building = box_building(turned)
    (space,) = building.spaces

    inputs = room_inputs(
        building,
        space,
        in_all_windows(space, system),
        place.weather,
        study.options,
        operation=study,
        skies=place.skies,
        cache=cache,
    )
    room = operated_zone(inputs)
    step_s = study.options.heat_step_s
    (result,) = balances([room], place.weather, step_s, terrain=study.terrain)
    walls, window = result.surface_in_c, result.window_inner_c
    (floor,) = (k for k, one in enumerate(room.zone.surfaces) if one.normal[2] < -FLOOR)
    faces = np.column_stack([walls, window])
    return EnergyPlusCase(
        place.name,
        system.name,
        orientation,
        "traced",
        result.air_c,
        walls.mean(axis=1),
        window[:, 0],
        walls[:, floor],
        result.operative_c,
        centre_operative(result.air_c, faces, walls[:, floor]),
    )


def compare(
    reference: Path,
    epw: Path,
    climates: Sequence[str],
    orientations: Sequence[str],
    names: Sequence[str] = SYSTEMS,
    *,
    one_diffuse: bool = False,
) -> pd.DataFrame:
    """A row of errors for every case; one_diffuse: `sky_light = "hemispherical"`."""
    variants.activate()
    study, cache, rows = read_study(STUDY), MatrixCache.of_user(), []
    if one_diffuse:
        trace = study.trace.model_copy(update={"sky_light": "hemispherical"})
        study = study.model_copy(update={"trace": trace})
    systems = [traced_system(name, read_optics(reference, name)) for name in names]
    for name in climates:
        weather = read_epw(epw / EPW_FILES[name])
        options = study.options
        skies = skies_for(weather, options.sampling, cache, **options.sky)
        place = Place(name, weather, skies)
        hours = pd.read_parquet(reference / f"ep_{name}.parquet")
        tables = dict(list(hours.groupby(["cfs", "ori"], observed=True)))
        for orientation in orientations:
            for system in systems:
                theirs = reference_case(name, system.name, orientation, tables[(system.name, orientation)])
                ours = traced_case(study, place, orientation, system, cache)
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
    """Errors by system, by orientation and by climate; one_diffuse: as `compare`."""
    cases = compare(reference, epw, climates, orientations, systems, one_diffuse=one_diffuse)
    groups = (["system"], ["system", "orientation"], ["system", "climate"])
    return {" and ".join(by): pooled(cases, by) for by in groups}
