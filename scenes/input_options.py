"""Options that every command takes: building, weather, fenestration, rooms."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bim.building_file import ReadOptions


@dataclass(frozen=True, slots=True)
class InputOptions:
    """Options that every command takes; a command adds only what is its own."""

    building: Path | None  # None: a building that is not from a file
    weather: Path | None  # EPW file; None: the command needs none, or has it as data
    system: Path | None = None  # BSDF file of every window; None: what the building's file holds
    spaces: tuple[str, ...] = ()  # names or GUIDs of rooms; none: all that the command is for
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether furniture is in the light and the views of its room
    apertures: tuple[str, ...] = ()  # materials of a Radiance scene's windows; none: all of glass
    cache: bool = True  # store traced matrices and use stored ones
    quick: bool = False  # noted in the results; `scenes.quick` has the numbers
    surroundings: tuple[Path, ...] = ()  # files of buildings, terrain, trees and horizons outdoors
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
    albedo: float | tuple[float, ...] | str | None = None  # of the ground, see `with_albedo`
    facade_panes: tuple[str, ...] = ()  # materials of a Radiance scene's panes before dark rooms
    u_value: float | None = None  # of every window, instead of the file's [W/(m2 K)]
    g_value: float | None = None  # of every window at normal incidence
    glazing: str | None = None  # generic glazing for windows whose file states no data
    visible_transmittance: float | None = None  # of windows without a BSDF, before the file's
    see_through: tuple[str, ...] = ()  # FILE=specular, lobe or a share, see `input_files`
    operation: Path | None = None  # shading control, gains, set points
    linked: tuple[Path, ...] = ()  # further files of the same building: facade, structure, site
    only_storeys: tuple[str, ...] = ()  # that are read of a large model, with the next ones; none: all

    @property
    def read(self) -> ReadOptions:
        """The options of the building's reader."""
        from bim.building_file import ReadOptions  # no `--help` needs a reader

        return ReadOptions(
            tuple(self.join),
            self.furniture,
            tuple(self.apertures),
            tuple(map(Path, self.surroundings)),
            self.surroundings_offset,
            tuple(self.facade_panes),
            tuple(map(Path, self.linked)),
            tuple(self.spaces),
            tuple(self.only_storeys),
        )

    @property
    def rooms(self) -> tuple[str, ...]:
        """Names of the rooms that are asked for, else of their storeys; none: all."""
        return self.spaces or self.only_storeys

    @property
    def building_files(self) -> tuple[Path, ...]:
        """The files of the building."""
        return () if self.building is None else (self.building, *self.linked)

    def named(self) -> dict[str, Any]:
        """Every option by its name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


NO_OPTIONS = InputOptions(None, None)
