"""Surroundings and shell of a whole building as one mesh that rays of every room intersect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Element, Space
from bim.rays import RayMesh, ray_mesh
from scenes.surroundings import TERRAIN

FloatArray = NDArray[np.float64]

MOST_PANES = 24  # surfaces of a room's own windows that one ray passes
STEP = 1e-5  # offset of a ray's new origin after a pane [m]
_NOTHING = Element("", "nothing", "IfcSite", -1e9 + np.eye(3)[None], 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class OutdoorMesh:
    """The elements of a building as one mesh."""

    mesh: RayMesh
    element: NDArray[np.int64]  # [N] element of each triangle
    guids: tuple[str, ...]  # [E]
    terrain: NDArray[np.bool_]  # [E] what one stands on, no building

    def windows_of(self, space: Space) -> NDArray[np.bool_]:
        """Which elements [E] are the windows of a room."""
        guids = {window.guid for window in space.windows}
        return np.array([guid in guids for guid in self.guids], dtype=bool)

    def first_hits(
        self, origins: FloatArray, directions: FloatArray, own: NDArray[np.bool_]
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Distance [R] [m] (inf: none) and element [R] (-1: none) that each ray meets first.

        Args: own: [E] elements that are looked through, `windows_of` a room.
        """
        distance, element = np.full(len(origins), np.inf), np.full(len(origins), -1, dtype=np.int64)
        rays, travelled = np.arange(len(origins)), np.zeros(len(origins))
        for _ in range(MOST_PANES):
            start = origins[rays] + travelled[:, None] * directions[rays]
            far, hit = self.mesh.first_hits(start, directions[rays])
            met = np.where(hit >= 0, self.element[hit], -1)
            travelled = travelled + far
            pane = (met >= 0) & own[met]
            distance[rays[~pane]], element[rays[~pane]] = travelled[~pane], met[~pane]
            rays, travelled = rays[pane], travelled[pane] + STEP
            if not len(rays):
                break
        return distance, element


def outdoors_of(building: Building) -> OutdoorMesh:
    """The elements of a building in one mesh; one far below where there are none."""
    elements = building.elements or (_NOTHING,)
    counts = [len(element.triangles) for element in elements]
    return OutdoorMesh(
        ray_mesh(np.concatenate([element.triangles for element in elements])),
        np.repeat(np.arange(len(elements)), counts),
        tuple(element.guid for element in elements),
        np.array([element.ifc_class.startswith(TERRAIN) for element in elements], dtype=bool),
    )


def opaque_room(space: Space) -> RayMesh:
    """Walls, reveals, floor and ceiling of a room without the frames of its windows.

    The standard's openings are holes in the wall: what divides the glass does not count.
    """
    parts = [face.triangles for face in space.faces if face.kind != "window frame"]
    return ray_mesh(np.concatenate(parts) if parts else np.empty((0, 3, 3)))
