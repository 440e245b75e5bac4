"""The year's light of a room on the grids of several rules, from one V and one D."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.sensors import plane_sides
from mitsuba_cfs.methods.light import direct_sun_by_group, illuminance
from mitsuba_cfs.metrics.en17037 import greatest_cell
from mitsuba_cfs.metrics.lm83 import blinds_operated
from scenes.comply.findings import GridLight
from scenes.comply.glass import sight_through
from scenes.comply.rules import GridTable
from scenes.room.daylight import overcast_factor
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight, grid_points
from scenes.room.options import SensorGrid


def sensor_grid_of(space: Space, table: GridTable) -> SensorGrid:
    """The grid of a rule in a room; where it has no spacing, whole cells no wider than p."""
    spacing = table.spacing
    if spacing is None:
        sides = plane_sides(space, table.height, table.margin)
        longer = max(sides)
        spacing = longer / np.ceil(longer / greatest_cell(*sides) - 1e-9)
    return SensorGrid(spacing=float(spacing), height=table.height, margin=table.margin)


def lights_of(room: RoomInputs, traced: RoomLight, operated: Iterable[int]) -> list[GridLight]:
    """The light on each grid of a room.

    The windows' first state is open, their second closed; LM-83's rule moves them by group.

    Args: operated: numbers of the grids whose light with operated blinds is wanted.
    """
    light, sky = traced.light, room.skies

    def year(values: NDArray[np.float64]) -> NDArray[np.float32]:
        return sky.whole_year(values.astype(np.float32)).T

    opened, factor = illuminance(light), overcast_factor(light)
    through = direct_sun_by_group(light) or []
    points = traced.scene.points
    seen = [[sight_through(one).is_view for one in room.windows.in_state(j)] for j in (0, 1)]
    found, first = [], 0
    for number, grid in enumerate(room.grids):
        count = len(grid_points(room.space, grid))
        own = slice(first, first + count)
        first += count
        direct = [part[own] for part in through]
        blinds = closed = free = None
        if number in operated:
            state = blinds_operated([part.T for part in direct]).astype(np.int64)  # [G, L]
            blinds, closed = year(illuminance(light, state)[own]), sky.whole_year(state).T > 0
            free = np.where(closed, seen[1], seen[0])
        sun = np.sum(direct, axis=0) if direct else np.zeros_like(opened[own])
        found.append(
            GridLight(points[own], year(opened[own]), year(sun), factor[own], blinds, closed, free)
        )
    return found
