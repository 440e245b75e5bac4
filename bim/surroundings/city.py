"""What CityJSON and CityGML share from polygons on: the one data model in two encodings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from bim.polygon_rooms import triangles_of_rings
from bim.surroundings.objects import BODY, TERRAIN, SurroundingObject

TERRAINS = ("TINRelief", "Road", "LandUse", "WaterBody", "Railway", "TransportSquare", "Square",
            "PlantCover")  # fmt: skip
FINEST = 3.0  # level of detail below which geometry is taken: 2.2 is, 3 (with openings) is not
NO_GEOMETRY = "objects-without-geometry"  # code of the issue


def city_object(name: str, kind: str, triangles: NDArray[np.float64]) -> SurroundingObject:
    """An object of triangles [T, 3, 3]; some of its kinds are terrain."""
    return SurroundingObject(name, triangles, TERRAIN if kind in TERRAINS else BODY)


def triangles_of_surfaces(
    surfaces: Iterable[Sequence[NDArray[np.float64]]],
) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of polygons, each of an outline [N, 3] and its holes."""
    found = [np.empty((0, 3, 3))]
    for rings in surfaces:
        if rings and min(map(len, rings)) >= 3:
            found.append(triangles_of_rings(rings))
    return np.concatenate(found)
