"""View and daylight matrices of the test rooms by Radiance, repeated for their error.

    python -m tests.trace.radiance_matrices [FOLDER]

writes what tests/reference/radiance_matrices holds (two minutes; needs pyradiance).
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from tests import radiance
from tests.conftest import REPOSITORY

from . import rooms

STORED = REPOSITORY / "tests" / "reference" / "radiance_matrices"
SCENES = {
    "room": lambda: (*rooms.test_room(), rooms.obstruction()),
    "L": rooms.l_shaped_room,
    "skylight": lambda: (*rooms.skylight_room(), rooms.NOTHING),
}
POINTS = np.array([[1.0, 1.2, 0.85], [2.2, 2.6, 0.85], [3.0, 2.9, 0.85]])
UP = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
RAYS = 4000  # of a Klems patch
RUNS = 10  # repetitions of Radiance, for its error


@dataclass(frozen=True, slots=True)
class Repeated:
    """Mean and deviation of independent runs, of each entry and of the sums of rows."""

    mean: NDArray[np.floating]  # [..., N]
    deviation: NDArray[np.floating]  # [..., N] standard deviation of one run
    sum_deviation: NDArray[np.floating]  # [...] of one run's sum over the last axis
    runs: int

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Repeated:
        """Of runs [R, ..., N]."""
        spread, sums = values.std(axis=0, ddof=1), values.sum(axis=-1).std(axis=0, ddof=1)
        return cls(values.mean(axis=0), spread, sums, len(values))

    @classmethod
    def read(cls, path: Path) -> Repeated:
        """What `write` wrote."""
        with np.load(path) as data:
            arrays = {name: data[name].astype(float) for name in data.files if name != "runs"}
            return cls(**arrays, runs=int(data["runs"]))

    def write(self, path: Path) -> None:
        """As float32: the runs' own noise is above 1e-4."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        np.savez_compressed(path, **{name: np.asarray(a, "f4") for name, a in arrays.items()})


def view(name: str, folder: Path) -> Repeated:
    """V of the room's sensors; [S, G, K]."""
    surfaces, groups, _ = SCENES[name]()
    radiance.write_surfaces(surfaces, folder / "room.rad")
    found = []
    for g, group in enumerate(groups):
        radiance.write_group(group, folder / f"group{g}.rad")
        command = (
            f"rfluxmtx -faf -I+ -n 2 -ab 10 -ad 12000 -lw 1e-6 -y {len(POINTS) * RUNS} "
            f"- group{g}.rad room.rad"  # the other windows are holes, as good as black
        )
        text = radiance.sensors_text(np.tile(POINTS, (RUNS, 1)), np.tile(UP, (RUNS, 1)))
        out = radiance.read_float_matrix(radiance.run(command, folder, text))
        found.append(out.reshape(RUNS, len(POINTS), 145))
    return Repeated.of(np.stack(found, axis=2))


def daylight(name: str, folder: Path) -> Repeated:
    """D of the room's windows; [G, K, P]."""
    _, groups, outside = SCENES[name]()
    radiance.write_surfaces(with_black_windows(outside, groups), folder / "outdoors.rad")
    radiance.write_sky(folder / "sky.rad", 1)
    found = []
    for g, group in enumerate(groups):
        radiance.write_group(group, folder / f"group{g}.rad")
        # rfluxmtx's rays start with the same random numbers in each run: only another count of
        # them, and so another division of the patch, makes a repetition
        runs = [
            f"rfluxmtx -ff -n 2 -ab 4 -ad 1 -lw 1e-6 -c {RAYS + 41 * i} group{g}.rad sky.rad outdoors.rad"
            for i in range(RUNS)
        ]
        runs = [radiance.read_float_matrix(radiance.run(command, folder)) for command in runs]
        found.append(np.stack(runs))
    return Repeated.of(np.stack(found, axis=1))


def with_black_windows(outside: Surfaces, groups: Sequence[WindowGroup]) -> Surfaces:
    """What stands outdoors and the windows, 2 mm behind the plane that the rays start on.

    What comes back to a window is absorbed, as in ours: without it, it would pass through the room.
    """
    if not len(outside.triangles):
        return outside
    panes = [(w.triangles - 2e-3 * w.normal, 0.0) for g in groups for w in g.windows]
    old = [(outside.triangles[[i]], r) for i, r in enumerate(outside.reflectance)]
    return rooms.surfaces(old + panes)


MATRICES: dict[str, Callable[[str, Path], Repeated]] = {"view": view, "daylight": daylight}


def main(folder: Path = STORED) -> None:
    """Run Radiance for every room and write its matrices."""
    folder.mkdir(parents=True, exist_ok=True)
    for matrix, run in MATRICES.items():
        for name in SCENES:
            with tempfile.TemporaryDirectory() as work:
                run(name, Path(work)).write(folder / f"{matrix}_{name}.npz")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
