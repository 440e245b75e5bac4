"""The daylight matrix of the dissertation's window to MF:4 against rfluxmtx."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.surfaces import Surfaces
from scenes.cost import room
from tests.benchmarks import radiance
from tests.benchmarks.harness import THREADS, Comparison, Run, rms_error, timed

SUBDIVISION = 4
BATCHES, SAMPLES = 8, 1024  # ours: `daylight_matrix`'s batches, paths of each patch in each
REFERENCE_BATCHES, REFERENCE_SAMPLES = 64, 16384


def shaded() -> Surfaces:
    """A wall to the south-east and an overhang above the window."""
    wall = [(2, -6, 0), (10, -6, 0), (10, -6, 6), (2, -6, 6)]
    overhang = [(0, -1, 2.8), (0, 0, 2.8), (room.WIDTH, 0, 2.8), (room.WIDTH, -1, 2.8)]
    triangles = [[quad[i] for i in corners] for quad in (wall, overhang) for corners in ((0, 1, 2), (0, 2, 3))]
    return Surfaces(np.array(triangles, dtype=float), np.array([0.4, 0.4, 0.6, 0.6]), np.array([0, 0, 1, 1]))


OUTDOORS = {"open": lambda: room.NOTHING, "shaded": shaded}


def ours(outdoors: str, samples: int, batches: int = BATCHES, seed: int = 1):
    """Our daylight matrix [G, K, P] as an `Estimate`."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    return daylight_matrix(
        OUTDOORS[outdoors](),
        room.window_groups(),
        subdivision=SUBDIVISION,
        samples=samples,
        stopping=Stopping(batches=batches),
        seed=seed,
    )


@cache
def reference(outdoors: str) -> NDArray[np.float64]:
    """The converged matrix: ours with another seed and a hundred times the samples."""
    return ours(outdoors, REFERENCE_SAMPLES, REFERENCE_BATCHES, seed=1_000).values


def command(rays: int) -> str:
    """Radiance's command line."""
    return f"rfluxmtx -ff -n {THREADS} -ab 2 -c {rays} window.rad sky.rad outdoors.rad"


def theirs(outdoors: str, rays: int, folder: Path) -> NDArray[np.float64]:
    """Radiance's daylight matrix [1, K, P] with so many rays of each Klems patch."""
    radiance.write_surfaces(_with_black_panes(OUTDOORS[outdoors]()), folder / "outdoors.rad")
    radiance.write_group(room.window_groups()[0], folder / "window.rad")
    radiance.write_sky(folder / "sky.rad", SUBDIVISION)
    return radiance.read_float_matrix(radiance.run(command(rays), folder))[None]


def _with_black_panes(outside: Surfaces) -> Surfaces:
    """The outdoors and the windows, 2 mm behind the plane where rays start: black, as in ours.

    Without them what comes back to a window would pass through the room.
    """
    if not len(outside.triangles):
        return outside
    windows = [window for group in room.window_groups() for window in group.windows]
    panes = np.concatenate([w.triangles - 2e-3 * w.normal for w in windows])
    black, number = np.zeros(len(panes)), outside.surface.max() + 1
    return Surfaces(
        np.concatenate([outside.triangles, panes]),
        np.concatenate([outside.reflectance, black]),
        np.concatenate([outside.surface, np.full(len(panes), number)]),
    )


def compare(name: str, progress: Progress, *, outdoors: str, rays: int) -> Comparison:
    """Both programs' time and error of the daylight matrix."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    found, seconds, processor = timed(lambda: ours(outdoors, SAMPLES).values, repeat=5)
    progress(name, 0.2)
    with tempfile.TemporaryDirectory() as folder:
        peer, peer_seconds, peer_processor = timed(
            lambda: theirs(outdoors, rays, Path(folder)), repeat=3 if rays < 2000 else 1, warm=False
        )
    progress(name, 0.6)
    truth = reference(outdoors)
    progress(name, 1.0)
    call = f"daylight_matrix(samples={SAMPLES}, stopping=Stopping(batches={BATCHES}))"
    return Comparison(
        name,
        f"daylight matrix {found.shape[1]} x {found.shape[2]}, outdoors {outdoors} [1]",
        Run("mitsuba-cfs", call, seconds, processor, rms_error(found, truth)),
        Run("Radiance", command(rays), peer_seconds, peer_processor, rms_error(peer, truth)),
        note=f"root mean square of the entries {np.sqrt(np.mean(truth**2)):.3g}",
    )


def _benchmark(outdoors: str, rays: int):
    name = f"daylight-matrix-{outdoors}-c{rays}"
    return name, lambda progress: compare(name, progress, outdoors=outdoors, rays=rays)


BENCHMARKS = dict(_benchmark(outdoors, rays) for outdoors in OUTDOORS for rays in (1000, 5000))
