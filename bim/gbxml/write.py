"""A building as gbXML: `write_gbxml`."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np
import shapely

from bim.doorways import Key, touching
from bim.hosted_windows import HostedPolygon, hosted_polygons
from bim.model import Building, Construction, Element, Face, Space, Window
from bim.planes import Plane, rings_of, triangulated
from mitsuba_cfs.files import write_text

SCHEMA = "http://www.gbxml.org/schema"
Known = Mapping[str, tuple[float | None, float | None]]  # U and g by a window's GUID


def write_gbxml(
    building: Building, path: str | PathLike[str], *, known: Known | None = None
) -> None:
    """Write rooms, windows, constructions, reflectances and what stands outdoors as gbXML 6.01.

    Lost: BSDF data and shading states, gloss, furniture, what lies behind inner walls.  Polygons
    with holes are cut into triangles, which is all that gbXML has for them.  An open doorway is a
    surface of air of two spaces; the way through the wall belongs to the first of them.

    Args: known: U and g of windows in place of those that the building states.
    """
    units = {
        "temperatureUnit": "C", "lengthUnit": "Meters", "areaUnit": "SquareMeters",
        "volumeUnit": "CubicMeters", "useSIUnitsForResults": "true", "version": "6.01",
    }  # fmt: skip
    root = ElementTree.Element("gbXML", {"xmlns": SCHEMA, **units})
    building, sides = touching(building)
    number_of = {space.guid: number for number, space in enumerate(building.spaces)}
    writer = _Writer(root, known or {}, {key: number_of[other[0]] for key, other in sides.items()})
    campus = _part(root, "Campus", id="campus")
    _text(campus, "Name", building.name)
    place = _part(campus, "Location")
    for field, value in (
        ("Latitude", building.latitude_deg),
        ("Longitude", building.longitude_deg),
    ):
        if value is not None:
            _text(place, field, f"{value:.6f}")
    _text(place, "Elevation", f"{building.elevation:.3f}")
    inner = _part(campus, "Building", id="building", buildingType="Unknown")
    storeys = {name: f"storey-{n}" for n, name in enumerate(_storeys(building))}
    for name, guid in storeys.items():
        _text(_part(inner, "BuildingStorey", id=guid), "Name", name)
    for number, space in enumerate(building.spaces):
        storey = {"buildingStoreyIdRef": storeys[space.storey]} if space.storey else {}
        one = _part(inner, "Space", id=f"space-{number}", **storey)
        _text(one, "Name", space.label)
        _text(one, "Area", f"{space.floor_area:.6f}")
        _text(one, "Volume", f"{space.volume:.6f}")
    for number, space in enumerate(building.spaces):
        writer.room(campus, space, number)
    windows = {window.guid for window in building.windows}
    for number, element in enumerate(e for e in building.elements if e.guid not in windows):
        writer.shade(campus, element, number)
    writer.libraries()
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    write_text(Path(path), f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


class _Writer:
    """The constructions and window types that have been asked for."""

    def __init__(self, root: ElementTree.Element, known: Known, air: Mapping[Key, int]) -> None:
        self._root, self._known = root, known
        self._air = air  # number of the space beyond a face of air
        self._constructions: dict[tuple, tuple[str, Construction, Face]] = {}
        self._windows: dict[tuple, tuple[str, Window]] = {}
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
                refers = {} if part.face is None or beyond is not None else {
                    "constructionIdRef": self._construction(part.face)
                }  # fmt: skip
                one = _part(campus, "Surface", id=guid, surfaceType=kind, **refers)
                name = part.panes[0][0].name if part.face is None else part.face.name
                _text(one, "Name", f"{space.label} {name}")
                for own in (number,) if beyond is None else (number, beyond):
                    _part(one, "AdjacentSpaceId", spaceIdRef=f"space-{own}")
                _loop(one, part.plane, polygon)
                for window, pane in part.panes:
                    if polygon.contains(pane.representative_point()):
                        self._opening(one, window, part.plane, pane)

    def _opening(
        self, surface: ElementTree.Element, window: Window, plane: Plane, pane: shapely.Polygon
    ) -> None:
        kind = "FixedSkylight" if plane.normal[2] > 0.7 else "FixedWindow"
        refers = {"windowTypeIdRef": self._window(window)}
        guid = f"opening-{self._openings}"
        self._openings += 1
        one = _part(surface, "Opening", id=guid, openingType=kind, **refers)
        _text(one, "Name", window.name or window.guid)
        _loop(one, plane, shapely.Polygon(pane.exterior))

    def shade(self, campus: ElementTree.Element, element: Element, number: int) -> None:
        """A surface for each triangle of what stands outdoors."""
        for index, triangle in enumerate(element.triangles):
            guid = f"shade-{number}-{index}"
            one = _part(campus, "Surface", id=guid, surfaceType="Shade")
            _text(one, "Name", element.name or element.guid)
            _points(one, triangle)

    def _construction(self, face: Face) -> str:
        key = (face.construction.layers, face.reflectance_visible, face.reflectance_solar)
        guid = f"construction-{len(self._constructions)}"
        return self._constructions.setdefault(key, (guid, face.construction, face))[0]

    def _window(self, window: Window) -> str:
        u_value, g_value = self._known.get(window.guid, (window.u_value, window.g_value))
        key = (u_value, g_value, window.visible_transmittance, window.solar_transmittance)
        guid = f"window-type-{len(self._windows)}"
        return self._windows.setdefault(key, (guid, window))[0]

    def libraries(self) -> None:
        """The constructions with their layers and materials, and the window types."""
        for guid, construction, face in self._constructions.values():
            one = _part(self._root, "Construction", id=guid)
            _text(one, "Name", construction.name)
            for number in range(len(construction.layers)):
                _part(one, "LayerId", layerIdRef=f"{guid}-layer-{number}")
            for kind, value in (("IntVis", face.reflectance_visible),
                                ("IntSolar", face.reflectance_solar)):  # fmt: skip
                _text(one, "Reflectance", f"{value:.6f}", type=kind, unit="Fraction")
            for number, layer in enumerate(construction.layers):
                own = _part(self._root, "Layer", id=f"{guid}-layer-{number}")
                _part(own, "MaterialId", materialIdRef=f"{guid}-material-{number}")
                material = _part(self._root, "Material", id=f"{guid}-material-{number}")
                _text(material, "Name", layer.name)
                for field, unit, value in (
                    ("Thickness", "Meters", layer.thickness),
                    ("Conductivity", "WPerMeterK", layer.conductivity),
                    ("Density", "KgPerCubicM", layer.density),
                    ("SpecificHeat", "JPerKgK", layer.heat_capacity),
                ):
                    _text(material, field, f"{value:.9g}", unit=unit)
        for (u_value, g_value, visible, solar), (guid, window) in self._windows.items():
            one = _part(self._root, "WindowType", id=guid)
            _text(one, "Name", window.type_name or guid)
            if u_value is not None:
                _text(one, "U-value", f"{u_value:.6g}", unit="WPerSquareMeterK")
            if g_value is not None:
                _text(one, "SolarHeatGainCoeff", f"{g_value:.6g}", unit="Fraction")
            for kind, share in (("Visible", visible), ("Solar", solar)):
                if share is not None:
                    _text(one, "Transmittance", f"{share:.6g}", type=kind, unit="Fraction")


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
        "ground": {
            "floor": "SlabOnGrade", "ceiling": "UndergroundCeiling", "wall": "UndergroundWall",
        },
    }  # fmt: skip
    inside = {"floor": "InteriorFloor", "ceiling": "Ceiling", "wall": "InteriorWall"}
    return kinds.get(adjacency, inside)[level]


def _without_holes(part: HostedPolygon) -> list[shapely.Polygon]:
    """A polygon, or the triangles of one with holes; with panes only the outline."""
    if part.panes:
        return [shapely.Polygon(part.polygon.exterior)]
    if not part.polygon.interiors:
        return [part.polygon]
    return [shapely.Polygon(triangle) for triangle in triangulated(part.polygon)]


def _loop(owner: ElementTree.Element, plane: Plane, polygon: shapely.Polygon) -> None:
    _points(owner, plane.to_world(rings_of(polygon)[0]))


def _points(owner: ElementTree.Element, ring: np.ndarray) -> None:
    loop = _part(_part(owner, "PlanarGeometry"), "PolyLoop")
    for point in ring:
        corner = _part(loop, "CartesianPoint")
        for value in point:
            _text(corner, "Coordinate", f"{value:.6f}")


def _part(owner: ElementTree.Element, tag: str, **fields: str) -> ElementTree.Element:
    return ElementTree.SubElement(owner, tag, fields)


def _text(owner: ElementTree.Element, tag: str, text: str, **fields: str) -> None:
    ElementTree.SubElement(owner, tag, fields).text = text
