"""Terrain as a grid of heights, coarser with the distance, and the horizon by azimuth.

Grids are ESRI ASCII grids and XYZ lists; the horizon is PVGIS' and becomes a far wall around the
building.

Sources: Esri, "ASCII raster format" (ncols, nrows, xllcorner or xllcenter, yllcorner or yllcenter,
cellsize, nodata_value, then rows from north to south); XYZ as GDAL's driver writes it, a line of x,
y and height for each node of a regular grid, in any order. PVGIS, "printhorizon": A is the azimuth
from south, west positive, H_hor the height [deg].
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.surroundings.objects import (
    TERRAIN,
    SurroundingObject,
    SurroundingsFile,
    are_coordinates,
    read_bytes,
    read_object,
)
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

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
    content = read_object(path)
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
    found = []
    for row in rows[start + 1 :]:
        if len(row) < 2:
            break
        found.append((row[0], row[1]))
    return found


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
SUFFIXES = (".asc", ".xyz")
HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize",
          "nodata_value")  # fmt: skip
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


def _worst(
    nodes: FloatArray, rows: NDArray[np.int64], columns: NDArray[np.int64], flat: FloatArray
) -> float:
    """Greatest difference in height between nodes and the mean of the cells kept [degrees]."""
    few = nodes[np.ix_(rows, columns)][..., 2]
    across = np.stack([np.interp(np.arange(nodes.shape[1]), columns, row) for row in few])
    whole = np.stack(
        [np.interp(np.arange(nodes.shape[0]), rows, column) for column in across.T], axis=1
    )
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
            raise DataError(
                f"expected a number, got {words[1]!r:.40}", file=path, field=name
            ) from None
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
    place = [
        fields.get(f"{axis}llcenter", fields.get(f"{axis}llcorner", 0.0) + step / 2)
        for axis in "xy"
    ]
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
        found = np.array(text.split(), dtype=float)
    except ValueError as error:
        raise DataError(f"expected numbers: {str(error)[:60]}", file=path) from None
    if not are_coordinates(found):
        raise DataError("expected finite numbers", file=path)
    return found
