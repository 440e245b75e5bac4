"""Options of `cfs run`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from scenes.input_options import InputOptions
from scenes.room.options import RoomOptions

if TYPE_CHECKING:
    from bim.building_file import ReadOptions


@dataclass(frozen=True, slots=True)
class JobOptions(InputOptions):
    """Options of a run."""

    room: RoomOptions = field(default_factory=RoomOptions)  # how each room is computed
    inner_glass: bool = False  # light passes glass and open doorways between rooms
    coupled_heat: bool = True  # heat flows between the rooms that are computed
    colour: bool = True  # each room's brightest picture in colour too
    explore: bool = False  # every hour's picture in every shading state, for the explorer
    error: float | None = None  # relative, of yearly means: fewer rays where it needs fewer
    energyplus: bool = False  # the rooms as an EnergyPlus model besides
    netcdf: bool = False  # all numbers of the run as one netCDF file besides
    ladybug: bool = False  # illuminances as a results folder of Ladybug Tools besides

    @property
    def read(self) -> ReadOptions:
        """The reader's options; with light between rooms, rooms open to each other are joined."""
        from bim.building_file import is_ifc  # no `--help` needs a reader
        from bim.ifc.corrections import OPEN

        read = super(JobOptions, self).read
        if not (self.inner_glass and self.building is not None and is_ifc(self.building)):
            return read
        return replace(read, join=(*read.join, OPEN))

    def named(self) -> dict[str, Any]:
        """Every option by its name, those of the rooms first."""
        named = super(JobOptions, self).named()
        return named.pop("room").named() | named
