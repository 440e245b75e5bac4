"""Radiance's view of the sun through a glazed partition: who is right of two that differ.

    python -m tests.validation inner_sun_radiance [--samples 4000]

The rooms of `inner_sun`.  `gendaymtx` sums sky and sun of the weather file over the year to the
patches of MF:4, `rfluxmtx` traces them to points on the indoor sides of window and pane.  Panes are
Radiance's `glass`: two for the window, of the same transmittance at normal incidence as the glazing
of `inner_sun`.  The room behind absorbs what passes the pane and does not return: its light [kWh],
and share [%] of what the window transmits, beside those of `cfs` and EnergyPlus.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyradiance
from numpy.typing import NDArray
from scipy.optimize import brentq

from bim.fenestration import pane_transmissivity
from mitsuba_cfs.gloss import pane_shares
from scenes.demo import WEATHER
from scenes.room.solar import GLASS_INDEX, SOLAR_CLEAR
from tests.validation.inner_sun import CASES, REAR_DEPTH, REFLECTANCE, Rectangle, energyplus, ours

GLAZING = 0.70  # transmittance of the window at normal incidence, as in `inner_sun` [-]
WIDTH, HEIGHT = 4.0, 3.0  # of the rooms [m]
STEP = 0.002  # of the points from the panes [m]
SPACING = 0.3  # of the points [m]
BOUNCES = 10
SKY = """#@rfluxmtx h=u u=Y
void glow ground_glow 0 0 4 1 1 1 0
ground_glow source ground 0 0 4 0 0 -1 180
#@rfluxmtx h=r4 u=Y
void glow sky_glow 0 0 4 1 1 1 0
sky_glow source sky 0 0 4 0 0 1 180
"""


def double_pane() -> float:
    """Transmissivity of each of two equal panes that transmit GLAZING together."""

    def together(transmissivity: float) -> float:
        tau, rho = (float(v[0]) for v in pane_shares(np.ones(1), GLASS_INDEX, transmissivity)[:2])
        return tau**2 / (1.0 - rho**2) - GLAZING

    return float(brentq(together, 0.5, 1.0))


def scene(case: str) -> str:
    """Both rooms with their panes, in Radiance's format."""
    depth, window, pane = CASES[case]
    lines = [
        *(f"void plastic {name} 0 0 5 {rho} {rho} {rho} 0 0" for name, rho in REFLECTANCE.items()),
        "void glass outer 0 0 3 {0} {0} {0}".format(double_pane()),
        "void glass inner 0 0 3 {0} {0} {0}".format(pane_transmissivity(SOLAR_CLEAR, GLASS_INDEX)),
        *_wall("facade", "wall", 0.0, window),
        *_wall("back", "wall", depth, pane),
        _level("floor", "floor", 0.0, 0.0, depth),
        _level("ceiling", "ceiling", HEIGHT, 0.0, depth),
        *(_side(f"side{x:g}", "wall", x, 0.0, depth) for x in (0.0, WIDTH)),
        _upright("outside", "outer", -0.001, window),
        _upright("inside", "outer", 0.0, window),
        _upright("partition", "inner", depth, pane),
        _upright("end", "wall", depth + REAR_DEPTH, (0.0, 0.0, WIDTH, HEIGHT)),
        _level("rear_floor", "floor", 0.0, depth, depth + REAR_DEPTH),
        _level("rear_ceiling", "ceiling", HEIGHT, depth, depth + REAR_DEPTH),
        *(_side(f"rear{x:g}", "wall", x, depth, depth + REAR_DEPTH) for x in (0.0, WIDTH)),
    ]
    return "\n".join(lines) + "\n"


def _wall(name: str, material: str, y: float, hole: Rectangle) -> list[str]:
    x, sill, width, height = hole
    strips = {
        "below": (0.0, 0.0, WIDTH, sill),
        "above": (0.0, sill + height, WIDTH, HEIGHT - sill - height),
        "left": (0.0, sill, x, height),
        "right": (x + width, sill, WIDTH - x - width, height),
    }
    return [_upright(f"{name}_{key}", material, y, r) for key, r in strips.items() if min(r[2:]) > 0]


def _upright(name: str, material: str, y: float, rectangle: Rectangle) -> str:
    x, z, width, height = rectangle
    return _polygon(name, material, [(x, y, z), (x + width, y, z), (x + width, y, z + height), (x, y, z + height)])


def _level(name: str, material: str, z: float, near: float, far: float) -> str:
    return _polygon(name, material, [(0.0, near, z), (WIDTH, near, z), (WIDTH, far, z), (0.0, far, z)])


def _side(name: str, material: str, x: float, near: float, far: float) -> str:
    corners = [(x, near, 0.0), (x, far, 0.0), (x, far, HEIGHT), (x, near, HEIGHT)]
    return _polygon(name, material, corners)


def _polygon(name: str, material: str, corners: list[tuple[float, float, float]]) -> str:
    numbers = " ".join(f"{value:.6g}" for corner in corners for value in corner)
    return f"{material} polygon {name} 0 0 12 {numbers}"


def points(rectangle: Rectangle, y: float, step: float, towards: float) -> NDArray[np.float64]:
    """Points [N, 6] on a pane's indoor side and their direction, -1 outdoors or 1 indoors."""
    x, z, width, height = rectangle
    across, up = (max(round(size / step), 1) for size in (width, height))
    xs = x + width * (np.arange(across) + 0.5) / across
    zs = z + height * (np.arange(up) + 0.5) / up
    grid = np.stack(np.meshgrid(xs, zs, indexing="ij"), axis=-1).reshape(-1, 2)
    rows = np.zeros((len(grid), 6))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 4] = grid[:, 0], y + STEP, grid[:, 1], towards
    return rows


def run(command: str, folder: Path, text: bytes = b"") -> bytes:
    """Output of a command of Radiance."""
    binaries = Path(pyradiance.__file__).parent / "bin"
    library = Path(pyradiance.__file__).parent / "lib"
    environment = os.environ | {"PATH": f"{binaries}:{os.environ['PATH']}", "RAYPATH": f".:{library}"}
    done = subprocess.run(command, shell=True, cwd=folder, env=environment, input=text, capture_output=True)
    if done.returncode:
        raise RuntimeError(done.stderr.decode()[-2000:])
    return done.stdout


def sky_of_year(weather: Path, folder: Path) -> NDArray[np.float64]:
    """Mean radiance [P] of ground and patches of MF:4 over the year [W/m2/sr]."""
    run(f"epw2wea {weather.absolute()} year.wea", folder)
    text = run("gendaymtx -h -A -m 4 -O1 -g 0.2 0.2 0.2 year.wea", folder).decode()
    return np.array(text.split(), dtype=float).reshape(-1, 3)[:, 0]


def radiance(case: str, samples: int) -> dict[str, float]:
    """Light of the year through the window, and what the room behind absorbs of it [kWh]."""
    depth, window, pane = CASES[case]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sky = sky_of_year(WEATHER, folder)
        (folder / "sky.rad").write_text(SKY)
        (folder / "room.rad").write_text(scene(case))

        def passing(rectangle: Rectangle, y: float, towards: float, bounces: int) -> float:
            rows = points(rectangle, y, SPACING, towards)
            text = "\n".join(" ".join(map(str, row)) for row in rows).encode()
            # -lw ends only paths that carry less than a tenth of one of a point's samples
            matrix = run(
                f"rfluxmtx -h -I+ -ab {bounces} -ad {samples} -lw {0.1 / samples:g} -lr -12 "
                f"-y {len(rows)} - sky.rad room.rad",
                folder,
                text,
            ).decode()
            coefficients = np.array(matrix.split(), dtype=float).reshape(len(rows), -1, 3)[..., 0]
            return float((coefficients @ sky).mean()) * rectangle[2] * rectangle[3] * 8.760

        returned = passing(pane, depth, 1.0, BOUNCES)
        return {
            "through the window": passing(window, 0.0, -1.0, 1),
            "rear room": passing(pane, depth, -1.0, BOUNCES) - returned,
        }


def main(*, samples: int = 4000, patch_samples: int = 4096) -> pd.DataFrame:
    """What the room behind absorbs by three programs."""
    rows = []
    for case in CASES:
        by_program = {
            "cfs": ours(case, patch_samples),
            "EnergyPlus": energyplus(case),
            "Radiance": radiance(case, samples),
        }
        for program, sums in by_program.items():
            window, rear = sums["through the window"], sums["rear room"]
            rows.append((case, program, window, rear, 100.0 * rear / window))
    return pd.DataFrame(rows, columns=["case", "program", "window kWh", "rear kWh", "rear %"])
