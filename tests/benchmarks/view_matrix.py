"""The view matrix of the dissertation's room against rfluxmtx."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.progress import Progress
from scenes.cost import room
from tests.benchmarks import radiance
from tests.benchmarks.harness import THREADS, Comparison, Run, rms_error, timed

RADIANCE = f"-ab 6 -ad 8192 -lw 1e-5 -n {THREADS}"
BATCHES, SAMPLES = 16, 1024  # ours: `view_matrix`'s batches, and paths of each sensor in each
REFERENCE_BATCHES, REFERENCE_SAMPLES = 32, 8192


def ours(spacing: float, groups: int, samples: int, batches: int = BATCHES, seed: int = 1):
    """Our view matrix of the room [S, G, K] as an `Estimate`."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.view import view_matrix

    return view_matrix(
        room.room(),
        room.window_groups(groups),
        *room.sensors(spacing),
        samples=samples,
        stopping=Stopping(batches=batches),
        seed=seed,
    )


@cache
def reference(spacing: float, groups: int) -> NDArray[np.float64]:
    """The converged matrix: ours with another seed and several hundred times the samples."""
    return ours(spacing, groups, REFERENCE_SAMPLES, REFERENCE_BATCHES, seed=1_000).values


def theirs(spacing: float, groups: int, folder: Path) -> NDArray[np.float64]:
    """Radiance's view matrix [S, G, K], each group with a run of its own."""
    points, directions = room.sensors(spacing)
    radiance.write_surfaces(room.room(), folder / "room.rad")
    matrices = []
    for group in room.window_groups(groups):
        radiance.write_group(group, folder / "window.rad")
        command = f"rfluxmtx -faf -I+ {RADIANCE} -y {len(points)} - window.rad room.rad"
        out = radiance.run(command, folder, radiance.sensors_text(points, directions))
        matrices.append(radiance.read_float_matrix(out))
    return np.stack(matrices, axis=1)


def compare(
    name: str, progress: Progress, *, spacing: float = 0.5, groups: int = 1, samples: int = SAMPLES
) -> Comparison:
    """Both programs' time and error of the room's view matrix."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    found, seconds, processor = timed(lambda: ours(spacing, groups, samples).values, repeat=5)
    progress(name, 0.2)
    with tempfile.TemporaryDirectory() as folder:
        peer, peer_seconds, peer_processor = timed(lambda: theirs(spacing, groups, Path(folder)), repeat=2, warm=False)
    progress(name, 0.6)
    truth = reference(spacing, groups)
    progress(name, 1.0)
    call = f"view_matrix(samples={samples}, stopping=Stopping(batches={BATCHES}))"
    return Comparison(
        name,
        f"view matrix of {found.shape[0]} sensors, {groups} windows [sr]",
        Run("mitsuba-cfs", call, seconds, processor, rms_error(found, truth)),
        Run("Radiance", f"rfluxmtx -I+ {RADIANCE}", peer_seconds, peer_processor, rms_error(peer, truth)),
        note=f"root mean square of the entries {np.sqrt(np.mean(truth**2)):.3g}",
    )


BENCHMARKS = {
    "view-matrix": lambda progress: compare("view-matrix", progress),
    "view-matrix-4-windows": lambda progress: compare("view-matrix-4-windows", progress, groups=4),
    "view-matrix-1m": lambda progress: compare("view-matrix-1m", progress, spacing=1.0),
    "view-matrix-4x-samples": lambda progress: compare("view-matrix-4x-samples", progress, samples=4 * SAMPLES),
}
