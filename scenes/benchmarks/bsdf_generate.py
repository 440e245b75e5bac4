"""Time to equal error of a traced blind: this project's goniophotometer against genBSDF.

    python -m scenes.benchmarks.bsdf_generate [--samples N] [--processes N]

The dissertation's blind at 45 degrees on the Klems full basis, all four directions, the same
triangles, the same machine, one run.  Errors are root mean squares over all pairs of patches,
weighted by projected solid angles, against a long run of ours (its own error far below either);
ours falls with the square root of the paths, so that

    time to genBSDF's error = our time (our error / its error)^2.

genBSDF runs at its default ray options and at options chosen for it: few ambient divisions, whose
effort goes into entering rays instead.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, plastic, write_radiance
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml

BLOCKS = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
SPACING, SLATS, WIDTH = 0.072, 101, 8.0  # [m], [], [m] of what stands in for an endless blind
TUNED = ("-ab", "10", "-ad", "2", "-lw", "1e-5", "-st", "0")
OURS_PATHS, TRUTH_PATHS = 16_384, 262_144


@dataclass(frozen=True)
class Run:
    """Seconds that a run took, and its error relative to the mean value of each block."""

    name: str
    seconds: float  # of the clock
    processor: float  # of all cores together; the ratio's measure, others' load left out
    errors: tuple[float, ...]  # of BLOCKS


def blind(width: float | None = None) -> PeriodicLayer:
    """The dissertation's blind."""
    material = plastic("grey", 0.55, specular=0.01, roughness=0.06)
    return venetian_blind(
        material, depth=0.08, radius=0.104, spacing=SPACING, tilt=np.radians(45), width=width
    )


def relative_errors(bsdf: KlemsBsdf, truth: KlemsBsdf) -> tuple[float, ...]:
    """Root mean square error of each block over its mean value."""
    area = truth.basis_in.projected_solid_angles()
    weight = area[:, None] * area / area.sum() ** 2
    return tuple(
        float(
            np.sqrt((weight * (getattr(bsdf, name) - getattr(truth, name)) ** 2).sum())
            / (weight * getattr(truth, name)).sum()
        )
        for name in BLOCKS
    )


def run_genbsdf(
    samples: int, processes: int, options: tuple[str, ...], *, levels: int = 0
) -> tuple[KlemsBsdf | TensorTreeBsdf, np.ndarray]:
    """Radiance's BSDF of the blind, with `levels` a tensor tree, and what `clocks` counted."""
    import pyradiance
    from pyradiance import genbsdf

    package = Path(pyradiance.__file__).parent
    os.environ["PATH"] = f"{package / 'bin'}{os.pathsep}{os.environ['PATH']}"
    os.environ["RAYPATH"] = str(package / "lib")
    layer, bottom = blind(WIDTH), (SLATS // 2) * SPACING
    cell = genbsdf.SamplingBox(
        -WIDTH / 2 - 0.04, -WIDTH / 2 + 0.04, bottom, bottom + SPACING, -layer.thickness, 0
    )
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "blind.rad"
        write_radiance(layer, scene, 1, SLATS)
        start = clocks()
        result = genbsdf.generate_bsdf(
            str(scene),
            nsamp=samples,
            nproc=processes,
            dim=cell,
            params=list(options),
            tensortree=4 if levels else 0,
            ttlog2=levels,
        )
        seconds = clocks() - start
        path = Path(folder) / "blind.xml"
        basis = "t4" if levels else "kf"
        path.write_bytes(genbsdf.generate_xml(vis_results=result, basis=basis, unit="meter"))
        return read_bsdf_xml(path, energy_limit=np.inf).band("Visible"), seconds


def clocks() -> np.ndarray:
    """Seconds of the clock, and processor seconds of this process and its finished children."""
    own, children = (
        resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    used = own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime
    return np.array([time.perf_counter(), used])


def run_ours(truth: KlemsBsdf) -> Run:
    """Ours; the first run compiles the kernels and is not counted."""
    generate_klems(blind(), samples=OURS_PATHS, seed=1)
    start = clocks()
    result = generate_klems(blind(), samples=OURS_PATHS, seed=2)
    seconds = clocks() - start
    return Run(f"ours, {OURS_PATHS} paths", *seconds, relative_errors(result.bsdf[0], truth))


def report(ours: Run, peers: list[Run]) -> str:
    """The table that is printed."""
    lines = [f"{'run':34s} seconds  core s   {'errors Tf, Tb, Rf, Rb':26s}   ratio"]
    for run in [ours, *peers]:
        errors = "  ".join(f"{error:.3f}" for error in run.errors)
        # the block that is hardest on us decides
        needed = ours.processor * max(
            (own / its) ** 2 for own, its in zip(ours.errors, run.errors, strict=True)
        )
        ratio = "" if run is ours else f"{run.processor / needed:8.0f}"
        lines.append(f"{run.name:34s} {run.seconds:7.2f} {run.processor:7.2f}   {errors}  {ratio}")
    return "\n".join(lines)


def main() -> None:
    """Run both and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=2000, help="genBSDF's -c, tuned options")
    parser.add_argument("--default-samples", type=int, default=20, help="-c at default options")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    truth = generate_klems(blind(), samples=TRUTH_PATHS, seed=99).bsdf[0]
    ours = run_ours(truth)
    peers = []
    for name, samples, rays in (
        ("tuned", options.samples, TUNED),
        ("default", options.default_samples, ()),
    ):
        bsdf, seconds = run_genbsdf(samples, options.processes, rays)
        errors = relative_errors(bsdf, truth)
        peers.append(Run(f"genBSDF -c {samples}, {name} options", *seconds, errors))
    print(report(ours, peers))


if __name__ == "__main__":
    main()
