"""Files as the parameters of commands: what can be said of one at once is said at once."""

from __future__ import annotations

from pathlib import Path

import click


class IfcFile(click.Path):
    """An IFC file whose head and corrections file are sound; nothing heavy is loaded for that."""

    def convert(self, value, param, ctx) -> Path:
        """The path; `DataError` where the file is none of ours."""
        from bim.building_file import check_ifc

        path = super().convert(value, param, ctx)
        check_ifc(path)
        return path


class BuildingFile(click.Path):
    """A file of any format that a building is read from, sound as far as it can be seen at once."""

    def convert(self, value, param, ctx) -> Path:
        """The path; `DataError` where the file is none of ours."""
        from bim.building_file import check_building_file

        path = super().convert(value, param, ctx)
        check_building_file(path)
        return path


def check_is_ifc(path: Path, field: str) -> None:
    """Raise `DataError` for what only an IFC file can do, asked of another format."""
    from bim.building_file import is_ifc
    from mitsuba_cfs.errors import DataError

    if not is_ifc(path):
        raise DataError(f"needs an IFC file, got {path.name}", field=field)


FILE = click.Path(exists=True, dir_okay=False, readable=True, path_type=Path)
BUILDING_FILE = BuildingFile(exists=True, dir_okay=False, readable=True, path_type=Path)
IFC_FILE = IfcFile(exists=True, dir_okay=False, readable=True, path_type=Path)
