"""What stands outdoors in an IFC file, and which of it a selector chooses, without its rooms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bim.ifc.corrections import Corrections, chosen, corrections_beside
from bim.ifc.elements import outdoor_elements
from bim.ifc.source import Progress, read_source
from bim.outdoor_model import OutdoorModel


def read_outdoor_model(
    path: str | Path,
    select: Sequence[str] = (),
    *,
    linked: Sequence[str | Path] = (),
    corrections: Corrections | None = None,
    selected_in: str | Path = "",
    progress: Progress | None = None,
) -> OutdoorModel:
    """All elements of an IFC file, and those that selectors choose by GUID, type, material, name.

    Args:
        select: ifcopenshell selectors, as in `bim.ifc.corrections`.
        selected_in: the file that the selectors stand in, for messages.
        linked: further files of the same building.
        corrections: by default those of `<model>.corrections.toml` beside the model.
    Raises: `DataError` where the file cannot be read or a selector is none.
    """
    corrections = corrections_beside(path) if corrections is None else corrections
    source = read_source(path, corrections, progress or (lambda stage, fraction: None), linked)
    elements = outdoor_elements(source.model, source.elements, reflectance=corrections.surroundings)
    found = tuple(
        frozenset(source.model.by_id(i).GlobalId for i in chosen(source.model, query, selected_in))
        for query in select
    )
    return OutdoorModel(tuple(elements), found, source.issues, source.name)
