"""What is compiled once after installation, done beside the reading of the inputs."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from mitsuba_cfs.interpreter import own_paths, own_python

COMPILE = "from scenes.commands.compiling import compile_now; compile_now()"


@contextmanager
def compiled_beside() -> Iterator[None]:
    """Where the heat balance has to be compiled yet, let another process do so in the meantime.

    It keeps what it compiles where this process looks for it; too late or failed, this one compiles
    for itself.
    """
    from mitsuba_cfs.compiled import must_compile
    from thermal.kernel import advance

    if not must_compile(advance) or advance.stats.cache_path is None:
        yield
        return
    nowhere = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
    with subprocess.Popen(
        own_python("-c", COMPILE), env=own_paths(), stderr=subprocess.DEVNULL, **nowhere
    ) as process:
        try:
            yield
        finally:
            process.terminate()


def compile_now() -> None:
    """Compile the heat balance and the glare of a picture by computing the smallest of each."""
    import numpy as np

    from mitsuba_cfs.glare.evaluation import evaluate
    from mitsuba_cfs.images.view import fisheye
    from thermal.balance import simulate
    from thermal.climate import Climate, no_sun
    from thermal.zone import Layer, OpaqueSurface, Zone

    day, up = np.zeros(24), np.array([0.0, 0.0, 1.0])
    roof = OpaqueSurface("roof", 10.0, (Layer(0.1, 1.0, 1000.0, 1000.0),), up)
    climate = Climate(day, day, day, day, day, day + 101325.0)
    simulate(Zone("room", 30.0, (roof,)), climate, no_sun(24, 1, 0))
    evaluate(np.ones((64, 64), dtype=np.float32), fisheye((0, 0, 0), (0, 1, 0), 64))
