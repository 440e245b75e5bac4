"""The temperatures of a room for rules of summer comfort."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.progress import Progress, silent
from scenes.comply.findings import RoomHeat
from scenes.room.heat import heat_alone
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room.solar import seasonal_outdoors
from scenes.room.zone import room_zone, zone_surfaces


def room_heat(
    room: RoomInputs,
    light: RoomLight,
    closed: NDArray[np.bool_] | None,
    *,
    progress: Progress = silent,
) -> RoomHeat:
    """Operative temperatures of a room that neither heats nor cools.

    Args:
        closed: [H, G] when the blinds of each window group are closed. None: open all year.
    """
    state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    if closed is not None:
        state = closed[:, : state.shape[1]].astype(np.int64)
    outdoors = seasonal_outdoors(room, light, progress=progress)
    zone = room_zone(room, zone_surfaces(room), outdoors, state, progress=progress)
    thermal, _ = heat_alone(zone, room.weather, room.options.heat_step_s, progress)
    return RoomHeat(
        thermal.temperatures["operative_c"].to_numpy(),
        np.asarray(room.weather.dry_bulb_c),
        room.occupied,
    )
