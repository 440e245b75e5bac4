"""Rooms as EnergyPlus computes them, beside the program's own results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bim.energyplus_twin import EnergyPlusTwin, TwinAir, TwinRoom
from bim.energyplus_windows import WindowOptics
from bim.model import Building
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import States
from scenes.fenestration.thermal_system import thermal_system, window_optics
from scenes.room.zone import RoomZone, climate

if TYPE_CHECKING:
    from scenes.heat.study import BalancedRooms
    from scenes.heat.study_file import StudyFile


def check_twin(study: StudyFile) -> None:
    """Raise `DataError` for a study that EnergyPlus cannot be given."""
    if study.measured is not None:
        raise DataError("EnergyPlus needs an EPW file", file=study.weather, field="measured")
    if study.air_nodes:
        message = "the EnergyPlus model has a zone for each room"
        raise DataError(message, file=study.building, field="air_nodes")
    if study.heat_island is not None:
        message = "EnergyPlus reads the EPW file itself, without a heat island"
        raise DataError(message, file=study.weather, field="heat_island")


def energyplus_twin(study: StudyFile, balanced: BalancedRooms) -> EnergyPlusTwin:
    """The model of a study's rooms as they were balanced.

    Raises: `DataError` for what EnergyPlus cannot take.
    """
    air = TwinAir(balanced.air_links, balanced.transfers)
    rooms = balanced.building, balanced.rooms, balanced.in_windows, balanced.weather
    return twin_of_rooms(*rooms, air=air, terrain=study.terrain, steps=60 // study.step_minutes)


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
