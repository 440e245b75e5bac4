"""What a method costs on this machine: seconds for each scene, system and time step.

    seconds = S (per_scene + N (per_system + T per_step))

with S scenes, N fenestration systems in each and T time steps: the constants of the dissertation's
Tables 5, 8 and 11.  What is timed are the very functions of `scenes.methods`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from mitsuba_cfs.progress import Progress, silent
from scenes.methods.methods import METHODS, method_scene
from scenes.methods.place import METRICS, Fenestration, Place, Quality, Skies

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
    place: Place,
    fenestration: Fenestration,
    skies: Skies,
    quality: Quality | None = None,
    *,
    methods: Sequence[str] = METHODS,
    metrics: Sequence[str] = METRICS,
    clock: Callable[[], float] = time.perf_counter,
    progress: Progress = silent,
) -> list[Cost]:
    """Time methods and metrics in a place.

    Kernels are compiled before, in a small picture: that is paid once on a machine.

    Args:
        skies: at least one hour; best with the sun before the windows.  They are repeated as
            needed.
        clock: elapsed seconds; `time.process_time` gives processor seconds of all threads, which
            other work on the machine disturbs less.
    """
    quality, found = quality or Quality(), []
    pairs = [(method, metric) for method in methods for metric in metrics]
    for number, (method, metric) in enumerate(pairs):
        progress("calibration", number / len(pairs))
        found.append(_measure(method, metric, place, fenestration, skies, quality, clock))
    progress("calibration", 1.0)
    return found


def _measure(
    method: str,
    metric: str,
    place: Place,
    fenestration: Fenestration,
    skies: Skies,
    quality: Quality,
    clock: Callable[[], float],
) -> Cost:
    small = replace(place, view=replace(place.view, width=SMALL, height=SMALL))
    cheap = replace(quality, sensor_samples=64, patch_samples=64)
    method_scene(method, metric, small, cheap).behind(fenestration).values(skies.part([0]))
    few, many = (skies.part(np.arange(n) % skies.hours) for n in STEPS[method])
    scene, per_scene = _timed(lambda: method_scene(method, metric, place, quality), clock)
    system, per_system = _timed(lambda: scene.behind(fenestration), clock)
    system.values(few)  # kernels of this size are compiled
    _, of_few = _timed(lambda: system.values(few), clock)
    _, of_many = _timed(lambda: system.values(many), clock)
    if method == "point-in-time":  # all is done again in every step
        return Cost(method, metric, per_scene, per_system, (of_few + of_many) / sum(STEPS[method]))
    slope = (of_many - of_few) / (many.hours - few.hours)
    per_step = max(slope, LEAST * of_many / many.hours)
    per_system += max(of_few - few.hours * per_step, 0.0)
    return Cost(method, metric, per_scene, per_system, per_step)


def _timed(work: Callable, clock: Callable[[], float]) -> tuple:
    start = clock()
    result = work()
    return result, clock() - start
