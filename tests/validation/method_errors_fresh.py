r"""What `--method auto` expects, judged on systems, suns and rooms that it was not made of.

    python -m tests.validation method_errors_fresh --weather CITY.epw BSDF.xml ... \
        [--hours 4] [--size 96] [--rooms near deep] [--sun-in-view] [--json FILE]

Rooms that `method_errors` does not have: "near", 6 x 4 m with three windows to the west and the
eye 1.2 m behind the middle one; "deep", 3.5 x 8 m with a strip of glass below the ceiling to the
south-east and the eye in its middle, looking along the wall.  Weather and BSDF files are given;
measured errors are those of `method_errors`, expected ones those of the table that ships.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

from bim.sensors import sensor_grid
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from scenes.calibration.errors import FILE, LEAST, MeasuredErrors
from tests.validation.method_errors import BARS, BRIGHT, measured, method_matrices, traits_of, with_sun

NEAR = [WindowRectangle(x, 0.8, 1.6, 1.7) for x in (0.3, 2.2, 4.1)]
DEEP = [WindowRectangle(0.2, 1.9, 3.1, 0.8)]


def rooms(size: int) -> dict[str, DaylightScene]:
    """The rooms by name."""
    near = shoebox(6.0, 4.0, 2.8, windows=NEAR, facing_deg=270.0)
    deep = shoebox(3.5, 8.0, 3.0, windows=DEEP, facing_deg=135.0)
    found = {}
    for name, building, behind, turned in (("near", near, 1.2, 0.0), ("deep", deep, 4.0, 60.0)):
        space = building.spaces[0]
        window = space.windows[len(space.windows) // 2]
        eye = window.centre - behind * window.normal
        azimuth = np.arctan2(window.normal[1], window.normal[0]) + np.radians(turned)
        towards = (np.cos(azimuth), np.sin(azimuth), 0.0)
        view = fisheye((eye[0], eye[1], 1.2), towards, size)
        points, normals = (one[:1] for one in sensor_grid(space))
        found[name] = DaylightScene(
            interior_surfaces(space), Surfaces.none(), window_groups(space), points, normals, view
        )
    return found


def fresh_hours(weather: Weather, hours: int, scene: DaylightScene | None = None) -> AnnualSky:
    """Bright hours spread over a year, wherever their sun stands.

    Args: scene: the sun stands in a window before its eye.
    """
    series = sky_series(weather)
    chosen = series.diffuse_horizontal > BRIGHT if scene is None else with_sun(scene, series)
    bright = np.flatnonzero(chosen)
    return annual_sky(weather, hours=bright[np.linspace(0, len(bright) - 1, hours + 2)[1:-1].astype(int)])


def visible(path: Path) -> Bsdf:
    """The visible band of a file."""
    bands = read_bsdf_xml(path).bands
    if "Visible" not in bands:
        raise DataError("has no Visible band", file=path)
    return bands["Visible"]


def compared(scene: DaylightScene, lit: AnnualSky, files: list[Path], room: str) -> list[dict]:
    """Expected and measured error of every method and metric, for each file."""
    table = MeasuredErrors.read(FILE)
    traced = {method: method_matrices(method, scene) for method in METHODS}
    rows = []
    for path in files:
        bsdf = visible(path)
        traits = traits_of(scene, bsdf, lit)
        found, said = measured(scene, traced, bsdf, lit), table.expected(traits)
        far = float(table.distances(traits).min())
        rows += [
            {
                "room": room,
                "system": path.stem,
                "pair": " ".join(pair),
                "expected": value,
                "measured": found[" ".join(pair)],
                "distance": far,
                "sun": traits.sun,
            }
            for pair, value in said.items()
        ]
        print(json.dumps(rows[-len(said) :]), file=sys.stderr, flush=True)
    return rows


def print_table(rows: list[dict]) -> None:
    """Expected beside measured, and the promises that were not kept."""
    print("| room, system | sun in view, distance | method, metric | expected [%] | measured [%] |")
    print("|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row['room']}, {row['system']} | {row['sun']:.2f}, {row['distance']:.1f} | "
            f"{row['pair']} | {100 * row['expected']:.1f} | {100 * row['measured']:.1f} |"
        )
    broken = sum(r["expected"] <= bar < r["measured"] for r in rows for bar in BARS)
    ratio = [row["expected"] / max(row["measured"], LEAST) for row in rows]
    print(
        f"\nbroken promises: {broken} of {len(rows) * len(BARS)}; expected over measured: "
        f"median {np.median(ratio):.2f}, 10 to 90 % {np.quantile(ratio, 0.1):.2f} to "
        f"{np.quantile(ratio, 0.9):.2f}"
    )


def main(
    files: Sequence[Path],
    *,
    weather: Path,
    rooms_: Annotated[Sequence[str], ("near", "deep")] = ("near", "deep"),
    hours: int = 4,
    sun_in_view: Annotated[bool, "in a window before the eye"] = False,
    size: Annotated[int, "pixels of a side"] = 96,
    json_: Path | None = None,
) -> None:
    """Measure and compare."""
    variants.activate()
    known, weather, rows = rooms(size), read_epw(weather), []
    for name in rooms_:
        scene = known[name]
        lit = fresh_hours(weather, hours, scene if sun_in_view else None)
        rows += compared(scene, lit, files, name)
    print_table(rows)
    if json_ is not None:
        json_.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
