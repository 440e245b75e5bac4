"""City models, CityJSON and CityGML: buildings, plants and terrain, in detail up to LoD 2.

Source: CityJSON 1.0 to 2.0 (https://www.cityjson.org/specs); CityGML 1.0 to 3.0
(https://www.ogc.org/standards/citygml), GML 3.1.1 and 3.2.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.georeference import crs_name
from bim.polygon_rooms import triangles_of_rings
from bim.surroundings.objects import (
    BODY,
    MOST_BYTES,
    TERRAIN,
    SurroundingObject,
    SurroundingsFile,
    are_coordinates,
    read_object,
)
from bim.xml_elements import xml_elements
from mitsuba_cfs.errors import DataError

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


SUFFIXES = (".gml", ".xml", ".citygml")
MEMBERS = ("cityObjectMember", "featureMember", "featureMembers")
POLYGONS = ("Polygon", "PolygonPatch", "Triangle", "Rectangle")
# geometry of one level of detail, the whole bodies first; boundary surfaces stand behind "Surface"
KINDS = ("Solid", "MultiSurface", "Surface", "Geometry", "RoofEdge", "FootPrint")
NAMED = re.compile(rf"lod(\d)({'|'.join(KINDS)})")
BOUNDARY = re.compile(r"\w+Surface|(?:Auxiliary)?TrafficArea")  # parts of an object's hull
NOT_FOUND = "surfaces-not-in-object"  # code of the issue

Element = ElementTree.Element
Rings = list[NDArray[np.float64]]


@dataclass(slots=True)
class _Member:
    """A member of the city model: its geometries by gml:id."""

    path: Path
    line: int
    by_id: dict[str, Element]
    objects: list[SurroundingObject] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)


def read_citygml(path: Path) -> SurroundingsFile:
    """The objects of a CityGML file; each in its finest level of detail below 3.

    A BuildingPart is an object of its own.  Surfaces named by xlink are those of the same member.

    Raises: `DataError` that names file, gml:id or line, and field.
    """
    objects: list[SurroundingObject] = []
    systems: dict[str, None] = {}
    left_out: Counter[str] = Counter()
    for element, line in xml_elements(path, "CityModel", depth=2, most_bytes=MOST_BYTES):
        systems |= dict.fromkeys(_systems(element))
        if len(systems) > 1:
            message = f"{', '.join(systems)}: expected one coordinate system"
            raise DataError(message, file=path, element=f"line {line}", field="srsName")
        if element.tag not in MEMBERS:
            continue
        by_id = {one.get("id", ""): one for one in element.iter() if one.get("id")}
        member = _Member(path, line, by_id)
        for feature in element:
            if not _read_object(feature, member):
                member.left_out[NO_GEOMETRY] += 1
        objects += member.objects
        left_out += member.left_out
    return SurroundingsFile(
        path, tuple(objects), next(iter(systems), None), left_out=tuple(left_out.items())
    )


def _systems(element: Element) -> Iterator[str]:
    """The coordinate systems of all but single points, which may be addresses."""
    for one in element.iter():
        name = one.get("srsName")
        if name and name.strip() and one.tag not in ("Point", "MultiPoint", "pos"):
            yield crs_name(name)


def _read_object(feature: Element, member: _Member) -> bool:
    """Reads an object and those in it; whether anything has geometry of whatever detail."""
    geometries = list(_geometries(feature))
    nested = [
        _read_object(child, member)
        for owner in feature
        if not NAMED.fullmatch(owner.tag)
        for child in owner
        if child.tag[:1].isupper() and not BOUNDARY.fullmatch(child.tag)
    ]
    kept = [one for one in geometries if one[0] < FINEST]
    if not kept:
        if geometries:
            member.left_out[NO_GEOMETRY] += 1
        return bool(geometries) or any(nested)
    name = _name(feature, member)
    surfaces, missing = _finest(kept, name, member)
    if missing:
        member.left_out[NOT_FOUND] += missing
    triangles = triangles_of_surfaces(surfaces)
    if len(triangles):
        member.objects.append(city_object(name, feature.tag, triangles))
    return True


def _name(feature: Element, member: _Member) -> str:
    return feature.get("id") or feature.findtext("name") or f"{feature.tag} of line {member.line}"


def _geometries(feature: Element) -> Iterator[tuple[int, int, list[Element]]]:
    """Level of detail, rank among `KINDS` and elements of each geometry of an object."""
    hulls: dict[int, list[Element]] = {}
    for owner in feature:
        if found := NAMED.fullmatch(owner.tag):
            yield int(found[1]), KINDS.index(found[2]), [owner]
        elif owner.tag == "tin":
            level = (feature.findtext("lod") or "").strip()
            yield int(level) if level in ("0", "1", "2", "3", "4") else 0, 0, [owner]
        for surface in owner:
            if BOUNDARY.fullmatch(surface.tag) and not NAMED.fullmatch(owner.tag):
                for one in surface:
                    if found := NAMED.fullmatch(one.tag):
                        hulls.setdefault(int(found[1]), []).append(one)
    for level, owners in hulls.items():
        yield level, KINDS.index("Surface"), owners


def _finest(
    geometries: list[tuple[int, int, list[Element]]], name: str, member: _Member
) -> tuple[list[Rings], int]:
    """The surfaces of the finest complete geometry, and how many of them were not found.

    Where none is complete, of the one with most surfaces.
    """
    found: list[tuple[list[Rings], int]] = []
    for _, _, owners in sorted(geometries, key=lambda one: (-one[0], one[1])):
        seen: set[int] = set()
        missing: list[str] = []
        surfaces = [
            _rings(polygon, name, member)
            for owner in owners
            for polygon in _polygons(owner, member, seen, missing)
        ]
        if surfaces and not missing:
            return surfaces, 0
        found.append((surfaces, len(missing)))
    return max(found, key=lambda one: len(one[0]))


def _polygons(
    owner: Element, member: _Member, seen: set[int], missing: list[str]
) -> Iterator[Element]:
    """The polygons in an element and those that it names, each once: links may go in circles."""
    waiting = [owner]
    while waiting:
        one = waiting.pop()
        target = one.get("href", "")
        if target and not len(one):
            name = target.removeprefix("#")
            if name not in member.by_id:
                missing.append(name)
            else:
                waiting.append(member.by_id[name])
            continue
        if id(one) in seen:
            continue
        seen.add(id(one))
        if one.tag in POLYGONS:
            yield one
        else:
            waiting += reversed(one)


def _rings(polygon: Element, name: str, member: _Member) -> Rings:
    """A polygon's outline and holes, each [N, 3] without its first corner again."""
    sides = [one for one in polygon if one.tag in ("exterior", "interior")]
    sides.sort(key=lambda side: side.tag)  # the outline first
    if not sides or sides[0].tag != "exterior":
        raise _fault("expected an exterior", polygon, name, member)
    return [_ring(side, name, member) for side in sides]


def _ring(side: Element, name: str, member: _Member) -> NDArray[np.float64]:
    lists = [one for one in side.iter() if one.tag in ("posList", "pos")]
    if not lists:
        raise _fault("expected posList or pos", side, name, member)
    if any(one.get("srsDimension", "3").strip() != "3" for one in lists):
        raise _fault("expected srsDimension 3", lists[0], name, member)
    try:
        texts = [text for one in lists for text in (one.text or "").split()]
        points = np.array(texts, dtype=float).reshape(-1, 3)
    except ValueError:
        message = "expected triples of numbers"
        raise _fault(message, lists[0], name, member) from None
    if not are_coordinates(points):
        raise _fault("expected finite numbers", lists[0], name, member)
    return points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points


def _fault(message: str, element: Element, name: str, member: _Member) -> DataError:
    where = f"{name[:60]} (from line {member.line})"
    return DataError(message, file=member.path, element=where, field=element.tag)


DEPTH = {"MultiSurface": 1, "CompositeSurface": 1, "Solid": 2, "MultiSolid": 3, "CompositeSolid": 3}


def read_cityjson(path: Path) -> SurroundingsFile:
    """The objects of a CityJSON file; each in its finest level of detail below 3.

    Raises: `DataError` that names file, object and field.
    """
    content = read_object(path)
    if content.get("type") != "CityJSON":
        found = content.get("type")
        raise DataError(f"expected CityJSON, got {found!r:.60}", file=path, field="type")
    vertices = _vertices(content, path)
    things = content.get("CityObjects")
    if not isinstance(things, dict):
        raise DataError("expected objects by name", file=path, field="CityObjects")
    objects, left_out = [], Counter()
    for name, thing in things.items():
        geometry = _geometry(thing, name, path)
        if geometry is None:
            left_out[NO_GEOMETRY] += not _has_children(thing)
            continue
        triangles = _triangles(geometry, vertices, name, path)
        if len(triangles):
            objects.append(city_object(name, str(thing.get("type")), triangles))
    metadata = content.get("metadata")
    system = metadata.get("referenceSystem") if isinstance(metadata, dict) else None
    return SurroundingsFile(
        path,
        tuple(objects),
        crs_name(system) if isinstance(system, str) else None,
        left_out=tuple((what, count) for what, count in left_out.items() if count),
    )


def _has_children(thing: dict[str, Any]) -> bool:
    return bool(thing.get("children"))


def _vertices(content: dict[str, Any], path: Path) -> NDArray[np.float64]:
    listed = content.get("vertices")
    try:
        points = np.asarray(listed, dtype=float).reshape(-1, 3)
        transform = content.get("transform")
        if transform is not None:
            scale = np.asarray(transform["scale"], dtype=float).reshape(3)
            points = points * scale + np.asarray(transform["translate"], dtype=float).reshape(3)
    except (TypeError, ValueError, KeyError, OverflowError):
        message = "expected triples of numbers, and a transform of scale and translate"
        raise DataError(message, file=path, field="vertices") from None
    if not are_coordinates(points):
        raise DataError("expected finite numbers", file=path, field="vertices")
    return points


def _geometry(thing: Any, name: str, path: Path) -> dict[str, Any] | None:
    """The finest geometry of an object below LoD 3; None without one."""
    if not isinstance(thing, dict):
        raise DataError("expected an object", file=path, element=name[:60])
    listed = thing.get("geometry") or []
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise DataError("expected a list", file=path, element=name[:60], field="geometry")
    if not all(isinstance(one.get("type"), str | None) for one in listed):
        raise DataError("expected a text", file=path, element=name[:60], field="geometry.type")
    found = [(_level(one), one) for one in listed if one.get("type") in DEPTH]
    found = [(level, one) for level, one in found if level < FINEST]
    return max(found, key=lambda pair: pair[0])[1] if found else None


def _level(geometry: dict[str, Any]) -> float:
    try:
        return float(geometry.get("lod", 0))
    except (TypeError, ValueError):
        return 0.0


def _triangles(
    geometry: dict[str, Any], vertices: NDArray[np.float64], name: str, path: Path
) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of all surfaces of a geometry."""
    boundaries, depth = geometry.get("boundaries"), DEPTH[geometry["type"]]
    if not _is_nested(boundaries, depth + 1, len(vertices)):
        message = "expected lists of the numbers of vertices"
        raise DataError(message, file=path, element=name[:60], field="boundaries")
    return triangles_of_surfaces(
        [vertices[np.asarray(ring, dtype=int)] for ring in one]
        for one in _surfaces(boundaries, depth)
    )


def _is_nested(part: Any, depth: int, count: int) -> bool:
    """Whether lists in lists, so many deep, hold numbers of so many vertices."""
    if not isinstance(part, list):
        return False
    if depth > 0:
        return all(_is_nested(one, depth - 1, count) for one in part)
    return all(isinstance(i, int) and 0 <= i < count for i in part)


def _surfaces(boundaries: Any, depth: int) -> Iterator[Any]:
    """The surfaces in nested boundaries: lists of rings."""
    for part in boundaries:
        if depth == 1:
            yield part
        else:
            yield from _surfaces(part, depth - 1)
