"""Overcast light through panes by wavelength: Radiance, its own rays by quadrature, and mitsuba-cfs."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.spectral_factor import ANGLES
from mitsuba_cfs.bsdf.spectral_pane import read_spectral_pane
from mitsuba_cfs.spectra.detectors import detected
from tests.radiance import run
from tests.validation.spectral import (
    EVERY_5_NM,
    GAP,
    NAMES,
    NORMALS,
    POINTS,
    Light,
    Window,
    edges,
    joined,
    peer_scene,
    ranges,
    room_scene,
)

PANES = {
    "coated blue": ("nfrc_9962.json",),
    "coated blue, clear": ("nfrc_9962.json", "CLEAR_3.DAT"),
    "three green": ("913.json",) * 3,
    "electrochromic at 6 %, clear": ("igsdb_product_7407.json", "CLEAR_3.DAT"),  # see `spectral.WINDOWS`
}
CELLS = 40  # of the window in each direction, whose middles are seen


def main(
    *, data: Path = Path("../shared/data/bsdf/products_spectral"), divisions: int = 100_000, gap: float = GAP
) -> str:
    """The table of docs/evidence_daylight.md; gap: between the peer's panes [m]."""
    rows = [
        "| panes | point | DER, rays | `rtrace -ab 1`: EDI % | DER % | CCT [K] | own panes: EDI % | DER % | CCT [K] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, files in PANES.items():
        if not all((data / file).exists() for file in files):
            continue
        window = Window([read_spectral_pane(data / file) for file in files])
        rays, sampled, own = _lights(window, divisions, gap)
        for s, point in enumerate(NAMES):
            differences = (
                f"{100 * (one.edi[s] / rays.edi[s] - 1):+.1f} | {100 * (one.ratio[s] / rays.ratio[s] - 1):+.2f} | "
                f"{one.kelvin[s] - rays.kelvin[s]:+.0f}"
                for one in (sampled, own)
            )
            rows.append(f"| {name} | {point} | {rays.ratio[s]:.4f} | {' | '.join(differences)} |")
    return "\n".join(rows)


def _lights(window: Window, divisions: int, gap: float) -> tuple[Light, Light, Light]:
    """By the peer's rays through the middles of cells, by its sampling, and by our panes for the same rays."""
    directions, weights = _cells()
    starts = np.repeat(POINTS, CELLS**2, axis=0)
    seen, bare, sampled = [], [], []
    with TemporaryDirectory() as name:
        folder = Path(name)
        for first, last in ranges():
            low, high = edges()[[first, last]]
            peer_scene(folder, window, "overcast", "neutral", (low, high), gap)
            run("oconv sky.rad room.rad > bare.oct", folder)
            options = f"-h -dj 0 -dt 0 -cs {last - first} -co+ -cw {low:g} {high:g}"
            rays = _lines(starts, directions.reshape(-1, 3))
            seen.append(_values(f"rtrace -ab 0 -lw 0 -lr 8 {options} scene.oct", folder, rays))
            bare.append(_values(f"rtrace -ab 0 {options} bare.oct", folder, rays))
            sampling = f"-I+ -ab 1 -aa 0 -as 0 -dc 1 -ad {divisions} -lw 1e-9"
            sampled.append(_values(f"rtrace {sampling} {options} scene.oct", folder, _lines(POINTS, NORMALS)))
    angle = np.arccos(np.abs(directions.reshape(-1, 3)[:, 1]))
    through = np.stack([np.interp(angle, ANGLES, row) for row in EVERY_5_NM.mean(window.factor.transmittance).T], 1)
    of_cells = [joined(part, ranges()) for part in (seen, bare)]
    whole = [of_cells[0], of_cells[1] * through]
    rays, own = (np.einsum("sc,scn->sn", weights, v.reshape(len(POINTS), CELLS**2, -1)) for v in whole)
    return _light(rays), _light(joined(sampled, ranges())), _light(own)


def _cells() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions [S, c, 3] from the points to the window's cells, and their projected solid angles [S, c]."""
    corners = room_scene()[0].groups[0].windows[0].triangles.reshape(-1, 3)
    low, size = corners.min(axis=0), np.ptp(corners, axis=0)
    middle = (np.arange(CELLS) + 0.5) / CELLS
    x, z = (v.ravel() for v in np.meshgrid(middle, middle))
    cells = low + size * np.stack([x, 0 * x, z], axis=1)
    to_cells = cells - POINTS[:, None]
    distance = np.linalg.norm(to_cells, axis=2)
    directions = to_cells / distance[..., None]
    cosines = np.maximum(np.einsum("scx,sx->sc", directions, NORMALS), 0.0) * np.abs(directions[..., 1])
    return directions, cosines * (size[0] * size[2] / CELLS**2) / distance**2


def _lines(points: NDArray[np.float64], directions: NDArray[np.float64]) -> str:
    pairs = zip(points, directions, strict=True)
    return "".join(" ".join(f"{v:.9g}" for v in (*p, *d)) + "\n" for p, d in pairs)


def _values(command: str, folder: Path, lines: str) -> NDArray[np.float64]:
    """Values in the bands of a range, from blue to red."""
    text = run(command, folder, lines.encode()).decode()
    return np.array([[float(v) for v in line.split()] for line in text.splitlines()])[:, ::-1]


def _light(values: NDArray[np.float64]) -> Light:
    return Light.of(values * 5.0 @ EVERY_5_NM.detection.T * 179.0 / detected(np.ones(401))[0])
