"""A building as gbXML: `write_gbxml`."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
import shapely

from bim.defaults import WINDOW_FRAME
from bim.doorways import Key, touching
from bim.energyplus_parts import at_most_layers
from bim.exported_glazing import LEFT_TO_READER, ExportedGlazing, Glazings, glazing_of, left_out, without_bsdf
from bim.hosted_windows import HostedPolygon, hosted_polygons
from bim.model import Building, Element, Face, MaterialLayer, Space, Window
from bim.planes import Plane, planar_facets, rings_of, without_holes
from mitsuba_cfs.files import write_text

SCHEMA = "http://www.gbxml.org/schema"
VERSION = "6.01"
LEAST_PART = 1e-4  # [m2] smaller parts of shades are left out


def write_gbxml(building: Building, path: str | PathLike[str], *, glazing: Glazings | None = None) -> tuple[str, ...]:
    """Write rooms, windows, constructions, reflectances and obstructions as gbXML 6.01.

    Not written: BSDF data (their transmittances are), shading states, gloss, furniture, the space
    beyond inner walls.  gbXML has no holes: polygons with holes are cut.  An open doorway is a
    surface of air of two spaces; the wall's thickness belongs to the first of them.

    Args: glazing: of windows by GUID, in place of what the building states.

    Returns: sentences on BSDF, inner glass and the ground, which are left out.
    """
    units = {
        "temperatureUnit": "C",
        "lengthUnit": "Meters",
        "areaUnit": "SquareMeters",
        "volumeUnit": "CubicMeters",
        "useSIUnitsForResults": "true",
        "version": VERSION,
    }
    root = ElementTree.Element("gbXML", {"xmlns": SCHEMA, **units})
    building, sides = touching(building)
    number_of = {space.guid: number for number, space in enumerate(building.spaces)}
    air = {key: number_of[other[0]] for key, other in sides.items()}
    writer = _Writer(root, glazing or {}, air)
    campus = _part(root, "Campus", id="campus")
    _text(campus, "Name", building.name)
    location = _part(campus, "Location")
    _text(location, "ZipcodeOrPostalCode", "")  # required by the schema; not known here
    for field, value in (("Latitude", building.latitude_deg), ("Longitude", building.longitude_deg)):
        if value is not None:
            _text(location, field, f"{value:.6f}")
    _text(location, "Elevation", f"{building.elevation:.3f}")
    inner = _part(campus, "Building", id="building", buildingType="Unknown")
    storeys = {name: f"storey-{n}" for n, name in enumerate(_storeys(building))}
    for name, guid in storeys.items():
        _text(_part(inner, "BuildingStorey", id=guid), "Name", name)
    for number, space in enumerate(building.spaces):
        storey = {"buildingStoreyIdRef": storeys[space.storey]} if space.storey else {}
        room = _part(inner, "Space", id=f"space-{number}", **storey)
        _text(room, "Name", space.label)
        _text(room, "Area", f"{space.floor_area:.6f}")
        _text(room, "Volume", f"{space.volume:.6f}")
    for number, space in enumerate(building.spaces):
        writer.room(campus, space, number)
    windows = {window.guid for window in building.windows}
    for number, element in enumerate(e for e in building.elements if e.guid not in windows):
        writer.shade(campus, element, number)
    writer.libraries()
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    write_text(Path(path), f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')
    lost = left_out(building.spaces, "gbXML", LEFT_TO_READER)
    return (*without_bsdf(building.windows, glazing or {}, "gbXML"), *lost)


class _Writer:
    """The surfaces of a campus, and the constructions and window types that they refer to."""

    def __init__(self, root: ElementTree.Element, glazing: Glazings, air: Mapping[Key, int]) -> None:
        self._root, self._glazing = root, glazing
        self._air = air  # number of the space beyond a face of air
        self._constructions: dict[_Finish, str] = {}
        self._windows: dict[tuple, tuple[str, Window, ExportedGlazing]] = {}
        self._openings = 0

    def room(self, campus: ElementTree.Element, space: Space, number: int) -> None:
        """The surfaces of a room, with their openings."""
        count = 0
        for part in hosted_polygons(space):
            beyond = self._air.get((space.guid, part.face.name)) if part.face is not None else None
            if beyond is not None and beyond < number:
                continue  # written with the other room
            for polygon in _without_holes(part):
                guid = f"surface-{number}-{count}"
                count += 1
                kind = _kind(part) if beyond is None else "Air"
                finish = AIR if beyond is not None else _finish(part.face)
                construction = self._construction(finish)
                surface = _part(campus, "Surface", id=guid, surfaceType=kind, constructionIdRef=construction)
                name = part.panes[0][0].name if part.face is None else part.face.name
                _text(surface, "Name", f"{space.label} {name}")
                for adjacent in (number,) if beyond is None else (number, beyond):
                    _part(surface, "AdjacentSpaceId", spaceIdRef=f"space-{adjacent}")
                _loop(surface, part.plane, polygon)
                for window, pane in part.panes:
                    if polygon.contains(pane.representative_point()):
                        self._opening(surface, window, part.plane, pane)

    def _opening(self, surface: ElementTree.Element, window: Window, plane: Plane, pane: shapely.Polygon) -> None:
        kind = "FixedSkylight" if plane.normal[2] > 0.7 else "FixedWindow"
        opening = _part(
            surface, "Opening", id=f"opening-{self._openings}", openingType=kind, windowTypeIdRef=self._window(window)
        )
        self._openings += 1
        _text(opening, "Name", window.name or window.guid)
        _loop(opening, plane, shapely.Polygon(pane.exterior))

    def shade(self, campus: ElementTree.Element, element: Element, number: int) -> None:
        """A surface for each plane part of an obstruction."""
        construction = self._construction(_Finish("obstruction", (), outside=element.reflectance_visible))
        parts = [
            (facet.plane, polygon)
            for facet in planar_facets(element.triangles)
            for polygon in without_holes(facet.polygon)
            if polygon.area > LEAST_PART
        ]
        for index, (plane, polygon) in enumerate(parts):
            surface = _part(
                campus, "Surface", id=f"shade-{number}-{index}", surfaceType="Shade", constructionIdRef=construction
            )
            _text(surface, "Name", element.name or element.guid)
            _loop(surface, plane, polygon)

    def _construction(self, finish: _Finish) -> str:
        return self._constructions.setdefault(finish, f"construction-{len(self._constructions)}")

    def _window(self, window: Window) -> str:
        known = glazing_of(window, self._glazing)
        key = (known.u_value, known.g_value, known.visible_transmittance, known.solar_transmittance)
        guid = f"window-type-{len(self._windows)}"
        return self._windows.setdefault(key, (guid, window, known))[0]

    def libraries(self) -> None:
        """Write the constructions with their layers and materials, and the window types."""
        for finish, guid in self._constructions.items():
            construction = _part(self._root, "Construction", id=guid)
            _text(construction, "Name", finish.name)
            for number in range(len(finish.layers)):
                _part(construction, "LayerId", layerIdRef=f"{guid}-layer-{number}")
            for kind, value in (
                ("IntVisible", finish.visible),
                ("IntSolar", finish.solar),
                ("ExtVisible", finish.outside),
            ):
                if value is not None:
                    _share(construction, "Reflectance", value, kind)
            for number, layer in enumerate(finish.layers):
                entry = _part(self._root, "Layer", id=f"{guid}-layer-{number}")
                _part(entry, "MaterialId", materialIdRef=f"{guid}-material-{number}")
                material = _part(self._root, "Material", id=f"{guid}-material-{number}")
                _text(material, "Name", layer.name)
                for field, unit, value in (
                    ("Thickness", "Meters", layer.thickness),
                    ("Conductivity", "WPerMeterK", layer.conductivity),
                    ("Density", "KgPerCubicM", layer.density),
                    ("SpecificHeat", "JPerKgK", layer.heat_capacity),
                ):
                    _text(material, field, _decimal(value), unit=unit)
        for guid, window, known in self._windows.values():
            window_type = _part(self._root, "WindowType", id=guid)
            _text(window_type, "Name", window.type_name or guid)
            if known.u_value is not None:
                _text(window_type, "U-value", _decimal(known.u_value), unit="WPerSquareMeterK")
            if known.g_value is not None:
                _text(window_type, "SolarHeatGainCoeff", _decimal(known.g_value), unit="Fraction")
            for kind, share in (("Visible", known.visible_transmittance), ("Solar", known.solar_transmittance)):
                if share is not None:
                    _share(window_type, "Transmittance", share, kind)


@dataclass(frozen=True, slots=True)
class _Finish:
    """Layers and reflectances of a construction; equal ones are written once."""

    name: str
    layers: tuple[MaterialLayer, ...]
    visible: float | None = None  # reflectance of the room side
    solar: float | None = None
    outside: float | None = None  # visible reflectance of the outer side


AIR = _Finish("air", ())


def _finish(face: Face | None) -> _Finish:
    """Finish of a face; a frame's where the face only carries a window."""
    if face is None:
        return _Finish(WINDOW_FRAME.name, WINDOW_FRAME.layers)
    layers = at_most_layers(face.construction.layers)
    reflectances = face.reflectance_visible, face.reflectance_solar
    return _Finish(face.construction.name, layers, *reflectances)


def _share(owner: ElementTree.Element, tag: str, value: float, kind: str) -> None:
    _text(owner, tag, _decimal(value), type=kind, unit="Fraction", surfaceType="Both")


def _decimal(value: float) -> str:
    """A number without exponent, which the schema's decimals do not have."""
    return np.format_float_positional(value, precision=9, fractional=False, trim="0")


def _storeys(building: Building) -> list[str]:
    return list(dict.fromkeys(space.storey for space in building.spaces if space.storey))


def _kind(part: HostedPolygon) -> str:
    """The type of a surface that one room names."""
    adjacency = "outside" if part.face is None or part.panes else part.face.adjacency
    z = part.plane.normal[2]
    level = "floor" if z < -0.7 else "ceiling" if z > 0.34 else "wall"
    if part.face is not None and part.face.kind == "reveal":  # a sill is no floor
        level = "wall"
    kinds = {
        "outside": {"floor": "ExposedFloor", "ceiling": "Roof", "wall": "ExteriorWall"},
        "ground": {"floor": "SlabOnGrade", "ceiling": "UndergroundCeiling", "wall": "UndergroundWall"},
    }
    inside = {"floor": "InteriorFloor", "ceiling": "Ceiling", "wall": "InteriorWall"}
    return kinds.get(adjacency, inside)[level]


def _without_holes(part: HostedPolygon) -> list[shapely.Polygon]:
    """A polygon without holes, or its parts; with panes only the outline."""
    if part.panes:
        return [shapely.Polygon(part.polygon.exterior)]
    return without_holes(part.polygon)


def _loop(owner: ElementTree.Element, plane: Plane, polygon: shapely.Polygon) -> None:
    loop = _part(_part(owner, "PlanarGeometry"), "PolyLoop")
    for point in plane.to_world(rings_of(polygon)[0]):
        corner = _part(loop, "CartesianPoint")
        for value in point:
            _text(corner, "Coordinate", f"{value:.6f}")


def _part(owner: ElementTree.Element, tag: str, **fields: str) -> ElementTree.Element:
    return ElementTree.SubElement(owner, tag, fields)


def _text(owner: ElementTree.Element, tag: str, text: str, **fields: str) -> None:
    ElementTree.SubElement(owner, tag, fields).text = text
