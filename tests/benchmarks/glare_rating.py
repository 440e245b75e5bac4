"""Glare of pictures in memory against evalglare, a process a picture, from equal files."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.images.hdr import read_hdr, write_hdr
from mitsuba_cfs.images.view import fisheye, pixel_directions
from mitsuba_cfs.progress import Progress
from tests.benchmarks import radiance
from tests.benchmarks.harness import Comparison, Run, timed

SIZE, PICTURES = 800, 8


def pictures() -> list[np.ndarray]:
    """Luminance of a room with a bright window and a sun that wanders over it."""
    directions, _ = pixel_directions(fisheye((0, 0, 1.2), (0, 1, 0), SIZE))
    x, _, z = np.moveaxis(directions, -1, 0)
    window = (np.abs(x) < 0.5) & (z > -0.1) & (z < 0.5)
    rng = np.random.default_rng(1)
    found = []
    for i in range(PICTURES):
        room = rng.uniform(80, 160, window.shape)
        towards = np.array([0.08 * i - 0.3, 1.0, 0.3]) / np.hypot(1.04, 0.08 * i - 0.3)
        sun = directions @ towards > np.cos(np.radians(0.2665)) * np.linalg.norm(towards)
        found.append(np.where(sun, 2e7, np.where(window, 4000 + 1500 * z, room)))
    return found


def rated(file: Path, options: str = "") -> float:
    """DGP of a picture by evalglare."""
    return float(radiance.run(f"evalglare {options} {file.name}", file.parent).split(b":")[1].split()[0])


def compare(name: str, progress: Progress) -> Comparison:
    """Both programs' time for all pictures; the view's geometry is ours to work out once."""
    radiance.environment()
    view = fisheye((0, 0, 1.2), (0, 1, 0), SIZE)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{i}.hdr" for i in range(PICTURES)]
        for file, luminance in zip(files, pictures(), strict=True):
            write_hdr(file, luminance, view)
        loaded = [read_hdr(file) for file in files]
        geometry = GlareView(view)

        def ours() -> list[float]:
            return [evaluate(picture.luminance, geometry).dgp for picture in loaded]

        def theirs() -> list[float]:
            return [rated(file) for file in files]

        found, seconds, processor = timed(ours)
        progress(name, 0.3)
        peer, peer_seconds, peer_processor = timed(theirs, repeat=1)
        progress(name, 1.0)
    most = float(np.abs(np.subtract(found, peer)).max())
    return Comparison(
        name,
        f"glare of {PICTURES} pictures of {SIZE} x {SIZE} pixels",
        Run("mitsuba-cfs", "evaluate(luminance, geometry)", seconds, processor),
        Run("Radiance", "evalglare FILE", peer_seconds, peer_processor),
        note=f"largest difference of DGP {most:.1g}",
    )


BENCHMARKS = {"glare-rating": lambda progress: compare("glare-rating", progress)}
