"""What an IFC file states of itself: program, units, site, north, storeys, elements.  No geometry is read."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell

from bim.ifc.damage import instances
from bim.ifc.fenestration_read import read_states
from bim.ifc.north import map_conversions, true_north, true_north_deg
from bim.ifc.project import length_scale, open_all, site_location, storey_of, storeys_in

# what is counted, by its label; a class counts with its subclasses
COUNTED = {
    "spaces": ("IfcSpace",),
    "zones": ("IfcZone",),
    "windows": ("IfcWindow",),
    "doors": ("IfcDoor",),
    "curtain walls": ("IfcCurtainWall",),
    "walls": ("IfcWall",),
    "slabs and roofs": ("IfcSlab", "IfcRoof"),
    "shading devices": ("IfcShadingDevice",),
    "light fixtures": ("IfcLightFixture", "IfcLightFixtureType"),
    "space boundaries": ("IfcRelSpaceBoundary",),
    "layer sets": ("IfcMaterialLayerSet",),
}


def summary(path: str | PathLike[str]) -> list[dict[str, Any]]:
    """One mapping for each model of a file: what it states, without reading its geometry.

    Raises: `DataError` where the file is no IFC model.
    """
    return [_of_model(name, model, Path(path)) for name, model in open_all([path]).items()]


def _of_model(name: str, model: ifcopenshell.file, path: Path) -> dict[str, Any]:
    latitude, longitude, elevation, _ = site_location(model)
    north = true_north(model)[0]
    spaces = instances(model, "IfcSpace")
    conversion = next((one for one in map_conversions(model) if not one.is_empty), None)
    return {
        "file": name,
        "schema": model.schema_identifier,
        "written_by": _programs(model),
        "metres_per_unit": length_scale(model),
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "elevation_m": elevation,
        "north_deg": None if north is None else true_north_deg(north),
        "map": None if conversion is None else conversion.crs or "no reference system stated",
        "storeys": {one.Name or "": sum(storey_of(s) == (one.Name or "") for s in spaces) for one in storeys_in(model)},
        "counts": {label: _count(model, kinds) for label, kinds in COUNTED.items()},
        "windows_with_attached_data": len(read_states(model, path.parent, file=path)),
    }


def _programs(model: ifcopenshell.file) -> list[str]:
    """Names and versions of the programs that the file names, each once."""
    found = [
        " ".join(filter(None, (one.ApplicationFullName, one.Version))) for one in instances(model, "IfcApplication")
    ]
    return list(dict.fromkeys(found))


def _count(model: ifcopenshell.file, kinds: tuple[str, ...]) -> int:
    return sum(len(instances(model, kind)) for kind in kinds)
