r"""An office that others published: DGP and Ev of the Geneva office of raytraverse.

    python -m tests.validation geneva_office FOLDER \
        [--cases 01_glz 03_shd] [--views 1 2 3] [--every 20] [--size 300] [--json FILE]

FOLDER holds `validations/base1compdv` of stephanwaz/raytraverse: scene, views, skies and the
brute-force reference of 2,022 hours.  Ours is the five-phase method of `import mitsuba_cfs`, rated
twice: sources as evalglare groups them, and as raytools sums them, pixel by pixel.  Errors as
raytraverse publishes them: over the hours whose reference DGP is 0.25 to 0.75, the mean absolute
difference of DGP, and of Ev as a share of the reference's, mean over views.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

import bim
import mitsuba_cfs as cfs
from mitsuba_cfs.methods.phase_matrices import with_eye, with_needs
from tests.validation import geneva_scene as geneva

PUBLISHED = {"01_glz": (0.0109, 0.0420), "03_shd": (0.0038, 0.0305)}  # raytraverse: DGP, Ev
RANGE = (0.25, 0.75)  # of the reference's DGP


def rated(
    folder: Path, case: str, numbers: list[int], every: int, size: int, sampling: cfs.Sampling
) -> dict:
    """Hours, DGP by either sum and Ev of each view of a case, beside the reference."""
    groups, systems = geneva.window_groups(folder, case)
    solid = bim.opaque_surfaces(geneva.scene(folder, case))
    hours = geneva.reference(folder, case, numbers[0]).hour[::every]
    sky, matrices, found = geneva.sky(folder, hours), None, {"hours": hours.tolist(), "views": {}}
    for number in numbers:
        view, start = geneva.view(folder, number, size), os.times()
        if matrices is None:
            scene = cfs.DaylightScene(solid, solid, groups, view=view)
            matrices = cfs.phase_matrices(scene, sampling, needs=["DGP"])
        else:
            matrices = with_needs(with_eye(matrices, view), ["DGP"])
        tracing = _seconds(start)
        start = os.times()
        light = cfs.phase_light(matrices, systems, sky, needs=["DGP"])
        pixels = cfs.hourly_glare(light, options=cfs.GlareOptions(grouping="pixels"))
        seconds = _seconds(start)
        glare = cfs.hourly_glare(light)
        truth = geneva.reference(folder, case, number)
        found["views"][str(number)] = {
            "dgp": glare.dgp.round(5).tolist(),
            "pixels": pixels.dgp.round(5).tolist(),
            "Ev": glare.Ev.round(1).tolist(),
            "reference dgp": truth.dgp[::every].tolist(),
            "reference Ev": truth.Ev[::every].tolist(),
            "seconds of matrices": round(tracing, 1),
            "seconds of hours": round(seconds, 1),
        }
        print(f"{case} view {number}:", _line(found["views"][str(number)]), file=sys.stderr)
    return found


def _seconds(start) -> float:
    """Core seconds since."""
    now = os.times()
    return now.user + now.system - start.user - start.system


def _line(row: dict) -> str:
    named = (("pixels", "DGP by pixels"), ("dgp", "grouped"), ("Ev", "Ev"))
    parts = [(label, errors(row, name)) for name, label in named]
    figures = "; ".join(f"{label} MAE {e[0]:.4f} bias {e[1]:+.4f}" for label, e in parts)
    return f"{figures}; {row['seconds of matrices']:.0f} + {row['seconds of hours']:.0f} core-s"


def errors(row: dict, name: str) -> tuple[float, float, int]:
    """Mean absolute difference, mean difference and number of hours; of Ev as shares."""
    reference = np.asarray(row[f"reference {'Ev' if name == 'Ev' else 'dgp'}"])
    of = np.asarray(row["reference dgp"])
    counted = (of >= RANGE[0]) & (of <= RANGE[1])
    difference = (np.asarray(row[name]) - reference)[counted]
    if name == "Ev":
        difference = difference / reference[counted]
    return float(np.abs(difference).mean()), float(difference.mean()), int(counted.sum())


def main(
    folder: Path,
    *,
    cases: Annotated[Sequence[str], geneva.CASES] = tuple(geneva.CASES),
    views: Annotated[Sequence[int], geneva.VIEWS] = (1, 2, 3),
    every: Annotated[int, "of the 2,022 hours"] = 20,
    size: Annotated[int, "[px]"] = 300,
    json_: Path | None = None,
) -> None:
    """Run the cases and print the table."""
    found = {case: rated(folder, case, views, every, size, cfs.Sampling()) for case in cases}
    if json_:
        json_.write_text(json.dumps(found))
    for case, result in found.items():
        for number, row in result["views"].items():
            print(case, number, _line(row))
