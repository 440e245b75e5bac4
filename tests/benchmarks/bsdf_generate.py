"""The dissertation's blind on the Klems full basis: our goniophotometer against genBSDF.

The blind at 45 degrees, all four blocks, the same triangles.  genBSDF runs at its default ray
options and at options chosen for it: few ambient divisions, whose effort goes into entering rays
instead.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.progress import Progress
from tests.benchmarks import radiance
from tests.benchmarks.harness import THREADS, Comparison, Run, rms_error, timed

BLOCKS = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
SPACING, SLATS, WIDTH = 0.072, 101, 8.0  # [m], [], [m] of what stands in for an endless blind
TUNED = ("-ab", "10", "-ad", "2", "-lw", "1e-5", "-st", "0")
PATHS, REFERENCE_PATHS = 16_384, 131_072


def blind(width: float | None = None):
    """The dissertation's blind."""
    from mitsuba_cfs.bsdf.blinds import venetian_blind
    from mitsuba_cfs.bsdf.periodic import plastic

    material = plastic("grey", 0.55, specular=0.01, roughness=0.06)
    return venetian_blind(material, depth=0.08, radius=0.104, spacing=SPACING, tilt=np.radians(45), width=width)


def ours(paths: int = PATHS, seed: int = 2) -> KlemsBsdf:
    """Our BSDF of the blind."""
    from mitsuba_cfs.bsdf.generate import generate_klems

    return generate_klems(blind(), samples=paths, seed=seed).bsdf[0]


@cache
def reference() -> KlemsBsdf:
    """The converged one: ours with another seed and eight times the paths."""
    return ours(REFERENCE_PATHS, seed=99)


def genbsdf(samples: int, options: tuple[str, ...], *, levels: int = 0) -> Bsdf:
    """Radiance's BSDF of the blind, with `levels` a tensor tree of 4^levels cells a hemisphere."""
    from pyradiance import genbsdf as program

    os.environ.update(radiance.environment())
    from tests.bsdf.radiance_cells import write_radiance

    layer, bottom = blind(WIDTH), (SLATS // 2) * SPACING
    cell = program.SamplingBox(-WIDTH / 2 - 0.04, -WIDTH / 2 + 0.04, bottom, bottom + SPACING, -layer.thickness, 0)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "blind.rad"
        write_radiance(layer, scene, 1, SLATS)
        result = program.generate_bsdf(
            str(scene),
            nsamp=samples,
            nproc=THREADS,
            dim=cell,
            params=list(options),
            tensortree=4 if levels else 0,
            ttlog2=levels,
        )
        path = Path(folder) / "blind.xml"
        basis = "t4" if levels else "kf"
        path.write_bytes(program.generate_xml(vis_results=result, basis=basis, unit="meter"))
        return read_bsdf_xml(path, energy_limit=np.inf).band("Visible")


def relative_values(bsdf: KlemsBsdf) -> NDArray[np.float64]:
    """Each block's values [4, K K] over the reference's mean.

    So weighted that their mean square is that over the directions, even in projected solid angle.
    """
    area = KLEMS_FULL.projected_solid_angles() / np.pi
    weight = area[:, None] * area
    blocks = []
    for name in BLOCKS:
        mean = (weight * getattr(reference(), name)).sum()
        blocks.append((getattr(bsdf, name) / mean * np.sqrt(weight * weight.size)).ravel())
    return np.array(blocks)


def compare(name: str, progress: Progress, *, samples: int, options: tuple[str, ...]) -> Comparison:
    """Both programs' time and error."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    found, seconds, processor = timed(ours, repeat=3)
    progress(name, 0.2)
    peer, peer_seconds, peer_processor = timed(lambda: genbsdf(samples, options), repeat=1, warm=False)
    progress(name, 0.7)
    block = hardest_block(*(relative_values(bsdf) for bsdf in (found, peer, reference())))
    progress(name, 1.0)
    command = f"genBSDF -n {THREADS} -c {samples} +f +b -r '{' '.join(options)}' blind.rad"
    call = f"generate_klems(samples={PATHS})"
    return Comparison(
        name,
        "Klems full BSDF of a venetian blind, 4 x 145 x 145 [mean of the block]",
        Run("mitsuba-cfs", call, seconds, processor, block.ours),
        Run("Radiance", command, peer_seconds, peer_processor, block.peer),
        note=f"errors of the block that is hardest on us, {block.name}",
    )


@dataclass(frozen=True)
class Block:
    """One of the four blocks and both programs' root mean square errors over its mean."""

    name: str
    ours: float
    peer: float


def hardest_block(ours: NDArray, peers: NDArray, truth: NDArray) -> Block:
    """Of values [4, N], the block in which the other program does best against us."""
    blocks = [
        Block(name.replace("_", " "), rms_error(own, true), rms_error(theirs, true))
        for name, own, theirs, true in zip(BLOCKS, ours, peers, truth, strict=True)
    ]
    return min(blocks, key=lambda block: block.peer / block.ours)


BENCHMARKS = {
    "bsdf-klems": lambda progress: compare("bsdf-klems", progress, samples=2000, options=TUNED),
    "bsdf-klems-default-options": lambda progress: compare(
        "bsdf-klems-default-options", progress, samples=20, options=()
    ),
}
