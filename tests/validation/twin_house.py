r"""The living room of a measured house by `cfs thermal`: Twin House N2, both experiments.

    python -m tests.validation twin_house ../shared/reference/twinhouse FOLDER \
        --experiment 2

Writes into FOLDER weather, neighbours, heating and supply air as CSV, the BSDF of the panes and the
study file (docs/tutorials/twin_house_living.toml, of experiment 1 twin_house_shutters.toml), runs
the study as `cfs thermal` does and puts its air beside the measured one, by phase.  Measured by
Fraunhofer IBP, IEA EBC Annex 58.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.angular import AngularTable, specular_matrices
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from mitsuba_cfs.progress import silent
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study

STUDIES = Path(__file__).parents[2] / "docs" / "tutorials"
FLOOR, VOLUME, HEIGHT = 33.24, 86.42, 2.60  # of the living room [m2], [m3], [m]
STEP = pd.Timedelta(minutes=10)


@dataclass(frozen=True)
class Experiment:
    """Where an experiment's data are, and what was done when."""

    study: Path
    table: str  # the file of all channels
    year: str  # whose seconds its first column counts
    first: str  # whole days that are simulated
    last: str
    phases: dict[str, slice]
    channels: dict[str, list[int]]  # numbers of its columns, time being 0
    heights: tuple[float, ...]  # of the living room's thermometers, from below [m]


EXPERIMENTS = {
    1: Experiment(
        STUDIES / "twin_house_shutters.toml",
        "validationdataN2Exp1.txt",
        "2013-01-01",
        "2013-08-21",
        "2013-09-30",
        {  # the first week of 30 degC is given for a start
            "30 degC held": slice("2013-08-28 00:10", "2013-08-29 17:40"),
            "random heat": slice("2013-08-29 17:50", "2013-09-14 00:10"),
            "25 degC held": slice("2013-09-14 00:20", "2013-09-20 00:10"),
            "floating": slice("2013-09-20 00:20", "2013-09-30 23:59"),
        },
        {
            "cellar": [3],
            "kitchen": [10],
            "doorway": [11],
            "living": [4, 5, 6],
            "corridor": [7],
            "child": [9],
            "attic": [1, 2],
            "heater": [19],
            "supply_m3_h": [30],
            "supply_c": [28],
            "T": [35],
            "G": [36],
            "D": [37],
            "L": [42],
            "south": [40],
            "wind_from": [45],
            "wind": [44],
            "RH": [46],
        },
        (0.67, 1.25, 1.87),
    ),
    2: Experiment(
        STUDIES / "twin_house_living.toml",
        "validationdataExp2.txt",
        "2014-01-01",
        "2014-04-10",
        "2014-05-19",
        {
            "30 degC held": slice("2014-04-14 00:10", "2014-04-17 07:50"),
            "floating": slice("2014-04-17 08:00", "2014-04-23 16:10"),
            "30 degC held again": slice("2014-04-23 16:20", "2014-04-29 00:50"),
            "random heat": slice("2014-04-29 01:00", "2014-05-13 23:59"),
            "30 degC held at last": slice("2014-05-14 01:10", "2014-05-19 23:50"),
        },
        {
            "cellar": [1],
            "kitchen": [2],
            "doorway": [3],
            "living": [5, 6, 9],
            "corridor": [10],
            "child": [14, 15, 16],
            "attic": [17, 18, 19],
            "heater": [27],
            "supply_m3_h": [31],
            "supply_c": [33],
            "T": [53],
            "G": [54],
            "D": [55],
            "L": [56],
            "south": [59],
            "wind_from": [61],
            "wind": [62],
            "RH": [63],
        },
        (0.10, 1.10, 1.70),
    ),
}
# solar values of the panes by EN 410's spectrum at each 10 degrees, as the house's description has
# them: transmittance, absorptance of both panes together
ANGLES = np.radians(np.arange(0.0, 91.0, 10.0))
PASSED = np.array([0.543, 0.546, 0.538, 0.528, 0.514, 0.486, 0.426, 0.310, 0.145, 0.0])
ABSORBED = np.array([0.192, 0.195, 0.203, 0.212, 0.218, 0.227, 0.245, 0.257, 0.215, 0.0])
NAME = "4/16/4 low-e of the Twin Houses"


def measured(folder: Path, experiment: Experiment) -> pd.DataFrame:
    """Channels of the experiment by name, ten-minute means by the end of their interval."""
    rows = np.loadtxt(folder / experiment.table, skiprows=2)
    times = pd.Timestamp(experiment.year) + pd.to_timedelta(rows[:, 0], unit="s")
    data = {name: rows[:, numbers].mean(axis=1) for name, numbers in experiment.channels.items()}
    data["living"] = rows[:, experiment.channels["living"]] @ layer_shares(experiment.heights)
    table = pd.DataFrame(data, index=times.round("min"))
    start = pd.Timestamp(experiment.first) + STEP
    end = pd.Timestamp(experiment.last) + pd.Timedelta(days=1)
    every = pd.date_range(start, end, freq=STEP)  # some rows are missing: linear between others
    return table.reindex(table.index.union(every)).interpolate("time").loc[every]


def layer_shares(heights: Sequence[float]) -> NDArray[np.float64]:
    """Shares of the room's air: each thermometer stands for the layer nearest to it."""
    between = [0.5 * (low + high) for low, high in pairwise(heights)]
    shares: NDArray[np.float64] = np.diff([0.0, *between, HEIGHT]) / HEIGHT
    return shares


def write_inputs(data: pd.DataFrame, folder: Path, study: Path) -> Path:
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
            "north": north_c(data).to_numpy(),
            "living": data["living"].to_numpy(),
            "heater_w_m2": (data["heater"].clip(lower=0) / FLOOR).to_numpy(),
            "supply_ach": (data["supply_m3_h"].clip(lower=0) / VOLUME).to_numpy(),
            "supply_c": data["supply_c"].to_numpy(),
        }
    )
    table.to_csv(inputs / "measured.csv", index=False, float_format="%.4f")
    reflected = 1.0 - PASSED - ABSORBED  # from the room too: that side is not told
    klems = specular_matrices(AngularTable(ANGLES, PASSED, reflected, reflected))
    nothing = np.zeros_like(PASSED)
    white = specular_matrices(AngularTable(ANGLES, nothing, nothing + 0.6, nothing + 0.6))
    for name, matrices in (("glass", klems), ("shutter", white)):
        bands = {"Visible": matrices, "Solar": matrices}
        write_bsdf_xml(BsdfFile(bands, name=f"{NAME} {name}"), inputs / f"{name}.xml")
    return Path(shutil.copy(study, folder / study.name))


def compare(study: Path, data: pd.DataFrame) -> pd.DataFrame:
    """Ours and the measured air [degC]."""
    (year,), _ = run_study(read_study(study), silent)
    ends = year.hours.index + pd.Timedelta(minutes=5)
    both = pd.DataFrame({"mitsuba-cfs": year.hours["air_c"].to_numpy()}, index=ends)
    return both.join(data["living"].rename("measured"), how="inner")


def heat_to_hold(study: Path, data: pd.DataFrame) -> pd.Series:
    """The heater's power that holds the measured air in our room [W], by the intervals' ends."""
    found = read_study(study)
    column = found.schedules["heater"].model_copy(update={"column": "living"})
    held = found.model_copy(
        update={
            "gains": found.gains.model_copy(update={"equipment_w_m2": 0.0}),
            "loads": found.loads.model_copy(
                update={"heating_c": "living", "heating_radiant": found.gains.radiant_share}
            ),
            "schedules": found.schedules | {"living": column},
        }
    )
    (year,), _ = run_study(held, silent)
    ends = year.hours.index + pd.Timedelta(minutes=5)
    return pd.Series(year.hours["heating_w"].to_numpy(), index=ends).reindex(data.index)


def north_c(data: pd.DataFrame) -> pd.Series:
    """The air behind the north partition: kitchen and entrance by their shares of it [degC]."""
    return 0.58 * data["kitchen"] + 0.42 * data["doorway"]


def what_is_missing(data: pd.DataFrame, held: pd.Series) -> tuple[float, float]:
    """By what the heater gives more than our room needs, daily means after four days.

    Returns: least squares for each kelvin to the rooms in the north [W/K], and for each W/m2 of
        sun measured on the south facade [m2]; positive: our room has too much of it.
    """
    days = (
        pd.DataFrame({"north": data["living"] - north_c(data), "south": data["south"], "more": data["heater"] - held})
        .resample("D")
        .mean()
        .iloc[4:-1]
    )
    of, *_ = np.linalg.lstsq(days[["north", "south"]].to_numpy(), days["more"].to_numpy())
    return float(of[0]), float(of[1])


def by_phase(experiment: Experiment, study: Path, data: pd.DataFrame, held: pd.Series) -> pd.DataFrame:
    """A row a phase: errors of the air [K]; the mean power that holds the measured air [W]."""
    both = compare(study, data)
    rows = []
    for name, times in experiment.phases.items():
        part = both.loc[times]
        gap, daily = part["mitsuba-cfs"] - part["measured"], part.resample("D").max()
        rows.append(
            {
                "phase": name,
                "intervals": len(part),
                "RMSE [K]": np.sqrt((gap**2).mean()),
                "bias [K]": gap.mean(),
                "daily maxima [K]": (daily["mitsuba-cfs"] - daily["measured"]).mean(),
                "heat to hold [W]": held.loc[times].mean(),
                "heater [W]": data.loc[times, "heater"].mean(),
            }
        )
    return pd.DataFrame(rows)


def main(source: Path, folder: Path, *, experiment: Annotated[int, EXPERIMENTS] = 2) -> dict[str, pd.DataFrame]:
    """Write the inputs, run `cfs thermal`'s study, compare by phase."""
    chosen = EXPERIMENTS[experiment]
    data = measured(source, chosen)
    study = write_inputs(data, folder, chosen.study)
    held = heat_to_hold(study, data)
    north, south = what_is_missing(data, held)
    missing = f"missing: {north:.1f} W/K to the north, {south:.2f} m2 of the south's sun"
    return {missing: by_phase(chosen, study, data, held).round(2)}
