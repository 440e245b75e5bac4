r"""How far each method and glare metric lies from paths, in several rooms and systems.

    python -m tests.validation method_errors [--out errors.json] [--hours 4] [--size 96]
    python -m tests.validation method_errors --check [FILE]

The first makes the table that `cfs study --method auto` judges by (scenes/calibration/errors.json):
relative root mean square errors of DGP against full pictures by more paths and another seed, with
the same BSDF, for seven systems in three rooms.  The second leaves out each system in turn and
compares what the table says of it with what was measured.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from datetime import date
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import klems_of
from mitsuba_cfs.bsdf.generate import generate_tensor_tree
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.glare import metric_values
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import SkySeries, sky_series
from mitsuba_cfs.surfaces import Surfaces
from scenes.calibration.costs import GLARE
from scenes.calibration.errors import (
    FILE,
    LEAST,
    MeasuredCase,
    MeasuredErrors,
    Traits,
    hidden_sky,
    sun_in_view,
    system_traits,
)
from scenes.cost import room as box
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.validation.blind_room import blind_layer

REFERENCE_SAMPLES, REFERENCE_SEED = 48, 11  # paths of a pixel of the reference
BRIGHT = 8_000.0  # [lx] horizontal diffuse: hours below it are left out
SHINING = 5_000.0  # [lx] normal to the sun
SUNNY = 20_000.0  # [lx] the same, of hours that are to have the sun
WALL = (12.0, 8.0, 8.0)  # [m] width, height and distance of the building opposite
BARS = (0.05, 0.1, 0.2)  # errors that a user may ask for
TREE_TILT = 20.0  # [degrees]


def lobe(width_deg: float, transmittance: float) -> KlemsBsdf:
    """A film that scatters forwards: a Gaussian round the straight direction."""
    way = KLEMS_FULL.outgoing_directions() @ -KLEMS_FULL.incident_directions().T
    angle = np.degrees(np.arccos(np.clip(way, -1, 1)))
    block = np.exp(-0.5 * (angle / width_deg) ** 2)
    block *= transmittance / (KLEMS_FULL.projected_solid_angles() @ block)
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block)


def fabric(openness: float, diffuse: float) -> KlemsBsdf:
    """A fabric: holes that pass the beam, threads that scatter evenly."""
    omega = KLEMS_FULL.projected_solid_angles()
    holes = openness * np.cos(KLEMS_FULL.centres()[0]) ** 0.5
    block = np.full((KLEMS_FULL.size,) * 2, diffuse / np.pi) + np.diag(holes / omega)
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block)


def systems() -> dict[str, Bsdf]:
    """The systems by name."""
    tree, _ = generate_tensor_tree(blind_layer(TREE_TILT), 4, samples=1024, seed=1)
    return {
        "clear glazing": specular_klems(Glazing("clear", 0.78, 0.14, 0.14), KLEMS_FULL),
        "dark glazing": specular_klems(Glazing("dark", 0.06, 0.1, 0.1), KLEMS_FULL),
        "fabric, 4 % open": fabric(0.04, 0.08),
        "diffuser": fabric(0.0, 0.3),
        "film of 10 degrees": lobe(10.0, 0.5),
        "blind, Klems": read_bsdf_xml(VENETIAN_BLIND).band("Visible"),
        "blind, tensor tree": tree[0],
    }


def rooms(size: int) -> dict[str, tuple[DaylightScene, bool]]:
    """Rooms by name, and whether the sun stands in the window before the eye."""
    points, normals = np.array([[1.8, 2.0, 0.85]]), np.array([[0.0, 0.0, 1.0]])
    view = fisheye((1.8, 2.0, 1.2), (0.0, -1.0, 0.0), size)
    free = DaylightScene(box.room(), Surfaces.none(), box.window_groups(), points, normals, view)
    blocked = replace(free, exterior=opposite())
    return {"sun aside": (free, False), "sun in view": (free, True), "building opposite": (blocked, False)}


def opposite() -> Surfaces:
    """A wall of 40 % before the window."""
    width, height, distance = WALL
    x, y = box.WIDTH / 2, -distance
    a, b, c, d = ((x + i * width / 2, y, j * height) for i, j in ((1, 0), (-1, 0), (-1, 1), (1, 1)))
    triangles = np.array([[a, b, c], [a, c, d]])
    return Surfaces(triangles, np.full(2, 0.4), np.zeros(2, dtype=np.int64))


def sky(scene: DaylightScene, hours: int, in_view: bool) -> AnnualSky:
    """Bright hours spread over a year, with the sun in the window before the eye, or without.

    Of those without, half have the sun before the window.
    """
    weather = read_epw(WEATHER)
    series = sky_series(weather)
    bright = series.diffuse_horizontal > BRIGHT
    sunny = bright & (series.direct_normal > SUNNY)
    seen = with_sun(scene, series)
    before = sunny & ~seen & (series.sun[:, 1] < -0.3)
    sets = [(before, hours - hours // 2), (bright & ~seen & ~before, hours // 2)]
    chosen = []
    for which, count in [(seen, hours)] if in_view else sets:
        found = np.flatnonzero(which)
        chosen.append(found[np.linspace(0, len(found) - 1, count + 2)[1:-1].astype(int)])
    return annual_sky(weather, hours=np.sort(np.concatenate(chosen)))


def with_sun(scene: DaylightScene, series: SkySeries) -> NDArray[np.bool_]:
    """Which hours [H] are bright and have the sun in a window before the eye."""
    view, bright = scene.view, series.diffuse_horizontal > BRIGHT
    seen = np.zeros(len(bright), dtype=bool)
    for hour in np.flatnonzero(bright & (series.direct_normal > SUNNY)):
        sun = series.sun[hour : hour + 1]
        eye = scene.groups, view.position, view.direction
        seen[hour] = sun_in_view(*eye, sun, np.ones(1, dtype=bool)) > 0
    return seen


def method_matrices(method: str, scene: DaylightScene, sampling: Sampling | None = None) -> PhaseMatrices | None:
    """The matrices of a scene that a method takes for every glare metric."""
    if method == "point-in-time":
        return None
    return phase_matrices(scene, sampling, five_phase=method == "five-phase", needs=GLARE)


def measured(scene: DaylightScene, traced: dict, bsdf: Bsdf, lit: AnnualSky) -> dict[str, float]:
    """Relative root mean square error of DGP of each method and metric."""
    optics = [[BsdfOptics(klems_of(bsdf), bsdf)]]
    many = Sampling(picture_samples=REFERENCE_SAMPLES, seed=REFERENCE_SEED)
    judge = metric_values(PathLight(scene, optics, lit, many), "DGP")
    found = {}
    for method in METHODS:
        for metric in GLARE:
            light = daylight(scene, optics, lit, method=method, needs=(), matrices=traced[method])
            dgp = metric_values(light, metric)
            found[f"{method} {metric}"] = float(np.sqrt(np.mean((dgp / judge - 1) ** 2)))
    return found


def traits_of(scene: DaylightScene, bsdf: Bsdf, lit: AnnualSky) -> Traits:
    """The traits of a case."""
    view = scene.view
    shining = lit.illuminance > SHINING
    sun = sun_in_view(scene.groups, view.position, view.direction, lit.direction, shining)
    return Traits(*system_traits(bsdf), sun, hidden_sky(scene.groups, scene.exterior))


def made(hours: int, size: int, out: Path) -> MeasuredErrors:
    """Measure all cases; the file grows case by case, and those that it has are kept."""
    cases: list[MeasuredCase] = []
    if out.is_file():
        cases = list(MeasuredErrors.read(out).cases)
    known = {(case.room, case.system) for case in cases}
    filled = systems()
    for place, (scene, in_view) in rooms(size).items():
        lit = sky(scene, hours, in_view)
        traced = {method: method_matrices(method, scene) for method in METHODS}
        for name, bsdf in filled.items():
            if (place, name) in known:
                continue
            found = measured(scene, traced, bsdf, lit)
            cases.append(MeasuredCase(place, name, traits_of(scene, bsdf, lit), found))
            print(name, place, {k: round(v, 3) for k, v in found.items()}, file=sys.stderr)
            table = MeasuredErrors("python -m tests.validation method_errors", date.today().isoformat(), tuple(cases))
            out.write_text(json.dumps(asdict(table), indent=1) + "\n")
    return MeasuredErrors.read(out)


def held_out(table: MeasuredErrors) -> dict[str, list[float]]:
    """Predicted over measured error of each pair, by the table without the system in question."""
    ratios: dict[str, list[float]] = {}
    for case in table.cases:
        rest = replace(table, cases=tuple(c for c in table.cases if c.system != case.system))
        said = rest.expected(case.traits)
        for pair, error in case.errors.items():
            found = said[tuple(pair.rsplit(" ", 1))] / max(error, LEAST)
            ratios.setdefault(pair, []).append(found)
    return ratios


def broken_promises(table: MeasuredErrors) -> tuple[int, int]:
    """How often a held-out system is said to be within an error that it is not, and of how many."""
    broken = asked = 0
    for case in table.cases:
        rest = replace(table, cases=tuple(c for c in table.cases if c.system != case.system))
        for pair, said in rest.expected(case.traits).items():
            for bar in BARS:
                broken += said <= bar < case.errors[" ".join(pair)]
                asked += 1
    return broken, asked


def print_check(table: MeasuredErrors) -> None:
    """Print a line for each pair, and what `auto` would have taken."""
    print(f"{len(table.cases)} cases of {table.made} by {table.script}")
    broken, asked = broken_promises(table)
    bars = ", ".join(f"{100 * bar:.0f}" for bar in BARS)
    print(f"said to be within {bars} % and not so: {broken} of {asked}")
    ratios = held_out(table)
    print("| method, metric | measured, least to most [%] | predicted over measured: median | 80 % |")
    print("|---|---|---|---|")
    for pair, found in ratios.items():
        errors = 100 * np.array([case.errors[pair] for case in table.cases])
        low, high = np.quantile(found, [0.1, 0.9])
        print(
            f"| {pair} | {errors.min():.1f} to {errors.max():.1f} | {np.median(found):.2f} | {low:.2f} to {high:.2f} |"
        )


def main(
    *,
    out: Path = FILE,
    hours: int = 4,
    size: Annotated[int, "pixels of a side"] = 96,
    check: Annotated[bool, "read `out` instead of measuring"] = False,
) -> None:
    """Measure or check."""
    if not check:
        variants.activate()
        made(hours, size, out)
    print_check(MeasuredErrors.read(out))
