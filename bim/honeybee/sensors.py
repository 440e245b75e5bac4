"""Sensor grids and views of a Honeybee model, and the shades that no result uses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bim.held_sensors import ModelGrid, ModelView
from bim.honeybee.schema import HoneybeeModel, Shade, ShadeMesh
from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import KINDS, View


class SensorReader:
    """The grids and views of a model; what cannot be one is in the issues."""

    def __init__(self, model: HoneybeeModel, file: Path) -> None:
        self.radiance, self.scale, self.file = model.properties.radiance, model.scale, file
        self.issues: list[Issue] = []

    def grids(self) -> tuple[ModelGrid, ...]:
        """The sensor grids [m].

        Raises: `DataError` that names the grid.
        """
        found = []
        for grid in _objects(self.radiance, "sensor_grids"):
            name = str(grid.get("display_name") or grid["identifier"])
            try:
                rows = [(one["pos"], one["dir"]) for one in grid["sensors"]]
                points, towards = np.array(rows, dtype=float).reshape(-1, 2, 3).transpose(1, 0, 2)
                lengths = np.linalg.norm(towards, axis=1, keepdims=True)
                if not (np.isfinite(points).all() and (lengths > 0).all() and len(points)):
                    raise ValueError(name)
            except (KeyError, TypeError, ValueError, OverflowError):
                message = "expected sensors, each with pos and dir of three numbers"
                raise DataError(message, file=self.file, element=name, field="sensors") from None
            found.append(ModelGrid(name, self.scale * points, towards / lengths))
        return tuple(found)

    def views(self) -> tuple[ModelView, ...]:
        """The views [m] that can be made; the others are named in the issues."""
        found = []
        for view in _objects(self.radiance, "views"):
            name = str(view.get("display_name") or view["identifier"])
            made = view_of(view, self.scale)
            if made is None:
                self.issues.append(Issue("view-unreadable", self.file.name, {"view": name}))
            else:
                found.append(ModelView(name, made))
        return tuple(found)


def shade_issues(model: HoneybeeModel, file: Path) -> Iterator[Issue]:
    """Issues that name shades with states, and shades that let light through by a schedule."""
    shades = [s for s in _shades(model) if s.properties.radiance.get("states")]
    if shades:
        values = {"count": len(shades), "shades": tuple(s.label for s in shades)}
        yield Issue("shades-with-states", file.name, values)
    seasonal = [s for s in _shades(model) if s.properties.energy.get("transmittance_schedule")]
    if seasonal:
        values = {"count": len(seasonal), "shades": tuple(s.label for s in seasonal)}
        yield Issue("shades-by-schedule", file.name, values)


def view_of(view: Mapping[str, Any], scale: float) -> View | None:
    """A honeybee view [m]; None where one of its fields cannot be one.

    Args: scale: metres in the model's unit of length.
    """
    sizes = [60.0 if view.get(field) is None else view[field] for field in ("h_size", "v_size")]
    up = view.get("up_vector") or (0.0, 0.0, 1.0)
    try:
        position, direction, up = (
            tuple(np.array(one, dtype=float).reshape(3).tolist())
            for one in (view.get("position"), view.get("direction"), up)
        )
        width, height = map(float, sizes)
        kind = KINDS[view.get("view_type") or "v"]
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    place = tuple(scale * x for x in position)
    try:
        return View(kind, place, direction, up, width, height)
    except ValueError:  # no direction, impossible angles
        return None


def _objects(properties: Mapping[str, Any], field: str) -> list[Mapping[str, Any]]:
    """The objects with an identifier that an extension lists."""
    listed = properties.get(field)
    listed = listed if isinstance(listed, list) else []
    return [one for one in listed if isinstance(one, dict) and one.get("identifier")]


def _shades(model: HoneybeeModel) -> Iterator[Shade | ShadeMesh]:
    yield from model.orphaned_shades or ()
    yield from model.shade_meshes or ()
    for room in model.rooms or ():
        yield from room.outdoor_shades or ()
        for face in room.faces:
            yield from face.outdoor_shades or ()
            for opening in (*(face.apertures or ()), *(face.doors or ())):
                yield from opening.outdoor_shades or ()
