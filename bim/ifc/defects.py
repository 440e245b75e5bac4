"""Defects of a model that do not stop the rooms, but that its author would want to know."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import ifcopenshell
import numpy as np

from bim.ifc.shapes import Shape
from bim.model import Problem
from bim.planes import area_vectors
from bim.solids import solid_of

SAME_PLACE = 0.002  # boxes that agree to this are one element drawn twice [m]
SAME_AREA = 0.3  # if their surfaces agree to this share: only one may have its openings cut
FLAT, UPRIGHT = 0.5, 1.5  # a slab is lower than this, a wall higher [m]
SOLID_CLASSES = ("IfcWall", "IfcSlab", "IfcRoof")


def model_defects(model: ifcopenshell.file, shapes: Sequence[Shape]) -> list[Problem]:
    """Repeated GlobalIds, elements drawn twice, wrong classes, open bodies, unused boundaries."""
    return [
        *repeated_guids(model),
        *drawn_twice(shapes),
        *wrong_classes(shapes),
        *open_bodies(shapes),
        *unused_boundaries(model),
    ]


def repeated_guids(model: ifcopenshell.file) -> list[Problem]:
    """GlobalIds that more than one entity has."""
    counts = Counter(root.GlobalId for root in model.by_type("IfcRoot"))
    return [
        Problem(guid, f"GlobalId is used {count} times", "entities are told apart by STEP number")
        for guid, count in counts.items()
        if count > 1
    ]


def drawn_twice(shapes: Sequence[Shape]) -> list[Problem]:
    """Elements of one class with the same box and about the same surface."""
    seen: dict[str, list[tuple[Shape, np.ndarray, float]]] = defaultdict(list)
    problems = []
    for shape in shapes:
        corners = shape.triangles.reshape(-1, 3)
        area = float(np.linalg.norm(area_vectors(shape.triangles), axis=1).sum())
        box = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
        bucket = seen[shape.ifc_class.removesuffix("StandardCase")]
        for other, theirs, their_area in bucket:
            same = np.abs(box - theirs).max() < SAME_PLACE
            if same and abs(area - their_area) < SAME_AREA * area:
                what = f"{shape.ifc_class} {shape.name}: lies where {other.guid} lies"
                problems.append(Problem(shape.guid, what, "drawn twice: both are kept"))
                break
        bucket.append((shape, box, area))
    return problems


def wrong_classes(shapes: Sequence[Shape]) -> list[Problem]:
    """Walls that lie flat and slabs that stand upright."""
    problems = []
    for shape in shapes:
        size = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
        vectors = area_vectors(shape.triangles)
        level = np.abs(vectors[:, 2]).sum() / max(np.linalg.norm(vectors, axis=1).sum(), 1e-12)
        wall = shape.ifc_class.startswith("IfcWall")
        if wall and size[2] < FLAT and min(size[:2]) > UPRIGHT and level > 0.8:
            what = f"{shape.ifc_class} {shape.name}: lies flat like a slab"
        elif shape.ifc_class.startswith("IfcSlab") and size[2] > UPRIGHT and level < 0.2:
            what = f"{shape.ifc_class} {shape.name}: stands upright like a wall"
        else:
            continue
        problems.append(Problem(shape.guid, what, "faces are named by their slope, not by class"))
    return problems


def open_bodies(shapes: Sequence[Shape]) -> list[Problem]:
    """Walls, slabs and roofs whose body is not a closed solid, or only after a repair."""
    problems = []
    for shape in shapes:
        if not shape.ifc_class.startswith(SOLID_CLASSES):
            continue
        solid = solid_of(shape.triangles)
        label = f"{shape.ifc_class} {shape.name}"
        if solid is None:
            what = f"{label}: its body is no closed solid"
            problems.append(Problem(shape.guid, what, "its surfaces are used as they are"))
        elif solid.repair not in ("", "welded"):
            what = f"{label}: its body is not sound ({solid.repair})"
            problems.append(Problem(shape.guid, what, "its surfaces are used as they are"))
    return problems


def unused_boundaries(model: ifcopenshell.file) -> list[Problem]:
    """A note that the file's space boundaries are not relied on."""
    count = len(model.by_type("IfcRelSpaceBoundary"))
    if not count:
        return []
    what = f"has {count} space boundaries"
    return [Problem("IfcRelSpaceBoundary", what, "not used: neighbours are found from geometry")]
