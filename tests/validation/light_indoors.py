"""Where light that a window transmits is absorbed: traced, by radiosity, and by EnergyPlus' rule.

    python -m tests.validation light_indoors

The room of docs/tutorials/energyplus_room.toml with clear double glazing.  The radiosity of its faces in
patches of 0.25 m is the judge: view factors by quadrature, made reciprocal and closed, one linear
system.  EnergyPlus spreads what the first faces reflect by area and absorptance.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bim.to_tracer import interior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix
from scenes.heat.box import box_building
from scenes.heat.study_file import read_study
from tests.validation.energyplus_study import STUDY
from tests.validation.room_exchange import absorbed_after_reflections, spread_evenly

FloatArray = NDArray[np.float64]
WIDTH, DEPTH, HEIGHT = 4.0, 5.0, 3.0  # [m]
WINDOW = (0.5, 3.5, 1.0, 2.5)  # left, right, sill, top [m]
REFLECTANCE = {"facade": 0.5, "back": 0.5, "sides": 0.5, "floor": 0.2, "ceiling": 0.7, "window": 0.13}
RING = {0: 0, 20: 2, 40: 4, 50: 5, 60: 6, 70: 7}  # polar angle of a patch [deg]: its ring
CELL, PARTS = 0.25, 2  # patches [m], and points along an edge of each
BEAM_POINTS = 50_000


class Patches:
    """The room's faces in square patches; x from the left, y from the window into the room."""

    def __init__(self) -> None:
        """All six faces; the window's patches are those of the facade within it."""
        x, y, z = np.eye(3)
        faces = (
            ("facade", np.zeros(3), WIDTH * x, HEIGHT * z, y),
            ("back", DEPTH * y, WIDTH * x, HEIGHT * z, -y),
            ("sides", np.zeros(3), DEPTH * y, HEIGHT * z, x),
            ("sides", WIDTH * x, DEPTH * y, HEIGHT * z, -x),
            ("floor", np.zeros(3), WIDTH * x, DEPTH * y, z),
            ("ceiling", HEIGHT * z, WIDTH * x, DEPTH * y, -z),
        )
        corners, edges, normals, names = [], [], [], []
        for name, origin, u, v, normal in faces:
            n, m = (round(float(np.linalg.norm(side)) / CELL) for side in (u, v))
            i, j = (index.ravel()[:, None] for index in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
            corners.append(origin + i * u / n + j * v / m)
            edges.append(np.tile(np.stack([u / n, v / m]), (n * m, 1, 1)))
            normals.append(np.tile(normal, (n * m, 1)))
            names += [name] * (n * m)
        self.corner, self.edge, self.normal = (np.concatenate(parts) for parts in (corners, edges, normals))
        left, right, sill, top = WINDOW
        middle = self.corner + 0.5 * self.edge.sum(axis=1)
        glass = (middle[:, 0] > left) & (middle[:, 0] < right) & (middle[:, 2] > sill) & (middle[:, 2] < top)
        names = np.array(names)
        names[glass & (names == "facade")] = "window"
        self.names, self.reflectance = names, np.array([REFLECTANCE[name] for name in names])

    def view_factors(self) -> FloatArray:
        """[N, N] among the patches: reciprocal, rows sum to 1."""
        part = (np.arange(PARTS) + 0.5) / PARTS
        points = self.corner[:, None] + np.concatenate(
            [a * self.edge[:, None, 0] + b * self.edge[:, None, 1] for a in part for b in part], axis=1
        )
        seen = np.zeros((len(self.names), len(self.names)))
        for a in range(PARTS**2):
            for b in range(PARTS**2):
                between = points[None, :, b] - points[:, None, a]
                squared = (between**2).sum(axis=2) + 1e-12
                here = np.einsum("ijk,ik->ij", between, self.normal)
                there = -np.einsum("ijk,jk->ij", between, self.normal)
                seen += np.where((here > 0.0) & (there > 0.0), here * there / (np.pi * squared**2), 0.0)
        for _ in range(100):  # all patches have one area
            scale = 1.0 / np.sqrt(seen.sum(axis=1))
            seen *= scale[:, None] * scale
        return seen

    def first_hits(self, ring: int) -> FloatArray:
        """Shares [N] of light that comes down through the window from a patch of a ring."""
        bounds = KLEMS_FULL.theta_bounds
        u = (np.arange(BEAM_POINTS)[:, None] * np.array([0.8566749, 0.7338918, 0.6287067, 0.5385973])) % 1.0
        low, high = np.sin(bounds[ring]) ** 2, np.sin(bounds[ring + 1]) ** 2
        sine = np.sqrt(low + (high - low) * u[:, 0])
        turn = (2.0 * u[:, 1] - 1.0) * np.pi / KLEMS_FULL.phi_counts[ring]
        towards = np.stack([sine * np.sin(turn), np.sqrt(1.0 - sine**2), -sine * np.cos(turn)], axis=1)
        left, right, sill, top = WINDOW
        start = np.stack([left + (right - left) * u[:, 2], 0.0 * sine, sill + (top - sill) * u[:, 3]], axis=1)
        with np.errstate(divide="ignore"):
            far = np.where(towards > 0.0, [WIDTH, DEPTH, HEIGHT] - start, -start) / towards
        far[towards == 0.0] = np.inf
        hit = start + far.min(axis=1)[:, None] * towards
        _, place = cKDTree(self.corner + 0.5 * self.edge.sum(axis=1)).query(hit)
        return np.bincount(place, minlength=len(self.names)) / len(place)


def _by_face(values: FloatArray, names: NDArray[np.str_]) -> FloatArray:
    return np.array([values[names == name].sum() for name in REFLECTANCE])


def main(*, samples: int = 8192) -> pd.DataFrame:
    """Share of the transmitted light [%] that each face absorbs; the window's is lost or warms its panes."""
    variants.activate()
    patches = Patches()
    exchange, names = patches.view_factors(), patches.names
    area = np.array([np.count_nonzero(names == name) for name in REFLECTANCE]) * CELL**2
    space = box_building(read_study(STUDY).box).spaces[0]
    surfaces, groups = interior_surfaces(space, "solar"), window_groups(space)
    window = space.windows[0]
    middle = surfaces.triangles.mean(axis=1)
    inwards = (window.triangles[0, 0] - middle) @ window.normal
    low = middle[:, 2] - surfaces.triangles[..., 2].min()
    flat = np.ptp(surfaces.triangles[..., 2], axis=1) < CELL
    level = np.where(low < CELL, "floor", "ceiling")
    upright = np.where(inwards < CELL, "facade", np.where(inwards > DEPTH - CELL, "back", "sides"))
    of_surface = dict(zip(surfaces.surface.tolist(), np.where(flat, level, upright).tolist(), strict=True))
    traced = absorption_matrix(surfaces, groups, window_reflectance=[REFLECTANCE["window"]], samples=samples).values[0]
    columns = np.array([of_surface.get(k, "window") for k in range(traced.shape[1])])
    rows = []
    omega = KLEMS_FULL.projected_solid_angles()
    cases: list[tuple[str, FloatArray, FloatArray]] = []
    for angle, ring in RING.items():
        patch = KLEMS_FULL.index(np.radians(angle), np.radians(270.0))
        cases.append((f"{angle} degrees", patches.first_hits(ring), traced[int(patch)]))
    cases.append(("all directions", exchange[names == "window"].mean(axis=0), omega @ traced / omega.sum()))
    reflectance = np.array(list(REFLECTANCE.values()))
    for light, hit, ours in cases:
        kept = {
            "radiosity": _by_face(absorbed_after_reflections(hit, patches.reflectance, exchange), names),
            "traced": _by_face(ours, columns),
            "EnergyPlus' rule": spread_evenly(_by_face(hit, names), reflectance, area),
        }
        rows += [
            {"light from": light, "": who} | dict(zip(REFLECTANCE, 100.0 * values, strict=True))
            for who, values in kept.items()
        ]
    return pd.DataFrame(rows)
