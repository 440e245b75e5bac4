"""Walls, floors and doors of files: the layers that each face of a room has against its element.

    python -m tests.validation wall_thickness FILES...

An element is nowhere thicker than it is long along the face's normal.  Printed is the area of the
rooms' faces of one layer, without reveals and frames, whose layer is thicker than that, by kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.building_file import read_building_file
from bim.model import Building
from mitsuba_cfs.errors import CfsError

SLACK = 0.01  # [m]
APART = ("reveal", "window frame")


def too_thick(building: Building) -> tuple[float, Counter[str]]:
    """Area of the rooms' faces whose element is drawn [m2], and of those too thick, by kind."""
    parts: dict[str, list[NDArray[np.float64]]] = {}
    for element in building.elements:  # one for each of its styles
        parts.setdefault(element.guid, []).append(element.triangles.reshape(-1, 3))
    corners = {guid: np.concatenate(own) for guid, own in parts.items()}
    total, found = 0.0, Counter[str]()
    for face in (face for space in building.spaces for face in space.faces):
        made = face.construction
        if face.kind in APART or made is None or face.element not in corners:
            continue
        total += face.area
        long = float(np.ptp(corners[face.element] @ face.normal))
        if len(made.layers) == 1 and made.thickness > long + SLACK:
            found[face.kind] += face.area
    return total, found


def main(files: Sequence[Path]) -> None:
    """Print a line for each file."""
    for path in files:
        try:
            total, found = too_thick(read_building_file(path))
        except CfsError as error:
            print(f"refused: {error}", flush=True)
            continue
        kinds = ", ".join(f"{kind} {area:.1f}" for kind, area in sorted(found.items())) or "none"
        print(f"{path.name}: {total:.0f} m2 of faces, too thick: {kinds} m2", flush=True)
