"""The elements of an IFC file without its rooms, and those that selectors choose."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bim.ifc.corrections import Corrections, chosen, corrections_beside
from bim.ifc.elements import outdoor_elements
from bim.ifc.source import Progress, read_source
from bim.model import Building


def read_outdoor_model(
    path: str | Path,
    select: Sequence[str] = (),
    *,
    linked: Sequence[str | Path] = (),
    corrections: Corrections | None = None,
    selected_in: str | Path = "",
    progress: Progress | None = None,
) -> tuple[Building, tuple[frozenset[str], ...]]:
    """The building without rooms of an IFC file, and the GUIDs that each selector chooses.

    Args:
        select: ifcopenshell selectors (GUID, type, material, name), as in `bim.ifc.corrections`.
        selected_in: the file that has the selectors, for messages.
        linked: further files of the same building.
        corrections: by default those of `<model>.corrections.toml` beside the model.
    Raises: `DataError` where the file cannot be read or a selector is none.
    """
    corrections = corrections_beside(path) if corrections is None else corrections
    source = read_source(path, corrections, progress or (lambda stage, fraction: None), linked)
    elements = outdoor_elements(source.model, source.elements, reflectance=corrections.surroundings)
    selected = tuple(
        frozenset(source.model.by_id(i).GlobalId for i in chosen(source.model, query, selected_in)) for query in select
    )
    building = Building(source.name, (), tuple(elements), source.issues, file=Path(path))
    return building, selected
