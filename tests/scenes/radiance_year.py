"""A year of illuminance in the demo's rooms by Radiance's own three-phase method.

    python -m tests.scenes.radiance_year [FOLDER]

writes what tests/reference/radiance_year holds, the mean of four runs (two minutes; needs
pyradiance).  Radiance gets the geometry that this project exports, the same BSDF file and the same
weather; V, D, the sky and the product are its own (rfluxmtx, gendaymtx, dctimestep).
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.ifc.building import read_ifc
from bim.to_radiance import write_radiance
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from tests import radiance
from tests.conftest import REPOSITORY

STORED = REPOSITORY / "tests" / "reference" / "radiance_year"
RAYS = "-n 2 -ab 8 -ad 60000 -lw 1e-6"
SPACING = 1.0  # [m] 24 sensors and less keep Radiance's part short
STORED_ROOM = "A"
RUNS = 4  # one run's sensors scatter by 0.5 to 1 %


@dataclass(frozen=True, slots=True)
class Year:
    """Means of illuminance [lx]."""

    hours: NDArray[np.floating]  # [H] over the sensors
    sensors: NDArray[np.floating]  # [S] over the year

    @classmethod
    def of(cls, illuminance: NDArray[np.floating]) -> Year:
        """Of illuminance [H, S]."""
        return cls(illuminance.mean(axis=1, dtype=float), illuminance.mean(axis=0, dtype=float))

    @classmethod
    def read(cls, room: str) -> Year:
        """The stored one."""
        with np.load(STORED / f"{room}.npz") as data:
            return cls(data["hours"].astype(float), data["sensors"].astype(float))

    def write(self, path: Path) -> None:
        """With three digits: Radiance's own noise is a few per mille."""
        arrays = {"hours": self.hours, "sensors": self.sensors}
        np.savez_compressed(path, **{n: three_digits(a) for n, a in arrays.items()})


def three_digits(values: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.array([float(f"{value:.3g}") for value in values], dtype=np.float32)


def radiance_year(name: str, folder: Path) -> Year:
    """The year of the demo's room of that name."""
    building = read_ifc(OFFICE)
    space = building.space(name)
    files = write_radiance(space, building, folder, sky_division=4, spacing=SPACING)
    sensors = files.sensors.read_bytes()
    count = sensors.count(b"\n")
    radiance.run(f"epw2wea {WEATHER} year.wea", folder)
    radiance.run("gendaymtx -of -m 4 year.wea > sky.smx", folder)
    total = 0.0
    for part, window in files.windows.items():
        room, outdoors = (f"{files.materials.name} {f.name}" for f in (files.room, files.outdoors))
        radiance.run(f"rfluxmtx -faf -I+ {RAYS} -y {count} - {window.name} {room} > {part}.vmx", folder, sensors)
        radiance.run(
            f"rfluxmtx -ff -n 2 -ab 4 -ad 1 -lw 1e-6 -c 10000 {window.name} {files.sky.name} {outdoors} > {part}.dmx",
            folder,
        )
        command = f"dctimestep -of {part}.vmx {VENETIAN_BLIND} {part}.dmx sky.smx"
        out = radiance.run(command, folder)  # gendaymtx's sky is bluish: all channels count
        total = total + radiance.read_float_matrix(out, radiance.LUMINANCE)
    return Year.of(np.transpose(total))


def mean_year(name: str) -> Year:
    """The mean of several years of that room, which Radiance draws anew each time."""
    years = []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            years.append(radiance_year(name, Path(folder)))
    return Year(*(np.mean([getattr(y, n) for y in years], axis=0) for n in ("hours", "sensors")))


def main() -> None:
    """Write the stored year."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else STORED
    out.mkdir(parents=True, exist_ok=True)
    mean_year(STORED_ROOM).write(out / f"{STORED_ROOM}.npz")


if __name__ == "__main__":
    main()
