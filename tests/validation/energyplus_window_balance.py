"""Whether EnergyPlus' balance of a window closes, without and with a shade inside.

    python -m tests.validation energyplus_window_balance FOLDER --reference DIR \
        --epw FRA_Strasbourg.071900_IWEC.epw

The room of `energyplus_by_study` to the south, kept at 20 to 26 degC.  Outdoors a window loses what
it takes from the room and what it absorbs: sun, and longwave of people and computers.  The first
table has the means of these flows in January by EnergyPlus' steps [W/m2 of the window], the second
heating and cooling of the year [kWh] by the radiant share of the gains.  The third has the window's
heat in EnergyPlus' hour of greatest cooling [W/m2]: as EnergyPlus reports it, and by ISO 15099
layer by layer in the same surroundings.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from tests.validation.energyplus_by_study import (
    KEPT,
    PATCHES,
    clear_system,
    known_window,
    our_year,
    study_text,
    window_text,
)
from tests.validation.energyplus_program import Model, room_model, run_written
from tests.validation.energyplus_reference import JOULES, LOADS
from tests.validation.reference_systems import layers
from thermal.glazing_unit import Environment
from thermal.iso15099 import Conditions, UnitBalance, unit_balance
from thermal.layer_balance import SIGMA
from thermal.window_model import bisected

SYSTEMS = ("clear", "clear int_shade", "dgu", "int_shade")
RADIANT_SHARES = (0.5, 0.0)  # of the gains; the first is the room's
AREA, ROOM_AREA = 4.5, 94.0  # of the window and of all inner faces [m2]
GAINS_W = 235.0  # of person and computers, from 8 to 18 h
STEPS = 6  # per hour
SHADED = {"clear int_shade": lambda: clear_system(shaded=True)[1], "int_shade": lambda: layers("int_shade")}
GLAZING_WIDTH = 3.0  # [m] as the study files state it
KELVIN = 273.15
ALL_REPORTS = {"Output:Diagnostics": {"more": {"diagnostics": [{"key": "DisplayAdvancedReportVariables"}]}}}
OUTSIDE, INSIDE = "WINDOW:Surface Outside Face ", "WINDOW:Surface Inside Face "
FILM, NET_LONGWAVE = "Convection Heat Transfer Coefficient", "Net Thermal Radiation Heat Gain Rate"
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
    patches, outputs = PATCHES.get(system, (system,)), {f"WINDOW:{n}": n for n in names}
    model = room_model("S", *patches, "ideal_loads_20_26", outputs=outputs, steps=STEPS)
    for output in model["Output:Variable"].values():
        output["reporting_frequency"] = "Timestep"
    model["RunPeriod"]["year"]["end_month"] = 1
    steps = _run(model | ALL_REPORTS, folder, epw)
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
        model = room_model("S", *PATCHES.get(system, (system,)), "ideal_loads_20_26", outputs=LOADS, steps=STEPS)
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


def hour_of_greatest_cooling(folder: Path, epw: Path, system: str) -> pd.DataFrame:
    """The window's heat in EnergyPlus' hour of greatest cooling [W/m2], a row for each reckoning.

    ISO 15099 takes films, air, what both sides radiate and what glass and shade absorb from
    EnergyPlus' reports.  How the glass shares its sun among its panes is not reported: it is what
    makes the outer face as warm as there; the shade's temperature is left to show the agreement.
    """
    names = [
        *(f"{INSIDE[7:]}{n}" for n in ("Temperature", FILM)),
        *(f"{OUTSIDE[7:]}{n}" for n in ("Temperature", FILM, *LOSSES)),
        *(f"Surface Window Inside Face {n}" for n in ROOM_SHADE),
        *(f"Surface Window {n}" for n in SUN_SHADE),
        "Zone Mean Air Temperature",
        "Site Outdoor Air Drybulb Temperature",
    ]
    outputs = {f"X:{n}": n for n in names} | LOADS
    patches = PATCHES.get(system, (system,))
    model = room_model("S", *patches, "ideal_loads_20_26", outputs=outputs, steps=STEPS)
    hours = _run(model | ALL_REPORTS, folder, epw)
    at = int(hours[tuple(LOADS)[1]].argmax())
    hour = hours.iloc[at]
    unit = replace(SHADED[system](), width=GLAZING_WIDTH)
    gap, face, longwave = (hour[f"WINDOW:Surface Window Inside Face {n}"] / AREA for n in ROOM_SHADE)
    glass, shade = (hour[f"WINDOW:Surface Window {n}"] / AREA for n in SUN_SHADE)
    outer_c, inner_c = hour[f"{OUTSIDE}Temperature"], hour[f"{INSIDE}Temperature"]
    outdoors = -sum(hour[f"{OUTSIDE}{n}"] for n in LOSSES) / AREA
    reported = {
        "hour": at,
        "reckoning": "EnergyPlus",
        "outer c": outer_c,
        "shade c": inner_c,
        "air behind": gap,
        "face": face,
        "longwave": longwave,
        "outdoors": outdoors,
        "missing": gap + face + longwave + outdoors - glass - shade,
    }
    emissivity = unit.layers[0].emissivity[0], unit.layers[-1].emissivity[1]
    lost = -hour[f"{OUTSIDE}{NET_LONGWAVE}"] / AREA, longwave
    radiant = [
        ((c + KELVIN) ** 4 - w / (e * SIGMA)) ** 0.25 - KELVIN
        for c, w, e in zip((outer_c, inner_c), lost, emissivity, strict=True)
    ]
    air_c = hour["ROOM:Zone Mean Air Temperature"]
    around = Conditions(
        Environment(hour["Environment:Site Outdoor Air Drybulb Temperature"], hour[f"{OUTSIDE}{FILM}"], radiant[0]),
        Environment(air_c, hour[f"{INSIDE}{FILM}"], radiant[1]),
    )

    def absorbed(share: float) -> np.ndarray:
        return np.array([share * glass, (1.0 - share) * glass, shade])

    def warmer(share: float) -> float:
        return float(unit_balance(unit, around, absorbed(share)).faces_c[0]) - outer_c

    sun = absorbed(bisected(warmer, 0.0, 1.0))
    layered = unit_balance(unit, around, sun)
    return pd.DataFrame([reported, {"hour": at, "reckoning": "ISO 15099"} | _flows(layered, air_c, sun)]).assign(
        system=system
    )


def _flows(balance: UnitBalance, air_c: float, sun: np.ndarray) -> dict[str, float]:
    """Temperatures [degC] and the heat [W/m2] to the air behind, by the face, to outdoors."""
    face = float(balance.films[1] * (balance.faces_c[-1] - air_c))
    return {
        "outer c": float(balance.faces_c[0]),
        "shade c": float(balance.faces_c[-1]),
        "air behind": balance.air_in,
        "face": face,
        "longwave": balance.heat_in - balance.air_in - face,
        "outdoors": float(sun.sum()) - balance.heat_in,
        "missing": 0.0,
    }


def _run(model: Model, folder: Path, epw: Path) -> pd.DataFrame:
    run = folder / "energyplus"
    run.mkdir(parents=True, exist_ok=True)
    (run / "in.epJSON").write_text(json.dumps(model), encoding="utf-8")
    return run_written(run / "in.epJSON", epw).drop(columns="Date/Time").astype(float)


def main(folder: Path, *, reference: Path, epw: Path) -> dict[str, pd.DataFrame]:
    """All three tables."""
    folder.mkdir(parents=True, exist_ok=True)
    return {
        "Balance": pd.concat([balance(folder, epw, system) for system in SYSTEMS]),
        "Loads": pd.concat([year_of_loads(folder, reference, epw, s) for s in SYSTEMS]),
        "Greatest cooling": pd.concat([hour_of_greatest_cooling(folder, epw, s) for s in SHADED]),
    }
