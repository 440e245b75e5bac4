"""The data files of a room: its plan, what casts shadows, its hours, each state's light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Building
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.picture_year.year import PictureYear
from scenes.explore.packing import packed, write_data
from scenes.explore.view_files import view_arrays, view_facts, write_pictures
from scenes.figures.plan import PlanFrame, plan_frame
from scenes.report.model3d import largest_triangles
from scenes.results import ExploredRoom, RoomYear, RunResult

LUX_STEP = 0.002  # of the logarithm of 1 + lux: an illuminance is kept to 0.1 %
TEMPERATURES = {"outdoor": "outdoor_c", "air": "air_c", "operative": "operative_c"}
LOADS = {"heating": "heating_w", "cooling": "cooling_w", "lighting": "lighting_w"}


def write_room(folder: Path, name: str, result: RunResult, room: RoomYear) -> dict[str, Any]:
    """Write a room's files, their names beginning with `name`; its entry of the case.

    Args: folder: of the page; the files go into `data` there.
    """
    explored = room.explored
    if explored is None:
        raise ValueError(f"{room.space.label} was not computed for the explorer")
    states = range(len(explored.states))
    for j in states:
        write_pictures(folder / "data", f"{name}_state{j}", explored.pictures[j])
        codes = np.round(np.log1p(np.maximum(explored.illuminance[j], 0)) / LUX_STEP)
        write_data(folder / "data" / f"{name}_lux{j}.js", packed(codes, "u2"))
    facts = {
        "states": explored.states,
        "groups": len(explored.windows),
        "view": view_facts(explored.pictures[0].view),
        "plan": _plan(room),
        "checks": [_check(year) for year in explored.pictures],
    }
    arrays = _arrays(result, room, explored)
    write_data(folder / "data" / f"{name}.js", {"facts": facts, "arrays": arrays})
    return {
        "name": room.space.label,
        "states": list(explored.states),
        "file": f"data/{name}",
        "models": [f"data/{name}_state{j}" for j in states],
        "lux": [f"data/{name}_lux{j}" for j in states],
    }


def _arrays(result: RunResult, room: RoomYear, explored: ExploredRoom) -> dict[str, Any]:
    arrays = view_arrays(explored.pictures[0]) | {
        "lit": packed(explored.lit, "i4"),
        "sun": packed(result.sun, "f4"),
        "sun_lux": packed(explored.sun_illuminance, "f4"),
        "eye": packed(explored.eye, "f4"),
        "through": packed(explored.through, "f4"),
        "operated": packed(explored.operated, "u1"),
        "blockers": packed(_blockers(result.building, room), "f4"),
    }
    for g, triangles in enumerate(explored.windows):
        arrays[f"group{g}"] = packed(triangles, "f4")
    for name, column in TEMPERATURES.items():
        if column in room.heat.temperatures:
            arrays[name] = packed(room.heat.temperatures[column], "f4")
    if room.operation is not None:
        for name, column in LOADS.items():
            arrays[name] = packed(room.operation.hours[column], "f4")
    return arrays


def _blockers(building: Building, room: RoomYear) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of what is opaque: what light meets in the room and outdoors."""
    outdoors, _ = largest_triangles(exterior_surfaces(building, room.space).triangles)
    return np.concatenate([furnished_surfaces(room.space).triangles, outdoors])


def _plan(room: RoomYear) -> dict[str, Any]:
    """Outline, windows and sensor cells from above [m], the eye, and the levels for the sun."""
    view, points = room.glare.view, room.daylight.points
    frame: PlanFrame = plan_frame(room.space, points)
    cells = np.round(frame.cells, 3)
    spacing = float(np.linalg.norm(cells[0, 1] - cells[0, 0])) if len(cells) else 0.5
    desk = float(np.median(points[:, 2])) if len(points) else room.space.floor_level + 0.8
    return {
        "outline": _rings(frame.outline),
        "windows": [np.round(ends, 3).tolist() for ends in frame.windows],
        "cells": cells.tolist(),
        "spacing": spacing,
        "bounds": [round(v, 3) for v in frame.outline.bounds],
        "eye": view.position[:2],
        "sight": view.direction[:2],
        "heights": {"floor": float(room.space.floor_level), "desk": desk},
    }


def _rings(outline: shapely.Geometry) -> list[list[list[float]]]:
    polygons = [one for one in shapely.get_parts(outline) if one.geom_type == "Polygon"]
    rings = [ring for one in polygons for ring in (one.exterior, *one.interiors)]
    return [np.round(shapely.get_coordinates(ring)[:-1], 3).tolist() for ring in rings]


def _check(year: PictureYear) -> dict[str, Any] | None:
    """DGP of the program's own pictures in some hours, and how far that of the kept ones is."""
    check = year.check
    if check is None or not len(check.hours):
        return None
    difference = np.abs(check.compressed_dgp - check.dgp)
    return {
        "hours": check.hours.tolist(),
        "dgp": np.round(check.dgp, 6).tolist(),
        "largest": float(difference.max()),
        "mean": float(difference.mean()),
    }
