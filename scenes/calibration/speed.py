"""How fast this machine is, in two seconds: one cost that is traced, and one that is rated."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.images.view import fisheye
from scenes.cost.reference import reference_costs

TRACED = {"methods": ["three-phase"], "metrics": ["sDGP"], "size": 48}  # V and D of one eye
SIDE = 200  # [px]
TRACINGS, RATINGS = 4, 100  # how often: the least counts, which other work disturbs least


@dataclass(frozen=True, slots=True)
class Speed:
    """Elapsed seconds of the two tests of a machine's speed, the least of several."""

    tracing: float  # [s] V and D of an eye, on all cores or the GPU
    rating: float  # [s] of one picture's glare


def measured_speed() -> Speed:
    """The machine's speed now; kernels are compiled before the clock starts."""
    traced = [reference_costs(**TRACED)[0].per_scene for _ in range(TRACINGS)]
    return Speed(min(traced), _rating())


def _rating() -> float:
    """Seconds to find the glare sources of a picture: a sky of 2000 cd/m2 and 20 small suns."""
    geometry = GlareView(fisheye((0.0, 0.0, 1.2), (0.0, -1.0, 0.0), SIDE))
    random = np.random.default_rng(0)
    picture = random.uniform(500.0, 2000.0, (SIDE, SIDE)).astype(np.float32)
    for x, y in random.integers(SIDE // 4, 3 * SIDE // 4, (20, 2)):
        picture[y : y + 3, x : x + 3] = 1e5
    evaluate(picture, geometry)
    taken = []
    for _ in range(RATINGS):
        start = time.perf_counter()
        evaluate(picture, geometry)
        taken.append(time.perf_counter() - start)
    return min(taken)
