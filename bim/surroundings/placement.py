"""Surroundings from files of their own, placed beside any building: `with_surroundings`.

Terrain grids are ESRI ASCII and XYZ lists, made coarser with the distance; a horizon is PVGIS'
and becomes a far wall around the building.

Trees are crowns of leaves: triangles at random in the hull, as many as let pass the stated share.
Leaves of all directions that stand at random let a beam through by Beer's law along its path,

    exp(-k c),    k = n a G / V,    G = 1/2

with n leaves of area a in the volume V, c the length of the path in the crown, G the projected
share of a leaf (the mean over all directions, whatever the beam's).  The attenuation k of a month
is that whose mean over the crown's shadow, the beam level, is the month's transmittance.  Every
leaf stands in all months that have more leaves, so that a few layers of them make the year.

Sources: Esri, "ASCII raster format" (ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter,
cellsize, nodata_value, then rows from north to south); XYZ as GDAL's driver writes it, a line of x,
y and height for each node of a regular grid, in any order. PVGIS, "printhorizon": A is the azimuth
from south, west positive, H_hor the height [deg].  Nilson 1971, doi:10.1016/0002-1571(71)90092-6,
for the law and the random (Poisson) crown.
"""

from __future__ import annotations

import csv
import re
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from os import PathLike
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.optimize import brentq

from bim.defaults import FACADE_REFLECTANCE, SITE_REFLECTANCE, TREE_LAYER
from bim.model import LONGITUDE_LATITUDE, Building, Element, local_metres, transformed
from bim.outdoors import lifted_sites, shut_in_area, simplified_mesh, unblinded
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Issue, Phrase
from bim.shell import enclosed_volume
from bim.surroundings.city_models import SUFFIXES as CITYGML
from bim.surroundings.city_models import monthly_transmittance, read_citygml, read_cityjson, read_footprints, read_trees
from bim.surroundings.objects import (
    SUFFIXES,
    TERRAIN,
    Foliage,
    SurroundingObject,
    SurroundingsFile,
    are_coordinates,
    read_bytes,
    read_meshes,
)
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import read_json, reason
from mitsuba_cfs.surfaces import even_numbers

# Leaves of broadleaf deciduous trees, visible 0.10 and near infrared 0.45: Oleson et al. 2013,
# "Technical description of version 4.5 of the Community Land Model", NCAR/TN-503, Table 3.1; half
# of the sun's energy is near infrared.  What leaves let through themselves (0.05, 0.25) is left out
REFLECTANCE_VISIBLE, REFLECTANCE_SOLAR = 0.10, 0.28
PROJECTED = 0.5  # share of a leaf's area that a beam sees, the mean over its directions
LEAVES, FEWEST = 4096, 256  # of a crown in the month that has most, by its distance
NEAR = 30.0  # up to which a crown has all of these [m]
BEAMS = 4096  # parallel rays whose paths in the crown are measured, from either side
MOST_FACES = 64  # that a ray may cross
TRIES = 200  # draws of points for the leaves


def crown_elements(
    crown: SurroundingObject, transmittance: Sequence[float], guid: str, distance: float
) -> list[Element]:
    """The leaves of a crown as elements, each of the months in which it stands.

    Args:
        crown: a closed mesh [m].
        transmittance: [12] mean of a level beam over the crown's shadow.
        distance: from the building [m]; far crowns have fewer and bigger leaves.

    Raises: `DataError` for a mesh that is not closed.
    """
    mesh = ray_mesh(crown.triangles)
    attenuation = np.array(_attenuations(mesh, crown.name, transmittance))
    if not attenuation.any():
        return []
    volume = abs(enclosed_volume(crown.triangles))
    most = int(np.clip(LEAVES * (NEAR / max(distance, NEAR)) ** 2, FEWEST, LEAVES))
    area = attenuation.max() * volume / (PROJECTED * most)
    counts = np.rint(most * attenuation / attenuation.max()).astype(int)
    leaves = _crown_leaves(mesh, most, area, zlib.crc32(guid.encode()))
    elements, steps = [], np.unique(np.append(counts, 0))
    for layer, (first, last) in enumerate(pairwise(steps)):
        months = tuple((np.flatnonzero(counts >= last) + 1).tolist())
        elements.append(
            Element(
                f"{guid}-{layer}",
                crown.name,
                crown.ifc_class,
                leaves[first:last],
                REFLECTANCE_VISIBLE,
                REFLECTANCE_SOLAR,
                layer=TREE_LAYER,
                months=() if len(months) == 12 else months,
            )
        )
    return elements


def _attenuations(mesh: RayMesh, name: str, transmittance: Sequence[float]) -> list[float]:
    """k [1/m] of each transmittance: exp(-k c) is that in the mean over level paths c."""
    paths = np.concatenate([_paths(mesh, axis) for axis in (0, 1)])
    if not len(paths) or not np.isfinite(paths).all():
        raise DataError(f"{name}: is no closed mesh: a crown needs an inside")

    def solved(value: float) -> float:
        if value >= 1:
            return 0.0
        dense = 1e3 / paths.mean()
        return float(brentq(lambda k: np.exp(-k * paths).mean() - value, 0.0, dense))

    known = {value: solved(value) for value in set(transmittance)}
    return [known[value] for value in transmittance]


def _paths(mesh: RayMesh, axis: int) -> FloatArray:
    """Lengths [n] [m] of rays along an axis inside a mesh, those that miss it left out.

    Infinite where more rays than a few get in and not out.
    """
    corners = mesh.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    others = [i for i in range(3) if i != axis]
    origins = np.empty((BEAMS, 3))
    origins[:, others] = low[others] + even_numbers(BEAMS) * (high - low)[others]
    origins[:, axis] = low[axis] - 1.0
    lengths, crossings = _inside(mesh, origins, np.eye(3)[axis])
    odd = crossings % 2 == 1  # through an edge or a corner
    if odd.mean() > 0.01:
        return np.array([np.inf])
    return lengths[(crossings > 0) & ~odd]


def _inside(mesh: RayMesh, origins: FloatArray, direction: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """How far [n] rays go inside a closed mesh [m], and how often [n] they cross it."""
    rays = np.broadcast_to(direction, origins.shape)
    t, lengths = np.zeros(len(origins)), np.zeros(len(origins))
    crossings = np.zeros(len(origins), dtype=np.int64)
    for _ in range(MOST_FACES):
        step, triangle = mesh.first_hits(origins + t[:, None] * direction, rays)
        met = triangle >= 0
        if not met.any():
            break
        step = np.where(met, step, 0.0)
        lengths += np.where(met & (crossings % 2 == 1), step + 1e-5, 0.0)
        crossings += met
        t += step + 1e-5
    return lengths, crossings


def _crown_leaves(mesh: RayMesh, count: int, area: float, seed: int) -> FloatArray:
    """Equilateral triangles [count, 3, 3] of an area [m2], anywhere inside, turned any way."""
    rng = np.random.default_rng(seed)
    corners = mesh.triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    points = np.empty((0, 3))
    for _ in range(TRIES):
        drawn = rng.uniform(low, high, (2 * count, 3))
        inside = _inside(mesh, drawn, np.array([1.0, 0.0, 0.0]))[1] % 2 == 1
        points = np.concatenate([points, drawn[inside]])
        if len(points) >= count:
            break
    points = points[:count]
    towards = rng.standard_normal((len(points), 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    along = np.cross(towards, rng.standard_normal((len(points), 3)))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(towards, along)
    radius = np.sqrt(4 * area / (3 * np.sqrt(3)))  # of the circle through the corners
    angles = 2 * np.pi / 3 * np.arange(3)
    steps = np.cos(angles)[:, None] * along[:, None] + np.sin(angles)[:, None] * across[:, None]
    return points[:, None] + radius * steps


WIDTHS_AWAY = 100.0  # distance of the wall in sizes of the building: 0.6 degrees of parallax
NEAREST = 1000.0  # [m]
STEP_DEG = 2.0  # of the wall's azimuths


def read_horizon(path: Path) -> NDArray[np.float64]:
    """Azimuth from north to east, rising, and height of the horizon [N, 2] [deg].

    Raises: `DataError` for a file that is none of PVGIS's two kinds (JSON, CSV).
    """
    rows = _json_rows(path) if path.suffix.lower() == ".json" else _csv_rows(path)
    try:
        table = np.array([[float(a), float(h)] for a, h in rows])
    except (TypeError, ValueError):
        raise DataError("is not a number", file=path, field="A, H_hor") from None
    if len(table) < 4 or not np.isfinite(table).all():
        raise DataError("expected four azimuths or more", file=path, field="A, H_hor")
    if table[:, 1].min() < 0 or table[:, 1].max() >= 90:
        raise DataError("expected heights from 0 to 90 degrees", file=path, field="H_hor")
    azimuth = (table[:, 0] + 180.0) % 360.0
    order = np.unique(azimuth, return_index=True)[1]
    return np.column_stack([azimuth, table[:, 1]])[order]


def _json_rows(path: Path) -> list[tuple[str, str]]:
    content = read_json(path)
    try:
        rows = content["outputs"]["horizon_profile"]
        return [(row["A"], row["H_hor"]) for row in rows]
    except (KeyError, TypeError):
        message = "expected outputs.horizon_profile with A and H_hor (PVGIS printhorizon)"
        raise DataError(message, file=path) from None


def _csv_rows(path: Path) -> list[tuple[str, str]]:
    text = read_bytes(path).decode("utf-8", errors="replace")
    try:
        rows = list(csv.reader(text.replace("\t", ",").split("\n")))
    except csv.Error as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    rows = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    start = next((i for i, row in enumerate(rows) if row[:2] == ["A", "H_hor"]), None)
    if start is None:
        raise DataError("expected columns A and H_hor (PVGIS printhorizon)", file=path)
    table = []
    for row in rows[start + 1 :]:
        if len(row) < 2:
            break
        table.append((row[0], row[1]))
    return table


def horizon_wall(
    horizon: NDArray[np.float64], centre: NDArray[np.float64], size: float
) -> tuple[NDArray[np.float64], float]:
    """Triangles [T, 3, 3] of a wall that hides what lies below the horizon; its distance [m].

    Args:
        horizon: azimuth and height [N, 2] [deg], linear between them.
        centre: of the building [3] [m]; size: of it [m].
    """
    radius = max(WIDTHS_AWAY * size, NEAREST)
    azimuth = np.arange(0.0, 360.0 + STEP_DEG / 2, STEP_DEG)
    height = np.interp(azimuth, horizon[:, 0], horizon[:, 1], period=360.0)
    a = np.radians(azimuth)
    foot = centre + radius * np.column_stack([np.sin(a), np.cos(a), np.zeros(len(a))])
    top = foot + np.column_stack([np.zeros((len(a), 2)), radius * np.tan(np.radians(height))])
    low = foot - [0.0, 0.0, 0.01 * radius]
    b0, b1, t0, t1 = low[:-1], low[1:], top[:-1], top[1:]
    walls = np.concatenate([np.stack([b0, t0, b1], axis=1), np.stack([b1, t0, t1], axis=1)])
    return walls, radius


FloatArray = NDArray[np.float64]
GRIDS = (".asc", ".xyz")
HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value")
MOST_NODES = 20_000_000
OFF_GRID = 0.01  # of a step: nodes of an XYZ list may lie beside their place
NODATA = -9999.0  # where no header says another


def read_terrain(path: Path) -> SurroundingsFile:
    """The terrain of a file, its nodes in the map of the building, heights above the sea.

    Raises: `DataError` that names file and field, or line.
    """
    try:
        text = read_bytes(path).decode("ascii")
    except UnicodeDecodeError:
        raise DataError("is no text of numbers", file=path) from None
    nodes = _ascii_grid(text, path) if path.suffix.lower() == ".asc" else _list(text, path)
    if np.isfinite(nodes[..., 2]).sum() < 4:
        raise DataError("has no heights", file=path)
    terrain = SurroundingObject("terrain", np.empty((0, 3, 3)), TERRAIN, nodes=nodes)
    return SurroundingsFile(path, (terrain,), on_own_map=True)


def graded(nodes: FloatArray, centre: FloatArray, steps_deg: float) -> tuple[FloatArray, float]:
    """Triangles [T, 3, 3] of a grid, its rows and columns wider apart the further they are.

    Args:
        nodes: [R, C, 3] of the world [m]; triangles with a corner that is no number are holes.
        centre: [3] from where it is seen; steps_deg: of nodes next to each other, about.

    Returns: the triangles, and by how much a node that is left out lies off them at the most, as
        an angle seen from the centre [degrees].
    """
    flat = np.linalg.norm(nodes[..., :2] - centre[:2], axis=-1)
    rows = _kept(nodes[:, 0, :2], flat.min(axis=1), steps_deg)
    columns = _kept(nodes[0, :, :2], flat.min(axis=0), steps_deg)
    few = nodes[np.ix_(rows, columns)]
    a, b, c, d = few[:-1, :-1], few[:-1, 1:], few[1:, 1:], few[1:, :-1]
    both = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], axis=2).reshape(-1, 3, 3)
    up = np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0])[:, 2]
    both = np.where((up < 0)[:, None, None], both[:, ::-1], both)
    return both[np.isfinite(both).all(axis=(1, 2))], _worst(nodes, rows, columns, flat)


def _kept(line: FloatArray, distance: FloatArray, steps_deg: float) -> NDArray[np.int64]:
    """Which nodes of a line [n, 2] to keep, at distances [n] from the building [m]."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    kept = [0]
    for node in range(1, len(line) - 1):
        ahead = along[node + 1] - along[kept[-1]]
        if ahead > np.tan(np.radians(steps_deg)) * min(distance[kept[-1]], distance[node]):
            kept.append(node)
    return np.array([*kept, len(line) - 1])


def _worst(nodes: FloatArray, rows: NDArray[np.int64], columns: NDArray[np.int64], flat: FloatArray) -> float:
    """Greatest difference in height between nodes and the mean of the cells kept [degrees]."""
    few = nodes[np.ix_(rows, columns)][..., 2]
    across = np.stack([np.interp(np.arange(nodes.shape[1]), columns, row) for row in few])
    whole = np.stack([np.interp(np.arange(nodes.shape[0]), rows, column) for column in across.T], axis=1)
    off = np.abs(nodes[..., 2] - whole)
    seen = np.degrees(np.arctan2(off, np.maximum(flat, 1.0)))
    return float(np.nanmax(seen)) if np.isfinite(seen).any() else 0.0


def _ascii_grid(text: str, path: Path) -> FloatArray:
    """Nodes [R, C, 3] of an ESRI ASCII grid: the middles of its cells."""
    words = text.split(maxsplit=2 * len(HEADER))
    fields: dict[str, float] = {}
    while len(words) > 1 and words[0].lower() in HEADER:
        name = words[0].lower()
        try:
            fields[name] = float(words[1])
        except ValueError:
            raise DataError(f"expected a number, got {words[1]!r:.40}", file=path, field=name) from None
        words = words[2:]
    missing = [name for name in ("ncols", "nrows", "cellsize") if name not in fields]
    for axis in "xy":
        if not {f"{axis}llcorner", f"{axis}llcenter"} & set(fields):
            missing.append(f"{axis}llcorner")
    if missing:
        raise DataError("is missing at the head", file=path, field=missing[0])
    columns, rows, step = (fields[name] for name in ("ncols", "nrows", "cellsize"))
    whole = all(n % 1 == 0 and n > 1 for n in (columns, rows))
    if not (whole and rows * columns <= MOST_NODES):
        message = f"expected 2 and more, {MOST_NODES} in all at the most"
        raise DataError(message, file=path, field="ncols, nrows")
    place = [fields.get(f"{axis}llcenter", fields.get(f"{axis}llcorner", 0.0) + step / 2) for axis in "xy"]
    if not (0 < step < 1e5 and are_coordinates(np.array(place))):
        raise DataError("expected metres", file=path, field="cellsize")
    heights = _numbers(" ".join(words), path)
    if len(heights) != rows * columns:
        message = f"has {len(heights)} heights, {rows * columns:.0f} expected"
        raise DataError(message, file=path)
    z = heights.reshape(int(rows), int(columns))[::-1]
    z = np.where(z == fields.get("nodata_value", NODATA), np.nan, z)
    x, y = (start + step * np.arange(n) for start, n in zip(place, z.shape[::-1], strict=True))
    return np.stack([*np.meshgrid(x, y), z], axis=-1)


def _list(text: str, path: Path) -> FloatArray:
    """Nodes [R, C, 3] of a list of x, y and height."""
    numbers = _numbers(text.replace(",", " ").replace(";", " "), path)
    if len(numbers) % 3 or len(numbers) < 12:
        raise DataError("expected lines of x, y and height, four at least", file=path)
    points = numbers.reshape(-1, 3)
    axes = []
    for values, name in zip(points.T[:2], "xy", strict=True):
        low, high = values.min(), values.max()
        gaps = np.diff(np.unique(values))
        gaps = gaps[gaps > OFF_GRID * gaps.max(initial=0.0)]
        step = gaps.min() if len(gaps) else 0.0
        count = round((high - low) / step) + 1 if step > 0 else 1
        index = np.rint((values - low) / step).astype(int) if step > 0 else np.zeros(1, int)
        if count < 2 or np.abs(values - low - index * step).max() > OFF_GRID * step * count:
            raise DataError("the points are no regular grid", file=path, field=name)
        axes.append((low + step * np.arange(count), index) if count <= MOST_NODES else ([], index))
    (x, i), (y, j) = axes
    if not 4 <= len(x) * len(y) <= MOST_NODES:
        raise DataError(f"expected {MOST_NODES} nodes at the most", file=path)
    z = np.full((len(y), len(x)), np.nan)
    z[j, i] = np.where(points[:, 2] == NODATA, np.nan, points[:, 2])
    return np.stack([*np.meshgrid(x, y), z], axis=-1)


def _numbers(text: str, path: Path) -> FloatArray:
    try:
        numbers = np.array(text.split(), dtype=float)
    except ValueError as error:
        raise DataError(f"expected numbers: {str(error)[:60]}", file=path) from None
    if not are_coordinates(numbers):
        raise DataError("expected finite numbers", file=path)
    return numbers


READ = (*SUFFIXES, ".city.json", *CITYGML, ".geojson", ".json", ".csv", ".toml", *GRIDS)
TERRAIN_DEG = 1.0  # between nodes of terrain next to each other
SEEN_DEG = 0.2  # by which corners may move as seen from the building: less than the sun's disc
PLAIN = 100  # triangles that an object may keep whatever its distance
FARTHEST = 20_000.0  # objects further from the building are left out [m]
SAME_PLACE = 0.5  # share of a room that a footprint covers which is the building itself


def with_surroundings(
    building: Building, files: Sequence[str | PathLike[str]], offset: Sequence[float] | None = None
) -> Building:
    """The building with what files hold of its surroundings.

    OBJ, STL, PLY, glTF, CityJSON, CityGML, GeoJSON footprints with heights, terrain as a grid; the
    horizon of PVGIS; trees as leaves (`bim.surroundings.placement`), some in some months only.
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
        placed = [replace(one, foliage=named.get(one.name, one.foliage)) for one in _placed(context, building, offset)]
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
    all_issues = tuple(dict.fromkeys((*building.issues, *issues)))
    return replace(
        building,
        elements=(*outdoors.elements, *leaves),
        issues=all_issues,
        account=building.account and replace(building.account, shut_in=shut_in_area(all_issues)),
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
    crowns: dict[str, Foliage] = {}
    for file in lists:
        crowns |= dict(read_trees(file).crowns)
    if crowns:
        known = {one.name for file in bodies for one in read_surroundings(file).objects}
        missing = next((name for name in crowns if name not in known), None)
        if missing is not None:
            message = f"{missing!r} is no object of the other files of surroundings"
            raise DataError(message, file=lists[0], field="object")
    return crowns


def _leaves(
    trees: Sequence[tuple[SurroundingObject, str]], building: Building, centre: NDArray[np.float64], size: float
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
        Phrase(
            "share-of-months",
            {
                "percent": 100 * shares[first],
                "first": Phrase(f"month-{first + 1}"),
                "last": Phrase(f"month-{last + 1}"),
            },
        )
        for first, last in zip(starts, ends, strict=True)
    )


def _is_horizon(path: Path) -> bool:
    """Whether a file is a horizon: by its ending, or by what PVGIS calls it."""
    if path.suffix.lower() == ".csv":
        return True
    return path.suffix.lower() == ".json" and "horizon" in path.name.lower()


def _placed(context: SurroundingsFile, building: Building, offset: Sequence[float] | None) -> list[SurroundingObject]:
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
    return [_each(one, lambda points: _to_world(points, context, building)) for one in context.objects]


def _each(one: SurroundingObject, move: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> SurroundingObject:
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
    elements, issues = [], []
    for one in objects:
        if one.nodes is not None:
            triangles, worst = graded(one.nodes, centre, TERRAIN_DEG)
            count = int(np.isfinite(one.nodes[..., 2]).sum())
            one = replace(one, triangles=triangles, nodes=None)
            values = {"count": count, "after": len(triangles), "moved_deg": worst}
            issues.append(Issue("terrain-simplified", file.name, values))
            if not len(triangles):
                continue
        elements.append(one)
    return elements, issues


def _to_world(points: NDArray[np.float64], context: SurroundingsFile, building: Building) -> NDArray[np.float64]:
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
    objects: Sequence[SurroundingObject], context: SurroundingsFile, building: Building, centre: NDArray[np.float64]
) -> tuple[list[SurroundingObject], list[Issue]]:
    """The objects that are not the building itself and not beyond all sight."""
    rooms = [
        (shapely.MultiPoint(s.shell.reshape(-1, 3)[:, :2]).convex_hull, s.shell.reshape(-1, 3)) for s in building.spaces
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


def _is_building_itself(one: SurroundingObject, rooms: Sequence[tuple[shapely.Geometry, NDArray[np.float64]]]) -> bool:
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
