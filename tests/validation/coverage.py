r"""How often twice the stated standard error covers the error, over many seeds.

    python -m tests.validation coverage [--seeds 100] [--methods point-in-time] [--json FILE]

A shoebox behind clear glass, four sensors, an eye beside them, each eighth hour of the demo's
weather with the sun up, by few paths, so that the noise is large.  Each seed traces all matrices
again.  The truth is the mean over the other seeds; its own error is a tenth of that of one seed
and is included.
Illuminance: mean over the hours at each sensor; DF: overcast sky; DA: share of the hours above the
median illuminance of a sensor; sDA: share of sensors with that in half of the hours; DGP: of the
six brightest hours.  By path tracing: illuminance of every sixteenth of these hours, each by itself
(`stated / spread` is dominated by the noisiest ones), and its mean.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs import variants
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.light import illuminance_with_noise, relative_error_of_mean
from mitsuba_cfs.methods.phase_light import PhaseLight, with_sensor_light
from mitsuba_cfs.methods.standard_error import relative_error_under
from mitsuba_cfs.metrics.autonomy import daylight_autonomy, daylight_autonomy_noise
from mitsuba_cfs.metrics.lm83 import spatial_daylight_autonomy_error
from mitsuba_cfs.metrics.room import daylight_factor
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from scenes import demo
from scenes.cost import room as box
from tests.validation.mirroring_street import hourly_errors

SUBDIVISION = 1
POINTS = np.array([[1.8, y, 0.8] for y in (0.5, 1.5, 2.5, 3.5)])
UP = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
SIZE = 48  # [px]
EVERY = 8
EVERY_BY_PATHS = 16  # of these
METHODS = ("five-phase", "point-in-time")
PICTURES = 6  # the brightest hours
PATHS = {
    "sensor_samples": 1_024,
    "patch_samples": 1_024,
    "sun_points": 256,
    "view_samples": 2,
    "outdoor_samples": 2,
    "hour_samples": 512,
}


def sky() -> cfs.AnnualSky:
    """Each eighth hour with the sun up of the demo's weather."""
    weather = cfs.read_epw(next(Path(demo.__file__).parent.glob("*.epw")))
    year = cfs.annual_sky(weather, SUBDIVISION)
    return year.part(np.arange(0, len(year.lit), EVERY))


def of_seed(
    method: str, seed: int, under: cfs.AnnualSky, limits: NDArray[np.float64] | None
) -> tuple[dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]], NDArray[np.float64]]:
    """Values and stated standard errors of each quantity, and the thresholds of DA [S] [lx]."""
    interior, groups = box.room(), box.window_groups()
    view = fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), SIZE)
    scene = cfs.DaylightScene(interior, box.NOTHING, groups, POINTS, UP, view=view)
    glass = cfs.AngularOptics([0.0, 0.4, 0.4, 0.4, 0.4])
    sampling = cfs.Sampling(**PATHS, subdivision=SUBDIVISION, seed=seed)
    if method == "point-in-time":
        under = under.part(np.arange(0, len(under.lit), EVERY_BY_PATHS))
    light = cfs.daylight(scene, [[glass]], under, method=method, sampling=sampling)
    lux, of_sums = illuminance_with_noise(light)
    relative, mean = relative_error_of_mean(lux, of_sums), lux.mean(axis=1)
    limits = np.median(lux, axis=1) if limits is None else limits
    found = {"illuminance": (mean, relative * mean)}
    if not isinstance(light, PhaseLight):
        hourly = hourly_errors(of_sums, lux.shape)
        found |= {"illuminance of an hour": (lux.ravel(), hourly.ravel())}
        return {f"{name}, paths": one for name, one in found.items()}, limits
    every = np.ones(lux.shape[1], dtype=bool)
    scaled = lux.T / limits
    da = daylight_autonomy(scaled, every, 1.0)
    noise = daylight_autonomy_noise(
        scaled, every, lambda weights: of_sums(weights.T / limits[:, None]), relative_error=relative, threshold=1.0
    )
    overcast = cie_patches("overcast", ReinhartSky(SUBDIVISION), 1.0)
    factor = daylight_factor(cfs.daylight_coefficients(light) @ overcast, 1.0)
    of_factor = relative_error_under(with_sensor_light(light), overcast)
    rated = cfs.hourly_glare(light, hours=np.sort(np.argsort(under.illuminance)[-PICTURES:]))
    sda = np.array([np.mean(da >= 0.5)])
    return found | {
        "daylight factor": (factor, of_factor * factor),
        "DA": (da, noise.standard_error()),
        "sDA": (sda, np.array([spatial_daylight_autonomy_error(da, noise)])),
        "DGP": (rated.dgp, rated.dgp_standard_error),
    }, limits


def coverage(values: NDArray[np.float64], errors: NDArray[np.float64]) -> dict[str, float]:
    """Shares of errors within twice the stated one, and the ratio of stated to found spread.

    Args: values, errors: [seeds, n].
    """
    count = len(values)
    others = (values.sum(axis=0) - values) / (count - 1)
    spread = values.std(axis=0, ddof=1)
    stated = np.sqrt(errors**2 + spread**2 / (count - 1))
    # half a step: shares of few hours are whole numbers of them
    within = np.abs(values - others) <= 2 * stated + 1e-12
    root = np.sqrt(np.mean(spread**2))
    ratio = float(np.sqrt(np.mean(errors**2)) / root) if root > 0 else np.nan
    return {"covered": float(within.mean()), "spread": float(root), "stated_to_spread": ratio}


def main(
    *,
    seeds: Annotated[int, "how often everything is traced"] = 100,
    methods: Annotated[Sequence[str], METHODS] = METHODS,
    json_: Annotated[Path | None, "file for the figures"] = None,
) -> str:
    """Print the table of coverage."""
    variants.activate("llvm_ad_mono")
    under, found = sky(), {}
    for method in methods:
        limits, runs = None, []
        for seed in range(seeds):
            run, limits = of_seed(method, seed, under, limits)
            runs.append(run)
        found |= {name: coverage(*(np.stack([run[name][k] for run in runs]) for k in (0, 1))) for name in runs[0]}
    if json_ is not None:
        json_.write_text(json.dumps({"seeds": seeds, **found}, indent=1), "utf-8")
    head = f"{'quantity':29}{'covered by 2 SE':>16}{'spread':>10}{'stated / spread':>17}"
    lines = [
        f"{name:29}{row['covered']:16.0%}{row['spread']:10.3g}{row['stated_to_spread']:17.2f}"
        for name, row in found.items()
    ]
    return "\n".join([head, *lines])
