"""The rooms of study files, and the same model computed by EnergyPlus.

    python -m scenes.evidence.validation.energyplus_twin STUDY.toml [...] --out FOLDER

Each study runs by `cfs thermal STUDY.toml --energyplus`; EnergyPlus then runs the model that this
has written, with the study's own weather file.  With `--their-sun` our balance is solved again with
EnergyPlus' sun in every hour: on the outer walls, absorbed by the window layers as what falls on
the glass, indoors as what passes it.  What still differs then is not the sun's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.progress import silent
from scenes.evidence.validation.energyplus_run import run_written
from scenes.heat.energyplus import energyplus_twin
from scenes.heat.study import BalancedRooms, run_study
from scenes.heat.study_file import read_study
from scenes.room.zone import RoomZone, balances

Hours = NDArray[np.float64]  # [H] or [H, N]
LEAST_SUN = 1.0  # [W] of a room, below which ours has no pattern
SETTLED = 7 * 24  # hours left out of the temperatures at the start
AIR = "Zone Mean Air Temperature"
HEATING = "Zone Ideal Loads Zone Sensible Heating Rate"
COOLING = "Zone Ideal Loads Zone Sensible Cooling Rate"
INCIDENT = "Surface Outside Face Incident Solar Radiation Rate per Area"
SUN = "Surface Window Transmitted Solar Radiation Rate"


def compared(path: Path, folder: Path, *, their_sun: bool = False) -> list[pd.DataFrame]:
    """Air [K] and loads [kWh] of every room of a study, ours and EnergyPlus'.

    Args: their_sun: a second table, of ours with EnergyPlus' sun.
    """
    study = read_study(path)
    kept: list[BalancedRooms] = []
    run_study(study, silent, balanced=kept.append)
    found = kept[0]
    twin = energyplus_twin(study, found)
    folder.mkdir(parents=True, exist_ok=True)
    model, *_ = twin.write(folder)
    theirs = run_written(model, study.weather)
    tables = [_rows(twin.zones, found, theirs)]
    if their_sun:
        pairs = zip(twin.zones, found.rooms, strict=True)
        rooms = [with_their_sun(zone, room, theirs) for zone, room in pairs]
        results = balances(
            rooms, found.weather, study.options.heat_step_s,
            air_links=found.air_links, transfers=found.transfers, terrain=study.terrain,
        )  # fmt: skip
        tables.append(_rows(twin.zones, replace(found, rooms=rooms, results=results), theirs))
    return tables


def their_sums(zone: str, room: RoomZone, theirs: pd.DataFrame) -> tuple[Hours, Hours]:
    """EnergyPlus' sun [H] [W] on the windows of a room, and through them."""
    glass = [shouted(f"{zone} W{k}") for k in range(len(room.zone.windows))]
    areas = [window.area for window in room.zone.windows]
    on, through = np.zeros(len(theirs)), np.zeros(len(theirs))
    for name, area in zip(glass, areas, strict=True):
        on += area * theirs[f"{name}:{INCIDENT}"].to_numpy()
        through += theirs[f"{name}:{SUN}"].to_numpy()
    return on, through


def with_their_sun(zone: str, room: RoomZone, theirs: pd.DataFrame) -> RoomZone:
    """A room with EnergyPlus' sun: its sums of every hour, spread as ours are.

    An hour in which we have no sun is spread as our year's.
    """
    sun = room.solar
    sums = dict(zip(("incident_w", "transmitted_w"), their_sums(zone, room, theirs), strict=True))

    def scaled(values: Hours | None, name: str) -> Hours | None:
        if values is None or name not in room.gains:
            return values
        own, dark = room.gains[name], room.gains[name] < LEAST_SUN
        share = values / np.where(dark, 1.0, own)[:, None]
        share[dark] = values.sum(axis=0) / max(own.sum(), LEAST_SUN)
        return share * sums[name][:, None]

    facade = sun.facade.copy()
    for index in np.flatnonzero([one.outside == "outdoor" for one in room.zone.surfaces]):
        name = shouted(f"{zone} S{index}")
        parts = [c for c in theirs if c.split(".")[0].split(":")[0] == name and INCIDENT in c]
        if parts:  # a frame's is that of the wall it is in, which stays ours
            facade[:, index] = theirs[parts].to_numpy().mean(axis=1)
    solar = replace(
        sun,
        absorbed_outer=scaled(sun.absorbed_outer, "incident_w"),
        absorbed_inner=scaled(sun.absorbed_inner, "incident_w"),
        inside=scaled(sun.inside, "transmitted_w"),
        window_inside=scaled(sun.window_inside, "transmitted_w"),
        facade=facade,
    )
    return replace(room, solar=solar, gains=room.gains | sums)


def _rows(zones: Sequence[str], found: BalancedRooms, theirs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for zone, room, result in zip(zones, found.rooms, found.results, strict=True):
        air = theirs[f"{shouted(zone)}:{AIR}"].to_numpy()
        plant = shouted(f"{zone} plant")
        on, through = (sums.sum() / 1e3 for sums in their_sums(zone, room, theirs))
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
    parser.add_argument("--their-sun", action="store_true", help="ours with EnergyPlus' sun too")
    chosen = parser.parse_args(words)
    for path in chosen.studies:
        tables = compared(path, chosen.out / path.stem, their_sun=chosen.their_sun)
        for table, title in zip(tables, ("", ", ours with EnergyPlus' sun"), strict=False):
            sys.stdout.write(f"{path.name}{title}\n{table.round(2).to_string()}\n")


if __name__ == "__main__":
    main()
