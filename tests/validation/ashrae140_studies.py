"""ASHRAE 140 cases said in study files alone, against the range of the standard's programs.

    python -m tests.validation ashrae140_studies ../shared/reference/ashrae140 FOLDER

Copies docs/tutorials/ashrae140 and the standard's weather into FOLDER and runs each file as
`cfs thermal` does: panes by layers, sun and view factors traced.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from mitsuba_cfs.progress import silent
from scenes.heat.study import ThermalYear, run_study
from scenes.heat.study_file import read_study
from tests.validation.ashrae140 import RANGES, WEATHER, judged_figures

STUDIES = Path(__file__).parents[2] / "docs" / "tutorials" / "ashrae140"


def copied(reference: Path, folder: Path) -> list[Path]:
    """The study files with the weather beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(reference / WEATHER, folder)
    return [Path(shutil.copy(file, folder)) for file in sorted(STUDIES.glob("*.toml"))]


def figures(name: str, year: ThermalYear) -> dict[str, float]:
    """The standard's outputs of a case from the hours of `cfs thermal`: MWh, kW or degC."""
    hours = year.hours
    if name.endswith("FF"):
        air = hours["air_c"]
        return {"maximum": air.max(), "minimum": air.min(), "average": air.mean()}
    heating, cooling = hours["heating_w"], hours["cooling_w"]
    return {
        "heating": heating.sum() / 1e6,
        "cooling": cooling.sum() / 1e6,
        "peak heating": heating.max() / 1e3,
        "peak cooling": cooling.max() / 1e3,
    }


def compare(reference: Path, folder: Path, only: Sequence[str] = ()) -> pd.DataFrame:
    """One row per case and output: mitsuba-cfs, and the range of the example programs."""
    ranges, rows = json.loads((reference / RANGES).read_text()), []
    for file in copied(reference, folder):
        if only and file.stem not in only:
            continue
        (year,), _ = run_study(read_study(file), silent)
        rows += judged_figures(file.stem, figures(file.stem, year), ranges)
    return pd.DataFrame(rows)


def main(reference: Path, folder: Path, only: Sequence[str] = ()) -> pd.DataFrame:
    """A row for each case and output."""
    return compare(reference, folder, only)
