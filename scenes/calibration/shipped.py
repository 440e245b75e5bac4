"""The costs that ship with the program, for a machine on which `cfs calibrate` was never run.

They were measured on one machine, with the two-second test of `speed` before and after; that test
brings them to another one:

    tracing     V, D, direct sun, every step of point-in-time       times tracing here / there
    steps       of the phase methods and heat: algebra and rating   times rating here / there

python -m scenes.calibration.shipped [--size 300]        measures and writes them anew
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.images.view import fisheye
from scenes.calibration.costs import Calibration, calibration_file
from scenes.cost.measure import Cost
from scenes.cost.reference import reference_costs

# V and D of one eye
TRACED: dict[str, Any] = {"methods": ["three-phase"], "metrics": ["sDGP"], "size": 48}
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


FILE = Path(__file__).with_name("shipped.json")
PATHS = "point-in-time"


def this_machines_costs() -> Calibration:
    """What `cfs calibrate` has kept; the shipped costs, scaled by a two-second test, without it.

    Raises: `DataError` for a kept file that cannot be read.
    """
    file = calibration_file()
    return Calibration.read(file) if file.is_file() else scaled_costs()


def scaled_costs(here: Speed | None = None) -> Calibration:
    """The shipped costs for a machine of that speed; this one's, tested now, by default."""
    here = here or _speed_here()
    there, costs = shipped_costs()
    tracing, rating = here.tracing / there.tracing, here.rating / there.rating
    origin = (
        f"costs that ship with the program, scaled by a two-second test of this machine (tracing "
        f"{tracing:.2g}, rating {rating:.2g} times as long); `cfs calibrate` measures it"
    )
    scaled = tuple(_scaled(cost, tracing, rating) for cost in costs.costs)
    return replace(costs, costs=scaled, origin=origin)


@cache
def _speed_here() -> Speed:
    """Speed of this machine, tested once in a process."""
    return measured_speed()


def _scaled(cost: Cost, tracing: float, rating: float) -> Cost:
    step = tracing if cost.method == PATHS else rating
    return replace(
        cost, per_scene=tracing * cost.per_scene, per_system=tracing * cost.per_system, per_step=step * cost.per_step
    )


def shipped_costs() -> tuple[Speed, Calibration]:
    """The costs as they were measured, and the speed of the machine that they are of."""
    table = json.loads(FILE.read_text(encoding="utf-8"))
    return Speed(**table.pop("speed")), Calibration.of(table)


def main() -> None:
    """Measure this machine, its speed before and after, and write the file that ships."""
    from scenes.calibration.measure import calibrated

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=300, help="pixels of a side")
    size = parser.parse_args().size
    before = measured_speed()
    result = calibrated(size)
    after = measured_speed()
    least = {name: min(getattr(before, name), getattr(after, name)) for name in asdict(before)}
    table = {"speed": least} | asdict(result)
    FILE.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
