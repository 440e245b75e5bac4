"""The building of a run, from its file."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from bim.ifc.building import STAGES, read_ifc
from bim.model import Building
from mitsuba_cfs.progress import Progress, silent, summed


def read_building(
    path: str | PathLike[str],
    *,
    join: Sequence[str] = (),
    furniture: bool = False,
    progress: Progress = silent,
) -> Building:
    """The building of an IFC file, with the corrections kept beside it.

    Args:
        join: rooms to make one, as "Hall + Living".
        furniture: whether what stands in the rooms is in their light and views.

    Raises: `DataError` for a file that cannot be used; faults of the model are the building's
        `problems`.
    """
    steps = summed(progress, "inputs", STAGES)
    return read_ifc(Path(path), join=join, furniture=furniture, progress=steps)
