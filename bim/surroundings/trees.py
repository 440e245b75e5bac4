"""Trees as crowns that pass a share of the sun by month: a list of them as TOML, or GeoJSON points.

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

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from bim.surroundings.objects import (
    Foliage,
    SurroundingObject,
    SurroundingsFile,
    is_number,
    read_bytes,
)
from mitsuba_cfs.errors import DataError

# Middles of the ranges of Konarska et al. 2014, doi:10.1007/s00704-013-1000-3, five deciduous
# species in Gothenburg: 1.3 to 5.3 % with leaves, 40.2 to 51.9 % without
LEAFED, BARE = 0.033, 0.46
LEAFY_MONTHS = range(5, 11)  # May to October on the northern half of the earth: an assumption
KINDS = ("deciduous", "evergreen")
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
    if isinstance(value, str) and value in KINDS:
        return value
    months = value if isinstance(value, list) else [value]
    if len(months) not in (1, 12) or not all(is_number(v) and LEAST <= v <= 1 for v in months):
        message = f"expected {' or '.join(KINDS)}, or one or twelve values from {LEAST} to 1"
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
    return tuple(
        LEAFED if (month + shift - 1) % 12 + 1 in LEAFY_MONTHS else BARE for month in range(1, 13)
    )


def _metres(
    fields: dict[str, Any], name: str, element: str, path: Path, default: float | None = None
) -> float:
    value = fields.get(name, default)
    if not is_number(value) or not 0 <= value < 200:
        message = f"expected metres, got {value!r:.40}"
        raise DataError(message, file=path, element=element, field=name)
    return float(value)
