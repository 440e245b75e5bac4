"""The building of a run, from its file."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from bim.ifc.building import STAGES, read_ifc
from bim.ifc.head import check_head
from bim.model import Building
from mitsuba_cfs.progress import Progress, silent, summed


def read_building(
    path: str | PathLike[str], *, join: Sequence[str] = (), progress: Progress = silent
) -> Building:
    """The building of an IFC file, with the corrections kept beside it.

    Args: join: rooms to make one, as "Hall + Living".

    Raises: `DataError` for a file that cannot be used; faults of the model are the building's
        `problems`.
    """
    path = Path(path)
    check_head(path)
    return read_ifc(path, join=join, progress=summed(progress, "inputs", STAGES))
