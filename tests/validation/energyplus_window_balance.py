"""Whether EnergyPlus' balance of a window closes, without and with a shade inside.

    python -m tests.validation energyplus_window_balance FOLDER --reference DIR \
        --epw FRA_Strasbourg.071900_IWEC.epw

The room of `energyplus_by_study` to the south, kept at 20 to 26 degC.  Outdoors a window loses what
it takes from the room and what it absorbs: sun, and longwave of people and computers.  The first
table has the means of these flows in January by EnergyPlus' steps [W/m2 of the window], the second
heating and cooling of the year [kWh] by the radiant share of the gains.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from tests.validation.energyplus_by_study import (
    KEPT,
    PATCHES,
    known_window,
    our_year,
    study_text,
    window_text,
)
from tests.validation.energyplus_program import Model, room_model, run_written
from tests.validation.energyplus_reference import JOULES, LOADS

SYSTEMS = ("clear", "clear int_shade", "dgu", "int_shade")
RADIANT_SHARES = (0.5, 0.0)  # of the gains; the first is the room's
AREA, ROOM_AREA = 4.5, 94.0  # of the window and of all inner faces [m2]
GAINS_W = 235.0  # of person and computers, from 8 to 18 h
STEPS = 6  # per hour
LOSSES = ("Convection Heat Gain Rate", "Net Thermal Radiation Heat Gain Rate")
ROOM_GLASS = ("Glazing Zone Convection Heat Gain Rate", "Glazing Net Infrared Heat Transfer Rate")
ROOM_SHADE = (
    "Gap between Shade and Glazing Zone Convection Heat Gain Rate",
    "Shade Zone Convection Heat Gain Rate",
    "Shade Net Infrared Heat Transfer Rate",
)
SUN_GLASS = ("Total Glazing Layers Absorbed Solar Radiation Rate",)
SUN_SHADE = (*SUN_GLASS, "Shading Device Absorbed Solar Radiation Rate")


def balance(folder: Path, epw: Path, system: str) -> pd.DataFrame:
    """Means of the window's flows [W/m2] at night, in the dark with gains, and by day."""
    shaded = "shade" in system
    parts = {
        "outdoors": ("Surface Outside Face ", LOSSES, -1.0),
        "room": ("Surface Window Inside Face ", ROOM_SHADE if shaded else ROOM_GLASS, -1.0),
        "sun": ("Surface Window ", SUN_SHADE if shaded else SUN_GLASS, 1.0),
    }
    names = [head + name for head, group, _ in parts.values() for name in group]
    patches, outputs = PATCHES.get(system, (system,)), dict.fromkeys(f"WINDOW:{n}" for n in names)
    model = room_model("S", *patches, "ideal_loads_20_26", outputs=outputs, steps=STEPS)
    for output in model["Output:Variable"].values():
        output["reporting_frequency"] = "Timestep"
    model["RunPeriod"]["year"]["end_month"] = 1
    model["Output:Diagnostics"] = {
        "more": {"diagnostics": [{"key": "DisplayAdvancedReportVariables"}]}
    }
    steps = _run(model, folder, epw)
    flows = pd.DataFrame(
        {
            name: sign * sum(steps[f"WINDOW:{head}{column}"] for column in group) / AREA
            for name, (head, group, sign) in parts.items()
        }
    )
    hour = np.arange(len(flows)) // STEPS % 24
    used = (hour >= 8) & (hour < 18)
    flows["gains"] = np.where(used, 0.5 * GAINS_W / ROOM_AREA, 0.0)
    flows["missing"] = flows["outdoors"] - flows["room"] - flows["sun"] - flows["gains"]
    dark = flows["sun"].to_numpy() < 0.01
    times = {"without gains": dark & ~used, "with gains, dark": dark & used, "sun": ~dark & used}
    rows = [{"system": system, "when": when} | dict(flows[at].mean()) for when, at in times.items()]
    return pd.DataFrame(rows)


def year_of_loads(folder: Path, reference: Path, epw: Path, system: str) -> pd.DataFrame:
    """Heating and cooling [kWh] by the radiant share of the gains, ours and EnergyPlus'."""
    window = window_text(known_window(folder, reference, system), system, "layers")
    rows = []
    for share in RADIANT_SHARES:
        model = room_model(
            "S", *PATCHES.get(system, (system,)), "ideal_loads_20_26", outputs=LOADS, steps=STEPS
        )
        for kind in ("ElectricEquipment", "People"):
            for gain in model[kind].values():
                gain["fraction_radiant"] = share
        other = _run(model, folder, epw)
        study = folder / f"{system} radiant {share:g}.toml"
        text = study_text(epw, "S", window, KEPT)
        study.write_text(text.replace("radiant_share = 0.5", f"radiant_share = {share}"), "utf-8")
        hours = our_year(study)
        row: dict[str, object] = {"system": system, "radiant share": share}
        for what, name in zip(("heating", "cooling"), LOADS, strict=True):
            row[what] = float(hours[f"{what}_w"].sum()) / 1e3
            row[f"{what} E+"] = float(other[name].sum()) / JOULES
        rows.append(row)
    return pd.DataFrame(rows)


def _run(model: Model, folder: Path, epw: Path) -> pd.DataFrame:
    run = folder / "energyplus"
    run.mkdir(parents=True, exist_ok=True)
    (run / "in.epJSON").write_text(json.dumps(model), encoding="utf-8")
    return run_written(run / "in.epJSON", epw).drop(columns="Date/Time").astype(float)


def main(folder: Path, *, reference: Path, epw: Path) -> dict[str, pd.DataFrame]:
    """Both tables."""
    folder.mkdir(parents=True, exist_ok=True)
    return {
        "Balance": pd.concat([balance(folder, epw, system) for system in SYSTEMS]),
        "Loads": pd.concat([year_of_loads(folder, reference, epw, s) for s in SYSTEMS]),
    }
