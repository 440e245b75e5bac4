"""The reference room said in a study file alone, against EnergyPlus.

    python -m tests.validation energyplus_study

Runs docs/tutorials/energyplus_room.toml as `cfs thermal` does, sun and view factors traced, then
the same with the double glazing of the stored year in place of blind and panes; EnergyPlus' hours
are those that the tests hold.  `--energyplus DIR` has EnergyPlus compute those of the blind anew.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import pandas as pd

from mitsuba_cfs.progress import silent
from scenes.demo import WEATHER
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_program import room_model, run_energyplus

REPOSITORY = Path(__file__).parents[2]
STUDY = REPOSITORY / "docs" / "tutorials" / "energyplus_room.toml"
STORED = {
    "blind": REPOSITORY / "tests" / "reference" / "energyplus_blind" / "chicago_blind.csv.gz",
    "glazing": REPOSITORY / "tests" / "reference" / "energyplus_chicago" / "chicago.csv.gz",
}
FIRST_HOUR = 168  # the first week is left out
COLUMNS = {"air": ("air_c", "T_air"), "window": ("window_1_inside_c", "T_win_in")}
GLAZING = """[[system]]
glazing_height = 1.5
[[system.layers]]
thickness = 0.003048
solar = [0.834, 0.075, 0.075]
gap = { width = 0.012 }
[[system.layers]]
thickness = 0.003048
solar = [0.834, 0.075, 0.075]

"""


def study_hours(study: Path = STUDY) -> pd.DataFrame:
    """The hours of the study's room."""
    (year,), _ = run_study(read_study(study), silent)
    return year.hours


def glazing_study(folder: Path) -> Path:
    """The study with plain double glazing, as a file in a folder."""
    text = STUDY.read_text(encoding="utf-8")
    head, rest = text.split("[[system]]", 1)
    text = head + GLAZING + rest[rest.index("[envelope]") :]
    study = folder / "glazing.toml"
    study.write_text(text.replace("../..", REPOSITORY.as_posix()), encoding="utf-8")
    return study


def differences(hours: pd.DataFrame, what: str) -> pd.DataFrame:
    """RMSE and bias [K] of a study's hours from EnergyPlus'."""
    stored = pd.read_csv(STORED[what])
    stored = stored[stored["ori"] == "S"]
    rows = []
    for name, (ours, theirs) in COLUMNS.items():
        values = hours[ours].to_numpy()[FIRST_HOUR:], stored[theirs].to_numpy()[FIRST_HOUR:]
        rmse, bias = rmse_and_bias(*values)
        rows.append({"system": what, "": name, "RMSE [K]": rmse, "bias [K]": bias})
    return pd.DataFrame(rows)


def write_energyplus(folder: Path) -> Path:
    """EnergyPlus' hours of the blind."""
    table = run_energyplus(room_model("S", "ext_blind", "blind_study"), WEATHER)
    table = table[[theirs for _, theirs in COLUMNS.values()]]
    table.insert(0, "ori", "S")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / STORED["blind"].name
    # without a time stamp in its head the file is the same every time
    plain = {"method": "gzip", "mtime": 0}
    table.to_csv(path, index=False, float_format="%.2f", compression=plain)
    return path


def main(*, energyplus: Path | None = None) -> pd.DataFrame | str:
    """Both comparisons; energyplus: write EnergyPlus' year into this folder instead."""
    if energyplus is not None:
        return str(write_energyplus(energyplus))
    with tempfile.TemporaryDirectory() as folder:
        glazing = study_hours(glazing_study(Path(folder)))
    return pd.concat([differences(study_hours(), "blind"), differences(glazing, "glazing")])
