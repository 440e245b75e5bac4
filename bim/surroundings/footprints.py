"""GeoJSON: footprints with heights, as blocks on the ground, and points of trees.

Source: RFC 7946; the fields of heights are those of OpenStreetMap and of usual exports.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import shapely
import shapely.errors
import shapely.geometry

from bim.georeference import LONGITUDE_LATITUDE, crs_name, local_metres
from bim.planes import plane_through, polygons_of
from bim.solids import prism, triangles_of
from bim.surroundings.objects import (
    SurroundingObject,
    SurroundingsFile,
    are_coordinates,
    is_number,
    read_object,
)
from bim.surroundings.trees import tree_of
from mitsuba_cfs.errors import DataError

HEIGHTS = ("height", "building:height", "measuredHeight", "measuredheight", "Height", "HEIGHT")
LEVELS = ("building:levels", "levels", "num_floors")
BASES = ("min_height", "building:min_height", "base")
SMALL_DEG = 1e-4  # of which the metres at a place are taken
STOREY = 3.0  # height of one, where only their number is stated [m]


def read_footprints(path: Path) -> SurroundingsFile:
    """The polygons of a GeoJSON file that state a height, their corners in its coordinates.

    Points that state a `crown_radius` are trees, with the fields of `bim.surroundings.trees`.

    Raises: `DataError` that names file, feature and field; a file without any height.
    """
    content = read_object(path)
    features = content.get("features")
    if content.get("type") != "FeatureCollection" or not isinstance(features, list):
        raise DataError("expected a FeatureCollection of GeoJSON", file=path, field="type")
    objects: list[SurroundingObject] = []
    without, crs = 0, _crs(content)
    for number, feature in enumerate(features):
        element = f"feature {number}"
        found = _block(feature, element, path) or _tree(feature, crs, element, path)
        without += not found
        objects += found
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
        finite = are_coordinates(shapely.get_coordinates(shape))
    except (ValueError, TypeError, LookupError, AttributeError, shapely.errors.ShapelyError):
        finite = False
    if not finite:
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
    for field in names:
        value = fields.get(field)
        if isinstance(value, str):
            try:
                value = float(value.strip().removesuffix("m").strip().replace(",", "."))
            except ValueError:
                raise DataError(
                    f"expected metres, got {value[:40]!r}", file=path, element=name, field=field
                ) from None
        if value is None:
            continue
        if not is_number(value) or not 0 <= value < 10_000:
            message = f"expected metres, got {value!r:.40}"
            raise DataError(message, file=path, element=name, field=field)
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
