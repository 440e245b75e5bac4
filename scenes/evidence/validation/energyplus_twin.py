"""The rooms of study files, and the same model computed by EnergyPlus.

    python -m scenes.evidence.validation.energyplus_twin STUDY.toml [...] --out FOLDER

Each study runs by `cfs thermal STUDY.toml --energyplus`; EnergyPlus then runs the model that this
has written, with the study's own weather file.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from mitsuba_cfs.progress import silent
from scenes.evidence.validation.energyplus_run import run_written
from scenes.heat.energyplus import energyplus_twin
from scenes.heat.study import BalancedRooms, run_study
from scenes.heat.study_file import StudyFile, read_study

SETTLED = 7 * 24  # hours left out of the temperatures at the start
AIR = "Zone Mean Air Temperature"
HEATING = "Zone Ideal Loads Zone Sensible Heating Rate"
COOLING = "Zone Ideal Loads Zone Sensible Cooling Rate"
INCIDENT = "Surface Outside Face Incident Solar Radiation Rate per Area"
SUN = "Surface Window Transmitted Solar Radiation Rate"


def compared(path: Path, folder: Path) -> pd.DataFrame:
    """Air [K] and loads [kWh] of every room of a study, ours and EnergyPlus'."""
    study = read_study(path)
    kept: list[BalancedRooms] = []
    run_study(study, silent, balanced=kept.append)
    return _rows(study, kept[0], folder)


def _rows(study: StudyFile, found: BalancedRooms, folder: Path) -> pd.DataFrame:
    twin = energyplus_twin(study, found)
    folder.mkdir(parents=True, exist_ok=True)
    model, *_ = twin.write(folder)
    theirs = run_written(model, study.weather)
    rows = []
    for zone, room, result in zip(twin.zones, found.rooms, found.results, strict=True):
        air = theirs[f"{shouted(zone)}:{AIR}"].to_numpy()
        plant = shouted(f"{zone} plant")
        on, through = (
            sum(
                theirs[shouted(f"{zone} W{k}") + f":{key}"].sum() * factor
                for k, factor in enumerate(areas)
            ) / 1e3
            for key, areas in (
                (INCIDENT, [window.area for window in room.zone.windows]),
                (SUN, [1.0] * len(room.zone.windows)),
            )
        )  # fmt: skip
        gap = (result.air_c - air)[SETTLED:]
        row = {"room": result.name, "air RMSE": np.sqrt(np.mean(gap**2)), "bias": gap.mean()}
        for name, ours, key in (
            ("heating", result.heating, HEATING),
            ("cooling", result.cooling, COOLING),
        ):
            row[name] = ours.sum() / 1e3
            other = theirs.get(f"{plant}:{key}")
            row[f"{name} E+"] = np.nan if other is None else other.sum() / 1e3
        for name, key, other in (
            ("sun on", "incident_w", on),
            ("sun in", "transmitted_w", through),
        ):
            row[name] = room.gains.get(key, np.zeros(1)).sum() / 1e3
            row[f"{name} E+"] = other
        rows.append(row)
    table = pd.DataFrame(rows).set_index("room")
    total = table.drop(columns=["air RMSE", "bias"]).sum()
    total["air RMSE"], total["bias"] = (
        np.sqrt((table["air RMSE"] ** 2).mean()),
        table["bias"].mean(),
    )
    return pd.concat([table, total.to_frame("all").T])


def shouted(name: str) -> str:
    """A name as EnergyPlus writes it: ASCII letters alone become capitals."""
    return "".join(c.upper() if c.isascii() else c for c in name)


def main(words: list[str] | None = None) -> None:
    """Print a table for each study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args(words)
    for path in chosen.studies:
        table = compared(path, chosen.out / path.stem)
        sys.stdout.write(f"{path.name}\n{table.round(2).to_string()}\n")


if __name__ == "__main__":
    main()
