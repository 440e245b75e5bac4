"""Sun through the windows of ASHRAE 140, traced: D matrices of the shaded windows and Perez skies.

    python -m tests.validation ashrae140_traced --reference DIR

Annual transmitted sun [kWh/m2] of cases 600, 610, 620 and 630 against the standard's tables; the
glass is the same, the light is this project's own from the weather file to the window.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Element
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import exterior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import series_matrix, sky_series
from mitsuba_cfs.sky.sun import is_up
from mitsuba_cfs.sky.three_part import three_part
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
from tests.validation.ashrae140 import RANGES, WEATHER
from tests.validation.ashrae140_cases import HEIGHT, Opening, cases
from tests.validation.ashrae140_sun import ANGLES, AshraeGlazing, glass
from tests.validation.sunlit_facade import Device, Overhang

FACING_DEG = {"south": 180.0, "east": 90.0, "west": 270.0}
TITLES = {"600": "B8-14", "610": "B8-15", "620": "B8-14", "630": "B8-15"}
SUBDIVISION = 4


def traced_light(
    opening: Opening, weather: Weather, *, samples: int = 4096, seed: int = 0
) -> dict[str, NDArray[np.float64]]:
    """Annual radiance [K] on the windows of a facade from sun, sky and ground [kWh/(m2 sr)]."""
    width = 8.0 if opening.facade == "south" else 6.0
    building = shoebox(
        width,
        6.0 if opening.facade == "south" else 8.0,
        HEIGHT,
        windows=[WindowRectangle(x[0], y[0], x[1] - x[0], y[1] - y[0]) for x, y in opening.windows],
        facing_deg=FACING_DEG[opening.facade],
    )
    space = building.spaces[0]
    groups = window_groups(space)
    frame = groups[0].frame
    plates = tuple(_element(d, i, frame) for i, d in enumerate(opening.devices))
    exterior = exterior_surfaces(replace(building, elements=plates), space, "solar")
    daylight = daylight_matrix(
        exterior, groups, subdivision=SUBDIVISION, samples=samples // 8, stopping=Stopping(batches=8), seed=seed
    )
    area = np.array([g.area for g in groups])
    seen = np.einsum("g,gkp->kp", area / area.sum(), daylight.values)
    series = three_part(sky_series(weather, "solar"))
    lit = np.flatnonzero(is_up(series.sun))
    sun, sky = (
        series_matrix(series, lit, SUBDIVISION, part, ground_reflectance=weather.albedo).sum(axis=1)
        * (weather.step_h / 1e3)
        for part in ("sun", "sky")
    )
    return {"sun": seen[:, 1:] @ sun[1:], "sky": seen[:, 1:] @ sky[1:], "ground": seen[:, 0] * (sun[0] + sky[0])}


def traced_transmission(
    opening: Opening, weather: Weather, pane: AshraeGlazing, *, samples: int = 4096, seed: int = 0
) -> float:
    """Annual sun through the windows of a facade [kWh/m2]."""
    light = sum(traced_light(opening, weather, samples=samples, seed=seed).values())
    return float(light @ (KLEMS_FULL.projected_solid_angles() * patch_transmittance(pane)))


def patch_transmittance(pane: AshraeGlazing) -> NDArray[np.float64]:
    """Transmittance [K] of the glass for uniform light from each Klems patch."""
    bounds = KLEMS_FULL.theta_bounds
    rings = np.empty(len(bounds) - 1)
    for ring in range(len(rings)):
        theta = np.linspace(bounds[ring], bounds[ring + 1], 61)
        weight = np.diff(np.sin(theta) ** 2)
        rings[ring] = np.interp(0.5 * (theta[1:] + theta[:-1]), ANGLES, pane.tau) @ weight
        rings[ring] /= weight.sum()
    return rings[KLEMS_FULL.rings]


def _element(device: Device, number: int, frame: NDArray[np.float64]) -> Element:
    """An overhang or a fin as two black triangles, from facade coordinates."""
    if isinstance(device, Overhang):
        (a, b), y = device.x, device.y
        corners = [(a, y, 0.0), (b, y, 0.0), (b, y, device.depth), (a, y, device.depth)]
    else:
        (a, b), x = device.y, device.x
        corners = [(x, a, 0.0), (x, b, 0.0), (x, b, device.depth), (x, a, device.depth)]
    world = np.array(corners) @ frame
    triangles = world[[[0, 1, 2], [0, 2, 3]]]
    return Element(f"plate-{number}", "plate", "IfcShadingDevice", triangles, 0.0, 0.0)


def compare(reference: Path, *, samples: int = 4096) -> pd.DataFrame:
    """One row per case: traced, and the range of the example programs [kWh/m2]."""
    variants.activate()
    weather = read_epw(reference / WEATHER)
    ranges = json.loads((reference / RANGES).read_text())
    pane, rows = glass("double"), []
    for name, table in TITLES.items():
        opening = cases()[name].openings[-1]  # south, or west
        row = ranges[table]["rows"][f"{name} {opening.facade.capitalize()}"]
        ours = traced_transmission(opening, weather, pane, samples=samples)
        inside = row["min"] <= ours <= row["max"]
        rows.append(
            {
                "case": name,
                "facade": opening.facade,
                "traced": ours,
                "low": row["min"],
                "high": row["max"],
                "inside": bool(inside),
            }
        )
    return pd.DataFrame(rows)


def main(*, reference: Path) -> pd.DataFrame:
    """Print the table."""
    return compare(reference).round(1)
