"""Backs of modules in rows beside published hours of Marion's model, and pvlib's.

    python -m tests.validation pv_published

Hours and results of four days are quoted from `724010TYA_BillMarion_C_Results.csv` in the tests of
NREL's bifacialvf (BSD-3-Clause): B. Marion's own C program (Marion et al., "A practical irradiance
model for bifacial PV modules", IEEE PVSC 2017) for Richmond, Virginia.  Rows tilted by 10 degrees
to the south, 1.5 slopes apart, 0.4 slopes above ground of 0.62; there 1.3 % of a row lets light
pass, here none.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pvlib

from mitsuba_cfs import variants
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.perez import SOLAR_CONSTANT, eccentricity
from mitsuba_cfs.sky.weather import Weather
from scenes.photovoltaics.irradiance import cell_irradiance
from scenes.photovoltaics.modules import pv_modules
from tests.validation.pv_rows import WIDTH, rows

TILT, PITCH, CLEARANCE, ALBEDO = 10.0, 1.5 * WIDTH, 0.4 * WIDTH, 0.62
HEIGHT = CLEARANCE + np.sin(np.radians(TILT)) * WIDTH / 2  # of the middle of a row [m]
# end of the hour: direct normal, diffuse horizontal, front, backs from the lower edge up [W/m2]
DAYS = {
    "1987-01-01": """
        10: 5 74 75.4 14.1 12.8 12.5 13.1 14.1 15.0
        11: 10 110 115.1 20.8 19.1 18.9 19.8 21.1 22.3
        12: 10 126 131.8 23.9 22.1 21.8 22.8 24.2 25.5
        13: 8 142 147.1 26.7 24.6 24.4 25.4 27.0 28.4
        14: 5 116 118.4 21.9 20.1 19.8 20.7 22.1 23.3
        15: 3 120 122.2 22.1 20.2 19.8 20.8 22.3 23.7
        16: 2 62 62.3 11.7 10.7 10.4 10.8 11.6 12.4""",
    "1987-01-03": """
        10: 480 82 308.6 14.7 15.1 17.1 20.8 24.3 24.8
        11: 879 49 548.3 23.4 31.3 42.8 51.3 49.5 40.5
        12: 793 62 568.5 30.9 42.6 56.9 63.3 56.6 44.9
        13: 749 95 590.2 34.7 47.0 61.3 66.8 59.3 47.5
        14: 790 67 551.3 26.8 36.7 49.6 56.9 52.3 41.9
        15: 841 46 475.1 17.8 22.1 29.8 38.1 41.0 36.2
        16: 708 35 296.2 7.8 7.3 7.4 8.3 9.8 11.1""",
    "1985-06-16": """
        8: 27 164 174.0 32.7 29.2 28.9 31.2 35.1 38.6
        9: 7 241 242.3 47.3 41.8 40.3 42.2 46.1 50.3
        10: 4 405 404.9 80.7 69.6 65.8 68.3 74.6 82.1
        11: 7 208 212.2 42.1 37.2 35.5 36.8 39.8 43.0
        12: 2 241 240.8 47.9 42.3 40.4 41.8 45.1 48.7
        13: 6 382 385.9 77.8 67.3 63.1 65.0 70.4 76.9
        14: 200 379 574.9 122.7 93.1 79.0 79.2 89.3 105.4
        15: 114 340 440.3 91.9 72.1 63.5 65.0 73.4 85.4
        16: 22 189 203.2 40.1 34.5 32.7 34.2 37.8 42.0
        17: 35 137 153.9 29.3 25.7 25.1 26.9 30.2 33.5""",
    "1985-06-17": """
        8: 675 95 409.3 66.3 54.5 57.7 72.7 94.6 113.5
        9: 752 125 620.3 118.9 85.1 74.9 83.3 105.4 134.4
        10: 756 151 770.0 165.2 114.1 91.6 93.4 113.2 144.7
        11: 476 287 737.7 163.4 115.0 90.7 88.9 103.1 128.3
        12: 727 216 947.2 219.2 149.7 112.4 106.4 123.1 156.3
        13: 691 242 944.9 218.2 149.4 112.5 106.6 123.2 156.2
        14: 586 313 883.0 195.9 137.0 107.4 104.9 122.0 152.6
        15: 555 267 749.4 163.8 115.6 93.3 93.7 110.8 138.7
        16: 612 190 630.4 128.4 91.5 77.8 83.3 102.8 130.1
        17: 311 143 309.2 54.7 43.6 42.7 50.0 62.9 76.0""",
}


def published(day: str) -> tuple[Weather, pd.DataFrame]:
    """The weather of a day in Richmond, and the published hours."""
    table = pd.DataFrame(
        [
            {"hour": int(head), **dict(zip(COLUMNS, map(float, rest.split()), strict=True))}
            for head, rest in (line.split(":") for line in DAYS[day].strip().splitlines())
        ]
    ).set_index("hour")
    sun = table[["direct", "diffuse"]].reindex(range(1, 25), fill_value=0.0).to_numpy()
    times = pd.date_range(f"{day} 01:00", periods=24, freq="h")
    weather = Weather("Richmond", 37.517, -77.317, -5.0, 50.0, 1.0, times, sun[:, 0], sun[:, 1], albedo=ALBEDO)
    return weather, table


COLUMNS = ("direct", "diffuse", "front", *(f"back {n}" for n in range(1, 7)))


def peer(weather: Weather, model: str) -> pd.DataFrame:
    """pvlib's irradiance of rows without ends, whose places see the sun as ours do."""
    series = sky_series(weather, "solar")
    zenith = np.degrees(np.arccos(np.clip(series.sun[:, 2], -1, 1)))
    azimuth = np.degrees(np.arctan2(series.sun[:, 0], series.sun[:, 1])) % 360.0
    days = weather.midpoints.day_of_year.to_numpy()
    return pvlib.bifacial.infinite_sheds.get_irradiance(
        TILT,
        180.0,
        pd.Series(zenith),
        pd.Series(azimuth),
        WIDTH / PITCH,
        HEIGHT,
        PITCH,
        pd.Series(series.global_horizontal),
        pd.Series(series.diffuse_horizontal),
        pd.Series(series.direct_normal),
        ALBEDO,
        model=model,
        dni_extra=pd.Series(SOLAR_CONSTANT * eccentricity(days)),
        bifaciality=1.0,
        shade_factor=0.0,
    )


def main() -> dict[str, pd.DataFrame]:
    """Sums of the quoted hours of each day [Wh/m2], and the backs by their place."""
    variants.activate()
    elements = rows(TILT, PITCH, HEIGHT, ALBEDO)
    modules = pv_modules(elements, frozenset({"front", "back"}), substrings=6, along=4)
    sums, places = [], []
    for day in DAYS:
        weather, table = published(day)
        used = table.index.to_numpy() - 1  # of the day's intervals
        found = cell_irradiance(elements, modules, weather, cache=MatrixCache.of_user())
        columns = np.searchsorted(found.steps, used)
        backs = [name for name in COLUMNS if name.startswith("back")]
        row: dict[str, object] = {"day": day}
        for number, module in enumerate(modules):
            mine = found.module == number
            row[module.guid] = found.plain[mine][:, columns].mean(axis=0).sum()
            if module.guid == "back":
                row["back, glazed"] = found.effective[mine][:, columns].mean(axis=0).sum()
                up = module.points[:, 2]
                order = np.array_split(np.argsort(up), 6)
                rest = found.effective[mine][:, columns].sum(axis=1)
                places.append(
                    {"day": day, "of": "mitsuba-cfs"}
                    | {name: rest[some].mean() for name, some in zip(backs, order, strict=True)}
                )
        row["front, Marion"] = table["front"].sum()
        row["back, Marion"] = table[backs].mean(axis=1).sum()
        places.append({"day": day, "of": "Marion"} | table[backs].sum().to_dict())
        for model in ("isotropic", "haydavies"):
            theirs = peer(weather, model).iloc[used]
            row[f"back, pvlib {model}"] = theirs["poa_back"].sum()
            row[f"front, pvlib {model}"] = theirs["poa_front"].sum()
        sums.append(row)
    return {"Sums [Wh/m2]": pd.DataFrame(sums), "By place [Wh/m2]": pd.DataFrame(places)}
