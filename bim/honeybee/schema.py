"""What is read of an HBJSON file, as pydantic models: geometry, conditions, names of properties.

Only fields that are used are named; others are passed over, so that files of every version of
honeybee-schema since 1.0 are read.  Materials, constructions and modifiers come as dictionaries:
`bim.honeybee.energy` and `bim.honeybee.building` read those that something refers to.

Source: honeybee-schema, "Model" (https://www.ladybug.tools/honeybee-schema/model.html).
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, ValidationError

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import read_json

METRES = {"Meters": 1.0, "Millimeters": 1e-3, "Centimeters": 0.01, "Feet": 0.3048, "Inches": 0.0254}
Coordinate = Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Ring = Annotated[list[Point], Field(min_length=3)]


class Polygon3D(BaseModel):
    """A plane polygon with holes (`Face3D`)."""

    boundary: Ring
    holes: list[Ring] | None = None

    def rings(self, scale: float) -> tuple[NDArray[np.float64], ...]:
        """Outline, then holes, each [N, 3] [m]."""
        return tuple(scale * np.asarray(ring) for ring in (self.boundary, *(self.holes or ())))


class Mesh(BaseModel):
    """A mesh of triangles and quadrangles (`Mesh3D`)."""

    vertices: list[Point]
    faces: list[Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=3, max_length=4)]]

    def triangles(self, scale: float) -> NDArray[np.float64]:
        """Triangles [T, 3, 3] [m]; `ValueError` for the number of a vertex that does not exist."""
        corners = scale * np.asarray(self.vertices, dtype=float).reshape(-1, 3)
        cut = [(f[0], b, c) for f in self.faces for b, c in pairwise(f[1:])]
        index = np.asarray(cut, dtype=int).reshape(-1, 3)
        if len(index) and index.max() >= len(corners):
            raise ValueError(f"vertex {index.max()} of {len(corners)}")
        return corners[index]


class Condition(BaseModel):
    """What lies behind a face or an opening."""

    type: str = "Outdoors"
    boundary_condition_objects: list[str] = []  # of "Surface": its face, then its room


class ObjectProperties(BaseModel):
    """What an object's extensions hold, by extension."""

    energy: dict[str, Any] = {}
    radiance: dict[str, Any] = {}


class HoneybeeObject(BaseModel):
    """What all objects have."""

    identifier: str
    display_name: str | None = None
    properties: ObjectProperties = ObjectProperties()

    @property
    def label(self) -> str:
        """The name that people see."""
        return self.display_name or self.identifier


class Shade(HoneybeeObject):
    """A polygon that shades."""

    geometry: Polygon3D
    is_detached: bool = False


class ShadeMesh(HoneybeeObject):
    """A mesh that shades."""

    geometry: Mesh
    is_detached: bool = True


class Shaded(HoneybeeObject):
    """An object that has shades of its own."""

    outdoor_shades: list[Shade] | None = None
    indoor_shades: list[Shade] | None = None


class HoneybeeAperture(Shaded):
    """A window."""

    geometry: Polygon3D
    boundary_condition: Condition = Condition()
    is_glass: bool = True


class HoneybeeDoor(HoneybeeAperture):
    """A door, opaque unless `is_glass` is set."""

    is_glass: bool = False


class RoomFace(Shaded):
    """A polygon of a room (`Face`)."""

    geometry: Polygon3D
    face_type: Literal["Wall", "Floor", "RoofCeiling", "AirBoundary"]
    boundary_condition: Condition = Condition()
    apertures: list[HoneybeeAperture] | None = None
    doors: list[HoneybeeDoor] | None = None


class HoneybeeRoom(Shaded):
    """A room (`Room`)."""

    faces: list[RoomFace]
    story: str | None = None
    multiplier: int = 1


class HoneybeeModel(HoneybeeObject):
    """A whole file (`Model`)."""

    type: Literal["Model"]
    units: Literal["Meters", "Millimeters", "Centimeters", "Feet", "Inches"] = "Meters"
    rooms: list[HoneybeeRoom] | None = None
    orphaned_faces: list[RoomFace] | None = None
    orphaned_shades: list[Shade] | None = None
    orphaned_apertures: list[HoneybeeAperture] | None = None
    orphaned_doors: list[HoneybeeDoor] | None = None
    shade_meshes: list[ShadeMesh] | None = None

    @property
    def scale(self) -> float:
        """Metres in a unit of length."""
        return METRES[self.units]


def read_model(path: Path) -> HoneybeeModel:
    """The model that an HBJSON file holds.

    Raises: `DataError` in one line that names the file, the object and the field.
    """
    content = read_json(path)
    if content.get("type") != "Model":
        kind = content.get("type")
        raise DataError(f"expected a honeybee Model, got {kind!r:.60}", file=path, field="type")
    if isinstance(content.get("buildings"), list):
        message = "is a dragonfly model; write honeybee's HBJSON of it (Model.to_honeybee)"
        raise DataError(message, file=path)
    try:
        return HoneybeeModel.model_validate(content)
    except ValidationError as error:
        raise validation_fault(error, content, path) from None


def validation_fault(error: ValidationError, content: Any, path: Path) -> DataError:
    """The first fault of a file's content: the nearest identifier above it, and the field."""
    first = error.errors(include_url=False, include_input=False)[0]
    element, at = None, content
    field: list[str] = []
    for step in first["loc"]:
        if isinstance(at, dict) and isinstance(at.get("identifier"), str):
            element, field = at["identifier"], []
        field.append(str(step))
        try:
            at = at[step]
        except (KeyError, IndexError, TypeError):
            at = None
    more = error.error_count() - 1
    message = first["msg"] + (f" (and {more} more faults)" if more else "")
    return DataError(message, file=path, element=element, field=".".join(field) or None)
