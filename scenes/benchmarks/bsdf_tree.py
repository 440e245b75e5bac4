"""Time to equal error of a traced tensor tree: this project against genBSDF's `-t4`.

    python -m scenes.benchmarks.bsdf_tree [--levels 5] [--samples N]

The blind of `bsdf_generate`, 90 % of the cells merged away by either program, processor time of one
run.  Errors are root mean squares over random pairs of directions, even in projected solid angle,
over the mean value, against a long run of ours that merges only noise.
"""

from __future__ import annotations

import argparse
import os

import numpy as np

from mitsuba_cfs.bsdf.evaluate import bsdf_values
from mitsuba_cfs.bsdf.generate import generate_tensor_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf, square_to_disk
from scenes.benchmarks.bsdf_generate import BLOCKS, TUNED, Run, blind, clocks, report, run_genbsdf

PAIRS, OURS_PATHS, TRUTH_PATHS = 400_000, 2048, 16_384


def errors(bsdf: TensorTreeBsdf, truth: TensorTreeBsdf) -> tuple[float, ...]:
    """Root mean square error of each block over its mean value."""
    found = []
    for name in BLOCKS:
        incident, outgoing = random_pairs(name, seed=1)
        ours, true = (bsdf_values(b, incident, outgoing) for b in (bsdf, truth))
        found.append(float(np.sqrt(((ours - true) ** 2).mean()) / true.mean()))
    return tuple(found)


def random_pairs(name: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Incident and outgoing directions [N, 3] of a block, even in projected solid angle."""
    kind, side = name.split("_")
    disk = square_to_disk(np.random.default_rng(seed).uniform(size=(2, PAIRS, 2)))
    z = np.sqrt(1 - (disk**2).sum(axis=-1, keepdims=True))
    incident, outgoing = np.concatenate([disk, z if side == "front" else -z], axis=-1)
    return incident, outgoing * [1, 1, 1 if kind == "reflection" else -1]


def main() -> None:
    """Run both and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--levels", type=int, default=5)
    parser.add_argument("--samples", type=int, default=100, help="genBSDF's -c")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    (truth,), _ = generate_tensor_tree(
        blind(), options.levels, samples=TRUTH_PATHS, cull=0.0, seed=9
    )
    start = clocks()
    (ours,), _ = generate_tensor_tree(blind(), options.levels, samples=OURS_PATHS, seed=2)
    own = Run(f"ours, {OURS_PATHS} paths", *(clocks() - start), errors(ours, truth))
    theirs, seconds = run_genbsdf(options.samples, options.processes, TUNED, levels=options.levels)
    name = f"genBSDF -t4 {options.levels} -c {options.samples}"
    print(report(own, [Run(name, *seconds, errors(theirs, truth))]))


if __name__ == "__main__":
    main()
