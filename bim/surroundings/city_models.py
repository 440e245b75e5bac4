"""Surroundings as objects: city models, footprints and trees.

CityJSON and CityGML: buildings, plants and terrain, in detail up to LoD 2.

Source: CityJSON 1.0 to 2.0 (https://www.cityjson.org/specs); CityGML 1.0 to 3.0
(https://www.ogc.org/standards/citygml), GML 3.1.1 and 3.2.

GeoJSON: footprints with heights, as blocks on the ground, and points of trees.

Source: RFC 7946; the fields of heights are those of OpenStreetMap and of usual exports.

Trees as crowns that pass a share of the sun by month: a list of them as TOML, or GeoJSON points.

    [[tree]]
    at = [12.0, -8.0]                # metres of the building; a third number: the ground's height
    height = 11.0
    crown_radius = 3.5
    crown_base = 2.5                 # a quarter of the height by default
    transmittance = "deciduous"      # or "evergreen", one value, or twelve from January

    [[tree]]
    object = "oak"                   # a closed mesh of another file of `--surroundings`
    transmittance = 0.2

A transmittance is the mean of the beam over the crown's shadow where the light comes level.
"""

from __future__ import annotations

import re
import tomllib
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import shapely.errors
import shapely.geometry
import trimesh
from numpy.typing import NDArray

from bim.model import LONGITUDE_LATITUDE, crs_name, local_metres
from bim.planes import plane_through, polygons_of
from bim.polygon_rooms import triangles_of_rings
from bim.solids import prism, triangles_of
from bim.surroundings.objects import (
    BODY,
    MOST_BYTES,
    TERRAIN,
    Foliage,
    SurroundingObject,
    SurroundingsFile,
    are_coordinates,
    is_number,
    read_bytes,
)
from bim.xml_elements import xml_elements
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import read_json

# Middles of the ranges of Konarska et al. 2014, doi:10.1007/s00704-013-1000-3, five deciduous
# species in Gothenburg: 1.3 to 5.3 % with leaves, 40.2 to 51.9 % without
LEAFED, BARE = 0.033, 0.46
LEAFY_MONTHS = range(5, 11)  # May to October on the northern half of the earth: an assumption
FOLIAGE = ("deciduous", "evergreen")
LEAST = 0.01  # of a transmittance; what passes less is a body
FIELDS = ("at", "object", "name", "height", "crown_radius", "crown_base", "transmittance")
ROUND = 3  # subdivisions of an icosahedron: 1,280 triangles


def read_trees(path: Path) -> SurroundingsFile:
    """The trees of a TOML list; those that are objects of other files by their names.

    Raises: `DataError` that names file, tree and field.
    """
    try:
        listed = tomllib.loads(read_bytes(path).decode("utf-8")).get("tree")
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise DataError(f"is no TOML: {error}", file=path) from None
    if not isinstance(listed, list) or not listed or not all(isinstance(t, dict) for t in listed):
        raise DataError("expected tables [[tree]]", file=path, field="tree")
    objects: list[SurroundingObject] = []
    crowns: list[tuple[str, Foliage]] = []
    for number, fields in enumerate(listed):
        element = f"tree {number}"
        unknown = sorted(set(fields) - set(FIELDS))
        if unknown:
            message = f"is unknown; there are {', '.join(FIELDS)}"
            raise DataError(message, file=path, element=element, field=unknown[0])
        if "object" in fields:
            if not isinstance(fields["object"], str) or "at" in fields:
                message = "expected the name of an object in place of at, height and radius"
                raise DataError(message, file=path, element=element, field="object")
            crowns.append((fields["object"], foliage_of(fields, element, path)))
            continue
        at = fields.get("at")
        if not (isinstance(at, list) and len(at) in (2, 3) and all(map(is_number, at))):
            message = "expected [x, y] or [x, y, z] in metres"
            raise DataError(message, file=path, element=element, field="at")
        objects.append(tree_of(fields, at, element, path))
    return SurroundingsFile(path, tuple(objects), crowns=tuple(crowns))


def tree_of(
    fields: dict[str, Any], at: list[float], element: str, path: Path, *, scale: Any = 1.0
) -> SurroundingObject:
    """A tree at [x, y] or [x, y, z] as the ellipsoid of its crown.

    Args: scale: [2] or one, of metres in the coordinates of `at`.
    """
    height = _metres(fields, "height", element, path)
    radius = _metres(fields, "crown_radius", element, path)
    base = _metres(fields, "crown_base", element, path, height / 4)
    if not base < height or not radius > 0:
        message = f"expected a crown from {base:g} m up to a greater height, with a radius"
        raise DataError(message, file=path, element=element, field="height")
    sphere = trimesh.creation.icosphere(subdivisions=ROUND)
    corners = np.asarray(sphere.triangles) * (4 / 3 * np.pi / sphere.volume) ** (1 / 3)
    half, foot = (height - base) / 2, at[2] if len(at) == 3 else 0.0
    triangles = corners * [radius, radius, half] + [0.0, 0.0, foot + base + half]
    triangles[..., :2] = triangles[..., :2] * scale + np.asarray(at[:2], dtype=float)
    label = str(fields.get("name") or element)[:60]
    return SurroundingObject(label, triangles, foliage=foliage_of(fields, element, path))


def foliage_of(fields: dict[str, Any], element: str, path: Path) -> Foliage:
    """The `transmittance` of a tree: a kind, or twelve values."""
    value = fields.get("transmittance")
    if isinstance(value, str) and value in FOLIAGE:
        return value
    months = value if isinstance(value, list) else [value]
    if len(months) not in (1, 12) or not all(is_number(v) and LEAST <= v <= 1 for v in months):
        message = f"expected {' or '.join(FOLIAGE)}, or one or twelve values from {LEAST} to 1"
        raise DataError(message, file=path, element=element, field="transmittance")
    return tuple(float(v) for v in (months * 12)[:12])


def monthly_transmittance(foliage: Foliage, latitude_deg: float | None) -> tuple[float, ...]:
    """Transmittance of a crown in each month [12]; south of the equator leaves come half a year on.

    Source: Konarska, Lindberg, Larsson, Thorsson and Holmer 2014, doi:10.1007/s00704-013-1000-3.
    What an evergreen crown passes is taken as a deciduous one's with leaves.
    """
    if not isinstance(foliage, str):
        return foliage
    if foliage == "evergreen":
        return (LEAFED,) * 12
    shift = 6 if latitude_deg is not None and latitude_deg < 0 else 0
    return tuple(LEAFED if (month + shift - 1) % 12 + 1 in LEAFY_MONTHS else BARE for month in range(1, 13))


def _metres(fields: dict[str, Any], name: str, element: str, path: Path, default: float | None = None) -> float:
    value = fields.get(name, default)
    if not is_number(value) or not 0 <= value < 200:
        message = f"expected metres, got {value!r:.40}"
        raise DataError(message, file=path, element=element, field=name)
    return float(value)


HEIGHTS = ("height", "building:height", "measuredHeight", "measuredheight", "Height", "HEIGHT")
LEVELS = ("building:levels", "levels", "num_floors")
BASES = ("min_height", "building:min_height", "base")
SMALL_DEG = 1e-4  # of which the metres at a place are taken
STOREY = 3.0  # height of one, where only their number is stated [m]


def read_footprints(path: Path) -> SurroundingsFile:
    """The polygons of a GeoJSON file that state a height, their corners in its coordinates.

    Points that state a `crown_radius` are trees, with the fields of `bim.surroundings.city_models`.

    Raises: `DataError` that names file, feature and field; a file without any height.
    """
    content = read_json(path, most_bytes=MOST_BYTES)
    features = content.get("features")
    if content.get("type") != "FeatureCollection" or not isinstance(features, list):
        raise DataError("expected a FeatureCollection of GeoJSON", file=path, field="type")
    objects: list[SurroundingObject] = []
    without, crs = 0, _crs(content)
    for number, feature in enumerate(features):
        element = f"feature {number}"
        footprints = _block(feature, element, path) or _tree(feature, crs, element, path)
        without += not footprints
        objects += footprints
    if not objects:
        message = f"no polygon states a height ({', '.join(HEIGHTS[:3])}, or {LEVELS[0]})"
        raise DataError(message, file=path, field="properties")
    left_out = (("features-without-height", without),) if without else ()
    return SurroundingsFile(path, tuple(objects), crs, True, left_out)


def _crs(content: dict[str, Any]) -> str:
    """Longitude and latitude, unless the file states another system in the old way."""
    try:
        name = str(content["crs"]["properties"]["name"])
    except (KeyError, TypeError):
        return LONGITUDE_LATITUDE
    return crs_name(name)


def _block(feature: Any, name: str, path: Path) -> list[SurroundingObject]:
    """A feature's polygons from base to top; none without a height."""
    if not isinstance(feature, dict) or not isinstance(feature.get("properties") or {}, dict):
        raise DataError("expected a feature", file=path, element=name)
    fields = feature.get("properties") or {}
    geometry = feature.get("geometry") or {}
    is_polygon = isinstance(geometry, dict) and geometry.get("type") in ("Polygon", "MultiPolygon")
    height = _number(fields, HEIGHTS, name, path)
    levels = _number(fields, LEVELS, name, path)
    top = height if height is not None else None if levels is None else STOREY * levels
    base = _number(fields, BASES, name, path) or 0.0
    if not is_polygon or top is None or top <= base:
        return []
    try:
        shape = shapely.make_valid(shapely.force_2d(shapely.geometry.shape(geometry)))
    except (ValueError, TypeError, LookupError, AttributeError, shapely.errors.ShapelyError):
        shape = None
    if shape is None or not are_coordinates(shapely.get_coordinates(shape)):
        raise DataError("is no polygon", file=path, element=name, field="geometry.coordinates")
    label = str(fields.get("name") or fields.get("id") or name)[:60]
    return [
        SurroundingObject(label, triangles)
        for polygon in shapely.get_parts(shape)
        if polygon.geom_type == "Polygon" and len(triangles := _prism(polygon, base, top))
    ]


def _tree(feature: dict[str, Any], crs: str, name: str, path: Path) -> list[SurroundingObject]:
    """A point that states a crown."""
    fields, geometry = feature.get("properties") or {}, feature.get("geometry") or {}
    if not isinstance(geometry, dict) or geometry.get("type") != "Point":
        return []
    if "crown_radius" not in fields:
        return []
    at = geometry.get("coordinates")
    on_globe = crs == LONGITUDE_LATITUDE
    if (
        not isinstance(at, list)
        or len(at) not in (2, 3)
        or not all(map(is_number, at))
        or (on_globe and not abs(at[1]) < 89)
    ):
        raise DataError("is no point", file=path, element=name, field="geometry.coordinates")
    scale: Any = 1.0
    if on_globe:
        step = np.array([[at[0] + SMALL_DEG, at[1]], [at[0], at[1] + SMALL_DEG]])
        scale = SMALL_DEG / np.diag(local_metres(step, at[0], at[1]))
    # heights of a footprint's file start at the ground
    return [tree_of(fields, at[:2], name, path, scale=scale)]


def _number(fields: dict[str, Any], names: tuple[str, ...], name: str, path: Path) -> float | None:
    """The first of some fields that is stated; texts as "12.5 m" are read."""
    for key in names:
        value = fields.get(key)
        if isinstance(value, str):
            try:
                value = float(value.strip().removesuffix("m").strip().replace(",", "."))
            except ValueError:
                raise DataError(f"expected metres, got {value[:40]!r}", file=path, element=name, field=key) from None
        if value is None:
            continue
        if not is_number(value) or not 0 <= value < 10_000:
            message = f"expected metres, got {value!r:.40}"
            raise DataError(message, file=path, element=name, field=key)
        return float(value)
    return None


def _prism(polygon: shapely.Polygon, base: float, top: float) -> np.ndarray:
    """Triangles of the block over a polygon.

    Degrees are far apart in number and near in metres: the polygon is lifted to a size at which
    nothing is dust, and put back.
    """
    low = np.asarray(polygon.bounds[:2])
    size = max(np.ptp(np.asarray(polygon.bounds).reshape(2, 2), axis=0).max(), 1e-12)
    scale = 100.0 / size
    unit = shapely.transform(polygon, lambda p: (p - low) * scale)
    plane = plane_through(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    parts = polygons_of(shapely.transform(unit, lambda p: plane.to_plane(_flat(p))[:, :2]))
    if not parts:
        return np.empty((0, 3, 3))
    body = prism(shapely.union_all(parts), plane, base, top)
    if body is None:
        return np.empty((0, 3, 3))
    triangles, _ = triangles_of(body)
    return np.concatenate([triangles[..., :2] / scale + low, triangles[..., 2:]], axis=2)


def _flat(points: np.ndarray) -> np.ndarray:
    return np.column_stack([points, np.zeros(len(points))])


TERRAINS = ("TINRelief", "Road", "LandUse", "WaterBody", "Railway", "TransportSquare", "Square", "PlantCover")
FINEST = 3.0  # level of detail below which geometry is taken: 2.2 is, 3 (with openings) is not
NO_GEOMETRY = "objects-without-geometry"  # code of the issue


def city_object(name: str, kind: str, triangles: NDArray[np.float64]) -> SurroundingObject:
    """An object of triangles [T, 3, 3]; some of its kinds are terrain."""
    return SurroundingObject(name, triangles, TERRAIN if kind in TERRAINS else BODY)


def triangles_of_surfaces(surfaces: Iterable[Sequence[NDArray[np.float64]]]) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of polygons, each of an outline [N, 3] and its holes."""
    triangles = [np.empty((0, 3, 3))]
    for rings in surfaces:
        if rings and min(map(len, rings)) >= 3:
            triangles.append(triangles_of_rings(rings))
    return np.concatenate(triangles)


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
    return SurroundingsFile(path, tuple(objects), next(iter(systems), None), left_out=tuple(left_out.items()))


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
        if match := NAMED.fullmatch(owner.tag):
            yield int(match[1]), KINDS.index(match[2]), [owner]
        elif owner.tag == "tin":
            level = (feature.findtext("lod") or "").strip()
            yield int(level) if level in ("0", "1", "2", "3", "4") else 0, 0, [owner]
        for surface in owner:
            if BOUNDARY.fullmatch(surface.tag) and not NAMED.fullmatch(owner.tag):
                for one in surface:
                    if match := NAMED.fullmatch(one.tag):
                        hulls.setdefault(int(match[1]), []).append(one)
    for level, owners in hulls.items():
        yield level, KINDS.index("Surface"), owners


def _finest(geometries: list[tuple[int, int, list[Element]]], name: str, member: _Member) -> tuple[list[Rings], int]:
    """The surfaces of the finest complete geometry, and how many of them were not found.

    Where none is complete, of the one with most surfaces.
    """
    complete: list[tuple[list[Rings], int]] = []
    for _, _, owners in sorted(geometries, key=lambda one: (-one[0], one[1])):
        seen: set[int] = set()
        missing: list[str] = []
        surfaces = [
            _rings(polygon, name, member) for owner in owners for polygon in _polygons(owner, member, seen, missing)
        ]
        if surfaces and not missing:
            return surfaces, 0
        complete.append((surfaces, len(missing)))
    return max(complete, key=lambda one: len(one[0]))


def _polygons(owner: Element, member: _Member, seen: set[int], missing: list[str]) -> Iterator[Element]:
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
    content = read_json(path, most_bytes=MOST_BYTES)
    if content.get("type") != "CityJSON":
        kind = content.get("type")
        raise DataError(f"expected CityJSON, got {kind!r:.60}", file=path, field="type")
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
    geometries = [(_level(one), one) for one in listed if one.get("type") in DEPTH]
    geometries = [(level, one) for level, one in geometries if level < FINEST]
    return max(geometries, key=lambda pair: pair[0])[1] if geometries else None


def _level(geometry: dict[str, Any]) -> float:
    try:
        return float(geometry.get("lod", 0))
    except (TypeError, ValueError):
        return 0.0


def _triangles(geometry: dict[str, Any], vertices: NDArray[np.float64], name: str, path: Path) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of all surfaces of a geometry."""
    boundaries, depth = geometry.get("boundaries"), DEPTH[geometry["type"]]
    if not _is_nested(boundaries, depth + 1, len(vertices)):
        message = "expected lists of the numbers of vertices"
        raise DataError(message, file=path, element=name[:60], field="boundaries")
    return triangles_of_surfaces(
        [vertices[np.asarray(ring, dtype=int)] for ring in one] for one in _surfaces(boundaries, depth)
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
