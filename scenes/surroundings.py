"""Whether a building's model has anything around it, and what follows where it has not."""

from __future__ import annotations

import numpy as np

from bim.model import Building
from mitsuba_cfs.notes import Note

TERRAIN = ("IfcSite", "IfcGeographicElement", "IfcCivilElement")
APART = 3.0  # from the rooms, of an element that is no part of the building, beyond eaves and balconies [m]
NO_SURROUNDINGS = Note(
    "The model has no surroundings (neighbouring buildings, trees): daylight, view out and sunlight are "
    "those of a free horizon; --surroundings adds them."
)


def has_surroundings(building: Building) -> bool:
    """Whether anything but terrain stands beside the rooms and what is built on to them."""
    shells = [space.shell.reshape(-1, 3)[:, :2] for space in building.spaces]
    if not shells:
        return bool(building.elements)
    corners = np.concatenate(shells)
    low, high = corners.min(axis=0) - APART, corners.max(axis=0) + APART
    for element in building.elements:
        points = element.triangles.reshape(-1, 3)[:, :2]
        if element.ifc_class.startswith(TERRAIN) or not len(points):
            continue
        if (points.min(axis=0) > high).any() or (points.max(axis=0) < low).any():
            return True
    return False
