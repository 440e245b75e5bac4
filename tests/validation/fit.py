"""Coverage of the intervals of `cfs fit`: planted values and readings in 100 seeds, for heat and for light.

    python -m tests.validation fit --kind heat
    python -m tests.validation fit --kind light --seeds 100

A box of 4 x 5 x 3 m with a window to the south in two weeks of May in Chicago.  In each seed the true
parameters are drawn from their priors, the study is computed with them, errors are added, and
`run_fit` fits the result as the command does.

Heat: hourly air temperature of 12 days; errors of 0.3 K with a correlation of 0.8 from hour to hour; the
two days before are predicted.
Light: four light meters in the 55 daylight hours of four days, independent errors of 5 %; the truth is
traced with other random numbers than the fit, and twice the paths, both anew every ten seeds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fit.fit import run_fit, with_readings
from scenes.fit.fit_file import Fit, read_fit
from scenes.fit.model import FittedModel

Array = NDArray[np.float64]
GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
STUDY = """
weather = "weather.csv"
step_minutes = 60
[measured]
latitude_deg = 41.98
longitude_deg = -87.92
timezone_h = -6
[measured.columns]
dry_bulb_c = "T"
direct_normal = "N"
diffuse_horizontal = "D"
horizontal_infrared = "L"
relative_humidity = "RH"
wind_speed = "wind"
[box]
width = 4.0
depth = 5.0
height = 3.0
[box.reflectance]
floor = 0.25
wall = 0.5
ceiling = 0.75
[[box.window]]
x = 0.5
sill = 0.9
width = 3.0
height = 1.6
[[system]]
bsdf = "GLAZING"
u_value = 1.3
g_value = 0.6
[gains]
persons = 0
equipment_w_m2 = 5.0
[air]
infiltration_ach = 0.5
[trace]
method = "three-phase"
PATHSview_factors = false
seed = SEED
"""
HEAT = """
study = "room.toml"
measured = "measured.csv"
begin = 2017-05-03T00:00:00
[[measurement]]
column = "air"
quantity = "air temperature"
[[parameter]]
name = "air change"
key = "air.infiltration_ach"
deviation = 0.15
low = 0.02
[[parameter]]
name = "g"
key = "system.g_value"
deviation = 0.03
low = 0.54
high = 0.75
[[parameter]]
name = "gains"
key = "gains.equipment_w_m2"
deviation = 1.5
low = 0
"""
LIGHT = """
study = "room.toml"
measured = "measured.csv"
[[measurement]]
column = "front"
quantity = "illuminance"
point = [2.0, 1.0, 0.8]
[[measurement]]
column = "middle"
quantity = "illuminance"
point = [2.0, 2.5, 0.8]
[[measurement]]
column = "back"
quantity = "illuminance"
point = [2.0, 4.2, 0.8]
[[measurement]]
column = "up"
quantity = "illuminance"
point = [2.0, 3.0, 2.5]
direction = [0, 0, -1]
[[parameter]]
name = "floor"
key = "box.reflectance.floor"
[[parameter]]
name = "walls"
key = "box.reflectance.wall"
[[parameter]]
name = "ceiling"
key = "box.reflectance.ceiling"
[[parameter]]
name = "ground"
key = "measured.albedo"
mean = 0.2
"""
KELVIN, CORRELATION = 0.3, 0.8  # of the errors of air temperatures, from hour to hour
SHARE = 0.05  # of the errors of light
OTHER_SEED = 1000  # of the tracing that plants the light
TRACED_ANEW = 10  # seeds of light after which both sides are traced with other random numbers
FEW_PATHS = 8192  # of heat
TRUE_PATHS = 262_144  # of a sensor; the fit has its own default


def planted_fit(folder: Path, kind: str, seed: int = 0, paths: int | None = None) -> Fit:
    """The fit of the box, with readings of zero; seed, paths: of its tracing (light: by default those of a fit)."""
    folder.mkdir(parents=True, exist_ok=True)
    weather = read_epw(WEATHER)
    days = np.flatnonzero((weather.midpoints.month == 5) & (weather.midpoints.day <= 14))
    table = pd.DataFrame(
        {
            "time": weather.times[days].strftime("%Y-%m-%dT%H:%M"),
            "T": weather.dry_bulb_c[days],
            "RH": 100 * weather.relative_humidity[days],
            "wind": weather.wind_speed[days],
            "N": weather.direct_normal[days],
            "D": weather.diffuse_horizontal[days],
            "L": weather.horizontal_infrared[days],
        }
    )
    table.to_csv(folder / "weather.csv", index=False)
    few = paths or (FEW_PATHS if kind == "heat" else None)
    stated = "" if few is None else f"sensor_samples = {few}\npatch_samples = {max(few, FEW_PATHS) // 8}\n"
    study = STUDY.replace("GLAZING", str(GLAZING)).replace("PATHS", stated).replace("SEED", str(seed))
    (folder / "room.toml").write_text(study)
    (folder / "fit.toml").write_text(HEAT if kind == "heat" else LIGHT)
    columns = ["air"] if kind == "heat" else ["front", "middle", "back", "up"]
    used = table if kind == "heat" else table[(table["D"] > 20) & (table["time"] < "2017-05-05")]
    used[["time"]].assign(**dict.fromkeys(columns, 0.0)).to_csv(folder / "measured.csv", index=False)
    return read_fit(folder / "fit.toml")


def planted_readings(fit: Fit, truth: FittedModel, theta: Array, kind: str, rng: np.random.Generator) -> pd.DataFrame:
    """What instruments with errors read of a study with known parameters."""
    exact = truth.whole(theta)
    readings, first = fit.readings.astype(float) * np.nan, 0
    for one in truth.columns:
        values = exact[first : first + len(one.values)]
        first += len(one.values)
        errors = rng.standard_normal(len(values))
        if kind == "heat":
            for number in range(1, len(errors)):
                errors[number] *= np.sqrt(1 - CORRELATION**2)
                errors[number] += CORRELATION * errors[number - 1]
            values = values + KELVIN * errors
        else:
            values = values * (1 + SHARE * errors)
        readings.loc[truth.weather.times[one.steps], one.table.column] = values
    return readings


def main(
    *, kind: Annotated[str, ("heat", "light")] = "heat", out: Path = Path("/tmp/cfs-fit"), seeds: int = 100
) -> dict[str, pd.DataFrame]:
    """How many of the seeds have each planted value within its 95 % interval, and readings within 90 %."""
    rows, readings = [], []
    for seed in range(seeds):
        if seed == 0 or (kind == "light" and seed % TRACED_ANEW == 0):
            fit = planted_fit(out / kind / "fitted", kind, seed)
            truth = model = FittedModel(fit)
            if kind == "light":
                truth = FittedModel(planted_fit(out / kind / "planted", kind, OTHER_SEED + seed, TRUE_PATHS))
        rng = np.random.default_rng([45, seed])
        theta = np.clip(fit.mean + fit.deviation * rng.standard_normal(len(fit.mean)), fit.low, fit.high)
        own = with_readings(fit, planted_readings(fit, truth, theta, kind, rng))
        result = run_fit(own, model=model)
        readings.append(result.coverage)
        table = result.parameters
        table["planted"] = theta
        rows.append(table)
        if (seed + 1) % 10 == 0:
            every = pd.concat(rows)
            hit = (every.low_95 <= every.planted) & (every.planted <= every.high_95)
            print(seed + 1, hit.groupby(every.parameter, sort=False).mean().to_dict(), flush=True)
    every = pd.concat(rows)
    every["within"] = (every["low_95"] <= every["planted"]) & (every["planted"] <= every["high_95"])
    every["scaled"] = (every["value"] - every["planted"]) / every["standard_error"]
    groups = every.groupby("parameter", sort=False)
    parameters = pd.DataFrame(
        {
            "within 95 % interval": groups["within"].sum(),
            "of": groups["within"].count(),
            "prior's deviation": groups["prior_deviation"].first(),
            "median standard error": groups["standard_error"].median(),
            "error over standard error, mean": groups["scaled"].mean(),
            "deviation": groups["scaled"].std(),
        }
    ).reset_index()
    within = pd.DataFrame(readings).mean().mul(100).rename("within 90 % interval [%]").rename_axis("readings")
    return {"parameters": parameters, "readings": within.reset_index()}
