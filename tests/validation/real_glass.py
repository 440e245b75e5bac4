"""Glass that elements of an IFC file have, by ifcopenshell alone; see `phantom_glass`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element as element_of
import ifcopenshell.util.unit
import numpy as np
import shapely
from numpy.typing import NDArray

GLAZED = ("IfcWindow", "IfcDoor", "IfcPlate", "IfcMember", "IfcCurtainWall")
NAMES = re.compile(r"gla[sz]|verre|vitr|crist|vidr|vetr[oa]|szk|sklo|polycarb|plexi|acryl|pmma|ガラス|玻璃|стекл", re.I)
BAR = 0.2  # narrower members are bars [m]
CLEAR = 0.25  # transparency of a style from which on it is glass
FRAMED = 0.7  # of a window whose glass is not drawn
UNLIKE, ALIKE = 0.1, 0.05  # logarithms of ratios of a drawn to a stated area
STEPS = np.array([0.15, 0.3, 0.5, 0.8])  # off the glass, where a room is looked for [m]
POINTS = 100  # of a pane


@dataclass(frozen=True, slots=True)
class Pane:
    """Real glass of one element."""

    area: float  # [m2]
    kind: str  # "drawn", "assumed", "empty" or "none"
    inside: float = 0.0  # share of it with an IfcSpace on one side, none on the other


def real_glass(model: ifcopenshell.file, more: set[str]) -> dict[str, Pane]:
    """Glass of windows, doors and plates, and of the elements of the GUIDs `more`."""
    wanted = {}
    for name in ("IfcWindow", "IfcDoor", "IfcPlate"):
        wanted |= {e.GlobalId: e for e in model.by_type(name)}
    for guid in more - set(wanted):
        try:
            wanted[guid] = model.by_guid(guid)
        except RuntimeError:
            continue
    bodies = dict(_meshes(model, list(wanted.values())))
    bodies = _each_once(bodies, [element.id() for guid, element in wanted.items() if guid in more])
    spaces = [triangles for triangles, _ in dict(_meshes(model, model.by_type("IfcSpace"))).values()]
    return {
        guid: _pane(element, *bodies[element.id()], spaces)
        for guid, element in wanted.items()
        if element.id() in bodies
    }


def _each_once(bodies: dict, first: Sequence[int]) -> dict:
    """The bodies without those that lie where another one does; those of `first` are kept."""
    kept: dict[tuple, int] = {}
    for key in sorted(bodies, key=lambda key: key not in set(first)):
        corners = bodies[key][0].reshape(-1, 3)
        box = tuple(np.concatenate([corners.min(axis=0), corners.max(axis=0)]).round(2))
        if key in first or box not in kept:
            kept[box if box not in kept else (key,)] = key
    return {key: bodies[key] for key in kept.values()}


def _meshes(model, elements) -> Iterator[tuple[int, tuple[NDArray, NDArray]]]:
    """STEP id, triangles [N, 3, 3] [m] and whether each is transparent [N]."""
    elements = [e for e in elements if e.Representation is not None]
    if not elements:
        return
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    settings.set("apply-default-materials", False)
    iterator = ifcopenshell.geom.iterator(settings, model, 1, include=elements)
    going = iterator.initialize()
    while going:
        shape = iterator.get()
        body = shape.geometry
        faces = np.array(body.faces, dtype=int).reshape(-1, 3)
        vertices = np.array(body.verts).reshape(-1, 3)
        clear = np.array([_is_clear(style) for style in body.materials] + [False])
        style = np.array(body.material_ids, dtype=int)
        style = style if len(style) == len(faces) else np.full(len(faces), -1)
        yield shape.id, (vertices[faces], clear[style])
        going = iterator.next()


def _is_clear(style) -> bool:
    return bool(np.isfinite(style.transparency) and style.transparency > CLEAR)


def _pane(element, triangles: NDArray, clear: NDArray, spaces: Sequence[NDArray]) -> Pane:
    if element.is_a("IfcOpeningElement"):
        outline, _ = _outline(triangles)
        return Pane(outline.area, "empty")
    if element.is_a("IfcVirtualElement") or not (element.is_a().startswith(GLAZED) or NAMES.search(_names(element))):
        return Pane(0.0, "none")
    if clear.any():
        if element.is_a("IfcMember") and _width(triangles) < BAR:
            return Pane(0.0, "none")
        outline, frame = _outline(triangles[clear])
        return Pane(outline.area, "drawn", _before_a_room(outline, frame, spaces))
    if not element.is_a("IfcWindow"):
        return Pane(0.0, "none")
    outline, frame = _outline(triangles, stated_area(element))
    lining = _lining(element)
    glass = outline.buffer(-lining, join_style="mitre") if lining else outline
    area = glass.area if lining else FRAMED * outline.area
    return Pane(area, "assumed", _before_a_room(outline, frame, spaces))


def _width(triangles: NDArray) -> float:
    """The second of the three sizes of a body along the axes of its plane and across."""
    _, (_, axes) = _outline(triangles)
    corners = triangles.reshape(-1, 3) @ axes.T
    return float(np.sort(np.ptp(corners, axis=0))[1])


def _names(element) -> str:
    """Names of the materials and styles of an element."""
    styles = [
        style.Name or "" for item in element_of.get_styles(element) or () for style in [item] if hasattr(style, "Name")
    ]
    return " ".join([*(m.Name or "" for m in element_of.get_materials(element)), *styles])


def _outline(triangles: NDArray, stated: float = 0.0) -> tuple[shapely.Geometry, tuple[NDArray, NDArray]]:
    """Outline across the direction of the largest faces, and the plane: a point, axes [3, 3].

    Args: stated: area [m2] that the whole is said to have: where that across the largest faces is
        another and that across others agrees, these are the front.
    """
    vectors = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(vectors, axis=1)
    solid = areas > 1e-9
    units = vectors[solid] / areas[solid, None]
    aligned = np.abs(units @ units.T) > 0.95
    weight = aligned @ areas[solid]
    if stated:
        hulls = np.array([_hull_area(triangles, normal) for normal in units])
        off = np.abs(np.log(np.maximum(hulls, 1e-9) / stated))
        if off[np.argmax(weight)] > UNLIKE and off.min() < ALIKE:
            weight = -off
    normal = units[np.argmax(weight)]
    facing = aligned[np.argmax(weight)]
    aside = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(aside, normal) / np.linalg.norm(np.cross(aside, normal))
    axes = np.stack([u, np.cross(normal, u), normal])
    own = triangles[solid][facing]
    flat = shapely.polygons((own @ axes.T)[..., :2])
    outline = shapely.union_all(shapely.buffer(flat, 1e-4))
    return outline, ((own.reshape(-1, 3) @ normal).mean() * normal, axes)


def _hull_area(triangles: NDArray, normal: NDArray) -> float:
    """Area [m2] of the convex hull of triangles seen along a direction."""
    flat = triangles.reshape(-1, 3) @ np.linalg.svd(normal[None])[2][1:].T
    return shapely.convex_hull(shapely.multipoints(flat)).area


def stated_area(element) -> float:
    """Width by height as the file states them [m2]; 0 where it does not."""
    scale = ifcopenshell.util.unit.calculate_unit_scale(element.file)
    width, height = getattr(element, "OverallWidth", None), getattr(element, "OverallHeight", None)
    return (width or 0.0) * (height or 0.0) * scale**2


def _before_a_room(outline, frame, spaces: Sequence[NDArray]) -> float:
    """Share of the glass with an IfcSpace on one side and none on the other."""
    origin, axes = frame
    flat = np.array([p.coords[0] for p in _points(outline)]).reshape(-1, 2)
    if not len(flat):
        return 0.0
    points = flat @ axes[:2] + origin
    sides = [np.any([_within(points + s * step * axes[2], spaces) for step in STEPS], axis=0) for s in (1.0, -1.0)]
    return float(np.mean(sides[0] ^ sides[1]))


def _points(outline) -> list[shapely.Point]:
    """Points in the glass, the same at each run."""
    low_x, low_y, high_x, high_y = outline.bounds
    number = np.arange(1, 3 * POINTS + 1)
    x = low_x + (high_x - low_x) * (number * 0.7548776662 % 1)
    y = low_y + (high_y - low_y) * (number * 0.5698402910 % 1)
    return [p for p in shapely.points(x, y) if outline.contains(p)][:POINTS]


def _within(points: NDArray, bodies: Sequence[NDArray]) -> NDArray[np.bool_]:
    """Which points [P] lie within one of the bodies, by the solid angle of its triangles."""
    found = np.zeros(len(points), dtype=bool)
    for body in bodies:
        low, high = body.min(axis=(0, 1)), body.max(axis=(0, 1))
        near = np.flatnonzero(np.all((points > low) & (points < high), axis=1) & ~found)
        for i in near:
            a, b, c = (body[:, k] - points[i] for k in range(3))
            la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
            over = np.einsum("ij,ij->i", a, np.cross(b, c))
            under = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
            found[i] = abs(2 * np.arctan2(over, under).sum()) > 2 * np.pi
    return found


def _lining(element) -> float:
    """Stated width of lining and panel frame [m]; 0 where the file states none."""
    scale = ifcopenshell.util.unit.calculate_unit_scale(element.file)
    total = 0.0
    for source in (element_of.get_type(element), element):
        sets = [
            *(getattr(source, "HasPropertySets", None) or ()),
            *(
                r.RelatingPropertyDefinition
                for r in getattr(source, "IsDefinedBy", None) or ()
                if r.is_a("IfcRelDefinesByProperties")
            ),
        ]
        for one in sets:
            if one.is_a("IfcWindowLiningProperties"):
                total += (one.LiningThickness or 0.0) * scale
            elif one.is_a("IfcWindowPanelProperties"):
                total += (one.FrameThickness or 0.0) * scale
        if total:
            break
    return total
