"""Simplified meshes of elements that are far finer than daylight needs, with a stated error.

Vertices are merged on ever wider grids until few enough triangles remain; the error is the largest
displacement of a vertex.  Only outdoor elements and furniture are simplified, never the boundary of
a room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Element
from bim.planes import area_vectors
from bim.report.issue import Issue

FINE = 5_000  # triangles of one element, above which it is made coarser
STEPS = (0.002, 0.005, 0.01, 0.02)  # of the grids [m]
KEPT_AREA = 0.9  # share of the surface that has to be left: slats and bars must not vanish


def simplified(elements: list[Element]) -> tuple[list[Element], list[Issue]]:
    """The elements, those of many triangles simplified, and an issue for each of these."""
    result, issues = [], []
    for element in elements:
        triangles, error = simplified_mesh(element.triangles)
        if len(triangles) < len(element.triangles):
            values = {
                "element": f"{element.ifc_class} {element.name}",
                "before": len(element.triangles),
                "after": len(triangles),
                "moved_mm": 1000 * error,
            }
            issues.append(Issue("mesh-simplified", element.guid, values))
            element = replace(element, triangles=triangles)
        result.append(element)
    return result, issues


def simplified_mesh(
    triangles: NDArray[np.float64], most: int = FINE, steps: Sequence[float] = STEPS
) -> tuple[NDArray[np.float64], float]:
    """Triangles [M, 3, 3], at most `most` where that can be, and how far a vertex moved [m].

    Args: steps: rising sizes of the grids' cells [m], tried in turn.
    """
    best, error = triangles, 0.0
    area = _area(triangles)
    for step in steps:
        if len(best) <= most:
            break
        merged, moved = _merged(triangles, step)
        if _area(merged) < KEPT_AREA * area:
            break
        best, error = merged, moved
    return best, error


def _merged(triangles: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], float]:
    """Vertices of one cell of a grid put to their mean; collapsed and repeated faces left out."""
    corners = triangles.reshape(-1, 3)
    cells = np.floor(corners / step).astype(np.int64)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    index = index.ravel()
    counts = np.bincount(index)
    means = np.stack([np.bincount(index, corners[:, k]) / counts for k in range(3)], axis=1)
    moved = float(np.linalg.norm(means[index] - corners, axis=1).max())
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return means[faces[np.sort(first)]], moved


def _area(triangles: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(area_vectors(triangles), axis=1).sum())
