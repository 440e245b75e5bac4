"""Slat tilts between those of a family's files against the same tilts traced.

    python -m tests.validation slat_tilts

An office in Chicago with a window to the south: the blind of the demo at 0, 15, ..., 75 degrees is
the family, and its tilts in the middle between these are traced too, as states of their own.  Light
by three phases; the durations are those of five phases.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import scenes as cfs
from bim.shoebox import WindowRectangle, shoebox
from scenes.demo import WEATHER
from scenes.fenestration.tilts import relative_difference, tilt_errors
from tests.validation.tilted_blinds import SPACING, WIDTH, family_tables, write_blind

FAMILY = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)  # [deg]
BETWEEN = (7.5, 22.5, 37.5, 52.5, 67.5)
EVERY = 40  # of the lit occupied hours, one is rated for glare
OPTIONS = {
    "sensor_spacing": 1.0,
    "sensor_samples": 2048,
    "patch_samples": 1024,
    "sky_subdivision": 1,
    "sun_points": 64,
    "picture_size": 80,
    "picture_samples": 4,
    "picture_count": 1,
    "heat_step_s": 3600.0,
}


def office(*sides: str):
    """A room with a window on each of some sides."""
    windows = tuple(WindowRectangle(0.5, 0.9, 3.0, 1.7, side=side) for side in sides)
    building = shoebox(4.0, 5.0, 3.0, windows=windows, reflectance={"wall": 0.5, "floor": 0.2, "ceiling": 0.8})
    return building.room(building.spaces[0].name)


class Listener:
    """A control function that notes the light of some states, and leaves the blind raised."""

    def __init__(self, tilts: Sequence[float]) -> None:
        """Of states at some tilts."""
        self.tilts, self.lux, self.dgp = tilts, [], []
        self._lit = 0

    def __call__(self, hour: cfs.ControlHour) -> int:
        """The raised state."""
        if hour.occupied and hour.sun[2] > 0.05:
            states = [int(np.flatnonzero(hour.tilts_deg[0] == tilt)[0]) for tilt in self.tilts]
            self.lux.append([hour.work_plane_lx(state) for state in states])
            self._lit += 1
            if self._lit % EVERY == 0:
                self.dgp.append([hour.dgp(state) for state in states])
        return 0


def listened(text: str, folder: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Illuminance [h, T] and DGP [n, T] at the tilts between, by states of an operation file."""
    file, listener = folder / "own.toml", Listener(BETWEEN)
    file.write_text(text)
    cfs.simulate(office("front"), None, WEATHER, operation=file, control=listener, method="three-phase", **OPTIONS)
    return np.array(listener.lux), np.array(listener.dgp)


def durations(folder: Path, files: dict[float, Path]) -> list[tuple[str, int, int, float]]:
    """Processor time of a year by cut-off: name, states, states that are traced, seconds."""
    rows = []
    control = f"[control]\nrule = 'cut-off'\nslat_width = {WIDTH}\nslat_spacing = {SPACING}\n"
    for name, tilts, step in (
        ("raised and 45°", (45.0,), None),
        ("raised and the family", FAMILY, None),
        ("raised and the family, every 2.5°", FAMILY, 2.5),
    ):
        head = "" if step is None else f"tilt_step_deg = {step}\n"
        file = folder / "cut_off.toml"
        file.write_text(head + family_tables([files[t] for t in tilts], tilts) + control)
        states = len(cfs.read_operation(file).systems)
        start = time.process_time()
        cfs.simulate(office("front"), None, WEATHER, operation=file, method="five-phase", **OPTIONS)
        rows.append((name, states, 1 + len(tilts), time.process_time() - start))
    return rows


def main(*, samples: int = 16384) -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = {tilt: write_blind(folder, tilt, samples) for tilt in (*FAMILY, *BETWEEN)}
        family = family_tables([files[t] for t in FAMILY], FAMILY)
        every = sorted((*FAMILY, *BETWEEN))
        traced = family_tables([files[t] for t in every], every)
        operation = folder / "family.toml"
        operation.write_text("tilt_step_deg = 7.5\n" + family)
        states = cfs.read_operation(operation).systems
        own = {tilt: cfs.read_system(files[tilt]) for tilt in BETWEEN}
        lux, dgp = listened("tilt_step_deg = 7.5\n" + family, folder)
        expected_lux, expected_dgp = listened(traced, folder)
        print("| tilt | BSDF | mean illuminance | hour by hour, rms | DGP, rms | DGP, most |")
        print("|---|---|---|---|---|---|")
        for k, tilt in enumerate(BETWEEN):
            mean = next(one for one in states if one.tilt_deg == tilt)
            of_bsdf = relative_difference(mean.visible, own[tilt].visible)
            difference = lux[:, k] - expected_lux[:, k]
            whole = expected_lux[:, k].mean()
            glare = dgp[:, k] - expected_dgp[:, k]
            print(
                f"| {tilt:g}° | {100 * of_bsdf:.1f} % | {100 * difference.mean() / whole:+.1f} % "
                f"| {100 * np.sqrt(np.mean(difference**2)) / whole:.1f} % "
                f"| {np.sqrt(np.mean(glare**2)):.4f} | {np.abs(glare).max():.3f} |"
            )
        print(f"\n{len(lux)} hours, {len(dgp)} of them rated for glare\n")
        print("| left out | neighbours apart | transmittance, rms | BSDF |\n|---|---|---|---|")
        for error in tilt_errors(states):
            print(
                f"| {error.tilt_deg:g}° | {error.spacing_deg:g}° | {error.transmittance:.4f} "
                f"| {100 * error.relative:.1f} % |"
            )
        print("\n| states | number | traced | processor time |\n|---|---|---|---|")
        for row in durations(folder, files):
            print("| {} | {} | {} | {:.0f} s |".format(*row))
