"""A horizon by azimuth, as PVGIS gives it: a far wall around the building.

Source: PVGIS, "printhorizon": A is the azimuth from south, west positive, H_hor the height [deg].
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.surroundings.objects import read_bytes, read_object
from mitsuba_cfs.errors import DataError

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


def _json_rows(path: Path) -> list[tuple[object, object]]:
    content = read_object(path)
    try:
        rows = content["outputs"]["horizon_profile"]
        return [(row["A"], row["H_hor"]) for row in rows]
    except (KeyError, TypeError):
        message = "expected outputs.horizon_profile with A and H_hor (PVGIS printhorizon)"
        raise DataError(message, file=path) from None


def _csv_rows(path: Path) -> list[tuple[object, object]]:
    text = read_bytes(path).decode("utf-8", errors="replace")
    rows = [
        [cell.strip() for cell in row] for row in csv.reader(text.replace("\t", ",").split("\n"))
    ]
    rows = [[cell for cell in row if cell] for row in rows]
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
