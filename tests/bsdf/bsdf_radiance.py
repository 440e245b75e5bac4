"""Radiance's own BSDF library as the judge of ours.

Each file is asked about in a process of its own: the library frees a file's data under a second
`load_file` of it.  Run as a program it answers lines of angles [degrees] from standard input.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree

# of `query` once Radiance's own factor is known (`perturbed`); it keeps values in float32
QUERY_TOLERANCE = 2e-6
LARGEST_FACTOR = 3.01e-4  # how far that factor is from one at most


def random_directions(count: int, seed: int) -> tuple[NDArray, NDArray]:
    """Incident (to the light) and outgoing unit vectors [N, 3] in Radiance's frame, z indoors."""
    z, phi = np.random.default_rng(seed).uniform([-1, 0], [1, 2 * np.pi], (2, count, 2)).T
    r = np.sqrt(1 - z**2)
    incident, outgoing = np.moveaxis(np.stack([r * np.cos(phi), r * np.sin(phi), z], -1), 1, 0)
    return incident, outgoing


def angles_deg(directions: NDArray) -> NDArray:
    """Polar angle and azimuth [N, 2] [degrees] of directions [N, 3]."""
    x, y, z = directions.T
    return np.degrees(np.stack([np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x)], -1))


def query(path: Path, incident: NDArray, outgoing: NDArray) -> NDArray:
    """Radiance's BSDF [N] [1/sr] of the XML file."""
    return ask(path, np.concatenate([angles_deg(incident), angles_deg(outgoing)], -1))


def query_xyz(path: Path, incident: NDArray, outgoing: NDArray) -> NDArray:
    """Radiance's BSDF as X, Y and Z [N, 3] [1/sr]."""
    angles = np.concatenate([angles_deg(incident), angles_deg(outgoing)], -1)
    return ask(path, np.concatenate([angles, np.zeros((len(angles), 1))], -1)).reshape(-1, 3)


def direct_hemispherical(path: Path, incident: NDArray) -> NDArray:
    """Radiance's share [N] of the light from each direction that is scattered to either side."""
    return ask(path, angles_deg(incident))


def samples(path: Path, incident: NDArray, count: int) -> NDArray:
    """Directions [count, 3] (Radiance's frame) that Radiance's library draws for one direction."""
    angles = angles_deg(incident[None])[0]
    return ask(path, np.array([[*angles, count]])).reshape(-1, 3)


def ask(path: Path, angles: NDArray) -> NDArray:
    """Radiance's answer [N] to lines of two (hemispherical) or four angles (BSDF) [degrees].

    Two angles and a count ask for so many sampled directions, four and a zero for X, Y and Z.
    """
    if find_spec("pyradiance") is None:  # only looked for: it is loaded in a process of its own
        pytest.skip("could not import 'pyradiance': No module named 'pyradiance'")
    answer = subprocess.run(
        [sys.executable, __file__, str(path)],
        input="\n".join(" ".join(map(repr, line)) for line in angles.tolist()),
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return np.array(answer.stdout.split(), dtype=float)


def perturbed(bsdf: Bsdf) -> Bsdf:
    """The BSDF as Radiance's `query` gives it: each entry times a factor near one of its own.

    Radiance multiplies what an entry has beyond the block's least value by a number that depends
    on its place alone, lest two be equal (within 3e-4 in matrices, 2e-4 in trees; measured to
    5e-8 on blocks of one value).  `direct_hemi` and sampling go without.
    """
    make = _perturbed_matrix if isinstance(bsdf, KlemsBsdf) else _perturbed_tree
    return replace(bsdf, **{name: make(block) for name, block in bsdf.blocks().items()})


def _perturbed_matrix(block: NDArray) -> NDArray:
    outgoing, incident = np.indices(block.shape)
    n_out, n_in = block.shape
    share = 2 * n_in / (incident + 0.22545) + 4 * n_out / (outgoing + 0.70281)
    factor = 1 + 6e-4 * (share % 1 - 0.5)
    least = _constant_part((block * factor).min())
    return least + (block - least) * factor


def _perturbed_tree(tree: TensorTree) -> TensorTree:
    corner = tree.corners() / (1 << tree.depth)
    share = 2.0 ** np.arange(1, tree.rank + 1) / (corner + 0.01687)
    factor = 1 + 1e-4 * (share % 1 - 0.5).sum(axis=1)
    used = corner[:, 0] < 0.5 if tree.rank == 3 else slice(None)
    least = _constant_part(tree.values[used].min())
    return replace(tree, values=least + (tree.values - least) * factor)


def _constant_part(least: float) -> float:
    """The constant [1/sr] that Radiance takes out of a block: what scatters 1 % or more."""
    return least if np.pi * least >= 0.01 else 0.0


def to_window(directions: NDArray) -> NDArray:
    """Directions [N, 3] of Radiance's frame in the window frame."""
    return directions * [-1, 1, -1]


def main(path: str) -> None:
    from pyradiance import bsdf

    data = bsdf.load_file(path)
    for line in sys.stdin:
        angles = [float(word) for word in line.split()]
        if len(angles) == 2:
            print(repr(float(bsdf.direct_hemi(data, *angles, 15))))
        elif len(angles) == 3:
            drawn = bsdf.sample(data, *angles[:2], int(angles[2]), 15)[:, :3]
            print(" ".join(map(repr, drawn.astype(float).ravel().tolist())))
        elif len(angles) == 5:
            print(" ".join(map(repr, bsdf.query(data, *angles[:4]).tolist())))
        else:
            print(repr(float(bsdf.query(data, *angles)[1])))
    sys.stdout.flush()
    os._exit(0)  # the library's own clean-up may crash


if __name__ == "__main__":
    main(sys.argv[1])
