"""CityJSON: the buildings, plants and terrain of a quarter, in the finest detail up to LoD 2.

Source: CityJSON 1.0 to 2.0 (https://www.cityjson.org/specs).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.georeference import crs_name
from bim.surroundings.city import FINEST, NO_GEOMETRY, city_object, triangles_of_surfaces
from bim.surroundings.objects import SurroundingsFile, read_object
from mitsuba_cfs.errors import DataError

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
        path, tuple(objects), crs_name(system) if isinstance(system, str) else None,
        left_out=tuple((what, count) for what, count in left_out.items() if count),
    )  # fmt: skip


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
    if not np.isfinite(points).all():
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
