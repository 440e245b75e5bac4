"""What an IFC file says of the use of its rooms besides their names."""

from __future__ import annotations

from os import PathLike

import ifcopenshell.util.classification
import ifcopenshell.util.element

from bim.ifc.project import open_all, psets_of

# Property sets and properties that name a use, the most telling first
PROPERTIES = (
    ("Pset_SpaceOccupancyRequirements", "OccupancyType"),
    ("Pset_SpaceCommon", "OccupancyType"),  # IFC2X3
    ("Pset_SpaceCommon", "Category"),
    ("Pset_SpaceCommon", "Reference"),
)


def read_room_uses(*paths: str | PathLike[str]) -> dict[str, tuple[tuple[str, str], ...]]:
    """The stated use of each IfcSpace by GUID: its property, and the text."""
    uses: dict[str, tuple[tuple[str, str], ...]] = {}
    models = open_all(paths).values()
    for space in (space for model in models for space in model.by_type("IfcSpace")):
        psets = psets_of(space)
        texts = [(f"{name}.{key}", str(psets[name][key])) for name, key in PROPERTIES if psets.get(name, {}).get(key)]
        for reference in ifcopenshell.util.classification.get_references(space):
            text = " ".join(filter(None, (reference[1], reference.Name)))  # its code, its name
            if text:
                texts.append(("classification", text))
        if space.ObjectType:
            texts.append(("ObjectType", space.ObjectType))
        if texts:
            uses.setdefault(space.GlobalId, tuple(texts))
    return uses
