"""Stage 2 of a room: the state of its shading in every hour, by the rule of its operation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.room.glare import glare_by_state, rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import ControlTable, OperationTables
from scenes.room.solar import SeasonalOutdoors, window_irradiance
from thermal.control import always, by_cut_off, by_glare, by_irradiance

FloatArray = NDArray[np.float64]


def control_signal(room: RoomInputs) -> str:
    """The computed quantity that the shading rule of a room reads; "": none.

    "irradiance" of the windows, "eye": illuminance at the eye, "dgp" of every hour.
    """
    if room.operation is None or not room.space.windows:
        return ""
    return signal_of(room.operation.control)


def signal_of(control: ControlTable) -> str:
    """The computed quantity that a rule reads; "": none."""
    if control.rule == "irradiance":
        return "irradiance"
    if control.rule == "glare":
        return "eye" if control.limit_dgp is None else "dgp"
    return ""


def shading_state(
    room: RoomInputs,
    light: RoomLight | None = None,
    outdoors: SeasonalOutdoors | None = None,
    *,
    progress: Progress = silent,
) -> NDArray[np.int64]:
    """The shading state of every hour [H], the same in all windows of the room.

    Args: light: for the signals "eye" and "dgp"; outdoors: for the signal "irradiance".
    """
    if room.operation is None or not room.space.windows:
        return np.zeros(room.skies.hours, dtype=np.int64)
    signal, values = control_signal(room), None
    if signal == "irradiance":
        values = window_irradiance(outdoors, room.skies)
    elif signal == "eye":
        values = room.skies.whole_year(light.eye())
    elif signal == "dgp":
        values = glare_by_state(light.light, rating_of(room.options.outputs), progress)
    return states_by_rule(room.operation, room.space, room.weather, room.windows.states, values)


def states_by_rule(
    operation: OperationTables,
    space: Space,
    weather: Weather,
    states: int,
    signal: FloatArray | None = None,
) -> NDArray[np.int64]:
    """The state of every hour [H] by the rule of an operation.

    Args:
        states: number of states, from open to closed.
        signal: `signal_of` the rule: irradiance of the window groups [H, G] [W/m2] (the brightest
            counts), illuminance at the eye [J, H] [lx] or DGP [J, H] in each state.
    """
    control = operation.control
    if control.rule == "schedule":
        return OperationHours(operation, weather).states(states)
    if control.rule == "irradiance":
        closed = control.state or states - 1
        brightest = signal.max(axis=1)
        return by_irradiance(brightest, control.close_above, control.open_below, closed=closed)
    if control.rule == "glare":
        limit = control.limit_lx if control.limit_dgp is None else control.limit_dgp
        return by_glare(signal, limit)
    if control.rule == "cut-off":
        local = (
            sun_directions(weather) @ window_frame(space.windows[0].normal, space.windows[0].up).T
        )
        beam = weather.direct_normal * np.maximum(local[:, 2], 0.0)
        tilts = np.radians(control.slat_tilts_deg)
        return by_cut_off(local, beam, tilts, control.slat_width, control.slat_spacing)
    return always(control.state, len(weather.times))
