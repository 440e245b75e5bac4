"""What a method costs on this machine: seconds for each scene, system and time step.

    seconds = S (per_scene + N (per_system + T per_step))

with S scenes, N fenestration systems in each and T time steps: the constants of the dissertation's
Tables 5, 8 and 11.  What is timed are the very functions of `mitsuba_cfs.methods`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from mitsuba_cfs.methods import METHODS, METRICS
from mitsuba_cfs.methods.by_name import PathScene, traced_scene, values, with_systems
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
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
    sampling, found = sampling or Sampling(), []
    pairs = [(method, metric) for method in methods for metric in metrics]
    for number, (method, metric) in enumerate(pairs):
        progress("calibration", number / len(pairs))
        found.append(_measure((method, metric), scene, optics, sky, sampling, clock))
    progress("calibration", 1.0)
    return found


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

    def traced(scene: DaylightScene, sampling: Sampling) -> PhaseScene | PathScene:
        found = traced_scene(method, scene, sampling)
        if isinstance(found, PhaseScene):
            found.trace(metric)
        return found

    small = replace(scene, view=replace(scene.view, width=SMALL, height=SMALL))
    cheap = replace(sampling, sensor_samples=64, patch_samples=64, hour_samples=64)
    values(with_systems(traced(small, cheap), systems).light(sky.part([0])), metric)
    few, many = (sky.part(np.arange(n) % len(sky.lit)) for n in STEPS[method])
    found, per_scene = _timed(lambda: traced(scene, sampling), clock)
    filled, per_system = _timed(lambda: with_systems(found, systems), clock)
    values(filled.light(few), metric)  # kernels of this size are compiled
    _, of_few = _timed(lambda: values(filled.light(few), metric), clock)
    _, of_many = _timed(lambda: values(filled.light(many), metric), clock)
    if method == "point-in-time":  # all is done again in every step
        return Cost(method, metric, per_scene, per_system, (of_few + of_many) / sum(STEPS[method]))
    slope = (of_many - of_few) / (len(many.lit) - len(few.lit))
    per_step = max(slope, LEAST * of_many / len(many.lit))
    per_system += max(of_few - len(few.lit) * per_step, 0.0)
    return Cost(method, metric, per_scene, per_system, per_step)


def _timed(work: Callable, clock: Callable[[], float]) -> tuple:
    start = clock()
    result = work()
    return result, clock() - start
