"""Rooms as they were balanced, as a model of EnergyPlus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bim.energyplus_twin import EnergyPlusTwin, TwinAir, TwinRoom
from bim.energyplus_windows import WindowOptics
from bim.model import Building
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import States
from scenes.fenestration.thermal_system import thermal_system, window_optics
from scenes.room.zone import RoomZone, climate


def twin_of_rooms(
    building: Building,
    rooms: Sequence[RoomZone],
    in_windows: Mapping[str, States],
    weather: Weather,
    *,
    air: TwinAir,
    terrain: str,
    steps: int,
) -> EnergyPlusTwin:
    """The model of rooms as they were balanced, with the shading states of every hour.

    Args: in_windows: systems by window GUID; steps: of an hour.

    Raises: `DataError` for what EnergyPlus cannot take.
    """
    optics: dict[int, WindowOptics] = {}
    twins = []
    for room in rooms:
        windows = {w.guid: in_windows[w.guid] for w in room.space.windows}
        for system in (one for states in windows.values() for one in states):
            optics.setdefault(id(system), window_optics(system, thermal_system(system)))
        of_window = {guid: [optics[id(system)] for system in states] for guid, states in windows.items()}
        twins.append(TwinRoom(room.space, room.room, of_window, room.shading.of_windows))
    return EnergyPlusTwin(building, twins, climate(weather), air=air, terrain=terrain, steps=steps)
