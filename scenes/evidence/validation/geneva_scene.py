"""The Geneva office of raytraverse: its `.rad` files, views, skies and reference as arrays.

The glazing is Radiance's `glass`; the fabric of case 03 a `BRTDfunc`: Roos' transmittance straight
on, the rest diffuse.  All else is plastic, in this office diffuse.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mitsuba_cfs as cfs
from mitsuba_cfs.bsdf.glazing import uncoated_values

CASES = ("01_glz", "03_shd")
VIEWS = (1, 2, 3)
INDEX, TRANSMISSIVITY = 1.52, 0.763  # of the glass
COATING = 1.05  # refractive index of the fabric's outer layer, which passes all but what it mirrors
ROOS = (0.03, 4.0, 2.9, 75.0)  # of the fabric: normal transmittance, p, q, cut-off [degrees]
DIFFUSE = 0.02  # transmittance of the fabric that scatters
ANGLES = 512  # even steps of the cosine of incidence
NEW_YEAR = 1  # the day that `gendaylit -ang` takes for the distance to the sun


@dataclass(frozen=True)
class Reference:
    """What brute-force ray tracing gives of a view and case."""

    hour: NDArray[np.int64]  # [L] of the year
    Ev: NDArray[np.float64]  # [L] [lx]
    dgp: NDArray[np.float64]  # [L]


def polygons(path: Path) -> list[tuple[str, NDArray[np.float64]]]:
    """Material and corners [n, 3] of each polygon of a Radiance file."""
    words = "\n".join(line.split("#")[0] for line in path.read_text().splitlines()).split()
    found, i = [], 0
    while i < len(words):
        material, kind, at = words[i], words[i + 1], i + 3
        arguments: list[str] = []
        for _ in range(3):  # strings, integers, numbers
            count = int(words[at])
            arguments = words[at + 1 : at + 1 + count]
            at += 1 + count
        if kind == "polygon":
            found.append((material, np.array(arguments, dtype=float).reshape(-1, 3)))
        i = at
    return found


def reflectances(path: Path) -> dict[str, tuple[float, cfs.Gloss | None]]:
    """Diffuse reflectance and gloss of each grey `plastic` and `metal` of a Radiance file."""
    words, found = path.read_text().split(), {}
    for i, kind in enumerate(words[:-2]):
        if kind in ("plastic", "metal") and words[i - 1] == "void":
            numbers = [float(word) for word in words[i + 5 : i + 10]]
            found[words[i + 1]] = cfs.radiance_gloss(kind, numbers)
    return found


def triangles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """A convex or seamed polygon [n, 3] as triangles [n - 2, 3, 3], by cutting ears."""
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    left, found = list(range(len(corners))), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = (corners[left[(k + j) % len(left)]] for j in range(3))
            if np.cross(b - a, c - b) @ normal <= 1e-12 * (normal @ normal) ** 0.5:
                continue
            others = [
                corners[i] for i in left if not any(np.allclose(corners[i], v) for v in (a, b, c))
            ]
            if not any(_within(p, a, b, c, normal) for p in others):
                found.append((a, b, c))
                del left[(k + 1) % len(left)]
                break
        else:
            raise ValueError(f"a polygon of {len(corners)} corners cannot be cut into triangles")
    return np.array([*found, [corners[i] for i in left]])


def _within(p, a, b, c, normal) -> bool:
    sides = ((a, b), (b, c), (c, a))
    return all(np.cross(end - start, p - start) @ normal > 1e-12 for start, end in sides)


def surfaces(office: Path) -> cfs.Surfaces:
    """All opaque polygons of the office."""
    rho, parts, glosses = reflectances(office), [], []
    for material, corners in polygons(office):
        if material in rho:
            found, (diffuse, gloss) = triangles(corners), rho[material]
            glosses.append(gloss)
            parts.append(
                (found, np.full(len(found), diffuse), np.full(len(found), len(glosses) - 1))
            )
    arrays = (np.concatenate(part) for part in zip(*parts, strict=True))
    return cfs.Surfaces(*arrays, gloss=tuple(glosses) if any(glosses) else ())


def window(name: str, corners: NDArray[np.float64]) -> cfs.WindowSurface:
    """A window whose normal points outdoors, to -y."""
    found = triangles(corners)
    outwards = np.cross(*np.diff(found[0], axis=0))[1] < 0
    return cfs.WindowSurface(name, found if outwards else found[:, ::-1])


def window_groups(folder: Path, case: str) -> tuple[list[cfs.WindowGroup], list[list]]:
    """The groups of a case and their systems: panes alone, or the fabric and the panes round it."""
    panes = [
        window(f"{material} {i}", corners)
        for i, (material, corners) in enumerate(polygons(folder / "RAD/office.rad"))
        if material.startswith("wg")
    ]
    if case == "01_glz":
        return [cfs.WindowGroup("panes", tuple(panes))], [[glass()]]
    cloth = [c for m, c in polygons(folder / "options/fabric.rad") if m == "shading"]
    groups = [
        cfs.WindowGroup("fabric", (window("fabric", cloth[0]),)),
        cfs.WindowGroup("below", tuple(p for p in panes if p.triangles[..., 2].max() < 0.95)),
        cfs.WindowGroup("beside", tuple(p for p in panes if p.triangles[..., 2].max() > 0.95)),
    ]
    return groups, [[fabric()], [glass()], [glass()]]


def glass_transmittance(cosine: NDArray[np.float64], index: float, inner: float):
    """Radiance's `glass` [..] of a refractive index and an inner transmittance at normal."""
    r = ((index - 1) / (index + 1)) ** 2
    normal = (1 - r) ** 2 * inner / (1 - (r * inner) ** 2)
    return uncoated_values(normal, r + r * normal * inner, np.arccos(cosine))[0]


def glass() -> cfs.AngularOptics:
    """The panes."""
    return cfs.AngularOptics(glass_transmittance(_cosines(), INDEX, TRANSMISSIVITY))


def fabric() -> cfs.AngularOptics:
    """The fabric behind a pane, without reflection between the two."""
    before = glass_transmittance(_cosines(), INDEX, TRANSMISSIVITY)
    before = before * glass_transmittance(_cosines(), COATING, 1.0)
    return cfs.AngularOptics(before * roos(_cosines()), before * DIFFUSE)


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
    """The skies of some hours of the year, as `gendaylit -ang` makes them."""
    rows = np.loadtxt(folder / "refs/skydata.txt")
    return cfs.given_sky(
        rows[:, :3], rows[:, 3], rows[:, 4], day_of_year=NEW_YEAR, hours=hours, ground="gendaylit"
    )  # fmt: skip
