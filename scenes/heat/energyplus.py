"""A study's rooms as EnergyPlus computes them, beside the study's own results."""

from __future__ import annotations

from bim.energyplus_twin import EnergyPlusTwin, TwinAir, TwinRoom
from bim.energyplus_windows import WindowOptics
from mitsuba_cfs.errors import DataError
from scenes.fenestration.thermal_system import thermal_system, window_optics
from scenes.heat.study import BalancedRooms
from scenes.heat.study_file import StudyFile
from scenes.room.zone import climate


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
    optics: dict[int, WindowOptics] = {}
    rooms = []
    for room in balanced.rooms:
        windows = {w.guid: balanced.in_windows[w.guid] for w in room.space.windows}
        for system in (one for states in windows.values() for one in states):
            optics.setdefault(id(system), window_optics(system, thermal_system(system)))
        of_window = {guid: [optics[id(system)] for system in states] for guid, states in windows.items()}
        rooms.append(TwinRoom(room.space, room.room, of_window, room.shading.of_windows))
    return EnergyPlusTwin(
        balanced.building,
        rooms,
        climate(balanced.weather),
        air=TwinAir(balanced.air_links, balanced.transfers),
        terrain=study.terrain,
        steps=60 // study.step_minutes,
    )
