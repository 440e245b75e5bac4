"""Sun on four facades from measured horizontal irradiance, beside what was measured on them.

    python -m tests.validation vertical_sun ../shared/reference/twinhouse

Pyranometers of the Twin Houses' site (Fraunhofer IBP, IEA EBC Annex 58), both experiments.  Global
and diffuse horizontal irradiance of every ten minutes become the beam and a sky on patches as for
heat, by the all-weather luminance (Perez 1993) and by the sky of three parts (Perez 1990); the
ground reflects evenly.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.matrix import SkySeries, sky_series
from mitsuba_cfs.sky.measured import measured_weather
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.three_part import three_part
from mitsuba_cfs.sky.weather import Weather
from tests.validation.twin_house import EXPERIMENTS, STEP, measured

PLACE = {"latitude_deg": 47.874, "longitude_deg": 11.728, "timezone_h": 1.0, "elevation_m": 680.0}
# numbers of the channels: horizontal global and diffuse, four facades
CHANNELS = {
    1: {"G": [36], "D": [37], "north": [38], "east": [39], "south": [40], "west": [41]},
    2: {"G": [54], "D": [55], "north": [57], "east": [58], "south": [59], "west": [60]},
}
OUTWARD = {"north": (0.0, 1.0), "east": (1.0, 0.0), "south": (0.0, -1.0), "west": (-1.0, 0.0)}
LOWEST = np.sin(np.radians(5.0))  # of the sun that is compared
SUBDIVISION = 4


def weather_of(data: pd.DataFrame) -> Weather:
    """The site's weather by its horizontal pyranometers."""
    none = np.zeros(len(data))
    site = Weather(
        site="Twin Houses",
        step_h=STEP / pd.Timedelta(hours=1),
        times=data.index,
        direct_normal=none,
        diffuse_horizontal=none,
        **PLACE,
    )
    whole = data["G"].to_numpy()
    return measured_weather(site, whole, np.minimum(data["D"].to_numpy(), whole))


def upright(
    series: SkySeries, hours: NDArray[np.int64], outward: tuple[float, float], albedo: float
) -> NDArray[np.float64]:
    """Irradiance of an upright plane in some of the moments [h] [W/m2]."""
    sky = ReinhartSky(SUBDIVISION)
    normal = np.array([*outward, 0.0])
    weight = sky.solid_angles[1:] * np.maximum(sky.directions[1:] @ normal, 0.0)
    beam = series.direct_normal[hours] * np.maximum(series.sun[hours] @ normal, 0.0)
    return weight @ series.patches(sky, hours) + beam + 0.5 * albedo * series.global_horizontal[hours]


def compared(folder: Path, number: int, albedo: float) -> pd.DataFrame:
    """A row of sums and errors for each facade of an experiment."""
    experiment = replace(EXPERIMENTS[number], channels=CHANNELS[number])
    data = measured(folder, experiment).clip(lower=0.0)
    series = sky_series(weather_of(data), "solar")
    lit = (series.sun[:, 2] > LOWEST) & (series.diffuse_horizontal > 0.0)
    hours = np.flatnonzero(lit)
    rows = []
    for name, outward in OUTWARD.items():
        found = data[name].to_numpy()[hours]
        row = {"experiment": number, "facade": name, "measured [kWh/m2]": found.sum() / 6e3}
        for sky, one in (("all-weather", series), ("three parts", three_part(series))):
            gap = upright(one, hours, outward, albedo) - found
            row[f"{sky} [%]"] = 100.0 * gap.sum() / found.sum()
            row[f"{sky} RMSE [W/m2]"] = np.sqrt(np.mean(gap**2))
        rows.append(row)
    return pd.DataFrame(rows)


def main(source: Path, *, albedo: Annotated[float, "of the ground (0.2)"] = 0.2) -> pd.DataFrame:
    """Print a table."""
    tables = [compared(source, number, albedo) for number in EXPERIMENTS]
    return pd.concat(tables).round(1)
