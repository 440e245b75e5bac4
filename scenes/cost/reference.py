"""The place that costs are measured in where none is given: the dissertation's room, demo's blind.

python -m scenes.cost.reference [--size 800] [--json FILE] [--method ...] [--metric ...]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods import METHODS, METRICS
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series
from scenes.cost import room
from scenes.cost.measure import Cost, measure
from scenes.demo import VENETIAN_BLIND, WEATHER

EYE, DIRECTION = (1.8, 2.0, 1.2), (0.0, -1.0, 0.0)
DIRECT = 20_000.0  # [lx] direct normal illuminance: the timed hours have the sun facing the window


def reference_scene(size: int = 800) -> DaylightScene:
    """The room of Table 1 with 7 x 9 sensors and an eye 2 m from its window."""
    points, normals = room.sensors()
    view = fisheye(EYE, DIRECTION, size)
    return DaylightScene(room.room(), room.NOTHING, room.window_groups(), points, normals, view)


def reference_system() -> BsdfOptics:
    """The demo's blind and glazing."""
    return BsdfOptics(read_bsdf_xml(VENETIAN_BLIND).band("Visible"))


def reference_sky(sampling: Sampling, count: int = 16) -> AnnualSky:
    """Hours of a year in which the sun shines on the window, whose outward normal is -y."""
    weather = read_epw(WEATHER)
    series = sky_series(weather)
    sunny = np.flatnonzero((series.direct_normal > DIRECT) & (series.sun[:, 1] < -0.2))
    chosen = sunny[np.linspace(0, len(sunny) - 1, count).astype(int)]
    return annual_sky(weather, sampling.subdivision, hours=chosen)


def reference_costs(
    *, size: int = 800, sampling: Sampling | None = None, progress: Progress = silent, **options
) -> list[Cost]:
    """Costs of this machine; options `methods`, `metrics`, `clock` of `measure`."""
    variants.activate()
    sampling = sampling or Sampling()
    return measure(
        reference_scene(size), reference_system(), reference_sky(sampling), sampling, progress=progress, **options
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=800, help="pixels of a side")
    parser.add_argument("--method", choices=METHODS, action="append")
    parser.add_argument("--metric", choices=METRICS, action="append")
    parser.add_argument("--processor", action="store_true", help="processor seconds of all threads")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    costs = reference_costs(
        size=options.size,
        methods=options.method or METHODS,
        metrics=options.metric or METRICS,
        clock=time.process_time if options.processor else time.perf_counter,
        progress=lambda stage, done: print(f"{stage} {100 * done:.0f} %", file=sys.stderr),
    )
    print(f"{'method':14} {'metric':12} {'scene [s]':>10} {'system [s]':>10} {'step [s]':>10}")
    for c in costs:
        print(f"{c.method:14} {c.metric:12} {c.per_scene:10.2f} {c.per_system:10.2f} {c.per_step:10.3f}")
    if options.json:
        options.json.write_text(json.dumps([c.record() for c in costs], indent=1))


if __name__ == "__main__":
    main()
