"""Where an IFC file says that it lies on the map: IfcMapConversion."""

from __future__ import annotations

import math

import ifcopenshell
import ifcopenshell.util.unit
import numpy as np

from bim.georeference import Georeference, crs_name
from bim.ifc.placing import Placed
from bim.ifc.project import length_scale


def map_georeference(model: ifcopenshell.file, placed: Placed) -> Georeference | None:
    """The way from map to world by the file's first map conversion; None without one (IFC2X3).

    map = (Eastings, Northings, OrthogonalHeight) + turn @ model; model and map are in metres here,
    so that Scale, which only changes between their units, is not needed.
    """
    found = [] if model.schema == "IFC2X3" else model.by_type("IfcMapConversion")
    for one in found:
        name = getattr(one.TargetCRS, "Name", None)
        parts = (one.Eastings, one.Northings, one.OrthogonalHeight)
        if not name or any(part is None or not math.isfinite(part) for part in parts):
            continue
        unit = getattr(one.TargetCRS, "MapUnit", None)
        metres = _metres(model, unit)
        x, y = one.XAxisAbscissa, one.XAxisOrdinate
        turned = x is not None and y is not None and math.hypot(x, y) > 1e-9
        c, s = (x / math.hypot(x, y), y / math.hypot(x, y)) if turned else (1.0, 0.0)
        back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # from map to model axes
        turn = placed.scale * placed.rotation @ back
        to_world = np.eye(4)
        to_world[:3, :3] = turn
        to_world[:3, 3] = -turn @ (metres * np.array(parts, dtype=float)) - placed.offset
        return Georeference(crs_name(str(name)), to_world)
    return None


def _metres(model: ifcopenshell.file, unit: ifcopenshell.entity_instance | None) -> float:
    """Metres in the map's unit; the project's unit of length where it states none."""
    if unit is None:
        return length_scale(model)
    if unit.is_a("IfcConversionBasedUnit"):
        return float(unit.ConversionFactor.ValueComponent.wrappedValue)
    return float(ifcopenshell.util.unit.get_prefix_multiplier(getattr(unit, "Prefix", None)))
