"""CityGML: the buildings, plants and terrain of a quarter, in the finest detail up to LoD 2.

Source: CityGML 1.0 to 3.0 (https://www.ogc.org/standards/citygml), GML 3.1.1 and 3.2.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.georeference import crs_name
from bim.surroundings.city import FINEST, NO_GEOMETRY, city_object, triangles_of_surfaces
from bim.surroundings.objects import MOST_BYTES, SurroundingObject, SurroundingsFile
from bim.xml_elements import xml_elements
from mitsuba_cfs.errors import DataError

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
    return SurroundingsFile(path, tuple(objects), next(iter(systems), None),
                       left_out=tuple(left_out.items()))  # fmt: skip


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
    if not (np.abs(points) < 1e12).all():
        raise _fault("expected finite numbers", lists[0], name, member)
    return points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points


def _fault(message: str, element: Element, name: str, member: _Member) -> DataError:
    where = f"{name[:60]} (from line {member.line})"
    return DataError(message, file=member.path, element=where, field=element.tag)
