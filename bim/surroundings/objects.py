"""What a file of surroundings holds: objects in its own coordinates."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

MOST_BYTES = 512 << 20
BODY, TERRAIN = "IfcBuildingElementProxy", "IfcGeographicElement"
Foliage = str | tuple[float, ...]  # a kind of tree, or what its crown passes in each month [12]


@dataclass(frozen=True, slots=True)
class SurroundingObject:
    """A building, tree or piece of terrain."""

    name: str
    triangles: NDArray[np.float64]  # [T, 3, 3] in the file's coordinates
    ifc_class: str = BODY
    nodes: NDArray[np.float64] | None = None  # [R, C, 3] of a grid, in place of triangles
    foliage: Foliage | None = None  # of a crown that passes light; None: a body


@dataclass(frozen=True, slots=True)
class SurroundingsFile:
    """The objects of a file and the map that they lie on."""

    path: Path
    objects: tuple[SurroundingObject, ...]
    crs: str | None = None  # None: a local system in metres
    from_ground: bool = False  # heights start at the ground, not at the sea
    left_out: tuple[tuple[str, int], ...] = ()  # codes of issues, and how many there are of each
    on_own_map: bool = False  # that of the building, which the file does not name
    crowns: tuple[tuple[str, Foliage], ...] = ()  # objects of other files that are crowns


def read_bytes(path: Path) -> bytes:
    """A file's content; `DataError` where it cannot be read or is too big."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise DataError(f"is too big: at most {MOST_BYTES >> 20} MiB are read", file=path)
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None


def read_object(path: Path) -> dict[str, Any]:
    """The object that a JSON file holds; `DataError` where it is none."""
    try:
        content = json.loads(read_bytes(path))
    except RecursionError:
        raise DataError("is no JSON: nested too deeply", file=path) from None
    except ValueError as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"is no JSON: {error}", file=path) from None
    if not isinstance(content, dict):
        raise DataError("expected a JSON object", file=path)
    return content


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e12
