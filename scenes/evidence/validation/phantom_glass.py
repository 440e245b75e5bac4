"""Glass of IFC files counted by ifcopenshell alone, against the glass that the rooms here have.

    python -m scenes.evidence.validation.phantom_glass FILES... [--misses]

The count knows nothing of `bim` but the areas of the windows that it judges.  Real glass of an
element is the outline of its own transparent triangles across their main direction; of a window
without any, all of it less the lining that it states, or 0.7 of it ("assumed").  Doors, plates and
members without transparent triangles have none, nor have members narrower than 0.2 m, the bars of
a frame; walls, slabs, roofs, coverings and proxies have some only where a material or a style
names glass or a clear plastic; virtual elements have none.

Phantom glass: what rooms here have beyond that, all that faces down, and what lies twice in one
place.  Glass before a space: real glass of windows, doors and plates, drawn twice or once, with an
IfcSpace of the file on one side and none on the other by 100 points of each, whatever became of
that space here.  Left: real glass of such elements that no room here has, between rooms or before
none; of it told: what a problem of the building is about, by the GUID of the element or of what it
is part of.
"""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element as element_of
import ifcopenshell.util.unit
import numpy as np
import shapely
from numpy.typing import NDArray

from bim.ifc.building import read_ifc
from bim.ifc.project import open_ifc
from bim.model import Window
from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.processes import process_pool

GLAZED = ("IfcWindow", "IfcDoor", "IfcPlate", "IfcMember", "IfcCurtainWall")
NAMES = re.compile(
    r"gla[sz]|verre|vitr|crist|vidr|vetr[oa]|szk|sklo|polycarb|plexi|acryl|pmma|ガラス|玻璃|стекл",
    re.I,
)
BAR = 0.2  # narrower members are bars [m]
CLEAR = 0.25  # transparency of a style from which on it is glass
FRAMED = 0.7  # of a window whose glass is not drawn
EXACT = 0.01  # areas that agree so are the same
DOWN = -0.5  # z of the outward normal of glass that faces down
NEAR = 0.3  # two panes nearer than this, one over the other, are one window [m]
STEPS = np.array([0.15, 0.3, 0.5, 0.8])  # off the glass, where a room is looked for [m]
POINTS = 100  # of a pane
ROUGH = 0.03  # error of a share by so many points


@dataclass(frozen=True, slots=True)
class Counted:
    """Areas [m2] of one file."""

    file: str
    used: float = 0.0  # in rooms here
    drawn: float = 0.0  # of it: real, and drawn
    assumed: float = 0.0  # of it: of windows whose glass is not drawn
    empty: float = 0.0  # of it: in openings that the file leaves empty
    beyond: float = 0.0  # of it: more than the element has, or of an element without glass
    down: float = 0.0  # of it: facing down
    twice: float = 0.0  # of it: over other glass
    before: float = 0.0  # real glass before an IfcSpace
    before_used: float = 0.0  # of it: in rooms here
    left: float = 0.0  # real glass that no room here has
    told: float = 0.0  # of it: with a problem of its own
    misses: tuple[str, ...] = ()
    refused: str = ""

    @property
    def phantom(self) -> float:
        """All that is none [m2]."""
        return self.beyond + self.down + self.twice


@dataclass(frozen=True, slots=True)
class Pane:
    """Real glass of one element."""

    area: float  # [m2]
    kind: str  # "drawn", "assumed", "empty" or "none"
    inside: float = 0.0  # share of it with an IfcSpace on one side, none on the other


def counted(path: Path) -> Counted:
    """The glass of the rooms of a file, judged."""
    try:
        building = read_ifc(path)
        model = open_ifc(path)
    except CfsError as error:
        return Counted(path.name, refused=str(error).split(": ", 1)[-1])
    windows = [w for space in building.spaces for w in space.windows]
    ours: dict[str, float] = defaultdict(float)
    down, misses = 0.0, []
    for window in windows:
        if window.normal[2] < DOWN:
            down += window.area
            misses.append(f"{_said(model, window.guid)}: {window.area:.2f} face down")
        else:
            ours[window.guid] += window.area
    real = real_glass(model, set(ours))
    parts: dict[str, float] = defaultdict(float)
    for guid, area in ours.items():
        pane = real.get(guid, Pane(0.0, "none"))
        parts[pane.kind] += min(area, pane.area)
        more = area - pane.area if area > (1 + EXACT) * pane.area else 0.0
        parts["beyond"] += more
        misses += [f"{_said(model, guid)}: {area:.2f}, real {pane.area:.2f}"] if more > 0 else []
    lost = {g: p.area * p.inside - ours.get(g, 0.0) for g, p in real.items()}
    lost = {g: a for g, a in lost.items() if a > ROUGH * real[g].area}
    misses += [f"{_said(model, guid)}: {area:.2f} not used" for guid, area in lost.items()]
    before = sum(pane.area * pane.inside for pane in real.values())
    left = {guid: pane.area - ours.get(guid, 0.0) for guid, pane in real.items()}
    left = {guid: area for guid, area in left.items() if area > ROUGH * real[guid].area}
    named = {problem.where for problem in building.problems}
    silent = {g: a for g, a in left.items() if named.isdisjoint(_with_wholes(model, g))}
    misses += [f"{_said(model, g)}: {area:.2f} left in silence" for g, area in silent.items()]
    left_area = sum(left.values())
    return Counted(
        path.name, sum(ours.values()) + down, parts["drawn"], parts["assumed"], parts["empty"],
        parts["beyond"], down, twice(windows), before, before - sum(lost.values()), left_area,
        left_area - sum(silent.values()), tuple(misses),
    )  # fmt: skip


def _with_wholes(model: ifcopenshell.file, guid: str) -> set[str]:
    """GUIDs of an element and of all that it is a part of."""
    found, element = {guid}, model.by_guid(guid)
    while (whole := element_of.get_aggregate(element)) is not None:
        found.add(whole.GlobalId)
        element = whole
    return found


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
    spaces = [
        triangles for triangles, _ in dict(_meshes(model, model.by_type("IfcSpace"))).values()
    ]
    return {
        guid: _pane(element, *bodies[element.id()], spaces)
        for guid, element in wanted.items() if element.id() in bodies
    }  # fmt: skip


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
    if element.is_a("IfcVirtualElement") or not (
        element.is_a().startswith(GLAZED) or NAMES.search(_names(element))
    ):
        return Pane(0.0, "none")
    if clear.any():
        if element.is_a("IfcMember") and _width(triangles) < BAR:
            return Pane(0.0, "none")
        outline, frame = _outline(triangles[clear])
        return Pane(outline.area, "drawn", _before_a_room(outline, frame, spaces))
    if not element.is_a("IfcWindow"):
        return Pane(0.0, "none")
    outline, frame = _outline(triangles)
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
        style.Name or ""
        for item in element_of.get_styles(element) or ()
        for style in [item] if hasattr(style, "Name")
    ]  # fmt: skip
    return " ".join([*(m.Name or "" for m in element_of.get_materials(element)), *styles])


def _outline(triangles: NDArray) -> tuple[shapely.Geometry, tuple[NDArray, NDArray]]:
    """Outline across the direction of the largest faces, and the plane: a point, axes [3, 3]."""
    vectors = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(vectors, axis=1)
    solid = areas > 1e-9
    units = vectors[solid] / areas[solid, None]
    aligned = np.abs(units @ units.T) > 0.95
    normal = units[np.argmax(aligned @ areas[solid])]
    facing = aligned[np.argmax(aligned @ areas[solid])]
    aside = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(aside, normal) / np.linalg.norm(np.cross(aside, normal))
    axes = np.stack([u, np.cross(normal, u), normal])
    own = triangles[solid][facing]
    flat = shapely.polygons((own @ axes.T)[..., :2])
    outline = shapely.union_all(shapely.buffer(flat, 1e-4))
    return outline, ((own.reshape(-1, 3) @ normal).mean() * normal, axes)


def _before_a_room(outline, frame, spaces: Sequence[NDArray]) -> float:
    """Share of the glass with an IfcSpace on one side and none on the other."""
    origin, axes = frame
    flat = np.array([p.coords[0] for p in _points(outline)]).reshape(-1, 2)
    if not len(flat):
        return 0.0
    points = flat @ axes[:2] + origin
    sides = [
        np.any([_within(points + s * step * axes[2], spaces) for step in STEPS], axis=0)
        for s in (1.0, -1.0)
    ]
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
            *(r.RelatingPropertyDefinition for r in getattr(source, "IsDefinedBy", None) or ()
              if r.is_a("IfcRelDefinesByProperties")),
        ]  # fmt: skip
        for one in sets:
            if one.is_a("IfcWindowLiningProperties"):
                total += (one.LiningThickness or 0.0) * scale
            elif one.is_a("IfcWindowPanelProperties"):
                total += (one.FrameThickness or 0.0) * scale
        if total:
            break
    return total


def twice(windows: Sequence[Window]) -> float:
    """Glass [m2] that lies over other glass that is as good as parallel to it."""
    area = 0.0
    for i, one in enumerate(windows):
        reach = np.ptp(one.triangles.reshape(-1, 3), axis=0).max()
        for other in windows[i + 1 :]:
            if abs(one.normal @ other.normal) < 0.99:
                continue
            apart = other.centre - one.centre
            if abs(apart @ one.normal) > NEAR or np.linalg.norm(apart) > 10 * reach:
                continue
            area += _overlap(one, other)
    return area


def _overlap(one: Window, other: Window) -> float:
    aside = np.eye(3)[np.argmin(np.abs(one.normal))]
    u = np.cross(aside, one.normal) / np.linalg.norm(np.cross(aside, one.normal))
    axes = np.stack([u, np.cross(one.normal, u)])
    flat = [shapely.union_all(shapely.polygons(w.triangles @ axes.T)) for w in (one, other)]
    shared = flat[0].intersection(flat[1]).area
    return float(shared) if shared > EXACT * min(one.area, other.area) else 0.0


def _said(model, guid: str) -> str:
    try:
        element = model.by_guid(guid)
    except RuntimeError:
        return guid
    return f"{element.is_a()} {element.Name or ''} {guid}"


def table(rows: Sequence[Counted]) -> str:
    """Markdown table of the files and their sum."""
    head = (
        "| file | glass m2 | drawn | assumed | in empty openings | phantom "
        "| before a space | of it used | left | of it told |"
    )
    lines = [head, "|---" * 10 + "|"]
    for r in rows:
        if r.refused:
            lines.append(f"| {r.file} | refused: {r.refused} | | | | | | | | |")
            continue
        share, told = _share(r.before_used, r.before), _share(r.told, r.left)
        lines.append(
            f"| {r.file} | {r.used:.1f} | {r.drawn:.1f} | {r.assumed:.1f} | {r.empty:.1f} "
            f"| {r.phantom:.2f} | {r.before:.1f} | {share} | {r.left:.1f} | {told} |"
        )
    sums = [sum(getattr(r, name) for r in rows) for name in (
        "used", "drawn", "assumed", "empty", "phantom", "before", "before_used",
        "left", "told")]  # fmt: skip
    lines.append(
        f"| all | {sums[0]:.1f} | {sums[1]:.1f} | {sums[2]:.1f} | {sums[3]:.1f} | {sums[4]:.2f} "
        f"| {sums[5]:.1f} | {_share(sums[6], sums[5])} "
        f"| {sums[7]:.1f} | {_share(sums[8], sums[7])} |"
    )
    return "\n".join(lines)


def _share(part: float, whole: float) -> str:
    return f"{100 * part / whole:.1f} %" if whole > EXACT else "-"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and with `--misses` the elements that miss."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--misses", action="store_true", help="name the elements that differ")
    options = parser.parse_args(arguments)
    rows = []
    for path in options.files:
        with process_pool(1) as pool:
            try:
                rows.append(pool.submit(counted, path).result())
            except BrokenProcessPool:
                rows.append(Counted(path.name, refused="its process was ended"))
        if options.misses:
            print(
                rows[-1].file,
                f"phantom {rows[-1].phantom:.2f} (down {rows[-1].down:.2f}, "
                f"twice {rows[-1].twice:.2f})",
                *rows[-1].misses,
                sep="\n  ",
                flush=True,
            )
    print(table(rows))


if __name__ == "__main__":
    main()
