"""The keys of a TOML file for how a building is read, as the options of `InputOptions`."""

from __future__ import annotations

from pathlib import Path

from scenes.toml_file import TomlTable


class ReadTable(TomlTable):
    """How a building's file is read, see `bim.building_file.ReadOptions`."""

    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether furniture is in the light and the views of its room
    apertures: tuple[str, ...] = ()  # materials of a Radiance scene's windows
    facade_panes: tuple[str, ...] = ()  # materials of a Radiance scene's panes before dark rooms


class OutdoorTable(TomlTable):
    """Files of what stands around a building."""

    surroundings: tuple[Path, ...] = ()  # of buildings, terrain, trees and horizons outdoors
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]


def read_options(*tables: TomlTable) -> dict[str, object]:
    """The keys of these tables as options of `InputOptions`."""
    names = (*ReadTable.model_fields, *OutdoorTable.model_fields)
    return {
        name: getattr(table, name)
        for table in tables
        for name in names
        if name in type(table).model_fields
    }
