"""Floor area to the middle of the walls, as some authoring tools are set to state it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.boundaries import ElementRecord
from bim.neighbours import Beyond
from bim.planes import rings_of
from bim.rooms import Piece
from bim.sensors import horizontal_section

SECTION = 1.0  # height above the floor at which the outline is taken [m]
SMOOTH = 0.002  # vertices this near a straight side are left out [m]
NEAR = 0.01  # faces this near a side lie on it [m]
UPRIGHT = 0.3  # vertical part of a wall's normal at the most
PARALLEL = 0.2  # sine: sides that meet at less than 12 degrees go on with a step

Wall = tuple[Piece, float]  # a part of the room's boundary, half the wall behind it [m]


def area_to_wall_middles(
    triangles: NDArray[np.float64], pieces: Sequence[Piece], beyond: Sequence[Beyond], records: Sequence[ElementRecord]
) -> float:
    """Area [m2] of a room's outline with each side moved outwards by half of the wall behind it.

    Sides without a wall (separations of open rooms) stay where they are.

    Args: triangles: [N, 3, 3] of the room as drawn; beyond: for each piece of its boundary.
    """
    walls = [
        (piece, 0.5 * _wall_behind(behind, records, piece.facet.plane.normal))
        for piece, behind in zip(pieces, beyond, strict=True)
        if piece.role == "room" and abs(piece.facet.plane.normal[2]) < UPRIGHT
    ]
    section = horizontal_section(triangles, float(triangles[..., 2].min()) + SECTION)
    total = 0.0
    for polygon in shapely.get_parts(section.simplify(SMOOTH)):
        rings = [shapely.Polygon(_moved(ring, walls)) for ring in rings_of(polygon)]
        total += rings[0].area - sum(hole.area for hole in rings[1:])
    return total


def _wall_behind(behind: Beyond, records: Sequence[ElementRecord], normal: NDArray[np.float64]) -> float:
    """Thickness [m] of the wall that a face lies on: its layers', else the ray's; 0: none."""
    for span in behind.spans:
        record = records[span.element]
        if span.start > NEAR or not record.ifc_class.startswith("IfcWall"):
            continue
        across = record.axis is None or abs(record.axis @ normal) > 0.7
        if record.layers and across:
            return sum(layer.thickness for layer in record.layers)
        if np.isfinite(span.stop):
            return span.stop - max(span.start, 0.0)
    return 0.0


def _moved(ring: NDArray[np.float64], walls: Sequence[Wall]) -> NDArray[np.float64]:
    """A ring [N, 2] with the room to its left, each side moved to its right by its own distance."""
    sides = np.roll(ring, -1, axis=0) - ring
    along = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    out = np.column_stack([along[:, 1], -along[:, 0]])
    half = np.array([_half_wall(a, s, n, walls) for a, s, n in zip(ring, sides, out, strict=True)])
    start = ring + half[:, None] * out
    corners: list[NDArray[np.float64]] = []
    for i, before in enumerate(np.roll(np.arange(len(ring)), 1)):
        sine = along[before, 0] * along[i, 1] - along[before, 1] * along[i, 0]
        if abs(sine) < PARALLEL:
            corners += [ring[i] + half[before] * out[before], start[i]]
            continue
        gap = start[i] - start[before]
        t = (gap[0] * along[i, 1] - gap[1] * along[i, 0]) / sine
        corners.append(start[before] + t * along[before])
    return np.array(corners)


def _half_wall(
    corner: NDArray[np.float64], side: NDArray[np.float64], out: NDArray[np.float64], walls: Sequence[Wall]
) -> float:
    """Half the thickness [m] of the wall behind most of a side's faces; 0 without a wall."""
    length = np.linalg.norm(side)
    shares: Counter = Counter()
    for piece, half in walls:
        plane = piece.facet.plane
        points = plane.to_world(shapely.get_coordinates(piece.facet.polygon))[:, :2] - corner
        reach = points @ side / length
        overlap = min(reach.max(), length) - max(reach.min(), 0.0)
        if plane.normal[:2] @ out > 0.9 and np.abs(points @ out).max() < NEAR and overlap > 0:
            shares[round(half, 4)] += piece.facet.polygon.area * overlap / np.ptp(reach)
    return max(shares, key=shares.__getitem__, default=0.0)
