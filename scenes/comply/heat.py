"""The temperatures of a room for rules of summer comfort."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.comply.findings import RoomHeat
from scenes.room.room import RoomSimulation


def room_heat(room: RoomSimulation, closed: NDArray[np.bool_] | None) -> RoomHeat:
    """Operative temperatures of a room that neither heats nor cools.

    Args:
        closed: [H, G] when the blinds of each window group are; a room's heat knows one state for
            all windows, closed when those of any group are.  None: open all year.
    """
    if closed is not None:
        room.state = np.where(closed.any(axis=1), 1, 0)
    temperatures = room.thermal().temperatures
    return RoomHeat(
        temperatures["operative_c"].to_numpy(), np.asarray(room.weather.dry_bulb_c), room.occupied
    )
