"""The living room of a measured house by `cfs thermal`: Twin House N2, experiment 2, one phase.

    python -m scenes.evidence.validation.twin_house ../shared/reference/twinhouse FOLDER

Writes into FOLDER weather, neighbours, heating and supply air as CSV, the BSDF of the panes and the
study file (docs/tutorials/twin_house_living.toml), runs the study as `cfs thermal` does and puts
its air beside the measured one.  Measured by Fraunhofer IBP, IEA EBC Annex 58.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.bsdf.angular import AngularTable, specular_matrices
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml_write import write_bsdf_xml
from mitsuba_cfs.progress import silent
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study

STUDY = Path(__file__).parents[3] / "docs" / "tutorials" / "twin_house_living.toml"
FLOOR, VOLUME = 33.24, 86.42  # of the living room [m2], [m3]
FIRST, LAST = "2014-04-21", "2014-05-13"  # whole days that are simulated
PHASE = slice("2014-04-29 01:00", "2014-05-13 23:59")  # heater powers by a random sequence
STEP = pd.Timedelta(minutes=10)
DAY_0 = pd.Timestamp("2014-01-01")
CHANNELS = {  # numbers in `validationdataExp2.txt`, time being 0
    "cellar": [1], "kitchen": [2], "doorway": [3], "living": [5, 6, 9], "corridor": [10],
    "child": [14, 15, 16], "attic": [17, 18, 19], "heater": [27], "supply_m3_h": [31],
    "supply_c": [33], "T": [53], "G": [54], "D": [55], "L": [56], "south": [59],
    "wind_from": [61], "wind": [62], "RH": [63],
}  # fmt: skip
# solar values of the panes by EN 410's spectrum at each 10 degrees, as the house's description has
# them: transmittance, absorptance of both panes together
ANGLES = np.radians(np.arange(0.0, 91.0, 10.0))
PASSED = np.array([0.543, 0.546, 0.538, 0.528, 0.514, 0.486, 0.426, 0.310, 0.145, 0.0])
ABSORBED = np.array([0.192, 0.195, 0.203, 0.212, 0.218, 0.227, 0.245, 0.257, 0.215, 0.0])
NAME = "4/16/4 low-e of the Twin Houses"


def measured(folder: Path) -> pd.DataFrame:
    """Channels of the experiment by name, ten-minute means by the end of their interval."""
    path = folder / "validationdataExp2.txt"
    rows = np.loadtxt(path, skiprows=2)
    times = DAY_0 + pd.to_timedelta(rows[:, 0], unit="s")
    data = {name: rows[:, numbers].mean(axis=1) for name, numbers in CHANNELS.items()}
    table = pd.DataFrame(data, index=times.round("min"))
    start, end = pd.Timestamp(FIRST) + STEP, pd.Timestamp(LAST) + pd.Timedelta(days=1)
    every = pd.date_range(start, end, freq=STEP)  # some rows are missing: linear between others
    return table.reindex(table.index.union(every)).interpolate("time").loc[every]


def write_inputs(data: pd.DataFrame, folder: Path) -> Path:
    """The study with its files; returns the study file."""
    inputs = folder / "twin_house"
    inputs.mkdir(parents=True, exist_ok=True)
    table = pd.DataFrame(
        {
            "time": data.index.strftime("%Y-%m-%dT%H:%M"),
            **{name: data[name].to_numpy() for name in ("T", "wind", "wind_from", "RH")},
            "G": data["G"].clip(lower=0).to_numpy(),
            "D": data["D"].clip(lower=0).to_numpy(),
            "L": data["L"].to_numpy(),
            "cellar": data["cellar"].to_numpy(),
            "attic": data["attic"].to_numpy(),
            "corridor": data["corridor"].to_numpy(),
            "east": (0.5 * (data["child"] + data["corridor"])).to_numpy(),
            "north": (0.58 * data["kitchen"] + 0.42 * data["doorway"]).to_numpy(),
            "heater_w_m2": (data["heater"].clip(lower=0) / FLOOR).to_numpy(),
            "supply_ach": (data["supply_m3_h"].clip(lower=0) / VOLUME).to_numpy(),
            "supply_c": data["supply_c"].to_numpy(),
        }
    )
    table.to_csv(inputs / "measured.csv", index=False, float_format="%.4f")
    reflected = 1.0 - PASSED - ABSORBED  # from the room too: that side is not told
    klems = specular_matrices(AngularTable(ANGLES, PASSED, reflected, reflected))
    bands = {"Visible": klems, "Solar": klems}
    write_bsdf_xml(BsdfFile(bands, name=NAME), inputs / "glass.xml")
    return Path(shutil.copy(STUDY, folder / STUDY.name))


def compare(folder: Path, data: pd.DataFrame) -> pd.DataFrame:
    """Ours and the measured air of the phase [degC]."""
    (year,), _ = run_study(read_study(folder / STUDY.name), silent)
    ends = year.hours.index + pd.Timedelta(minutes=5)
    both = pd.DataFrame({"ours": year.hours["air_c"].to_numpy()}, index=ends)
    return both.join(data["living"].rename("measured"), how="inner").loc[PHASE]


def main(source: Path, folder: Path) -> str:
    """Write, run, compare."""
    data = measured(source)
    write_inputs(data, folder)
    both = compare(folder, data)
    both.to_csv(folder / "compared.csv")
    gap = both["ours"] - both["measured"]
    daily = both.resample("D").max()
    tops = (daily["ours"] - daily["measured"]).mean()
    return (
        f"{len(both)} intervals: RMSE {np.sqrt((gap**2).mean()):.2f} K, bias {gap.mean():+.2f} K, "
        f"daily maxima {tops:+.2f} K; measured {both['measured'].min():.1f} to "
        f"{both['measured'].max():.1f}, ours {both['ours'].min():.1f} to {both['ours'].max():.1f}\n"
    )


if __name__ == "__main__":
    sys.stdout.write(main(Path(sys.argv[1]), Path(sys.argv[2])))
