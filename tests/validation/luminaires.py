"""Illuminance by luminaires of IES files against Radiance's ies2rad and rtrace.

    python -m tests.validation luminaires

A room of 4 m x 5 m x 3 m without windows, with one and with four luminaires whose light differs by
direction in both angles.  Radiance has the same triangles and reflectances.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from bim.electric_light import Luminaire, lamp_light
from bim.sensors import sensor_grid
from bim.shoebox import shoebox
from bim.to_tracer import furnished_surfaces
from mitsuba_cfs.metrics.photometry import read_photometry
from tests.metrics.test_photometry import GAMMA, ies
from tests.radiance import run, sensors_text, write_surfaces

PLACES = {
    "one": [((1.5, 2.0, 2.6), 0.0)],
    "four": [((1.0, 1.2, 2.8), 0.0), ((3.0, 1.2, 2.8), 90.0), ((1.0, 3.8, 2.8), 180.0), ((3.0, 3.8, 2.8), 30.0)],
}
OPTIONS = "-I -h -ab {} -ad 1024 -as 0 -aa 0 -lw 1e-6 -dt 0 -dc 1"  # of rtrace


def photometric_file(folder: Path) -> Path:
    """An IES file whose intensity differs by both angles."""
    c = np.arange(0.0, 361.0, 15.0)
    down = np.cos(np.radians(GAMMA))
    rows = [800.0 * down * (1.0 + 0.6 * np.cos(np.radians(a)) * np.sin(2 * np.radians(GAMMA))) for a in c]
    path = folder / "lamp.ies"
    path.write_text(ies(c, GAMMA, rows))
    return path


def compare(paths: int = 4096) -> pd.DataFrame:
    """By arrangement: means, and the differences of the sensors."""
    building = shoebox(4.0, 5.0, 3.0, windows=(), reflectance={"wall": 0.5, "floor": 0.2, "ceiling": 0.8})
    space = building.spaces[0]
    points = sensor_grid(space, spacing=0.5, height=0.8, margin=0.5)[0]
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = photometric_file(folder)
        photometry = read_photometry(file)
        surfaces = furnished_surfaces(space, "visible")
        write_surfaces(surfaces, folder / "room.rad")
        run("ies2rad -o lamp lamp.ies", folder)
        for label, places in PLACES.items():
            scene = "".join(f"!xform -rz {turned} -t {x} {y} {z} lamp.rad\n" for (x, y, z), turned in places)
            (folder / "lamps.rad").write_text(scene)
            run("oconv room.rad lamps.rad > scene.oct", folder)
            both = []
            for bounces in (0, 8):
                command = f"rtrace {OPTIONS.format(bounces)} scene.oct"
                out = run(command, folder, stdin=sensors_text(points, up))
                rgb = np.array([line.split()[:3] for line in out.decode().splitlines()], float)
                both.append(179.0 * rgb @ [0.265, 0.670, 0.065])
            lamps = [Luminaire(photometry, place, turned) for place, turned in places]
            ours = lamp_light(space, lamps, points, paths=paths)
            whole, theirs = ours.direct + ours.reflected, both[1]
            rows.append(
                {
                    "luminaires": label,
                    "sensors": len(points),
                    "direct lx": round(float(ours.direct.mean()), 2),
                    "Radiance": round(float(both[0].mean()), 2),
                    "direct rms %": round(100 * _rms(ours.direct, both[0]), 2),
                    "all lx": round(ours.mean, 2),
                    "Radiance, all": round(float(theirs.mean()), 2),
                    "stated error lx": round(ours.standard_error, 2),
                    "rms %": round(100 * _rms(whole, theirs), 2),
                }
            )
    return pd.DataFrame(rows)


def _rms(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.sqrt(np.mean((ours - theirs) ** 2)) / theirs.mean())


def main() -> pd.DataFrame:
    """Both arrangements."""
    return compare()
