"""The building of a run, from its file."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from bim.building_file import STAGES, ReadOptions, read_building_file
from bim.model import Building
from mitsuba_cfs.progress import Progress, silent, summed
from scenes.run.options import BuildingOptions


def read_building(
    path: str | PathLike[str],
    *,
    join: Sequence[str] = (),
    furniture: bool = False,
    apertures: Sequence[str] = (),
    surroundings: Sequence[str | PathLike[str]] = (),
    surroundings_offset: tuple[float, float, float] | None = None,
    progress: Progress = silent,
) -> Building:
    """The building of an IFC file, with the corrections kept beside it, or of another format.

    Args:
        join: rooms to make one, as "Hall + Living".
        furniture: whether what stands in the rooms is in their light and views.
        apertures: materials of a Radiance scene's surfaces that are windows.
        surroundings: files of what stands around, see `bim.with_surroundings`.
        surroundings_offset: added to their coordinates [m] in place of any georeference.

    Raises: `DataError` for a file that cannot be used; faults of the model are the building's
        `issues`.
    """
    steps = summed(progress, "inputs", STAGES)
    options = ReadOptions(
        tuple(join), furniture, tuple(apertures), tuple(map(Path, surroundings)),
        surroundings_offset,
    )  # fmt: skip
    return read_building_file(path, options, steps)


def building_of(options: BuildingOptions, progress: Progress = silent) -> Building:
    """The building of a command's options; raises as `read_building`."""
    return read_building(
        options.building,
        join=options.joined,
        furniture=options.furniture,
        apertures=options.apertures,
        surroundings=options.surroundings,
        surroundings_offset=options.surroundings_offset,
        progress=progress,
    )
