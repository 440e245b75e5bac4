"""A folder of Radiance scene files under a sky of patches and a sun, rendered by Radiance."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.images.hdr import EFFICACY, read_hdr
from mitsuba_cfs.images.view import View, format_view
from mitsuba_cfs.sky.sun import SUN_RADIUS
from tests.benchmarks import radiance

QUALITY = "-dc 1 -dt 0 -dj 0 -ds 0.1 -st 0"
FINER = 4  # rpict's pixels across one, which is their mean


@dataclass(frozen=True, slots=True)
class RenderedScene:
    """The scene of some files in a folder; the programs' options are those of a comparison."""

    folder: Path
    files: str  # that oconv takes besides the sky
    of_pictures: str  # options of rpict
    of_points: str  # options of rtrace

    def set_sky(self, patches: NDArray, subdivision: int, sun: ArrayLike, luminance: float) -> None:
        """Compile the scene under Reinhart patches [cd/m2] and the disc of a sun; 0: without."""
        library = radiance.environment()["RAYPATH"].split(":")[-1]
        cal = (Path(library) / "reinhart.cal").read_text()
        (self.folder / "sky.cal").write_text(f"MF : {subdivision};\n{cal}")
        values = " ".join(f"{v / EFFICACY:.8g}" for v in patches)
        last = len(patches) - 1
        (self.folder / "sky.dat").write_text(f"1\n0 {last} {last + 1}\n{values}\n")
        strength, angle = f" {luminance / EFFICACY:.8g}", 2 * np.degrees(SUN_RADIUS)
        x, y, z = np.asarray(sun, dtype=float)
        disc = (
            f"void light solar\n0\n0\n3{3 * strength}\nsolar source sun\n0\n0\n4 {x:.9g} {y:.9g} {z:.9g} {angle:.6g}\n"
        )
        (self.folder / "sky.rad").write_text(
            "void brightdata patches\n4 noop sky.dat sky.cal rbin\n0\n0\n"
            "patches glow sky_glow\n0\n0\n4 1 1 1 0\nsky_glow source sky\n0\n0\n4 0 0 1 360\n"
            + (disc if luminance else "")
        )
        radiance.run(f"oconv sky.rad {self.files} > scene.oct", self.folder)

    def picture(self, view: View) -> NDArray[np.float64]:
        """Luminance [ny, nx], each pixel the mean of finer ones."""
        return self.halves(view).mean(axis=0)

    def halves(self, view: View) -> NDArray[np.float64]:
        """The picture by every other one of the finer pixels, and by the others [2, ny, nx].

        They share what rpict caches of the ambient light, whose noise they do not show.
        """
        n = FINER
        size = f"-x {n * view.width} -y {n * view.height}"
        options = f"{QUALITY} {self.of_pictures} {format_view(view)} {size}"
        radiance.run(f"rpict {options} scene.oct > fine.hdr", self.folder)
        fine = read_hdr(self.folder / "fine.hdr").luminance
        fine = fine.reshape(view.height, n, view.width, n)
        first = np.add.outer(np.arange(n), np.arange(n)) % 2 == 0
        squares = fine.transpose(0, 2, 1, 3)  # [ny, nx, n, n]
        return np.stack([squares[..., chosen].mean(axis=-1) for chosen in (first, ~first)])

    def eye_illuminance(self, view: View, points: int) -> tuple[float, float]:
        """Illuminance at the eye by rtrace so many times, and the mean's standard error."""
        command = f"rtrace -h -I+ {QUALITY} {self.of_points} scene.oct"
        given = radiance.sensors_text([view.position] * points, [view.direction] * points)
        lines = radiance.run(command, self.folder, given).decode().split()
        values = np.array(lines, dtype=float).reshape(points, -1)[:, :3] @ radiance.LUX
        return float(values.mean()), float(values.std(ddof=1) / np.sqrt(points))


Row = TypeVar("Row")


def show_rows(file: Path | None, rows: Callable[[Path], Iterable[Row]], line: Callable[[Row], str]) -> None:
    """Print a line of each row, which are dataclasses, made in a folder; write them to a file."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(Path(folder).resolve()):
            found.append(asdict(row))
            print(line(row), flush=True)
    if file:
        file.write_text(json.dumps(found, indent=1))
