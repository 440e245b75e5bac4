"""Defects of a model that do not stop the rooms, but that its author would want to know."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import ifcopenshell
import numpy as np
from scipy.spatial import cKDTree

from bim.apertures import main_direction
from bim.boxes import Boxes
from bim.ifc.shapes import Shape
from bim.isolated_solids import gaps_between, solids_of
from bim.report.issue import Issue, Phrase
from bim.solids import PackedSolid, Solid, packed
from mitsuba_cfs.processes import ProcessEnded
from mitsuba_cfs.surfaces import area_vectors

DRAWN_TWICE = "element-drawn-twice"  # code of the issue
SAME_PLACE = 0.002  # boxes that agree to this are one element drawn twice [m]
SAME_AREA = 0.3  # if their surfaces agree to this share: only one may have its openings cut
SAME_MIDDLE = 0.2  # of the box's diagonal: both halves of a pane have one box
FLAT, UPRIGHT = 0.5, 1.5  # a slab is lower than this, a wall higher [m]
WIDEST_JOINT, CLOSEST = 0.05, 0.001  # walls this far apart were meant to meet [m]
ACROSS = 0.7  # cosine between the normals of walls that meet at a corner at the most
SOLID_CLASSES = ("IfcWall", "IfcSlab", "IfcRoof")
Solids = Mapping[int, Solid | ProcessEnded | None]  # by STEP number


def model_defects(model: ifcopenshell.file, shapes: Sequence[Shape]) -> list[Issue]:
    """Repeated GlobalIds, elements without a body, drawn twice, of a wrong class, open, apart."""
    checked = [shape for shape in shapes if shape.ifc_class.startswith(SOLID_CLASSES)]
    closed = solids_of([shape.triangles for shape in checked])
    solids = {shape.step_id: solid for shape, solid in zip(checked, closed, strict=True)}
    return [
        *repeated_guids(model),
        *without_body(model),
        *drawn_twice(shapes),
        *wrong_classes(shapes),
        *open_bodies(shapes, solids),
        *walls_apart(shapes, solids),
    ]


def repeated_guids(model: ifcopenshell.file) -> list[Issue]:
    """GlobalIds that more than one entity has."""
    counts = Counter(root.GlobalId for root in model.by_type("IfcRoot"))
    return [Issue("guid-repeated", guid, {"count": count}) for guid, count in counts.items() if count > 1]


def without_body(model: ifcopenshell.file) -> list[Issue]:
    """Walls, slabs and roofs that are neither drawn nor made of parts."""
    return [
        Issue("element-without-geometry", one.GlobalId, {"element": f"{one.is_a()} {one.Name or ''}"})
        for name in SOLID_CLASSES
        for one in model.by_type(name)
        if one.Representation is None and not one.IsDecomposedBy
    ]


def drawn_twice(shapes: Sequence[Shape]) -> list[Issue]:
    """Elements of one class with the same box, about the same surface and the same middle of it."""
    boxes, middles, areas = np.zeros((len(shapes), 6)), np.zeros((len(shapes), 3)), []
    by_class: dict[str, list[int]] = defaultdict(list)
    for number, shape in enumerate(shapes):
        corners = shape.triangles.reshape(-1, 3)
        sizes = np.linalg.norm(area_vectors(shape.triangles), axis=1)
        boxes[number] = [*corners.min(axis=0), *corners.max(axis=0)]
        areas.append(float(sizes.sum()))
        middles[number] = sizes @ shape.triangles.mean(axis=1) / max(areas[-1], 1e-12)
        by_class[shape.ifc_class.removesuffix("StandardCase")].append(number)
    earlier: dict[int, list[int]] = defaultdict(list)
    for numbers in by_class.values():
        pairs = cKDTree(boxes[numbers]).query_pairs(SAME_PLACE, p=np.inf)
        for first, second in pairs:
            earlier[numbers[second]].append(numbers[first])
    issues = []
    for number, others in sorted(earlier.items()):
        apart = SAME_MIDDLE * float(np.linalg.norm(boxes[number, 3:] - boxes[number, :3]))
        for other in sorted(others):
            near = np.linalg.norm(middles[number] - middles[other]) < apart
            if near and abs(areas[number] - areas[other]) < SAME_AREA * areas[number]:
                label = f"{shapes[number].ifc_class} {shapes[number].name}"
                values = {"element": label, "other": shapes[other].guid}
                issues.append(Issue(DRAWN_TWICE, shapes[number].guid, values))
                break
    return issues


def wrong_classes(shapes: Sequence[Shape]) -> list[Issue]:
    """Walls that lie flat and slabs that stand upright."""
    issues = []
    for shape in shapes:
        size = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
        vectors = area_vectors(shape.triangles)
        level = np.abs(vectors[:, 2]).sum() / max(np.linalg.norm(vectors, axis=1).sum(), 1e-12)
        wall = shape.ifc_class.startswith("IfcWall")
        if wall and size[2] < FLAT and min(size[:2]) > UPRIGHT and level > 0.8:
            code = "wall-lies-flat"
        elif shape.ifc_class.startswith("IfcSlab") and size[2] > UPRIGHT and level < 0.2:
            code = "slab-stands-upright"
        else:
            continue
        issues.append(Issue(code, shape.guid, {"element": f"{shape.ifc_class} {shape.name}"}))
    return issues


def open_bodies(shapes: Sequence[Shape], solids: Solids) -> list[Issue]:
    """Walls, slabs and roofs whose body is not a closed solid, or only after a repair."""
    issues = []
    for shape in shapes:
        if shape.step_id not in solids:
            continue
        solid = solids[shape.step_id]
        label = f"{shape.ifc_class} {shape.name}"
        if solid is None:
            issues.append(Issue("body-not-closed", shape.guid, {"element": label}))
        elif isinstance(solid, ProcessEnded):
            values = {"element": label, "reason": str(solid)}
            issues.append(Issue("body-not-computed", shape.guid, values))
        elif solid.repair not in ("", "welded"):
            values = {"element": label, "repair": Phrase(solid.repair)}
            issues.append(Issue("body-not-sound", shape.guid, values))
    return issues


def walls_apart(shapes: Sequence[Shape], solids: Solids) -> list[Issue]:
    """Walls across each other that nearly meet; leaves of one wall, side by side, are none."""
    walls = []
    for shape in shapes:
        solid = solids.get(shape.step_id)
        normal = main_direction(shape.triangles) if shape.ifc_class.startswith("IfcWall") else None
        if isinstance(solid, Solid) and normal is not None:
            box = solid.manifold.bounding_box()
            body = packed(solid.manifold)
            walls.append((shape, body, normal, np.array(box[:3]), np.array(box[3:])))
    ends = np.array([wall[3:] for wall in walls]).reshape(-1, 2, 3)
    pairs: dict[int, list[int]] = {}
    for i, j in Boxes(ends[:, 0], ends[:, 1]).pairs(WIDEST_JOINT):
        if abs(walls[i][2] @ walls[j][2]) <= ACROSS:
            pairs.setdefault(i, []).append(j)
    near = [(*walls[i][:2], [walls[j][:2] for j in others]) for i, others in pairs.items()]
    return _gap_issues(near)


def _gap_issues(near: Sequence[tuple[Shape, PackedSolid, list[Any]]]) -> list[Issue]:
    """Walls, each with its neighbours: those that do not meet."""
    bodies = [(body, [its_body for _, its_body in others]) for _, body, others in near]
    issues = []
    for (one, _, others), gaps in zip(near, gaps_between(bodies, WIDEST_JOINT), strict=True):
        if isinstance(gaps, ProcessEnded):
            values = {"element": f"{one.ifc_class} {one.name}", "reason": str(gaps)}
            issues.append(Issue("wall-distance-not-computed", one.guid, values))
            continue
        for (other, _), gap in zip(others, gaps, strict=True):
            if CLOSEST < gap < WIDEST_JOINT:
                values = {"wall": one.name, "other": other.name, "gap_mm": 1000 * gap}
                issues.append(Issue("walls-do-not-meet", one.guid, values))
    return issues
