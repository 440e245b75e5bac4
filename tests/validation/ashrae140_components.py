"""Sun through the shaded window of ASHRAE 140 by its parts: traced by mitsuba-cfs, and EnergyPlus' own.

    python -m tests.validation ashrae140_components --reference DIR

Cases 600 and 610 (overhang) [kWh/m2 of window a year]: sun, sky and ground light on the glass, and
through it.  The programs behind the standard's range pass all diffuse light with the glass's
hemispherical transmittance; a traced matrix keeps its direction.  `flat` is the traced light with
that same simplification.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.sky.epw import read_epw
from tests.validation.ashrae140 import WEATHER
from tests.validation.ashrae140_cases import cases
from tests.validation.ashrae140_sun import glass
from tests.validation.ashrae140_traced import patch_transmittance, traced_light
from tests.validation.energyplus_program import room_model, run_energyplus

WINDOWS = ("LEFT", "RIGHT")
FALLING = {
    "sun": "Surface Outside Face Incident Beam Solar Radiation Rate per Area",
    "sky": "Surface Outside Face Incident Sky Diffuse Solar Radiation Rate per Area",
    "ground": "Surface Outside Face Incident Ground Diffuse Solar Radiation Rate per Area",
}
PASSING = {
    "sun": "Surface Window Transmitted Beam Solar Radiation Rate",
    "all": "Surface Window Transmitted Solar Radiation Rate",
}


def energyplus_sun(name: str, epw: Path) -> dict[str, tuple[float, float]]:
    """On the glass and through it [kWh/m2] by part, as EnergyPlus computes it."""
    outputs = {
        f"{window}:{variable}": f"{window} {kind} {part}"
        for window in WINDOWS
        for kind, table in (("on", FALLING), ("through", PASSING))
        for part, variable in table.items()
    }
    changes = ("clear_double", "box_600", *(("box_overhang",) if name == "610" else ()))
    year = run_energyplus(room_model("S", *changes, outputs=outputs), epw, outputs=outputs)
    year = year.sum() / 1e3
    area = cases()[name].openings[0].area / len(WINDOWS)

    def mean(column: str) -> float:
        return float(sum(year[f"{window} {column}"] for window in WINDOWS) / len(WINDOWS))

    on = {part: mean(f"on {part}") for part in FALLING}
    sun, both = mean("through sun") / area, mean("through all") / area
    diffuse = on["sky"] + on["ground"]
    found = {"sun": (on["sun"], sun)}
    for part in ("sky", "ground"):  # one transmittance for all diffuse light
        found[part] = (on[part], (both - sun) * on[part] / diffuse)
    return found


def compare(reference: Path, *, samples: int = 4096) -> pd.DataFrame:
    """One row per case and part: on the glass and through it, EnergyPlus, traced, traced flat."""
    variants.activate()
    weather, pane = read_epw(reference / WEATHER), glass("double")
    omega, tau = KLEMS_FULL.projected_solid_angles(), patch_transmittance(pane)
    flat = pane.diffuse[0]
    rows = []
    for name in ("600", "610"):
        theirs = energyplus_sun(name, reference / WEATHER)
        ours = traced_light(cases()[name].openings[0], weather, samples=samples)
        for part, (on, through) in theirs.items():
            radiance = ours[part]
            traced = float(radiance @ (omega * tau))
            simple = traced if part == "sun" else flat * float(radiance @ omega)
            rows.append(
                {
                    "case": name,
                    "part": part,
                    "on: EnergyPlus": on,
                    "on: traced": float(radiance @ omega),
                    "through: EnergyPlus": through,
                    "through: traced": traced,
                    "through: flat": simple,
                }
            )
    table = pd.DataFrame(rows)
    totals = table.drop(columns="part").groupby("case").sum().reset_index().assign(part="all")
    return pd.concat([table, totals], ignore_index=True)


def main(*, reference: Path) -> pd.DataFrame:
    """A row for each case and part."""
    return compare(reference).round(1)
