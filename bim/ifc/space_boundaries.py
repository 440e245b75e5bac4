"""Second-level space boundaries of an IFC file beside those found from geometry.

Neighbours and areas are always our own (`bim.neighbours`); the file's are compared with them by
room and element, so that a reader sees where an energy tool that takes the file's would differ.
Compared are the areas, and whether the open air or the ground lies beyond.  A wall's boundary holds
its windows and doors in some files and not in others: either agrees.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bim.ifc.damage import entities
from bim.ifc.project import length_scale
from bim.ifc.source import Source
from bim.model import Face, Space
from bim.planes import newell_normal
from bim.report.issue import Issue

SAME_SHARE, SAME_AREA = 0.05, 0.2  # areas that differ by less agree: share, and [m2]
RELATION = "IfcRelSpaceBoundary"
# our words for theirs; most files have EXTERNAL for the ground too, IFC2X3 no other word
OUTSIDE = {"EXTERNAL": ("outside", "ground"), "EXTERNAL_EARTH": ("ground",)}
INSIDE = ("space", "adiabatic", "unknown")


@dataclass(slots=True)
class _Stated:
    """What the file says of one element at one room."""

    area: float = 0.0  # [m2]
    beyond: dict[str, float] = field(default_factory=lambda: defaultdict(float))  # area by word


def boundary_issues(source: Source, spaces: Sequence[Space]) -> list[Issue]:
    """How the file's second-level boundaries differ from the rooms' faces."""
    model = source.model
    relations = model.by_type(RELATION)
    second = [one for one in relations if _is_second_level(one)]
    if not relations:
        return []
    if not second:
        return [Issue("boundaries-first-level", RELATION, {"count": len(relations)})]
    stated, unread = _stated(second, length_scale(model))
    rooms = {space.guid: space for space in spaces}
    issues, compared = [], 0
    hosts = _hosts(model)
    for (room, element), boundary in stated.items():
        if room not in rooms:
            continue
        compared += 1
        issues += _differences(model.by_guid(element), boundary, rooms[room], hosts)
    differing = len({(i.where, i.values["room"]) for i in issues})
    values = {
        "count": len(second),
        "pairs": compared,
        "agreeing": compared - differing,
        "percent": 100 * SAME_SHARE,
        "unread": unread,
    }
    return [Issue("boundaries-compared", RELATION, values), *issues]


def _hosts(model: ifcopenshell.file) -> dict[str, str]:
    """GUID of the element that each window or door is in."""
    return {
        fills.RelatedBuildingElement.GlobalId: voids.RelatingBuildingElement.GlobalId
        for fills in model.by_type("IfcRelFillsElement")
        for voids in fills.RelatingOpeningElement.VoidsElements or ()
    }


def _is_second_level(relation: ifcopenshell.entity_instance) -> bool:
    text = f"{relation.is_a()} {relation.Name or ''} {relation.Description or ''}".lower()
    return any(word in text for word in ("2ndlevel", "second level", "2a", "2b"))


def _stated(
    relations: Sequence[ifcopenshell.entity_instance], scale: float
) -> tuple[dict[tuple[str, str], _Stated], int]:
    """The file's boundaries by GUID of room and element, and how many could not be read."""
    stated: dict[tuple[str, str], _Stated] = defaultdict(_Stated)
    unread = 0
    for one in relations:
        element, room = one.RelatedBuildingElement, one.RelatingSpace
        # type 2b ends at a wall, so that nothing of it passes to a neighbour: ours are adiabatic
        if element is None or room is None or one.PhysicalOrVirtualBoundary == "VIRTUAL":
            continue
        geometry = getattr(one, "ConnectionGeometry", None)
        surfaces = entities(getattr(geometry, "SurfaceOnRelatingElement", None))
        area = _area(surfaces[0]) if surfaces else None
        if area is None:
            unread += 1
            continue
        entry = stated[room.GlobalId, element.GlobalId]
        entry.area += area * scale**2
        entry.beyond[one.InternalOrExternalBoundary or ""] += area * scale**2
    return dict(stated), unread


def _area(surface: ifcopenshell.entity_instance) -> float | None:
    """Area of a plane boundary in the file's units squared; None where its curves are others."""
    if surface.is_a("IfcCurveBoundedPlane"):
        outer = [_ring_area(curve) for curve in entities(surface.OuterBoundary)]
        inner = [_ring_area(curve) for curve in entities(surface.InnerBoundaries)]
        areas = [area for area in inner if area is not None]
        if len(outer) != 1 or outer[0] is None or len(areas) < len(inner):
            return None
        return outer[0] - sum(areas)
    if surface.is_a("IfcSurfaceOfLinearExtrusion"):
        curves = entities(getattr(surface.SweptCurve, "Curve", None))
        points = _points(curves[0]) if curves else None
        if points is None or not isinstance(surface.Depth, float):
            return None
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() * surface.Depth)
    return None


def _ring_area(curve: ifcopenshell.entity_instance) -> float | None:
    points = _points(curve)
    if points is None or len(points) < 3:
        return None
    return float(np.linalg.norm(newell_normal(points)))


def _points(curve: ifcopenshell.entity_instance) -> NDArray[np.float64] | None:
    """Corners [N, 3] of a curve made of straight lines; None of any other."""
    if curve.is_a("IfcPolyline"):
        rows = [getattr(point, "Coordinates", None) for point in entities(curve.Points)]
        sizes = {len(row) if isinstance(row, tuple) else 0 for row in rows}
        if sizes not in ({2}, {3}):
            return None
        flat = np.array(rows, dtype=float)
        return np.pad(flat, ((0, 0), (0, 3 - flat.shape[1])))
    if curve.is_a("IfcCompositeCurve"):
        turned = []
        for segment in entities(curve.Segments):
            parents = entities(getattr(segment, "ParentCurve", None))
            part = _points(parents[0]) if parents else None
            if part is None:
                return None
            turned.append(part if segment.SameSense else part[::-1])
        return np.concatenate(turned) if turned else None
    return None


def _differences(
    element: ifcopenshell.entity_instance, boundary: _Stated, room: Space, hosts: Mapping[str, str]
) -> list[Issue]:
    """What the file says otherwise of one element at a room."""
    faces = [f for f in room.faces if f.element == element.GlobalId and f.kind != "reveal"]
    net, gross = _own_areas(element.GlobalId, faces, room, hosts)
    values = {"element": f"{element.is_a()} {element.Name or ''}", "room": room.label}
    between = net < boundary.area < gross  # with some of its openings
    if not (between or _agree(boundary.area, net) or _agree(boundary.area, gross)):
        areas = {"stated": boundary.area, "net": net, "gross": gross}
        code = "boundary-area-differs" if net else "boundary-without-face"
        return [Issue(code, element.GlobalId, values | areas)]
    word = max(boundary.beyond, key=lambda key: boundary.beyond[key])
    beyond: Mapping[str, float] = _by_adjacency(faces)
    if not beyond or word not in (*OUTSIDE, "INTERNAL"):
        return []
    computed = max(beyond, key=lambda key: beyond[key])
    if computed in OUTSIDE.get(word, INSIDE):
        return []
    neighbours = {"stated": word.lower(), "computed": computed}
    return [Issue("boundary-neighbour-differs", element.GlobalId, values | neighbours)]


def _own_areas(guid: str, faces: Sequence[Face], room: Space, hosts: Mapping[str, str]) -> tuple[float, float]:
    """Area [m2] of an element at a room: without the openings in it, and with them."""
    same_window = [window for window in room.windows if window.guid == guid]
    if same_window:
        glass = sum(window.area for window in same_window)
        return glass, max(sum(window.opening_area for window in same_window), glass)
    net = sum(face.area for face in faces)
    inner = [f for f in room.faces if f.kind != "reveal" and hosts.get(f.element or "") == guid]
    lit = {w.guid for w in room.windows}  # frames of these are in their openings' area
    openings = sum(w.opening_area for w in room.windows if w.host == guid)
    return net, net + openings + sum(f.area for f in inner if f.element not in lit)


def _by_adjacency(faces: Sequence[Face]) -> dict[str, float]:
    areas: dict[str, float] = defaultdict(float)
    for face in faces:
        areas[face.adjacency] += face.area
    return areas


def _agree(one: float, other: float) -> bool:
    return abs(one - other) < max(SAME_AREA, SAME_SHARE * max(one, other))
