"""Objects of a file of surroundings in its coordinates; meshes (OBJ, STL, PLY, glTF) by trimesh.

No file beside a mesh is opened.
"""

from __future__ import annotations

import base64
import binascii
import io
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

SUFFIXES = (".obj", ".stl", ".ply", ".glb", ".gltf")
# what trimesh's readers raise where a file is none of theirs: NumPy's, struct's and their own
FAULTS = (
    ValueError,
    LookupError,
    NameError,
    TypeError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    NotImplementedError,
    EOFError,
    MemoryError,
    struct.error,
)
UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0, 0, 0, 1.0]])


class _NoFiles(trimesh.resolvers.Resolver):
    """Finds nothing: materials and textures are not read."""

    def __init__(self) -> None: ...

    def get(self, name: str) -> bytes:
        raise ValueError(f"{name}: files beside a mesh are not read")

    def keys(self) -> list[str]:
        return []

    def write(self, name: str, data: object) -> None:
        raise ValueError("nothing is written")

    def namespaced(self, namespace: str) -> _NoFiles:
        return self


def read_meshes(path: Path) -> SurroundingsFile:
    """The objects of a mesh file in metres, z up; glTF, which has y up by its standard, turned.

    Raises: `DataError` for a file that is no mesh, or keeps its data in other files.
    """
    kind = path.suffix.lower().removeprefix(".")
    content = read_bytes(path)
    if kind == "gltf":
        _check_data(content, path)
    resolver = _NoFiles()
    try:
        scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, resolver=resolver, skip_materials=True)
        meshes = [
            (m.metadata.get("name"), np.asarray(m.triangles, dtype=float))
            for m in scene.dump()
            if isinstance(m, trimesh.Trimesh)
        ]
    except FAULTS as error:
        reason = (str(error).splitlines() or [""])[0][:120]
        raise DataError(f"is no {kind.upper()} mesh: {reason or type(error).__name__}", file=path) from None
    objects = []
    for number, (named, triangles) in enumerate(meshes, 1):
        if triangles.shape[1:] != (3, 3):
            raise DataError("has corners without three coordinates", file=path)
        if kind in ("glb", "gltf"):
            triangles = triangles @ UP[:3, :3].T
        if not are_coordinates(triangles):
            raise DataError("has coordinates that are no numbers", file=path)
        if len(triangles):
            name = str(named or f"{path.stem} {number}")
            objects.append(SurroundingObject(name, triangles))
    if not objects:
        raise DataError("holds no triangles", file=path)
    return SurroundingsFile(path, tuple(objects))


def _check_data(content: bytes, path: Path) -> None:
    """Refuse a glTF whose buffers lie in other files."""
    try:
        buffers: Any = json.loads(content).get("buffers", [])
        uris = [str(one.get("uri", "")) for one in buffers]
        for uri in uris:
            base64.b64decode(uri.partition("base64,")[2], validate=True)
    except (ValueError, AttributeError, TypeError, binascii.Error, RecursionError):
        raise DataError("is no glTF with its data inside", file=path) from None
    outside = next((uri for uri in uris if not uri.startswith("data:")), None)
    if outside is not None:
        message = f"{outside[:60]}: files beside a mesh are not read; save it as .glb"
        raise DataError(message, file=path, field="buffers.uri")


MOST_BYTES = 512 << 20
FARTHEST = 1e12  # of a coordinate: products of larger ones overflow
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


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < FARTHEST


def are_coordinates(values: NDArray[np.float64]) -> bool:
    """Whether all values are finite numbers that can be coordinates."""
    return bool((np.abs(values) < FARTHEST).all())
