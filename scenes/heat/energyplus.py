"""Rooms as EnergyPlus computes them, beside the program's own results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bim.energyplus_twin import EnergyPlusTwin, TwinAir
from mitsuba_cfs.errors import DataError
from scenes.room.energyplus import twin_of_rooms

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
