"""What a method costs on this machine: seconds for each scene, system and time step.

    seconds = S (per_scene + N (per_system + T per_step))

with S scenes, N fenestration systems in each and T time steps: the constants of the dissertation's
Tables 5, 8 and 11.  What is timed are the very functions of `mitsuba_cfs.methods`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods import METHODS, METRICS
from mitsuba_cfs.methods.glare import metric_values
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_light import phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky

# Timed, after one untimed: what more steps take beyond a few is the cost of a step, the rest of the
# few is that of their system
STEPS = {"three-phase": (16, 272), "five-phase": (16, 144), "point-in-time": (1, 2)}
LEAST = 0.25  # of the mean of many steps: a slope below it is noise of a busy machine
SMALL = 48  # [px] of the pictures of the run that compiles the kernels


@dataclass(frozen=True, slots=True)
class Cost:
    """Elapsed seconds of one method for one metric."""

    method: str
    metric: str
    per_scene: float  # [s] outdoors and room, once
    per_system: float  # [s] for each fenestration system in a scene
    per_step: float  # [s] for each time step of each system in a scene

    def seconds(self, steps: int, *, systems: int = 1, scenes: int = 1) -> float:
        """Estimated time of a study [s]."""
        return scenes * (self.per_scene + systems * (self.per_system + steps * self.per_step))

    def record(self) -> dict[str, object]:
        """Plain data, as `Cost(**record)` takes it back."""
        return asdict(self)


def measure(
    scene: DaylightScene,
    optics: SystemOptics,
    sky: AnnualSky,
    sampling: Sampling | None = None,
    *,
    methods: Sequence[str] = METHODS,
    metrics: Sequence[str] = METRICS,
    clock: Callable[[], float] = time.perf_counter,
    progress: Progress = silent,
) -> list[Cost]:
    """Time methods and metrics in a scene with a system in all its windows.

    Kernels are compiled before, in a small picture: that is paid once on a machine.

    Args:
        sky: at least one hour; best with the sun facing the windows.  They are repeated as needed.
        clock: elapsed seconds; `time.process_time` gives processor seconds of all threads, which
            other work on the machine disturbs less.
    """
    sampling, result = sampling or Sampling(), []
    pairs = [(method, metric) for method in methods for metric in metrics]
    for number, (method, metric) in enumerate(pairs):
        progress("calibration", number / len(pairs))
        result.append(_measure((method, metric), scene, optics, sky, sampling, clock))
    progress("calibration", 1.0)
    return result


def _measure(
    pair: tuple[str, str],
    scene: DaylightScene,
    optics: SystemOptics,
    sky: AnnualSky,
    sampling: Sampling,
    clock: Callable[[], float],
) -> Cost:
    method, metric = pair
    systems = [[optics]] * len(scene.groups)

    small = replace(scene, view=replace(scene.eye, width=SMALL, height=SMALL))
    cheap = replace(sampling, sensor_samples=64, patch_samples=64, hour_samples=64)
    first = sky.part([0])
    metric_values(daylight(small, systems, first, method=method, sampling=cheap), metric)
    few, many = (sky.part(np.arange(n) % len(sky.lit)) for n in STEPS[method])
    if method == "point-in-time":  # all is done again in every step
        lights = [PathLight(scene, systems, steps, sampling) for steps in (few, many)]
        seconds = [_timed(partial(metric_values, light, metric), clock)[1] for light in lights]
        return Cost(method, metric, 0.0, 0.0, sum(seconds) / sum(STEPS[method]))
    five_phase, needs = method == "five-phase", (metric,)
    matrices, per_scene = _timed(lambda: phase_matrices(scene, sampling, five_phase=five_phase, needs=needs), clock)

    def rated(steps: AnnualSky) -> NDArray[np.float64]:
        return metric_values(phase_light(matrices, systems, steps, needs=needs), metric)

    rated(few)  # kernels of this size are compiled
    of_few, of_many = (_timed(partial(rated, steps), clock)[1] for steps in (few, many))
    slope = (of_many - of_few) / (len(many.lit) - len(few.lit))
    per_step = max(slope, LEAST * of_many / len(many.lit))
    per_system = max(of_few - len(few.lit) * per_step, 0.0)
    return Cost(method, metric, per_scene, per_system, per_step)


def _timed(work: Callable, clock: Callable[[], float]) -> tuple[Any, ...]:
    start = clock()
    result = work()
    return result, clock() - start
