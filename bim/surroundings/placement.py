"""Surroundings from files of their own, placed beside any building: `with_surroundings`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.defaults import FACADE_REFLECTANCE, SITE_REFLECTANCE
from bim.model import LONGITUDE_LATITUDE, Building, Element, local_metres, transformed
from bim.outdoors import lifted_sites, shut_in_area, simplified_mesh, unblinded
from bim.report.issue import Issue, Phrase
from bim.surroundings.city_models import SUFFIXES as CITYGML
from bim.surroundings.city_models import (
    monthly_transmittance,
    read_citygml,
    read_cityjson,
    read_footprints,
    read_trees,
)
from bim.surroundings.crowns import crown_elements
from bim.surroundings.objects import (
    SUFFIXES,
    Foliage,
    SurroundingObject,
    SurroundingsFile,
    read_meshes,
)
from bim.surroundings.terrain import SUFFIXES as GRIDS
from bim.surroundings.terrain import graded, horizon_wall, read_horizon, read_terrain
from mitsuba_cfs.errors import DataError

READ = (*SUFFIXES, ".city.json", *CITYGML, ".geojson", ".json", ".csv", ".toml", *GRIDS)
TERRAIN_DEG = 1.0  # between nodes of terrain next to each other
SEEN_DEG = 0.2  # by which corners may move as seen from the building: less than the sun's disc
PLAIN = 100  # triangles that an object may keep whatever its distance
FARTHEST = 20_000.0  # objects further from the building are left out [m]
SAME_PLACE = 0.5  # share of a room that a footprint covers which is the building itself


def with_surroundings(
    building: Building,
    files: Sequence[str | PathLike[str]],
    offset: Sequence[float] | None = None,
) -> Building:
    """The building with what files hold of its surroundings.

    OBJ, STL, PLY, glTF, CityJSON, CityGML, GeoJSON footprints with heights, terrain as a grid; the
    horizon of PVGIS; trees as leaves (`bim.surroundings.crowns`), some in some months only.
    Objects on a map are placed by the building's map conversion, else by its latitude and
    longitude, which are then taken as those of its origin; others lie in the building's own metres.
    What the
    surroundings hold of the building itself is left out.  Corners of far objects are merged by
    less than 0.2 degrees as seen from the building.

    Args: offset: added to the files' coordinates [m] in place of any georeference.

    Raises: `DataError` for a file that cannot be used, or that cannot be placed.
    """
    spaces = [space.shell.reshape(-1, 3) for space in building.spaces if len(space.shell)]
    if not spaces:
        raise DataError("has no rooms that anything could stand around", file=building.file)
    corners = np.concatenate(spaces)
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    elements: list[Element] = []
    trees: list[tuple[SurroundingObject, str]] = []  # each with its GUID
    issues: list[Issue] = []
    named = _named_crowns([Path(file) for file in files])
    for file in map(Path, files):
        if _is_horizon(file):
            walls, radius = horizon_wall(read_horizon(file), centre, size)
            values = {"file": file.name, "radius": radius}
            issues.append(Issue("horizon-as-wall", file.name, values))
            elements.append(_element(SurroundingObject("horizon", walls), file, len(elements)))
            continue
        context = read_surroundings(file)
        placed = [
            replace(one, foliage=named.get(one.name, one.foliage))
            for one in _placed(context, building, offset)
        ]
        crowns = [one for one in placed if one.foliage is not None]
        trees += [(one, f"{file.stem}-tree-{n}") for n, one in enumerate(crowns)]
        placed = [one for one in placed if one.foliage is None]
        placed, more = _meshed(placed, centre, file)
        issues += more
        kept, more = _beside(placed, context, building, centre)
        issues += more
        kept, more = _as_seen(kept, centre, size, file)
        issues += more
        elements += [_element(one, file, len(elements) + n) for n, one in enumerate(kept)]
    windows = list(building.windows)
    free, more = lifted_sites(elements, windows)
    outdoors = unblinded([*building.elements, *free], building.spaces)
    leaves, told = _leaves(trees, building, centre, size)
    issues += [*more, *outdoors.issues, *told]
    found = tuple(dict.fromkeys((*building.issues, *issues)))
    return replace(
        building,
        elements=(*outdoors.elements, *leaves),
        issues=found,
        account=building.account and replace(building.account, shut_in=shut_in_area(found)),
    )


def read_surroundings(path: Path) -> SurroundingsFile:
    """The objects of a file by its name's ending.

    Raises: `DataError` for an ending that is not read.
    """
    ending = path.suffix.lower()
    if ending in SUFFIXES:
        return read_meshes(path)
    if ending == ".geojson":
        return read_footprints(path)
    if ending == ".json":
        return read_cityjson(path)
    if ending in CITYGML:
        return read_citygml(path)
    if ending == ".toml":
        return read_trees(path)
    if ending in GRIDS:
        return read_terrain(path)
    raise DataError(f"expected a file of {', '.join(READ)}", file=path, field="surroundings")


def _named_crowns(files: Sequence[Path]) -> dict[str, Foliage]:
    """What lists of trees say of objects of the other files, by their names."""
    lists = [file for file in files if file.suffix.lower() == ".toml"]
    bodies = [file for file in files if file not in lists and not _is_horizon(file)]
    found: dict[str, Foliage] = {}
    for file in lists:
        found |= dict(read_trees(file).crowns)
    if found:
        known = {one.name for file in bodies for one in read_surroundings(file).objects}
        missing = next((name for name in found if name not in known), None)
        if missing is not None:
            message = f"{missing!r} is no object of the other files of surroundings"
            raise DataError(message, file=lists[0], field="object")
    return found


def _leaves(
    trees: Sequence[tuple[SurroundingObject, str]],
    building: Building,
    centre: NDArray[np.float64],
    size: float,
) -> tuple[list[Element], list[Issue]]:
    """The leaves of crowns, and what is to be said of them at the head of every result."""
    elements: list[Element] = []
    stated: list[tuple[float, ...]] = []
    far = 0
    for one, guid in trees:
        corners = one.triangles.reshape(-1, 3)
        gap = float(np.linalg.norm(corners - centre, axis=1).min() - size / 2)
        if gap > FARTHEST:
            far += 1
            continue
        shares = monthly_transmittance(one.foliage or (), building.latitude_deg)
        elements += crown_elements(one, shares, guid, max(gap, 0.0))
        stated.append(shares)
    issues = []
    if far:
        values = {"count": far, "limit_km": FARTHEST / 1000}
        issues.append(Issue("trees-far-away", trees[0][0].name, values))
    for shares in dict.fromkeys(stated):
        values = {"count": stated.count(shares), "shares": _by_month(shares)}
        issues.append(Issue("trees-by-month", trees[0][0].name, values))
    return elements, issues


def _by_month(shares: Sequence[float]) -> tuple[Phrase, ...]:
    """Transmittances of the months [12] as phrases: 3 % from May to October, 46 % from ..."""
    if len(set(shares)) == 1:
        return (Phrase("share-all-year", {"percent": 100 * shares[0]}),)
    starts = [month for month in range(12) if shares[month] != shares[month - 1]]
    ends = [(month - 1) % 12 for month in (*starts[1:], starts[0])]
    return tuple(
        Phrase("share-of-months", {
            "percent": 100 * shares[first],
            "first": Phrase(f"month-{first + 1}"), "last": Phrase(f"month-{last + 1}"),
        })
        for first, last in zip(starts, ends, strict=True)
    )  # fmt: skip


def _is_horizon(path: Path) -> bool:
    """Whether a file is a horizon: by its ending, or by what PVGIS calls it."""
    if path.suffix.lower() == ".csv":
        return True
    return path.suffix.lower() == ".json" and "horizon" in path.name.lower()


def _placed(
    context: SurroundingsFile, building: Building, offset: Sequence[float] | None
) -> list[SurroundingObject]:
    """The file's objects in the building's world."""
    if offset is not None:
        moved = np.asarray(offset, dtype=float)
        return [_each(one, lambda points: points + moved) for one in context.objects]
    if context.on_own_map and building.georeference is None:
        message = "lies on a map, and the building has none: give the offset of the surroundings"
        raise DataError(message, file=context.path)
    own = building.georeference.crs if building.georeference is not None else None
    if context.crs not in (None, own) and not re.fullmatch(r"[A-Za-z]+:\w+", context.crs):
        message = f"{context.crs[:80]!r} is no EPSG code: give the offset of the surroundings"
        raise DataError(message, file=context.path, field="coordinate system")
    if context.crs is None and not context.on_own_map:
        return list(context.objects)
    return [
        _each(one, lambda points: _to_world(points, context, building)) for one in context.objects
    ]


def _each(
    one: SurroundingObject, move: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> SurroundingObject:
    """An object with its points [N, 3] moved."""
    triangles = move(one.triangles.reshape(-1, 3)).reshape(-1, 3, 3)
    if one.nodes is None:
        return replace(one, triangles=triangles)
    holes = np.isnan(one.nodes[..., 2])
    nodes = move(np.nan_to_num(one.nodes).reshape(-1, 3)).reshape(one.nodes.shape)
    nodes[holes, 2] = np.nan
    return replace(one, triangles=triangles, nodes=nodes)


def _meshed(
    objects: Sequence[SurroundingObject], centre: NDArray[np.float64], file: Path
) -> tuple[list[SurroundingObject], list[Issue]]:
    """Grids as triangles, the further the coarser."""
    found, issues = [], []
    for one in objects:
        if one.nodes is not None:
            triangles, worst = graded(one.nodes, centre, TERRAIN_DEG)
            count = int(np.isfinite(one.nodes[..., 2]).sum())
            one = replace(one, triangles=triangles, nodes=None)
            values = {"count": count, "after": len(triangles), "moved_deg": worst}
            issues.append(Issue("terrain-simplified", file.name, values))
            if not len(triangles):
                continue
        found.append(one)
    return found, issues


def _to_world(
    points: NDArray[np.float64], context: SurroundingsFile, building: Building
) -> NDArray[np.float64]:
    file, place = str(context.path), building.georeference
    if place is not None:
        flat = transformed(points[:, :2], context.crs or place.crs, place.crs, file=file)
        heights = points[:, 2]
        if context.from_ground:
            heights = heights - place.to_world[2, 3] / place.to_world[2, 2]
        whole = np.column_stack([flat, heights, np.ones(len(flat))])
        return (whole @ place.to_world.T)[:, :3]
    if building.latitude_deg is None or building.longitude_deg is None:
        message = (
            f"lies on the map {context.crs}, and the building has neither a map conversion nor"
            " latitude and longitude: give the offset of the surroundings"
        )
        raise DataError(message, file=context.path)
    degrees = transformed(points[:, :2], context.crs, LONGITUDE_LATITUDE, file=file)
    flat = local_metres(degrees, building.longitude_deg, building.latitude_deg)
    heights = points[:, 2] if context.from_ground else points[:, 2] - building.elevation
    return np.column_stack([flat, heights])


def _beside(
    objects: Sequence[SurroundingObject],
    context: SurroundingsFile,
    building: Building,
    centre: NDArray[np.float64],
) -> tuple[list[SurroundingObject], list[Issue]]:
    """The objects that are not the building itself and not beyond all sight."""
    rooms = [
        (shapely.MultiPoint(s.shell.reshape(-1, 3)[:, :2]).convex_hull, s.shell.reshape(-1, 3))
        for s in building.spaces
    ]
    kept, own, far = [], [], 0
    for one in objects:
        corners = one.triangles.reshape(-1, 3)
        if np.linalg.norm(corners[:, :2] - centre[:2], axis=1).min() > FARTHEST:
            far += 1
        elif _is_building_itself(one, rooms):
            own.append(one.name)
        else:
            kept.append(one)
    issues = [Issue(code, context.path.name, {"count": count}) for code, count in context.left_out]
    if own:
        values = {"count": len(own), "objects": tuple(own)}
        issues.append(Issue("objects-of-building", context.path.name, values))
    if far:
        values = {"count": far, "limit_km": FARTHEST / 1000}
        issues.append(Issue("objects-far-away", context.path.name, values))
    return kept, issues


def _is_building_itself(
    one: SurroundingObject, rooms: Sequence[tuple[shapely.Geometry, NDArray[np.float64]]]
) -> bool:
    corners = one.triangles.reshape(-1, 3)
    if one.ifc_class != SurroundingObject.__dataclass_fields__["ifc_class"].default:
        return False
    outline = shapely.MultiPoint(corners[:, :2]).convex_hull
    low, high = corners[:, 2].min(), corners[:, 2].max()
    return any(
        outline.intersection(room).area > SAME_PLACE * room.area
        and low < shell[:, 2].max() - 0.5
        and high > shell[:, 2].min() + 0.5
        for room, shell in rooms
    )


def _as_seen(
    objects: Sequence[SurroundingObject], centre: NDArray[np.float64], size: float, file: Path
) -> tuple[list[SurroundingObject], list[Issue]]:
    """Objects of many triangles with corners merged as far as it cannot be seen."""
    kept, before, after, worst = [], 0, 0, 0.0
    for one in objects:
        corners = one.triangles.reshape(-1, 3)
        gap = np.linalg.norm(corners - centre, axis=1).min() - size / 2
        if len(one.triangles) > PLAIN and gap > size:
            step = gap * np.tan(np.radians(SEEN_DEG)) / np.sqrt(3)
            steps = tuple(step * part for part in (0.125, 0.25, 0.5, 1.0))
            fewer, moved = simplified_mesh(one.triangles, PLAIN, steps)
            if len(fewer) < len(one.triangles):
                before, after = before + len(one.triangles), after + len(fewer)
                worst = max(worst, float(np.degrees(np.arctan2(moved, gap))))
                one = replace(one, triangles=fewer)
        kept.append(one)
    if not before:
        return kept, []
    values = {"before": before, "after": after, "moved_deg": worst}
    return kept, [Issue("far-objects-simplified", file.name, values)]


def _element(one: SurroundingObject, file: Path, number: int) -> Element:
    terrain = one.ifc_class.startswith("IfcGeographic") or one.name == "horizon"
    value = SITE_REFLECTANCE if terrain else FACADE_REFLECTANCE
    guid = f"{file.stem}-{number}"
    return Element(guid, one.name, one.ifc_class, one.triangles, value, value)
