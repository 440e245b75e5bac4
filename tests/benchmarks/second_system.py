"""Processor seconds of C_ds for a second system in a room, from what the first one stored.

    OPENBLAS_THREAD_TIMEOUT=4 python -m tests.benchmarks second_system [--sensors 300]

An L-shaped room with two windows, a wall and a mirror outdoors, 4,000 suns, 256 points on each
window in 4 batches.  The variable is the one that `cfs` sets itself.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

SUNS = 40, 100  # altitudes and azimuths


def main(*, sensors: int = 300) -> None:
    """Print a line for each run: seconds of the processor, and elapsed."""
    from mitsuba_cfs import variants

    variants.activate()
    from mitsuba_cfs.bsdf.xml import read_bsdf_xml
    from mitsuba_cfs.matrices.cache import MatrixCache
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.scattering import sun_scattering
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix
    from scenes.demo import VENETIAN_BLIND
    from tests.trace import rooms
    from tests.trace.test_open_sun import outdoors
    from tests.trace.test_reflected_sun import towards

    folder = Path(VENETIAN_BLIND).parent
    blind, glazing = (
        sun_scattering(read_bsdf_xml(folder / f"{name}.xml").band("Visible")) for name in ("venetian_blind", "glazing")
    )
    room, groups, shade = rooms.l_shaped_room()
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0.2, 3.8, sensors), rng.uniform(0.2, 5.8, sensors), np.full(sensors, 0.8)])
    altitudes, azimuths = np.linspace(2, 62, SUNS[0]), np.linspace(-110, 110, SUNS[1])
    suns = np.array([towards(a, z) for a in altitudes for z in azimuths])

    def run(label: str, system, cache: MatrixCache | None) -> None:
        used, started = time.process_time(), time.perf_counter()
        direct_sun_matrix(
            room,
            outdoors(shade),
            groups,
            [system] * 2,
            points,
            np.tile([0.0, 0.0, 1.0], (sensors, 1)),
            suns=suns,
            window_points=256,
            stopping=Stopping(batches=4),
            by_group=True,
            cache=cache,
        )
        print(
            f"{label:28} {time.process_time() - used:7.2f} s {time.perf_counter() - started:7.2f} s elapsed", flush=True
        )

    for system in (glazing, blind):
        run("kernels compiled", system, None)
    for first, second, name in ((glazing, blind, "blind"), (blind, glazing, "glazing")):
        with tempfile.TemporaryDirectory() as place:
            cache = MatrixCache(Path(place))
            run("the first system, stored", first, cache)
            run(f"{name} as the second system", second, cache)
            run(f"{name} without a cache", second, None)
