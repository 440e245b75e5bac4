"""The blind of `bsdf_generate` as a tensor tree of rank 4: this project against genBSDF's `-t4 5`.

90 % of the cells are merged away by either program.  Errors are over random pairs of directions,
even in projected solid angle, against a long run of ours that merges only noise.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.evaluate import bsdf_values
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf, square_to_disk
from mitsuba_cfs.progress import Progress
from tests.benchmarks import radiance
from tests.benchmarks.bsdf_generate import BLOCKS, TUNED, blind, genbsdf, hardest_block
from tests.benchmarks.harness import THREADS, Comparison, Run, timed

LEVELS, SAMPLES = 5, 100
PAIRS, PATHS, REFERENCE_PATHS = 400_000, 2048, 16_384


def ours(paths: int = PATHS, *, levels: int = LEVELS, cull: float = 0.9, seed: int = 2):
    """Our tensor tree of the blind."""
    from mitsuba_cfs.bsdf.generate import generate_tensor_tree

    (tree,), _ = generate_tensor_tree(blind(), levels, samples=paths, cull=cull, seed=seed)
    return tree


@cache
def reference() -> NDArray[np.float64]:
    """Values [4, N] of the converged tree."""
    tree = ours(REFERENCE_PATHS, cull=0.0, seed=9)
    return np.array([bsdf_values(tree, *random_pairs(name)) for name in BLOCKS])


def relative_values(tree: TensorTreeBsdf) -> NDArray[np.float64]:
    """Values [4, N] of each block at random pairs, over the reference's mean."""
    values = np.array([bsdf_values(tree, *random_pairs(name)) for name in BLOCKS])
    return values / reference().mean(axis=1, keepdims=True)


def random_pairs(name: str, seed: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Incident and outgoing directions [N, 3] of a block, even in projected solid angle."""
    kind, side = name.split("_")
    disk = square_to_disk(np.random.default_rng(seed).uniform(size=(2, PAIRS, 2)))
    z = np.sqrt(1 - (disk**2).sum(axis=-1, keepdims=True))
    incident, outgoing = np.concatenate([disk, z if side == "front" else -z], axis=-1)
    return incident, outgoing * [1, 1, 1 if kind == "reflection" else -1]


def compare(name: str, progress: Progress) -> Comparison:
    """Both programs' time and error."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    found, seconds, processor = timed(ours, repeat=2)
    progress(name, 0.2)
    peer, peer_seconds, peer_processor = timed(lambda: genbsdf(SAMPLES, TUNED, levels=LEVELS), repeat=1, warm=False)
    progress(name, 0.6)
    truth = reference() / reference().mean(axis=1, keepdims=True)
    block = hardest_block(relative_values(found), relative_values(peer), truth)
    progress(name, 1.0)
    command = f"genBSDF -t4 {LEVELS} -n {THREADS} -c {SAMPLES} +f +b -r '{' '.join(TUNED)}'"
    call = f"generate_tensor_tree(levels={LEVELS}, samples={PATHS})"
    return Comparison(
        name,
        f"tensor tree of 4^{LEVELS} cells a hemisphere of a venetian blind [mean of the block]",
        Run("mitsuba-cfs", call, seconds, processor, block.ours),
        Run("Radiance", command, peer_seconds, peer_processor, block.peer),
        note=f"errors of the block that is hardest on us, {block.name}",
    )


BENCHMARKS = {"bsdf-tree": lambda progress: compare("bsdf-tree", progress)}
