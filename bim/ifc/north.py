"""North of an IFC model, from its map conversion, its TrueNorth or a correction.

TrueNorth "is for information only" beside an IfcMapConversion: "in case of inconsistency, the value
provided with IfcMapConversion shall take precedence" (IFC4, IfcGeometricRepresentationContext).  A
grid north differs from geographic north by the convergence of its meridians, at most
`CONVERGENCE_DEG` in the common systems: within that the two agree, and TrueNorth is geographic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bim.ifc.project import psets_of
from bim.report.issue import Issue

CONVERGENCE_DEG = 4.0  # UTM: 3 degrees of longitude from the meridian, times sin(latitude)
UPRIGHT = 0.1  # a direction with a larger vertical part is none in the plane
MAP_SET = "ePSet_MapConversion"  # of IFC2X3: buildingSMART, User guide for geo-referencing in IFC


@dataclass(frozen=True, slots=True)
class MapConversion:
    """Map coordinates of the model's origin, and the direction of the model's x axis on the map."""

    origin: tuple[float | None, float | None, float | None]  # in the map's unit
    x_axis: tuple[float, float] | None  # None where the file states none
    crs: str | None
    unit: ifcopenshell.entity_instance | None = None  # of the map

    @property
    def is_empty(self) -> bool:
        """Whether it is what a program writes that knows no map: no origin and no rotation."""
        x, y = self.x_axis or (1.0, 0.0)
        return not any(self.origin) and abs(y) < 1e-9 * abs(x) and x > 0

    @property
    def north(self) -> tuple[float, float] | None:
        """Direction of grid north in model axes; None where the file states none."""
        if self.x_axis is None or self.is_empty:
            return None
        x, y = self.x_axis
        return y, x


def map_conversions(model: ifcopenshell.file) -> list[MapConversion]:
    """The map conversions of a file; those of IFC2X3 are property sets of its project or site."""
    if model.schema == "IFC2X3":
        holders = [*model.by_type("IfcProject"), *model.by_type("IfcSite")]
        psets = [psets_of(holder) for holder in holders]
        conversions = [pset[MAP_SET] for pset in psets if MAP_SET in pset]
        names = [next((p["ePSet_ProjectedCRS"] for p in psets if "ePSet_ProjectedCRS" in p), {})]
        return [_conversion(one, names[0].get("Name"), None) for one in conversions]
    return [
        _conversion(one.get_info(), getattr(one.TargetCRS, "Name", None), getattr(one.TargetCRS, "MapUnit", None))
        for one in model.by_type("IfcMapConversion")
    ]


def _conversion(values: dict[str, Any], crs: str | None, unit) -> MapConversion:
    origin = [_number(values.get(k)) for k in ("Eastings", "Northings", "OrthogonalHeight")]
    x, y = _number(values.get("XAxisAbscissa")), _number(values.get("XAxisOrdinate"))
    turned = x is not None and y is not None and math.hypot(x, y) > 1e-9
    return MapConversion((origin[0], origin[1], origin[2]), (x, y) if turned else None, crs, unit)


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def north_rotation(
    model: ifcopenshell.file, corrected_deg: float | None = None
) -> tuple[NDArray[np.float64], list[Issue]]:
    """Rotation [3, 3] about z from model axes to x east, y north; and what is odd about it.

    Args: corrected_deg: direction of the model's +y axis, from north to east; None: the file's.
    """
    true, issues = true_north(model)
    grid = next((n for one in map_conversions(model) if (n := one.north) is not None), None)
    if corrected_deg is not None:
        angle = math.radians(corrected_deg)
        rotation = _turned(-math.sin(angle), math.cos(angle))
        return rotation, [Issue("north-corrected", "project", {"angle": corrected_deg})]
    if grid is None:
        if true is not None:
            return _turned(*true), issues
        return np.eye(3), issues or [Issue("true-north-missing", "project")]
    if true is None:
        return _turned(*grid), [*issues, Issue("true-north-from-map", "IfcMapConversion")]
    difference = (true_north_deg(true) - true_north_deg(grid) + 180.0) % 360.0 - 180.0
    if abs(difference) <= CONVERGENCE_DEG:
        return _turned(*true), issues
    values = {"map": true_north_deg(grid), "true": true_north_deg(true), "difference": abs(difference)}
    return _turned(*grid), [*issues, Issue("north-contradicts-map", "IfcMapConversion", values)]


def true_north_deg(north: tuple[float, float]) -> float:
    """Direction of the model's +y axis, from north to east [deg]."""
    return math.degrees(math.atan2(-north[0], north[1])) + 0.0


def true_north(model: ifcopenshell.file) -> tuple[tuple[float, float] | None, list[Issue]]:
    """TrueNorth in the model's plane, None without a usable one; and what is odd about it."""
    for context in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        direction = getattr(context, "TrueNorth", None)
        if direction is None or context.ContextType == "Plan":
            continue
        ratios = [float(value) for value in direction.DirectionRatios]
        x, y, z = (*ratios, 0.0, 0.0, 0.0)[:3]
        if math.hypot(x, y) > 1e-9 and abs(z) <= UPRIGHT * math.hypot(x, y):
            return (x, y), []
        values = {"direction": str(tuple(ratios))}
        return None, [Issue("true-north-invalid", "project", values)]
    return None, []


def _turned(x: float, y: float) -> NDArray[np.float64]:
    """Rotation [3, 3] about z that takes the direction (x, y) to +y."""
    length = math.hypot(x, y)
    c, s = y / length, x / length
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
