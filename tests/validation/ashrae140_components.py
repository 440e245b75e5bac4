"""Sun through the shaded window of ASHRAE 140 by its parts: ours traced, and EnergyPlus' own.

    python -m tests.validation ashrae140_components --reference DIR

Cases 600 and 610 (overhang) [kWh/m2 of window a year]: sun, sky and ground light on the glass, and
through it.  The programs behind the standard's range pass all diffuse light with the glass's
hemispherical transmittance; a traced matrix keeps its direction.  `flat` is the traced light with
that same simplification.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.sky.epw import read_epw
from tests.benchmarks.thermal_year import energyplus_room
from tests.validation.ashrae140 import WEATHER
from tests.validation.ashrae140_cases import DEPTH, HEIGHT, WIDTH, cases
from tests.validation.ashrae140_sun import glass
from tests.validation.ashrae140_traced import patch_transmittance, traced_light
from tests.validation.energyplus_model import (
    Model,
    detailed_surface,
    hourly_outputs,
    run_energyplus,
)

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
_X, _Y, _Z = WIDTH, DEPTH, HEIGHT
_BOX = {  # vertices counter-clockwise from outside, upper left first
    "FACADE": ("Wall", [(0, 0, _Z), (0, 0, 0), (_X, 0, 0), (_X, 0, _Z)]),
    "WEST": ("Wall", [(0, _Y, _Z), (0, _Y, 0), (0, 0, 0), (0, 0, _Z)]),
    "EAST": ("Wall", [(_X, 0, _Z), (_X, 0, 0), (_X, _Y, 0), (_X, _Y, _Z)]),
    "NORTH": ("Wall", [(_X, _Y, _Z), (_X, _Y, 0), (0, _Y, 0), (0, _Y, _Z)]),
    "FLOOR": ("Floor", [(0, 0, 0), (0, _Y, 0), (_X, _Y, 0), (_X, 0, 0)]),
    "ROOF": ("Roof", [(0, _Y, _Z), (0, 0, _Z), (_X, 0, _Z), (_X, _Y, _Z)]),
}
_OVERHANG = [(0, 0, _Z), (0, -1, _Z), (_X, -1, _Z), (_X, 0, _Z)]


def energyplus_model(name: str, outputs: dict[str, str]) -> Model:
    """The box of a case with its south windows and its glass, for the sun alone."""
    model = energyplus_room("S") | hourly_outputs(outputs)
    model["BuildingSurface:Detailed"] = {
        wall: detailed_surface(
            kind, "FACADE", "ROOM", "Adiabatic" if wall == "FLOOR" else "Outdoors", vertices
        )
        for wall, (kind, vertices) in _BOX.items()
    }
    model["Zone"]["ROOM"] = {"volume": _X * _Y * _Z}
    opening = cases()[name].openings[0]
    model["FenestrationSurface:Detailed"] = {
        window: _window(x, y) for window, (x, y) in zip(WINDOWS, opening.windows, strict=True)
    }
    if opening.devices:
        corners = [
            {f"vertex_{axis}_coordinate": c for axis, c in zip("xyz", v, strict=True)}
            for v in _OVERHANG
        ]
        shade = {"base_surface_name": "FACADE", "vertices": corners, "number_of_vertices": 4}
        model["Shading:Zone:Detailed"] = {"OVERHANG": shade}
    return model


def _window(x: tuple[float, float], y: tuple[float, float]) -> dict[str, object]:
    window: dict[str, object] = {
        "surface_type": "Window",
        "construction_name": "GLAZING",
        "building_surface_name": "FACADE",
        "number_of_vertices": 4,
    }
    corners = [(x[0], 0, y[1]), (x[0], 0, y[0]), (x[1], 0, y[0]), (x[1], 0, y[1])]
    for i, vertex in enumerate(corners, 1):
        window |= {f"vertex_{i}_{a}_coordinate": c for a, c in zip("xyz", vertex, strict=True)}
    return window


def energyplus_sun(name: str, epw: Path) -> dict[str, tuple[float, float]]:
    """On the glass and through it [kWh/m2] by part, as EnergyPlus computes it."""
    outputs = {
        f"{window}:{variable}": f"{window} {kind} {part}"
        for window in WINDOWS
        for kind, table in (("on", FALLING), ("through", PASSING))
        for part, variable in table.items()
    }
    year = run_energyplus(energyplus_model(name, outputs), epw, outputs=outputs).sum() / 1e3
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
            rows.append({"case": name, "part": part, "on: EnergyPlus": on,
                         "on: traced": float(radiance @ omega), "through: EnergyPlus": through,
                         "through: traced": traced, "through: flat": simple})  # fmt: skip
    table = pd.DataFrame(rows)
    totals = table.drop(columns="part").groupby("case").sum().reset_index().assign(part="all")
    return pd.concat([table, totals], ignore_index=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reference", type=Path, required=True)
    options = parser.parse_args(arguments)
    sys.stdout.write(compare(options.reference).round(1).to_string(index=False) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
