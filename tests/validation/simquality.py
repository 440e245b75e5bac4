"""SimQuality's walls (TF03) and shaded windows (TF09) by study files; its sun positions (TF01).

    python -m tests.validation simquality ../shared/reference/simquality FOLDER

Runs each file of docs/tutorials/simquality as `cfs thermal` does, those of TF09 once more without
what shades them: the sun that enters with over that without is the sunlit share of the window.
Values, bounds and sizes: ghorwin/SIM-VICUS, data/validation/SimQuality.  TF01's sun stands in no
study: it is put beside the directions that every command takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.progress import silent
from mitsuba_cfs.sky.sun import direction, sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.heat.study import run_study
from scenes.heat.study_file import StudyFile, read_study

STUDIES = Path(__file__).parents[2] / "docs" / "tutorials" / "simquality"
TABLE, LOWEST, HIGHEST = (f"TF09_Referenzwerte{end}.tsv" for end in ("", "_Min", "_Max"))
ENTERS = ["inside_sun_w", "glass_sun_w"]  # what the room's faces and the panes absorb
MINUTES = "Time [min]"  # of the year; the sun of the study stands there a quarter of an hour later
STEP_DAY = 1  # day of step.csv that begins with the step
STEP_HOURS = (2, 6, 12, 24, 120)  # after it
STEP_AIR = {  # of TF03 [degC]: TF03/reference/Referenzwerte_minus8d.tsv of the same source
    "1": (20.04, 21.26, 23.48, 26.37, 30.0),
    "2": (25.09, 29.63, 30.0, 30.0, 30.0),
    "3": (20.0, 20.26, 21.67, 24.9, 29.95),
    "4": (20.0, 20.06, 20.25, 20.63, 23.17),
}
POSITIONS = "TF01_reference_states.tsv"
LIMA = Weather(  # of PER_Lima.846280_IWEC, the place of TF01's table
    "Lima",
    -12.0,
    -77.12,
    -5.0,
    13.0,
    1.0,
    times=pd.date_range("2021-01-01 00:30", periods=8760, freq="h"),
    direct_normal=np.zeros(8760),
    diffuse_horizontal=np.zeros(8760),
)
LOW = 5.0  # altitude below which the air bends the light by more than 0.15 degrees [deg]


def sun_in(study: StudyFile) -> np.ndarray:
    """The sun that the panes and the room absorb in each interval [W]."""
    (year,), _ = run_study(study, silent)
    return year.hours[ENTERS].sum(axis=1).to_numpy()


def sunlit_share(study: StudyFile) -> np.ndarray:
    """The sunlit share of a study's windows by interval; NaN where no sun falls on them."""
    open_box = study.box.model_copy(update={"plate": ()})
    unshaded = study.model_copy(update={"box": open_box, "surroundings": ()})
    whole = sun_in(unshaded)
    return np.divide(sun_in(study), whole, out=np.full(len(whole), np.nan), where=whole > 0)


def compare(reference: Path, folder: Path = STUDIES, only: Sequence[str] = ()) -> pd.DataFrame:
    """A row a variant and place of the sun: ours, the suite's value and its bounds."""
    suite, low, high = (pd.read_csv(reference / n, sep="\t") for n in (TABLE, LOWEST, HIGHEST))
    interval = (suite[MINUTES] % 1440 // 30).to_numpy()
    rows = []
    for file in sorted(folder.glob("TF09.*.toml")):
        number = file.stem.removeprefix("TF09.")
        if only and number not in only:
            continue
        column = f"Var09.{number} [---]"
        rows.append(
            pd.DataFrame(
                {
                    "variant": number,
                    "azimuth": suite["Azimuth [Deg]"],
                    "altitude": suite["Altitude [Deg]"],
                    "mitsuba-cfs": sunlit_share(read_study(file))[interval],
                    "suite": suite[column],
                    "low": low[column],
                    "high": high[column],
                }
            )
        )
    table = pd.concat(rows, ignore_index=True)
    table["inside"] = table["mitsuba-cfs"].between(table["low"], table["high"])
    return table


def step_response(folder: Path = STUDIES) -> pd.DataFrame:
    """A row a wall and hour after the step of TF03: air, ours and the suite's [degC]."""
    rows = []
    for number, theirs in STEP_AIR.items():
        (year,), _ = run_study(read_study(folder / f"TF03.{number}.toml"), silent)
        air = year.hours["air_c"]
        start = air.index[0].normalize() + pd.Timedelta(days=STEP_DAY)
        since = (air.index - start) / pd.Timedelta(hours=1)  # middles of the intervals
        ours = np.interp(STEP_HOURS, since, air)
        rows.append(pd.DataFrame({"variant": number, "hours": STEP_HOURS, "mitsuba-cfs": ours, "suite": theirs}))
    return pd.concat(rows, ignore_index=True)


def sun_angles(reference: Path) -> np.ndarray:
    """Angles between the suite's sun and ours [deg], every full hour that it is up in Lima."""
    table = pd.read_csv(reference / POSITIONS, sep="\t")
    altitude = table["Sun elevation angle [Deg]"].to_numpy()[: len(LIMA.times)]
    azimuth = table["Sun azimuth angle [Deg]"].to_numpy()[: len(LIMA.times)]
    theirs = direction(np.radians(altitude), np.radians(azimuth))
    cosine = np.clip(np.einsum("hi,hi->h", theirs, sun_directions(LIMA)), -1.0, 1.0)
    return np.degrees(np.arccos(cosine))[altitude > LOW]


def main(reference: Path, folder: Path, only: Sequence[str] = ()) -> dict[str, pd.DataFrame]:
    """The tables, written to FOLDER as CSV too; only: numbers of TF09's variants."""
    tables = {"walls": step_response(), "sunlit": compare(reference, only=only)}
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        table.to_csv(folder / f"{name}.csv", index=False)
    angles = sun_angles(reference)
    said = f"TF01: {angles.mean():.2f} degrees in the mean, {angles.max():.2f} at most"
    return tables | {said: pd.DataFrame()}
