r"""The dissertation's Table 2 remade: phase methods against explicit slats, hour by hour.

    python -m tests.validation daylight_methods \
        --weather CITY.epw [--every 10] [--json FILE] [--series FIGURES_27_TO_30.png]

Room of Table 1 (3.65 x 4.60 x 3.00 m, to the south-west), six sensors in its middle line; double
glazing by the Roos model, alone and behind an exterior blind of curved slats at 5, 40 and 70
degrees.  The reference is the same room path-traced with the slats as geometry; the methods know
only BSDFs made from it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases, variants
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.methods.light import illuminance, illuminance_with_error
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE, is_up
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.kernels.scattering import Scattering, sun_scattering
from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
from mitsuba_cfs.trace.matrices.view import view_matrix
from mitsuba_cfs.trace.paths.point_in_time import daylight_coefficients, point_in_time
from mitsuba_cfs.trace.paths.scene import PathOptics, PathTracingScene, Sky, path_optics
from tests.validation.blind_room import TILTS, BlindRoom, blind_layer, empty, glass_klems, slats, test_room
from tests.validation.fine_basis import fine_basis
from tests.validation.glare_room import glazing, known_system, lit_hours, sunny_days

DIM = 50.0  # [lx] hours below this at the reference count no relative error
SUBDIVISION = 4
SAMPLING = Sampling(sensor_samples=262_144, patch_samples=32_768, subdivision=SUBDIVISION)
FINE = fine_basis(3)  # 1,321 patches
THRESHOLD = 300.0  # [lx] of daylight autonomy
DAYS = {"glass": (3, 25), "5 degrees": (4, 6), "40 degrees": (4, 1), "70 degrees": (6, 16)}
SHOWN = (
    "slats",
    "three-phase",
    "five-phase, Klems",
    "five-phase, tensor tree",
    "point in time, Klems",
    "point in time, tensor tree",
)
COEFFICIENT_PATHS = 65_536  # of a sensor in each of 16 batches


def chosen_hours(weather: Weather, every: int) -> AnnualSky:
    """The skies of all sunlit hours of every `every`-th day."""
    series = sky_series(weather)
    day = np.arange(len(weather.times)) // weather.per_day
    lit = (series.diffuse_horizontal > 100) & is_up(series.sun) & (day % every == every // 2)
    return annual_sky(weather, SUBDIVISION, hours=np.flatnonzero(lit))


def known_klems(tilt_deg: float | None, basis: KlemsBasis, samples: int) -> KlemsBsdf:
    """Matrices of the glazing, behind the blind where there is one."""
    glass = glass_klems(basis)
    if tilt_deg is None:
        return glass
    blind = generate_klems(blind_layer(tilt_deg), basis, samples=samples, seed=1).bsdf[0]
    return combine_layers([blind, glass]).bsdf


def by_phases(
    scene: BlindRoom, system: KlemsBsdf, ways: dict[str, Scattering], sky: AnnualSky
) -> tuple[dict[str, NDArray[np.float64]], float]:
    """Illuminance [S, H] by the three-phase and the five-phase method, and V's share of its error.

    Args: ways: what passes the sun in the five-phase method, by name.
    """
    room = DaylightScene(scene.interior, empty(), scene.groups, scene.points, scene.up)
    known, found = BsdfOptics(system), {}
    systems = [[MatrixOptics(known.transmission, way, reflection=known.reflection) for way in ways.values()]]
    three_phase = phase_light(phase_matrices(room, SAMPLING, five_phase=False), systems, sky)
    found["three-phase"] = illuminance(three_phase)
    light = phase_light(phase_matrices(room, SAMPLING), systems, sky)
    for number, name in enumerate(ways):
        found[f"five-phase, {name}"] = illuminance(light, np.full(len(sky.lit), number))
    return found, float(illuminance_with_error(three_phase)[1].max())


def by_fine_matrix(scene: BlindRoom, tilt_deg: float | None, sky: AnnualSky) -> NDArray[np.float64]:
    """Illuminance [S, H] by three phases with matrices of high resolution."""
    view = view_matrix(scene.interior, scene.groups, scene.points, scene.up, samples=16384, max_depth=32, basis=FINE)
    daylight = daylight_matrix(empty(), scene.groups, subdivision=SUBDIVISION, samples=512, max_depth=32, basis=FINE)
    T = known_klems(tilt_deg, FINE, 8192).transmission_matrix()
    return phases.three_phase(view.values, [T], daylight.values, sky.whole)


def by_coefficients(scene: BlindRoom, system: PathOptics, sky: AnnualSky) -> NDArray[np.float64]:
    """Illuminance [S, H] by two phases: daylight coefficients through the system's BSDF."""
    room = PathTracingScene(scene.interior, empty(), scene.groups, [system])
    coefficients = daylight_coefficients(
        room, scene.points, scene.up, subdivision=SUBDIVISION, samples=COEFFICIENT_PATHS
    )
    return coefficients.values @ sky.whole


def by_paths(
    scene: BlindRoom, exterior: Surfaces, system: PathOptics, sky: AnnualSky, samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance [S, H] by point-in-time paths, and its standard error."""
    room = PathTracingScene(scene.interior, exterior, scene.groups, [system])
    runs = []
    for h in range(len(sky.lit)):
        luminance = sky.illuminance[h] / SUN_SOLID_ANGLE
        now = Sky(sky.without_sun(h), sky.direction[h], luminance)
        runs.append(point_in_time(room, now, scene.points, scene.up, samples=samples, stopping=Stopping(batches=4)))
    return tuple(np.stack([getattr(r, name) for r in runs], axis=1) for name in ("values", "standard_error"))


def errors(found: NDArray, reference: NDArray) -> dict[str, float]:
    """Relative mean bias and root mean square error [%] of each sensor's hours, and of their mean.

    The mean of the six sensors is what the dissertation's figures 27 to 30 show.
    """
    bright = reference > DIM
    relative = found[bright] / reference[bright] - 1
    lit = reference.mean(axis=0) > DIM
    mean = found.mean(axis=0)[lit] / reference.mean(axis=0)[lit] - 1
    return {
        "rMBE": 100 * float(relative.mean()),
        "rRMSE": 100 * float(np.sqrt(np.mean(relative**2))),
        "rMBE of the sensors' mean": 100 * float(mean.mean()),
        "rRMSE of the sensors' mean": 100 * float(np.sqrt(np.mean(mean**2))),
        "rMBE of sums": 100 * float(found.sum() / reference.sum() - 1),
        "lowest [lx]": float(found.min()),
        "highest ratio of the sensors' mean": 1 + float(mean.max()),
        "hours above 1.05 [%]": 100 * float(np.mean(mean > 0.05)),
    }


def classified(found: NDArray, reference: NDArray) -> dict[str, float]:
    """Daylight autonomy as a test of two classes, the dissertation's 3.1.1.5 [%].

    Sensitivity: of a sensor's hours with 300 lx and more by the reference, those that the method
    has too; specificity: of the others, those that it has below; the same of the sensors' mean.
    """
    table = {}
    for name, ours, theirs in (
        ("", found, reference),
        (" of the sensors' mean", found.mean(axis=0), reference.mean(axis=0)),
    ):
        said, enough = ours >= THRESHOLD, theirs >= THRESHOLD
        for word, chosen, right in (("sensitivity", enough, said), ("specificity", ~enough, ~said)):
            share = 100 * float(right[chosen].mean()) if chosen.any() else None
            table[f"{word}{name} [%]"] = share
    return table


def one_case(scene: BlindRoom, sky: AnnualSky, tilt_deg: float | None, samples: int) -> dict:
    """All methods against the explicit geometry for one system."""
    exterior = empty() if tilt_deg is None else slats(scene.groups[0], tilt_deg)
    klems = known_klems(tilt_deg, KLEMS_FULL, 65536)
    ways, systems = {"Klems": sun_scattering(klems)}, {"Klems": path_optics(klems)}
    if tilt_deg is not None:
        tree = known_system(blind_layer(tilt_deg))
        ways["tensor tree"], systems["tensor tree"] = tree.scattering, tree.paths
    start = time.monotonic()
    reference, noise = by_paths(scene, exterior, glazing(), sky, samples)
    seconds = time.monotonic() - start
    found, view_noise = by_phases(scene, klems, ways, sky)
    found["three-phase, fine matrix"] = by_fine_matrix(scene, tilt_deg, sky)
    for name, system in systems.items():
        found[f"two-phase, {name}"] = by_coefficients(scene, system, sky)
        found[f"point in time, {name}"] = by_paths(scene, empty(), system, sky, samples)[0]
    return {
        "noise of the reference [%]": 100 * float(np.mean(noise / np.maximum(reference, DIM))),
        "noise of V, worst sensor [%]": 100 * view_noise,
        "seconds of the reference": round(seconds, 1),
        "hours": reference.shape[1],
        "series": {
            name: values.mean(axis=0).round(1).tolist() for name, values in {"slats": reference, **found}.items()
        },
        **{name: errors(values, reference) | classified(values, reference) for name, values in found.items()},
    }


def of_a_day(weather: Weather, month: int, day: int) -> tuple[AnnualSky, list[str]]:
    """The sunniest day within a fortnight of a date: its skies, and its hours."""
    of_day = sunny_days(weather, month, day, 1)
    hours = lit_hours(weather, of_day, 1)
    return annual_sky(weather, SUBDIVISION, hours=hours), [f"{t:%H:%M}" for t in weather.midpoints[hours]]


def write_series(results: dict, path: Path) -> None:
    """The sensors' mean over the hours of each system's day, as Figures 27 to 30 (PNG)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6.4), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplots(2, 2).ravel()
    for axes in places[len(results) :]:
        axes.remove()
    for axes, (name, result) in zip(places, results.items(), strict=False):
        for method, values in result["series"].items():
            if method in SHOWN:
                style = "ko-" if method == "slats" else "-"
                axes.plot(result["times"], values, style, label=method, markersize=3)
        axes.axhline(THRESHOLD, color="#999", linewidth=0.8)
        axes.set_title(name, fontsize=9)
        axes.set_ylabel("mean of six sensors [lx]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(fontsize=7)
    figure.savefig(path)


def main(
    *,
    weather: Path,
    every: Annotated[int, "days from one to the next"] = 10,
    samples: Annotated[int, "paths of a sensor in a batch"] = 8192,
    only: Annotated[Sequence[str], TILTS, "system, all by default"] = (),
    json_: Path | None = None,
    series: Annotated[Path | None, "Figures 27 to 30 of a day each, as a picture"] = None,
) -> None:
    """Run all systems and print the table."""
    variants.activate()
    weather = read_epw(weather)
    scene, results = test_room(), {}
    for name in only or TILTS:
        if series:
            sky, times = of_a_day(weather, *DAYS[name])
        else:
            sky, times = chosen_hours(weather, every), []
        results[name] = one_case(scene, sky, TILTS[name], samples) | {"times": times}
        print(name, json.dumps(results[name], indent=1), flush=True)
    if json_:
        json_.write_text(json.dumps(results, indent=1))
    if series:
        write_series(results, series)
