r"""A room of an IFC file by its exported folder's own run.sh, and by our matrices.

    python -m scenes.evidence.validation.radiance_folder FILE.ifc ROOM FOLDER \
        [--runs 3] [--indoors 5000] [--outdoors 400]

V T D of each sensor under four skies that weigh directions differently: the root mean square of the
sensors' relative differences, and the standard error of either side's mean over the runs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.ifc.building import read_ifc
from bim.to_radiance import RadianceFiles, write_radiance
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
from mitsuba_cfs.trace.view_matrix import view_matrix
from scenes.demo import VENETIAN_BLIND
from scenes.evidence.benchmarks.radiance import environment


def theirs(files: RadianceFiles, indoors: int, outdoors: int) -> NDArray[np.float64]:
    """Coefficients [S, P] by Radiance alone; its seed is the clock's."""
    rays = {"INDOORS": str(indoors), "OUTDOORS": str(outdoors)}
    subprocess.run(
        [str(files.script.resolve())], check=True, capture_output=True, env=environment() | rays
    )
    text = (files.script.parent / "coefficients.mtx").read_text()
    return np.loadtxt(text.split("\n\n", 1)[1].splitlines())


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("room")
    parser.add_argument("folder", type=Path)
    for name, value in (("--runs", 3), ("--indoors", 5000), ("--outdoors", 400)):
        parser.add_argument(name, type=int, default=value)
    given = parser.parse_args()
    building = read_ifc(given.file)
    space = building.space(given.room)
    blind, groups = read_bsdf_xml(VENETIAN_BLIND), window_groups(space)
    files = write_radiance(
        space, building, given.folder, filled=[(group, blind) for group in groups], spacing=1.0
    )
    rows = np.loadtxt(files.sensors)
    visible = blind.bands["Visible"]
    passed = visible.transmission_front * visible.basis_in.projected_solid_angles()
    ours, radiance = [], []
    for seed in range(given.runs):
        radiance.append(theirs(files, given.indoors, given.outdoors))
        view = view_matrix(
            interior_surfaces(space), groups, rows[:, :3], rows[:, 3:], samples=20_000, seed=seed
        ).values
        daylight = daylight_matrix(
            exterior_surfaces(building, space), groups, samples=2_000, subdivision=1, seed=seed
        ).values
        ours.append(np.einsum("sgk,kj,gjp->sp", view, passed, daylight))
    print(f"{space.label}: {len(rows)} sensors, {os.cpu_count()} cores")
    _print(np.array(ours), np.array(radiance))


def _print(ours: NDArray[np.float64], radiance: NDArray[np.float64]) -> None:
    """A line for each sky; ours, radiance: [runs, S, P]."""
    patches = np.arange(ours.shape[2])
    skies = {
        "uniform, with the ground": patches >= 0,
        "half of the patches": patches % 30 < 15,
        "the other half": patches % 30 >= 15,
        "the ground alone": patches == 0,
    }
    for name, sky in skies.items():
        a, b = ours @ sky.astype(float), radiance @ sky.astype(float)
        difference = _rms(a.mean(axis=0) / b.mean(axis=0) - 1)
        noises = [_rms(x.std(axis=0, ddof=1) / x.mean(axis=0)) / len(x) ** 0.5 for x in (a, b)]
        ratio = a.mean(axis=0).sum() / b.mean(axis=0).sum()
        print(
            f"| {name} | {100 * difference:.2f} % | {100 * noises[1]:.2f} % "
            f"| {100 * noises[0]:.2f} % | {ratio:.4f} |"
        )


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
