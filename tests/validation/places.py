"""A box room at latitudes, hemispheres, time zones and in a leap year that few files have.

    python -m tests.validation places

The weather is a clear year (Haurwitz for the global, Erbs for the diffuse part: pvlib) written as
an EPW file; `cfs study` computes the room with its window to the equator, and `cfs sky positions`
the sun.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib

from scenes.demo import VENETIAN_BLIND
from tests.conftest import REPOSITORY
from tests.scenes.study_files import BOX, FEW_RAYS
from tests.sky.weather_files import HEADER

PLACES = {  # name: latitude, longitude, time zone, year
    "Longyearbyen": (78.22, 15.63, 1.0, 2023),
    "Chicago": (41.98, -87.92, -6.0, 2023),
    "Chicago, leap year": (41.98, -87.92, -6.0, 2024),
    "Mumbai": (19.09, 72.85, 5.5, 2023),
    "Kathmandu": (27.70, 85.32, 5.75, 2023),
    "Adelaide": (-34.93, 138.60, 9.5, 2023),
    "Adelaide, mirrored": (34.93, 138.60, 9.5, 2023),  # the same half a year later
    "St. John's": (47.56, -52.71, -3.5, 2023),
    "Ushuaia": (-54.80, -68.30, -3.0, 2023),
    "Neumayer": (-70.67, -8.27, 0.0, 2023),
}
STUDY = """
methods = ["three-phase"]
glare = "none"
{box}
[[system]]
name = "blind"
bsdf = "{blind}"
{climates}
{rest}
"""


def clear_year(latitude: float, longitude: float, zone: float, year: int) -> pd.DataFrame:
    """Times (ends of hours) and irradiances [W/m2] of a year without clouds."""
    ends = pd.date_range(f"{year}-01-01", f"{year + 1}-01-01", freq="h", inclusive="right")
    minutes = pd.date_range(ends[0] - pd.Timedelta("59.5min"), ends[-1], freq="1min")
    universal = (minutes - pd.Timedelta(hours=zone)).tz_localize("UTC")
    zenith = pvlib.solarposition.get_solarposition(universal, latitude, longitude).apparent_zenith
    horizontal = pvlib.clearsky.haurwitz(zenith).ghi
    split = pvlib.irradiance.erbs(horizontal, zenith, universal)
    table = pd.DataFrame({"global": horizontal, "direct": split.dni, "diffuse": split.dhi})
    means = table.to_numpy().reshape(len(ends), 60, 3).mean(axis=1)
    return pd.DataFrame(means, ends, table.columns)


def write_year(path: Path, name: str, place: tuple[float, float, float, int]) -> None:
    """An EPW file of a clear year; 20 C in the local summer, 0 C in the winter."""
    latitude, longitude, zone, year = place
    head = HEADER.format(steps=1).replace("Testville", name.replace(",", ""))
    head = head.replace("48.0,8.0,1.0,250.0", f"{latitude},{longitude},{zone},10.0")
    lines = [head.rstrip("\n")]
    for end, row in clear_year(latitude, longitude, zone, year).iterrows():
        begin = end - pd.Timedelta("1h")
        season = np.cos(2 * np.pi * (begin.dayofyear - 15) / 365) * np.sign(latitude)
        warm = 10.0 - 10.0 * season + 3.0 * np.sin(2 * np.pi * (begin.hour - 9) / 24)
        fields = [
            begin.year,
            begin.month,
            begin.day,
            begin.hour + 1,
            60,
            "?",
            f"{warm:.1f}",
            f"{warm - 5:.1f}",
            71,
            101325,
            0,
            0,
            300,
            f"{row['global']:.0f}",
            f"{row['direct']:.0f}",
            f"{row['diffuse']:.0f}",
            999999,
            999999,
            999999,
            9999,
            270,
            3.5,
            0,
            0,
            9999,
            99999,
            9,
            999999999,
            0,
            0,
            0,
            88,
            0.2,
            0,
            0,
        ]
        lines.append(",".join(map(str, fields)))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def cfs(*words: object) -> str:
    """The output of a command."""
    result = subprocess.run(
        [sys.executable, "-m", "scenes.cli", *map(str, words)],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode:
        raise RuntimeError(result.stderr)
    return result.stdout


def sun_figures(table: pd.DataFrame) -> list[str]:
    """Hours with the sun up, days without it and without night, noon of 21 March, highest sun."""
    times = pd.to_datetime(table.iloc[:, 0])
    up = table["altitude_deg"] > 0
    by_day = up.groupby(times.dt.normalize()).sum()
    march = table[(times.dt.month == 3) & (times.dt.day == 21)]
    noon = pd.to_datetime(march.iloc[march["altitude_deg"].argmax(), 0])
    return [
        f"{up.sum()}",
        f"{(by_day == 0).sum()}",
        f"{(by_day >= 24).sum()}",
        f"{noon:%H:%M}",
        f"{table['altitude_deg'].max():.1f}",
    ]


def main() -> None:
    """One row for each place."""
    columns = (
        "place",
        "rows",
        "sun up [h]",
        "days without sun",
        "days without night",
        "highest sun of 21 March, middle of hour",
        "highest altitude [deg]",
        "DA toward the equator [%]",
        "away [%]",
        "operative max [C]",
        "not finite",
    )
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
    with tempfile.TemporaryDirectory() as folder:
        for name, place in PLACES.items():
            weather, out = Path(folder) / "w.epw", Path(folder) / name.replace(" ", "_")
            write_year(weather, name, place)
            cfs("sky", "positions", weather, Path(folder) / "sun.csv")
            sun = pd.read_csv(Path(folder) / "sun.csv")
            angles = [0, 180] if place[0] > 0 else [180, 0]  # of the window: south at 0
            study = Path(folder) / "study.toml"
            text = STUDY.format(
                box=BOX,
                blind=VENETIAN_BLIND,
                rest=FEW_RAYS,
                climates=f'[[climate]]\nname = "{name}"\nweather = "{weather}"',
            )
            study.write_text(f"orientations_deg = {sorted(angles)}\n{text}", encoding="utf-8")
            cfs("study", study, "--out", out)
            table = pd.read_parquet(out / "results.parquet").set_index("orientation_deg")
            toward, away = table.loc[angles[0]], table.loc[angles[1]]
            numbers = table.select_dtypes("number").to_numpy(float)
            row = [
                name,
                f"{len(sun)}",
                *sun_figures(sun),
                f"{toward.da300:.1f}",
                f"{away.da300:.1f}",
                f"{toward.operative_max_c:.1f}",
                f"{(~np.isfinite(numbers)).sum()}",
            ]
            print("| " + " | ".join(row) + " |", flush=True)
