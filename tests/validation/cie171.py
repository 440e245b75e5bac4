r"""CIE 171:2006, tests 5.9 to 5.14: every method against an independent quadrature.

    python -m tests.validation cie171 [--figures FILE.tsv] [--tests 5.9 5.11] \
        [--methods paths five-phase] [--glass klems exact] [--json FILE]

A black room of 4 x 4 x 3 m under five standard skies: roof and facade openings, with and without
a pane of 6 mm, and a facade opening under a shelf or opposite a wall.  Judge is
`cie171_quadrature`, which has neither patches nor paths; `--figures` gives what the report's own
figures deviate from it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.glazing import Pane, pane_values, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import daylight, illuminance
from mitsuba_cfs.methods.optics import AngularOptics, BsdfOptics, SystemOptics
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.paths.point_in_time import daylight_coefficients
from mitsuba_cfs.trace.paths.scene import PathTracingScene
from tests.validation.cie171_cases import GLASS, SKIES, Case, cases, cie_sky, reported
from tests.validation.cie171_quadrature import INDEX, Array

METHODS = {"paths": "point-in-time", "two-phase": "two-phase", "three-phase": "three-phase", "five-phase": "five-phase"}
SAMPLING = Sampling(sensor_samples=1 << 17, patch_samples=1 << 13, hour_samples=1 << 20)
BATCHES = 4  # of two-phase coefficients
MORE = 2  # paths of those, for each of an hour's: all skies share them
STEPS = 513  # of the exact pane, in cosine


def pane() -> Pane:
    """The 6 mm pane with the reflectance that its index gives."""
    r = ((INDEX - 1) / (INDEX + 1)) ** 2
    root = np.sqrt((1 - r) ** 4 + 4 * r**2 * GLASS**2)
    passed = (root - (1 - r) ** 2) / (2 * r**2 * GLASS)
    rho = float(r + r * GLASS * passed)
    return Pane("6 mm clear", GLASS, rho, rho)


def optics(case: Case, glass: str) -> SystemOptics:
    """What fills the opening: nothing, or the pane as Klems matrices or by its exact function."""
    if not case.glass:
        return AngularOptics((1.0, 1.0))
    if glass == "klems":
        return BsdfOptics(specular_klems(pane(), KLEMS_FULL))
    tau, _, _ = pane_values(pane(), np.arccos(np.linspace(0, 1, STEPS)))
    return AngularOptics(tau)


def computed(case: Case, method: str, glass: str, sampling: Sampling = SAMPLING) -> Array:
    """Illuminance [S, 5] of the sensors in per cent of the ground's under each sky."""
    sky = cie_sky(sampling.subdivision)
    group, filled = case.group(), optics(case, glass)
    if method == "two-phase":
        room = PathTracingScene(Surfaces.none(), case.exterior(), [group], [filled.paths])
        found = daylight_coefficients(
            room,
            case.points,
            case.normals,
            subdivision=sampling.subdivision,
            samples=MORE * sampling.hour_samples // BATCHES,
            stopping=Stopping(batches=BATCHES),
        )
        return found.values @ sky.whole
    scene = DaylightScene(Surfaces.none(), case.exterior(), [group], case.points, case.normals)
    light = daylight(scene, [[filled]], sky, method=METHODS[method], sampling=sampling)
    return illuminance(light)


def deviations(case: Case, method: str, glass: str, sampling: Sampling = SAMPLING) -> Array:
    """Relative deviations [S, 5] of a method from the quadrature."""
    judge = np.stack([case.quadrature(kind) for kind in SKIES], axis=1)
    return computed(case, method, glass, sampling) / judge - 1


def summary(found: Array, grazing: Array) -> dict[str, float]:
    """Worst and root mean square deviation, of the grazing sensors by themselves [per cent]."""
    table = {}
    for name, chosen in (("", found[~grazing]), ("grazing ", found[grazing])):
        values = 100 * chosen
        table[f"{name}worst"] = round(float(np.abs(values).max(initial=0.0)), 2)
        table[f"{name}rms"] = round(float(np.sqrt((values**2).mean())) if values.size else 0.0, 2)
    return table


def figures_against_quadrature(file: Path) -> None:
    """Print what the report's figures deviate from the quadrature."""
    known = {(case.name, case.parameter): case for case in cases()}
    for name, parameter, kind, values in reported(file):
        case = known.get((name, parameter))
        if case is not None:
            ratio = values / case.quadrature(kind)[: len(values)] - 1
            print(f"{case.label}, sky {kind}:", np.round(100 * ratio, 1))


def main(
    *,
    figures: Annotated[Path | None, "the report's figures: compared by themselves"] = None,
    tests: Annotated[Sequence[str], "such as 5.9; all by default"] = (),
    methods: Annotated[Sequence[str], METHODS] = tuple(METHODS),
    glass: Annotated[Sequence[str], ("exact", "klems")] = ("exact",),
    subdivision: Annotated[int, "Reinhart MF"] = SAMPLING.subdivision,
    json_: Annotated[Path | None, "all deviations"] = None,
) -> None:
    """Run the methods and print a line for each case."""
    if figures:
        figures_against_quadrature(figures)
        return
    variants.activate("llvm_ad_mono")
    sampling, rows = replace(SAMPLING, subdivision=subdivision), []
    for case in cases():
        if tests and case.name.split()[0] not in tests:
            continue
        for optics in glass if case.glass else ["none"]:
            for method in methods:
                found = deviations(case, method, optics, sampling)
                shares = summary(found, case.grazing())
                rows.append({"case": case.label, "glass": optics, "method": method} | shares)
                rows[-1]["deviations"] = (100 * found).round(3).tolist()
                print(f"{case.label:38} {optics:6} {method:12}", shares, flush=True)
    if json_:
        json_.write_text(json.dumps(rows))
