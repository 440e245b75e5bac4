"""A year of illuminance, V T D s, from equal matrices: matrix files in, a matrix file out."""

from __future__ import annotations

import tempfile
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases, variants
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.matrices.mtx_io import luminance, read_matrix, write_matrix
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_matrix
from tests.benchmarks import daylight_matrix, radiance, view_matrix
from tests.benchmarks.harness import Comparison, Run, timed

DEMO = Path(str(files("scenes") / "demo"))
WEATHER = DEMO / "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
SYSTEM = DEMO / "venetian_blind.xml"
COMMAND = f"dctimestep -of view.mtx {SYSTEM.name} daylight.mtx sky.mtx > year.mtx"
GREY = (1.0, 0.0, 0.0)
AGREEMENT = 1e-5  # of float32 sums over 2306 patches, relative to the largest value of an hour


def write_inputs(folder: Path, spacing: float) -> None:
    """V, D, s of the room at MF:4 and the blind, as the files both programs read."""
    view = view_matrix.ours(spacing, 1, 256, 4).values[:, 0]
    daylight = daylight_matrix.ours("open", 256, 4).values[0]
    sky = sky_matrix(read_epw(WEATHER), daylight_matrix.SUBDIVISION, dtype=np.float32)
    for name, matrix in (("view", view), ("daylight", daylight), ("sky", sky)):
        write_matrix(folder / f"{name}.mtx", matrix, components=3)
    (folder / SYSTEM.name).write_bytes(SYSTEM.read_bytes())


def ours(folder: Path) -> NDArray[np.float64]:
    """Illuminance [S, H] from the files, written as a file."""
    transmission = read_bsdf_xml(folder / SYSTEM.name).band("Visible").transmission_matrix()
    view, daylight, sky = (luminance(read_matrix(folder / f"{name}.mtx"), GREY) for name in ("view", "daylight", "sky"))
    year = phases.three_phase(view[:, None], [transmission], daylight[None], sky)
    write_matrix(folder / "ours.mtx", year, components=3)
    return year


def theirs(folder: Path) -> NDArray[np.float64]:
    """The same by dctimestep."""
    radiance.run(COMMAND, folder)
    return luminance(read_matrix(folder / "year.mtx"), GREY)


def compare(name: str, progress: Progress, *, spacing: float = 0.5) -> Comparison:
    """Both programs' time for the year's illuminance, from files to a file."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_inputs(folder, spacing)
        progress(name, 0.3)
        found, seconds, processor = timed(lambda: ours(folder), repeat=3)
        progress(name, 0.6)
        peer, peer_seconds, peer_processor = timed(lambda: theirs(folder), repeat=3)
    progress(name, 1.0)
    difference = np.abs(found - peer).max() / peer.max()
    if not difference < AGREEMENT:
        raise RuntimeError(f"{name}: results differ by {difference:.2g} of the largest value")
    return Comparison(
        name,
        f"illuminance of {found.shape[0]} sensors in {found.shape[1]} hours, MF:4 [lx]",
        Run("mitsuba-cfs", "read_matrix, three_phase, write_matrix", seconds, processor),
        Run("Radiance", COMMAND, peer_seconds, peer_processor),
        note=f"largest difference {difference:.2g} of the largest illuminance",
    )


BENCHMARKS = {
    "annual-product": lambda progress: compare("annual-product", progress),
    "annual-product-1m": lambda progress: compare("annual-product-1m", progress, spacing=1.0),
    "annual-product-0.25m": lambda progress: compare("annual-product-0.25m", progress, spacing=0.25),
}
