"""Shading control: which state of its windows holds in each hour of a room's year."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import OperationTables
from thermal.control import always, by_cut_off, by_glare, by_irradiance

FloatArray = NDArray[np.float64]


def shading_states(
    operation: OperationTables,
    space: Space,
    weather: Weather,
    states: int,
    *,
    irradiance: Callable[[], FloatArray],
    eye: Callable[[], FloatArray],
    dgp: Callable[[], FloatArray],
) -> NDArray[np.int64]:
    """The state of every hour [H], the same in all windows of the room.

    What a rule does not ask for is not worked out.

    Args:
        irradiance: gives [H, G] of the window groups [W/m2]: the brightest counts.
        eye: gives [J, H] vertical illuminance at the eye in each state [lx].
        dgp: gives [J, H].
    """
    control, hours = operation.control, len(weather.times)
    if control.rule == "schedule":
        return OperationHours(operation, weather).states(states)
    if control.rule == "irradiance":
        closed = control.state or states - 1
        brightest = irradiance().max(axis=1)
        return by_irradiance(brightest, control.close_above, control.open_below, closed=closed)
    if control.rule == "glare":
        if control.limit_dgp is not None:
            return by_glare(dgp(), control.limit_dgp)
        return by_glare(eye(), control.limit_lx)
    if control.rule == "cut-off":
        local = sun_directions(weather) @ window_frame(space.windows[0].normal).T
        beam = weather.direct_normal * np.maximum(local[:, 2], 0.0)
        tilts = np.radians(control.slat_tilts_deg)
        return by_cut_off(local, beam, tilts, control.slat_width, control.slat_spacing)
    return always(control.state, hours)
