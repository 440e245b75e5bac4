"""What a honeybee model holds that is no part of a building: sensors, views, use of rooms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bim.honeybee.schema import HoneybeeModel, Shade, ShadeMesh
from bim.model import Problem
from mitsuba_cfs.images.view import KINDS, View, format_view

# of a room's extension of energy: what says how it is used
USES = (
    "program_type", "people", "lighting", "electric_equipment", "gas_equipment", "infiltration",
    "ventilation", "setpoint", "hvac", "window_vent_control", "service_hot_water", "process_loads",
)  # fmt: skip
NAMED = 4  # of many things so many are named


def left_out(model: HoneybeeModel, file: Path) -> Iterator[Problem]:
    """Problems that name sensor grids, views, uses of rooms and states of shades.

    A view is given as Radiance's options, which `--view` takes.
    """
    radiance = model.properties.radiance
    grids = _objects(radiance, "sensor_grids")
    if grids:
        listed = (grid.get("sensors") for grid in grids)
        count = sum(len(sensors) for sensors in listed if isinstance(sensors, list))
        what = f"{len(grids)} sensor grid(s) with {count} sensors: {_names(grids)}"
        yield Problem(file.name, what, "left out; --spacing and --height make the sensors")
    for view in _objects(radiance, "views"):
        found = view_of(view, model.scale)
        done = "" if found is None else f"; --view '{format_view(found)}' gives it"
        yield Problem(str(view["identifier"]), f"view {view['identifier']}", f"left out{done}")
    used = [room for room in model.rooms or () if any(map(room.properties.energy.get, USES))]
    if used:
        programs = {str(room.properties.energy.get("program_type") or "own") for room in used}
        what = f"{len(used)} room(s) with loads, schedules or systems: {_listed(sorted(programs))}"
        yield Problem(file.name, what, "left out; --operation says how rooms are used")
    shades = [s for s in _shades(model) if s.properties.radiance.get("states")]
    if shades:
        what = f"{len(shades)} shade(s) with states: {_listed([s.label for s in shades])}"
        yield Problem(file.name, what, "their own modifier holds all year")
    seasonal = [s for s in _shades(model) if s.properties.energy.get("transmittance_schedule")]
    if seasonal:
        what = f"{len(seasonal)} shade(s) let light through by a schedule"
        yield Problem(file.name, f"{what}: {_listed([s.label for s in seasonal])}", "opaque")


def view_of(view: Mapping[str, Any], scale: float) -> View | None:
    """A honeybee view [m]; None where one of its fields cannot be one.

    Args: scale: metres in the model's unit of length.
    """
    sizes = [60.0 if view.get(field) is None else view[field] for field in ("h_size", "v_size")]
    try:
        position, direction = (
            np.array(view[field], dtype=float) for field in ("position", "direction")
        )
        return View(
            KINDS[view.get("view_type") or "v"], tuple(scale * position), tuple(direction),
            view.get("up_vector") or (0.0, 0.0, 1.0), *map(float, sizes),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError):
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


def _names(objects: Iterable[Mapping[str, Any]]) -> str:
    return _listed([str(one.get("display_name") or one["identifier"]) for one in objects])


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
