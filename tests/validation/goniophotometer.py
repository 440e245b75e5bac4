"""Closed forms measured as a goniophotometer would, and what comes back on a Klems basis.

    python -m tests.validation goniophotometer [--json FILE]

Files of three samples whose BSDF is known are written with the directions of a goniophotometer,
read by `cfs bsdf interpolate`'s functions and by Radiance's `pabopto2bsdf` and `bsdf2klems`, and
compared with means of the closed form over the pairs of patches.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBasis
from mitsuba_cfs.bsdf.measured import ScatteringInterpolant, patterns_of
from mitsuba_cfs.bsdf.measured_file import read_measurement
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from tests.benchmarks.radiance import run

FloatArray = NDArray[np.float64]
Lobe = Callable[[FloatArray, FloatArray], FloatArray]
DIFFUSE, SHARE = 0.2, 0.5  # of the light: evenly, and in the lobe
FARTHEST_DEG = 60.0  # patches' centres within this: beyond it lobes reach behind the sample's plane


def even(incident: FloatArray, outgoing: FloatArray) -> FloatArray:
    """BSDF [..] [1/sr] of a sample that scatters all its light evenly."""
    shape = np.broadcast_shapes(incident.shape, outgoing.shape)[:-1]
    return np.full(shape, (DIFFUSE + SHARE) / np.pi)


def gaussian(incident: FloatArray, outgoing: FloatArray, *, width: float = 0.15) -> FloatArray:
    """BSDF [..] [1/sr] with a Gaussian lobe on the disk of direction cosines round straight on."""
    squares = ((outgoing[..., :2] + incident[..., :2]) ** 2).sum(-1)
    return (DIFFUSE + SHARE / width**2 * np.exp(-squares / width**2)) / np.pi


def cosine_power(incident: FloatArray, outgoing: FloatArray, *, power: int = 60) -> FloatArray:
    """BSDF [..] [1/sr] with a lobe that falls by a power of the cosine of the angle to it."""
    cosine = np.maximum(-(incident * outgoing).sum(-1), 0)
    return (DIFFUSE + SHARE * (power + 1) / 2 * cosine**power) / np.pi


def unit_vectors(angles_deg: FloatArray) -> FloatArray:
    """Unit vectors [.., 3] of polar angles and azimuths [.., 2] [degrees]."""
    theta, phi = np.moveaxis(np.radians(angles_deg), -1, 0)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def measured_files(
    folder: Path,
    lobe: Lobe,
    *,
    azimuths_deg: Sequence[float] = (0,),
    incident_step_deg: float = 10,
    outgoing_step_deg: float = 4,
    noise: float = 0.0,
    form: str = "BSDF",
) -> list[Path]:
    """Files of transmission in `folder`, light from 0 to 80 degrees; noise relative, normal."""
    rng, paths = np.random.default_rng(1), []
    rings = np.arange(0, 89.0, outgoing_step_deg)
    counts = np.maximum(1, np.round(360 * np.sin(np.radians(rings)) / outgoing_step_deg))
    out = np.concatenate(
        [
            np.stack([np.full(int(n), 180 - ring), 360 * np.arange(n) / n], -1)
            for ring, n in zip(rings, counts, strict=True)
        ]
    )
    for azimuth in azimuths_deg:
        for theta in np.arange(0, 80.1, incident_step_deg):
            values = lobe(unit_vectors(np.array([theta, azimuth])), unit_vectors(out))
            values = values * (1 + noise * rng.standard_normal(len(out)))
            if form == "DSF":
                values = values * np.abs(np.cos(np.radians(out[:, 0])))
            lines = [
                '#sample_name "closed form"',
                f"#format: theta phi {form}",
                "#upphi 90",
                f"#incident_angle {theta:g} {azimuth:g}",
                *(f"{a:.5f} {b:.5f} {v:.7g}" for (a, b), v in zip(out, values, strict=True)),
            ]
            paths.append(folder / f"in_{azimuth:03.0f}_{theta:04.1f}.txt")
            paths[-1].write_text("\n".join(lines) + "\n")
    return paths


def interpolant(paths: Sequence[Path], block: str = "transmission_back") -> ScatteringInterpolant:
    """What `cfs bsdf interpolate` makes of files."""
    return ScatteringInterpolant(patterns_of([read_measurement(path) for path in paths], block))


def patch_means(lobe: Lobe, basis: KlemsBasis, *, points: tuple[int, int] = (8, 16)) -> FloatArray:
    """Means [K, K] [1/sr] over pairs of patches, `points` squared of each in and out."""
    incident, outgoing = (_directions(basis, (np.arange(n) + 0.5) / n) for n in points)
    means = np.zeros((basis.size, basis.size))
    for patch, inside in enumerate(incident):
        # straight on is the same point of both hemispheres, and the other way
        means[:, patch] = lobe(inside, -outgoing[:, :, None]).mean(axis=(1, 2))
    return means


def _directions(basis: KlemsBasis, axis: FloatArray) -> FloatArray:
    """Unit vectors [K, n^2, 3] of the points of each patch."""
    u, v = (part.ravel() for part in np.meshgrid(axis, axis))
    theta, phi = basis.angles_within(np.arange(basis.size)[:, None], u, v)
    return unit_vectors(np.degrees(np.stack([theta, phi], -1)))


def misplaced(matrix: FloatArray, exact: FloatArray, basis: KlemsBasis) -> FloatArray:
    """Share [K in] of the incident light by which patches differ, all of them added up."""
    return basis.projected_solid_angles() @ np.abs(matrix - exact)


def by_radiance(paths: Sequence[Path], folder: Path) -> FloatArray:
    """The transmission [K, K] [1/sr] that Radiance makes of files, on the quarter basis."""
    names = " ".join(path.name for path in paths)
    run(f"pabopto2bsdf {names} > measured.sir", folder)
    run("bsdf2klems -p -q -n 256 measured.sir > radiance.xml", folder)
    found = read_bsdf_xml(folder / "radiance.xml").band("Visible").transmission_back
    assert found is not None
    return found


CASES: list[tuple[str, Lobe, float, float, float]] = [
    ("even", even, 10, 4, 0.0),
    *(("Gaussian, 0.15", gaussian, 10, step, 0.0) for step in (8, 4, 2)),
    *(("Gaussian, 0.15", gaussian, step, 2, 0.0) for step in (20, 5)),
    ("Gaussian, 0.15", gaussian, 10, 2, 0.05),
    *(("Gaussian, 0.05", partial(gaussian, width=0.05), 10, step, 0.0) for step in (4, 2, 1)),
    *(("cosine^60", cosine_power, 10, step, 0.0) for step in (8, 4, 2)),
    *(("cosine^60", cosine_power, step, 2, 0.0) for step in (20, 5)),
]  # sample, lobe, step of incident and of outgoing light [degrees], noise


def rows() -> Iterator[dict[str, object]]:
    """A row for each case: misplaced light and error of the share, ours and Radiance's."""
    basis = KLEMS_QUARTER
    omega = basis.projected_solid_angles()
    inner = basis.centres()[0] < np.radians(FARTHEST_DEG)
    for sample, lobe, incident, outgoing, noise in CASES:
        exact = patch_means(lobe, basis)
        with TemporaryDirectory() as folder:
            steps = {"incident_step_deg": incident, "outgoing_step_deg": outgoing}
            paths = measured_files(Path(folder), lobe, noise=noise, **steps)
            start = time.process_time()
            ours = interpolant(paths).matrix(basis)[0]
            seconds = time.process_time() - start
            row = {"sample": sample, **steps, "noise": noise, "seconds": round(seconds, 1)}
            for name, matrix in (("mitsuba-cfs", ours), ("Radiance", by_radiance(paths, Path(folder)))):
                share = np.abs(omega @ matrix / (omega @ exact) - 1)[inner].max()
                light = misplaced(matrix, exact, basis)[inner].max()
                row |= {f"{name} misplaced": round(float(light), 4), f"{name} share": float(share)}
        yield row


def main(*, json_: Path | None = None) -> None:
    """Print the table; `--json` keeps its rows."""
    found = []
    print("| sample | step in, out [deg] | noise | misplaced | Radiance | share | Radiance |")
    print("|---|---|---|---|---|---|---|")
    for row in rows():
        found.append(row)
        print(
            f"| {row['sample']} | {row['incident_step_deg']:g}, {row['outgoing_step_deg']:g}"
            f" | {row['noise']:g} | {row['mitsuba-cfs misplaced']:.4f} | {row['Radiance misplaced']:.4f}"
            f" | {row['mitsuba-cfs share']:.4f} | {row['Radiance share']:.4f} |",
            flush=True,
        )
    if json_:
        json_.write_text(json.dumps(found, indent=1))
