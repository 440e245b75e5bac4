"""Files as the parameters of commands: what can be said of one at once is said at once."""

from __future__ import annotations

from pathlib import Path

import click


class IfcFile(click.Path):
    """An IFC file whose head and corrections file are sound; nothing heavy is loaded for that."""

    def convert(self, value, param, ctx) -> Path:
        """The path; `DataError` where the file is none of ours."""
        from bim.ifc.corrections import corrections_beside
        from bim.ifc.head import check_head

        path = super().convert(value, param, ctx)
        check_head(path)
        corrections_beside(path)
        return path


FILE = click.Path(exists=True, dir_okay=False, readable=True, path_type=Path)
IFC_FILE = IfcFile(exists=True, dir_okay=False, readable=True, path_type=Path)
