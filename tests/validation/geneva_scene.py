"""The Geneva office of raytraverse: its `.rad` files, views, skies and reference as arrays.

The glazing is Radiance's `glass`; the fabric of case 03 a `BRTDfunc`: Roos' transmittance straight
on, the rest diffuse.  All else is plastic, in this office diffuse.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import bim
import mitsuba_cfs as cfs

CASES = {"01_glz": "clear", "03_shd": "fabric"}  # and the file of its options
VIEWS = (1, 2, 3)
PANES = ("wgTopMat", "wgMiddleMat", "wgBottomMat")
# the fabric's outer layer, which passes all but what it mirrors
COATING = bim.RadianceMaterial("fabric_outerlayer", "glass", transmissivity=1.0, index=1.05)
ROOS = (0.03, 4.0, 2.9, 75.0)  # of the fabric: normal transmittance, p, q, cut-off [degrees]
DIFFUSE = 0.02  # transmittance of the fabric that scatters
REFLECTED = 0.1  # diffuse reflectance of the fabric on either side
ANGLES = 512  # even steps of the cosine of incidence


@dataclass(frozen=True)
class Reference:
    """What brute-force ray tracing gives of a view and case."""

    hour: NDArray[np.int64]  # [L] of the year
    Ev: NDArray[np.float64]  # [L] [lx]
    dgp: NDArray[np.float64]  # [L]


def scene(folder: Path, case: str) -> bim.RadianceScene:
    """The files of a case."""
    return bim.read_radiance(folder / f"options/{CASES[case]}.rad", folder / "RAD/office.rad")


def window_groups(folder: Path, case: str) -> tuple[list[cfs.WindowGroup], list[list]]:
    """The groups of a case and their systems: panes alone, or the fabric and the panes round it."""
    office = scene(folder, case)
    panes = bim.scene_windows(office, PANES)
    pane = office.of_modifiers(PANES)[0].material
    glass = pane_optics(pane)
    if case == "01_glz":
        return [cfs.WindowGroup("panes", tuple(panes))], [[glass]]
    groups = [
        cfs.WindowGroup("fabric", tuple(bim.scene_windows(office, ["shading"]))),
        cfs.WindowGroup("below", tuple(p for p in panes if p.triangles[..., 2].max() < 0.95)),
        cfs.WindowGroup("beside", tuple(p for p in panes if p.triangles[..., 2].max() > 0.95)),
    ]
    return groups, [[fabric(pane)], [glass], [glass]]


def pane_optics(pane: bim.RadianceMaterial) -> cfs.AngularOptics:
    """A pane of glass."""
    passed, mirrored = bim.glass_shares(pane)
    return cfs.AngularOptics(passed, mirrored=mirrored)


def fabric(pane: bim.RadianceMaterial) -> cfs.AngularOptics:
    """The fabric behind a pane, without reflection between the two."""
    before = bim.glass_shares(pane)[0] * bim.glass_shares(COATING)[0]
    reflected = np.full(ANGLES, REFLECTED)
    return cfs.AngularOptics(before * roos(_cosines()), before * DIFFUSE, reflected=reflected)


def roos(cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Straight transmittance of a weave with a cut-off angle. Source: `roos_fabric.cal`."""
    normal, p, q, cut = ROOS
    z = np.arccos(cosine) * 2 / np.pi
    a, b = 8.0, 0.25 / q
    x = np.maximum(z + 1 - cut / 90, 1e-300)
    powers = 5.2 + 0.7 * q, 2.0, (5.26 + 0.06 * p) + (0.73 + 0.04 * p) * q
    shape = a * x ** powers[0] + b * x ** powers[1] + (1 - a - b) * x ** powers[2]
    return np.where(z < cut / 90, normal * (1 - shape), 0.0)


def _cosines() -> NDArray[np.float64]:
    return np.linspace(0.0, 1.0, ANGLES)


def view(folder: Path, number: int, size: int) -> cfs.View:
    """One of the three views, an angular fisheye."""
    row = np.loadtxt(folder / "POINTS/sensors.txt")[number - 1]
    return cfs.fisheye(tuple(row[:3]), tuple(row[3:]), size)


def reference(folder: Path, case: str, number: int) -> Reference:
    """The reference of a view."""
    table = np.loadtxt(folder / f"refrt/{case}_v{number}_refrt.tsv", skiprows=1)
    return Reference(table[:, 0].astype(np.int64), table[:, 4], table[:, 5])


def sky(folder: Path, hours: NDArray[np.int64]) -> cfs.AnnualSky:
    """The skies of some hours of the year, with the distance to the sun of their day.

    `gendaylit -ang` takes that of 1 January; the reference does not (docs/evidence_glare.md).
    """
    rows = np.loadtxt(folder / "refs/skydata.txt")
    days = 1 + np.arange(len(rows)) // 24
    return cfs.given_sky(rows[:, :3], rows[:, 3], rows[:, 4], day_of_year=days, hours=hours, ground="gendaylit")
