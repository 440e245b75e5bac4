"""From model axes to the world and to the map: true north, length unit, far-off origins."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import ifcopenshell
import ifcopenshell.util.unit
import numpy as np
from numpy.typing import NDArray

from bim.ifc.damage import Damage, placement_of
from bim.ifc.north import map_conversions
from bim.ifc.project import length_scale
from bim.ifc.shapes import Shape
from bim.model import Georeference, crs_name
from bim.report.issue import Issue

FAR_OFF = 5000.0  # coordinates beyond this cost precision [m]
STOREY_HEIGHTS = (1.2, 60.0)  # of rooms and walls that a building may have [m]
UNIT_SLIPS = (1000.0, 0.001, 100.0, 0.01, 0.3048, 1 / 0.3048, 304.8, 1 / 304.8, 25.4, 1 / 25.4)
GROUND_RANGE = 1.5  # the ground storey lies at most this far from height zero [m]


@dataclass(frozen=True, slots=True)
class Placed:
    """Shapes in the world, and how they came there: world = scale * rotation @ model - offset."""

    shapes: dict[int, Shape]
    rotation: NDArray[np.float64]  # [3, 3]
    scale: float
    offset: NDArray[np.float64]  # [3] [m]
    issues: tuple[Issue, ...]

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Model points [..., 3] [m] in the world."""
        return self.scale * points @ self.rotation.T - self.offset

    def matrix(self) -> NDArray[np.float64]:
        """The way from model to world [4, 4]."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.scale * self.rotation, -self.offset
        return matrix


def in_world(shapes: dict[int, Shape], rotation: NDArray[np.float64]) -> Placed:
    """Shapes turned to true north, scaled if the unit is plainly wrong, moved near the origin."""
    issues: list[Issue] = []
    scale = _unit_slip(shapes)
    if scale != 1.0:
        height = _typical_height(shapes)
        values = {"height": height, "scale": scale}
        issues.append(Issue("length-unit-wrong", "project", values))
    offset = np.zeros(3)
    boxes = [shape.triangles.reshape(-1, 3) for shape in shapes.values()]
    if boxes:
        middle = scale * np.median([points.mean(axis=0) for points in boxes], axis=0) @ rotation.T
        if np.abs(middle[:2]).max() > FAR_OFF:
            offset = np.array([*np.round(middle[:2], -1), 0.0])
            distance, (east, north) = float(np.hypot(*middle[:2])), -offset[:2]
            moved = {"distance_km": distance / 1000, "east": float(east), "north": float(north)}
            issues.append(Issue("model-far-from-origin", "project", moved))
    world = {
        key: replace(shape, triangles=scale * shape.triangles @ rotation.T - offset) for key, shape in shapes.items()
    }
    return Placed(world, rotation, scale, offset, tuple(issues))


def _typical_height(shapes: dict[int, Shape]) -> float:
    """Median height of spaces, else of walls [m]; 0 without either."""
    for prefix in ("IfcSpace", "IfcWall"):
        heights = [
            float(np.ptp(shape.triangles[..., 2])) for shape in shapes.values() if shape.ifc_class.startswith(prefix)
        ]
        if heights:
            return float(np.median(heights))
    return 0.0


def _whole_height(shapes: dict[int, Shape]) -> float:
    """Height of all shapes together [m]."""
    z = [(shape.triangles[..., 2].min(), shape.triangles[..., 2].max()) for shape in shapes.values()]
    return float(max(top for _, top in z) - min(bottom for bottom, _ in z))


def _unit_slip(shapes: dict[int, Shape]) -> float:
    """Factor that makes the building's height possible; 1 where it already is or nothing helps."""
    height = _typical_height(shapes)
    low, high = STOREY_HEIGHTS
    if height == 0.0 or 0.1 * low <= height <= high:
        return 1.0
    if height < low <= _whole_height(shapes):  # low spaces, such as beams of the wrong class
        return 1.0
    fits = [factor for factor in UNIT_SLIPS if low * 1.5 <= height * factor <= 0.1 * high]
    return fits[0] if fits else 1.0


def ground_level(model: ifcopenshell.file, placed: Placed, damage: Damage | None = None) -> float:
    """Height [m] in the world of the storey nearest to elevation zero, else of the lowest one."""
    unit = length_scale(model)
    levels: list[tuple[float, float]] = []
    for storey in model.by_type("IfcBuildingStorey"):
        matrix = placement_of(storey, damage)
        if matrix is None or storey.Elevation is None:
            continue
        z = float(matrix[2, 3])
        levels.append((float(storey.Elevation) * unit * placed.scale, z * unit))
    if not levels:
        bottoms = [shape.triangles[..., 2].min() for shape in placed.shapes.values()]
        return float(min(bottoms, default=0.0))
    near = [level for level in levels if abs(level[0]) <= GROUND_RANGE]
    chosen = min(near, key=lambda level: abs(level[0])) if near else min(levels)
    return placed.scale * chosen[1] - float(placed.offset[2])


def map_georeference(
    model: ifcopenshell.file, placed: Placed, *, north_is_corrected: bool = False
) -> Georeference | None:
    """The way from map to world by the file's first map conversion; None without one.

    map = (Eastings, Northings, OrthogonalHeight) + turn @ model; model and map are in metres here,
    so that Scale, which only changes between their units, is not needed.

    Args: north_is_corrected: the conversion's rotation is wrong then, and the map's north is north.
    """
    stated = to_map(model)
    if stated is None:
        return None
    crs, model_to_map = stated
    to_world = placed.matrix()
    if north_is_corrected:
        to_world[:3, :3] = placed.scale * model_to_map[:3, :3]
    return Georeference(crs, to_world @ np.linalg.inv(model_to_map))


def to_map(model: ifcopenshell.file) -> tuple[str, NDArray[np.float64]] | None:
    """The first map of a file, and the way [4, 4] from model to map [m]; None without one."""
    for one in map_conversions(model):
        if not one.crs or None in one.origin:
            continue
        x, y = one.x_axis or (1.0, 0.0)
        c, s = x / math.hypot(x, y), y / math.hypot(x, y)
        matrix = np.eye(4)
        matrix[:2, :2] = (c, -s), (s, c)
        matrix[:3, 3] = _metres(model, one.unit) * np.array(one.origin, dtype=float)
        return crs_name(str(one.crs)), matrix
    return None


def _metres(model: ifcopenshell.file, unit: ifcopenshell.entity_instance | None) -> float:
    """Metres in the map's unit; the project's unit of length where it states none."""
    if unit is None:
        return length_scale(model)
    if unit.is_a("IfcConversionBasedUnit"):
        return float(unit.ConversionFactor.ValueComponent.wrappedValue)
    return float(ifcopenshell.util.unit.get_prefix_multiplier(getattr(unit, "Prefix", None)))
