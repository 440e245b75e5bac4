"""Inputs and choices of commands that compute the rooms of a building, and those of a run."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from scenes.room.options import RoomOptions


@dataclass(frozen=True, slots=True)
class BuildingOptions:
    """Inputs and choices of every command that computes the rooms of a building."""

    building: Path | None  # None: not from a file
    weather: Path | None
    system: Path | None = None  # of every window; None: what the building's file holds
    spaces: tuple[str, ...] = ()  # names or GUIDs; none: all that the command is for
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether what stands in the rooms is in their light and views
    apertures: tuple[str, ...] = ()  # materials of a Radiance scene's windows; none: all of glass
    cache: bool = True  # keep traced matrices and find them again
    quick: bool = False  # said in the results; what it chooses is in `scenes.quick`
    room: RoomOptions = field(default_factory=RoomOptions)  # how each room is computed
    surroundings: tuple[Path, ...] = ()  # files of what stands around
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]

    @property
    def joined(self) -> tuple[str, ...]:
        """The rooms to make one."""
        return self.join

    def named(self) -> dict[str, Any]:
        """Every choice by its name, those of the rooms first."""
        own = [one.name for one in fields(self) if one.name != "room"]
        return self.room.named() | {name: getattr(self, name) for name in own}


@dataclass(frozen=True, slots=True, kw_only=True)
class JobOptions(BuildingOptions):
    """Inputs and choices of a run."""

    operation: Path | None = None
    inner_glass: bool = False  # light passes glass and open doorways between rooms
    coupled_heat: bool = True  # heat flows between the rooms that are computed
    colour: bool = True  # each room's brightest picture in colour too
    explore: bool = False  # every hour's picture in every shading state, for the explorer
    netcdf: bool = False  # all numbers of the run as one netCDF file besides
    u_value: float | None = None  # of the system [W/(m2 K)]; None: what the files say, else a rule
    g_value: float | None = None  # at normal incidence

    @property
    def joined(self) -> tuple[str, ...]:
        """The rooms to make one: with light between rooms, those open by more than a door too."""
        from bim.building_file import is_ifc  # the help does without what readers load
        from bim.ifc.corrections import OPEN

        if not (self.inner_glass and self.building is not None and is_ifc(self.building)):
            return self.join
        return (*self.join, OPEN)
