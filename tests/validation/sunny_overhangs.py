"""Sunny hours behind what stands before a window: three and five phases against paths.

    python -m tests.validation sunny_overhangs [--cases "overhang 2 m" ...] [--paths N]

The room, cases and sensors of `cut_groups`; 800 W/m2 from the sun, 100 W/m2 of sky, the sun at four
places.  Illuminance of the twelve sensors in the four hours over that by paths, lowest and highest,
and the share of them within 3 %; the spread of five phases over seeds and the error of the paths,
root mean squares; the processor time over that with the window in one part.  The error of three
phases in a sensor's sunny hours against paths, and as `sunny_hour_error` states it: root mean
square over the mean illuminance by three phases, mean and greatest of the sensors.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.methods.light import illuminance, illuminance_with_error
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.sun_by_patches import sunny_hour_error
from mitsuba_cfs.sky.annual import AnnualSky, given_sky
from mitsuba_cfs.surfaces import Surfaces
from tests.validation.cut_groups import BRIGHT, CASES, POINTS, UP, front, room, surfaces

SUNS = ((20, 0), (45, 10), (62, -25), (30, 50))  # altitude, azimuth from south to east [degrees]
SEEDS = 2


def sunny() -> AnnualSky:
    """The four hours."""
    altitude, azimuth = np.radians(np.array(SUNS, dtype=float)).T
    level = np.cos(altitude)
    suns = np.stack([level * np.sin(azimuth), -level * np.cos(azimuth), np.sin(altitude)], axis=1)
    return given_sky(suns, np.full(4, 800.0), np.full(4, 100.0), day_of_year=80)


def by_phases(
    scene: DaylightScene, glass: KlemsBsdf, *, five_phase: bool, parts: int = 0, seed: int = 0
) -> tuple[NDArray[np.float64], float, int]:
    """Illuminance [S, H], processor time [s] and number of parts."""
    start = time.process_time()
    sampling = Sampling(window_parts=parts, seed=seed)
    traced = phase_matrices(scene, sampling, five_phase=five_phase)
    values = illuminance(phase_light(traced, [[BsdfOptics(glass)]], sunny()))
    return values, time.process_time() - start, len(traced.parts.groups)


def by_paths(scene: DaylightScene, glass: KlemsBsdf, paths: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance [S, H] and its standard error."""
    values, errors = [], []
    optics, sampling = [[BsdfOptics(glass)]], Sampling(hour_samples=paths)
    for hour in range(len(SUNS)):
        one = PathLight(scene, optics, sunny().part([hour]), sampling)
        found, error = illuminance_with_error(one)
        values.append(found[:, 0])
        errors.append(error * found[:, 0])
    return np.stack(values, axis=1), np.stack(errors, axis=1)


def row(name: str, glass: KlemsBsdf, paths: int) -> str:
    """One line of the table."""
    interior, group = room()
    quads = CASES[name]
    outside = surfaces(quads + front(-15, 19, -4, 6, 0.4)) if quads else Surfaces.none()
    scene = DaylightScene(interior, outside, [group], POINTS, UP)
    expected, error = by_paths(scene, glass, paths)
    _, whole, _ = by_phases(scene, glass, five_phase=True, parts=1)
    found = [by_phases(scene, glass, five_phase=True, seed=seed) for seed in range(SEEDS)]
    traced = phase_matrices(scene, Sampling(), five_phase=False)
    light = phase_light(traced, [[BsdfOptics(glass)]], sunny())
    three = illuminance(light)
    stated = 100 * sunny_hour_error(light, None, three)
    measured = 100 * np.sqrt(np.mean((three - expected) ** 2, axis=1)) / three.mean(axis=1)
    apart = np.abs(stated - measured).max()
    bright = expected > BRIGHT
    values = np.stack([values for values, *_ in found])
    five = (values[0] / expected)[bright]
    off = np.abs(five - 1)
    noise = (values.std(axis=0, ddof=1) / expected)[bright]
    quotient = (three / expected)[bright]
    return (
        f"| {name} | {five.min():.3f} to {five.max():.3f} | {100 * np.mean(off <= 0.03):.0f} % | "
        f"{quotient.min():.2f} to {quotient.max():.2f} | "
        f"{measured.mean():.0f}, {measured.max():.0f} % | "
        f"{stated.mean():.0f}, {stated.max():.0f} %, {apart:.1f} points | "
        f"{100 * np.sqrt(np.mean(noise**2)):.1f} % | "
        f"{100 * np.sqrt(np.mean((error / expected)[bright] ** 2)):.1f} %, "
        f"{100 * (error / expected)[bright].max():.1f} % | {found[0][2]} | "
        f"{found[0][1] / whole:.1f} |"
    )


def main(
    *, cases: Annotated[Sequence[str], CASES] = tuple(CASES), paths: Annotated[int, "of a sensor in an hour"] = 131_072
) -> None:
    """Print the table."""
    glass = specular_klems(Glazing("double", 0.78, 0.14, 0.14), KLEMS_FULL)
    interior, group = room()
    compiled = DaylightScene(interior, surfaces(CASES["fins"]), [group], POINTS, UP)
    for parts in (1, 0):
        by_phases(compiled, glass, five_phase=True, parts=parts)
    print(
        "| before the window | 5-phase | within 3 % | 3-phase | its error | stated, largest "
        "difference | 5-phase's noise | paths' error, largest | parts | time, times |\n"
        f"{'|---' * 10}|"
    )
    for name in cases:
        print(row(name, glass, paths), flush=True)
