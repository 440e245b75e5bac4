"""Rooms that a file draws as polygons with openings in them, closed and wound alike.

honeybee and gbXML draw a room so: walls without thickness, openings in their plane.  Corners that
lie within a tolerance are one, so that neighbouring polygons meet; every opening is cut out of its
wall; polygons that are not plane are cut into triangles.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bim.boundaries import floor_area
from bim.defaults import EMISSIVITY, GLASS_REFLECTANCE, ROOM_REFLECTANCE, default_construction, glass_construction
from bim.fenestration import PlainGlass, ShadingState
from bim.mesh_repair import wound_alike
from bim.model import Construction, Face, Space, Window
from bim.planes import Facet, Plane, newell_normal, plane_through, polygons_of, triangulated
from bim.report.issue import Effect, Issue
from bim.shell import conforming_triangles, enclosed_volume, open_edges, welded
from bim.soundness import soundness_issues
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.gloss import Gloss

TOLERANCE = 0.005  # corners nearer than this are one: half of honeybee's own tolerance [m]
FLAT = 1e-4  # a polygon whose corners lie further from its plane is cut into triangles [m]
OFF_THE_WALL = 0.1  # an opening this far before its wall is none of it [m]
MOST_OUTSIDE = 0.01  # share of an opening that may lie beside its wall unsaid


@dataclass(frozen=True, slots=True)
class SurfaceFinish:
    """What a file says of a surface; None where it says nothing."""

    construction: Construction | None = None
    visible: float | None = None  # diffuse reflectances towards the room
    solar: float | None = None
    emissivity: float = EMISSIVITY
    gloss: Gloss | None = None
    outer: float | None = None  # visible reflectance of the other side

    def turned(self) -> SurfaceFinish:
        """The finish as the room on the other side has it."""
        one = self.construction
        layers = None if one is None else replace(one, layers=one.layers[::-1])
        return replace(self, construction=layers, visible=self.outer, outer=self.visible)


@dataclass(frozen=True, slots=True)
class GlazingValues:
    """What a file states of a glazing at normal incidence."""

    u_value: float | None = None  # [W/(m2 K)]
    g_value: float | None = None
    visible: float | None = None  # transmittances
    solar: float | None = None
    panes: int | None = None
    name: str = ""
    glass: PlainGlass | None = None  # of which `visible` is the transmittance


@dataclass(frozen=True, slots=True)
class DrawnOpening:
    """A window or door as a polygon in its wall."""

    guid: str
    name: str
    ring: NDArray[np.float64]  # [N, 3] [m]
    finish: SurfaceFinish = SurfaceFinish()
    glazing: GlazingValues | None = None  # None: an opaque door
    states: tuple[ShadingState, ...] = ()  # BSDFs that the file holds for it
    holes: tuple[NDArray[np.float64], ...] = ()  # each [N, 3] [m]: there is wall
    up: NDArray[np.float64] | None = None  # [3] of its BSDFs
    both_sides: str = ""  # identity that it shares with the same opening of the room beyond

    @property
    def area(self) -> float:
        """Of the opening as drawn, without its holes [m2]."""
        outline, *holes = (np.linalg.norm(newell_normal(r)) for r in (self.ring, *self.holes))
        return float(outline - sum(holes))


@dataclass(frozen=True, slots=True)
class DrawnFace:
    """A polygon of a room's boundary."""

    guid: str
    name: str
    kind: str  # one of bim.model.FACE_KINDS; "" by its slope
    rings: tuple[NDArray[np.float64], ...]  # outline, then holes, each [N, 3] [m]
    adjacency: str  # one of bim.model.ADJACENCIES
    neighbour: str | None = None  # GUID of the room behind
    finish: SurfaceFinish = SurfaceFinish()
    openings: tuple[DrawnOpening, ...] = ()
    is_open: bool = False  # nothing is there: air


@dataclass(frozen=True, slots=True)
class DrawnRoom:
    """A room as a file draws it."""

    guid: str
    name: str
    faces: tuple[DrawnFace, ...]
    storey: str = ""
    long_name: str = ""
    stated_area: float | None = None  # [m2]
    stated_volume: float | None = None  # [m3]


@dataclass(frozen=True, slots=True)
class _Part:
    """A plane polygon of a room: of a face, or of an opening in it."""

    facet: Facet
    face: DrawnFace
    opening: DrawnOpening | None = None


def space_of(room: DrawnRoom) -> tuple[Space, list[Issue]]:
    """The room with its faces and windows, and what had to be changed.

    Raises: `RoomError` where its polygons enclose nothing.
    """
    issues: list[Issue] = []
    parts = [part for face in _joined_corners(room.faces) for part in _parts(face, issues)]
    if len(parts) < 4:
        raise RoomError(f"room {room.name}: {len(parts)} polygons enclose nothing")
    meshes = _wound(room, conforming_triangles([part.facet for part in parts]), issues)
    if not sum(map(len, meshes)):
        raise RoomError(f"room {room.name}: its polygons have no area")
    faces, windows = _faces_and_windows(parts, meshes)
    shell = np.concatenate(meshes)
    volume = enclosed_volume(shell)
    if not volume > 0:
        raise RoomError(f"room {room.name}: its polygons enclose nothing")
    space = Space(
        room.guid,
        room.name,
        room.storey,
        volume,
        floor_area(faces),
        tuple(faces),
        tuple(windows),
        volume,
        room.stated_area,
        room.stated_volume,
        room.long_name,
    )
    return space, [*issues, *_assumptions(space, room), *soundness_issues(space)]


def _joined_corners(faces: Sequence[DrawnFace]) -> list[DrawnFace]:
    """The faces with corners that lie within the tolerance made one."""
    corners = np.concatenate([ring for face in faces for ring in face.rings] or [np.empty((0, 3))])
    if not len(corners):
        return []
    kept = welded(corners, TOLERANCE)
    tree = cKDTree(kept)
    moved = (tuple(kept[tree.query(ring)[1]] for ring in face.rings) for face in faces)
    return [replace(face, rings=rings) for face, rings in zip(faces, moved, strict=True)]


def _parts(face: DrawnFace, issues: list[Issue]) -> list[_Part]:
    """The face's polygons without its openings, then these."""
    vector = newell_normal(face.rings[0])
    if not np.linalg.norm(vector) > 0:
        issues.append(Issue("face-without-area", face.guid, {"element": face.name}))
        return []
    plane = plane_through(face.rings[0].mean(axis=0), vector)
    flat = [plane.to_plane(ring) for ring in face.rings]
    whole = flat_polygon(flat)
    if max(np.abs(ring[:, 2]).max() for ring in flat) > FLAT and not face.openings:
        return [_Part(facet, face) for facet in _bent(face.rings, whole, plane)]
    rest, cut = whole, []
    for opening in face.openings:
        if opening.glazing is not None and face.adjacency not in ("outside", "space"):
            values = {"element": opening.name, "surface": face.name}
            effect = Effect("window", opening.area)
            issues.append(Issue("glass-within-room", opening.guid, values, effect))
        own = plane.to_plane(opening.ring)
        outline = flat_polygon([own, *map(plane.to_plane, opening.holes)])
        inside = shapely.intersection(outline, rest)
        near = np.abs(own[:, 2]).max() < OFF_THE_WALL
        polygons = polygons_of(inside) if near else []
        if not polygons:
            issues.append(_lost(opening, face))
            continue
        beside = outline.area - inside.area
        if beside > MOST_OUTSIDE * outline.area:
            values = {"element": opening.name, "area": beside, "face": face.name}
            issues.append(Issue("opening-beside-face", opening.guid, values))
        rest = shapely.difference(rest, shapely.union_all(polygons))
        cut += [_Part(Facet(plane, polygon), face, opening) for polygon in polygons]
    return [*(_Part(Facet(plane, polygon), face) for polygon in polygons_of(rest)), *cut]


def _lost(opening: DrawnOpening, face: DrawnFace) -> Issue:
    values = {"element": opening.name, "face": face.name}
    effect = Effect() if opening.glazing is None else Effect("window", opening.area)
    return Issue("opening-not-in-face", opening.guid, values, effect)


def flat_polygon(rings: Iterable[NDArray[np.float64]]) -> shapely.Geometry:
    """The polygon of flat rings [N, 2 or 3], the first one its outline; repaired where invalid."""
    outline, *holes = (shapely.make_valid(shapely.Polygon(ring[:, :2])) for ring in rings)
    return shapely.difference(outline, shapely.union_all(holes)) if holes else outline


def triangles_of_rings(rings: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of a polygon in space, its outline and holes; none without area."""
    vector = newell_normal(rings[0])
    if not np.linalg.norm(vector) > 0:
        return np.empty((0, 3, 3))
    plane = plane_through(rings[0][0], vector)
    flat = [triangulated(p) for p in polygons_of(flat_polygon(map(plane.to_plane, rings)))]
    corners = np.concatenate(flat or [np.empty((0, 3, 2))])
    return plane.to_world(corners.reshape(-1, 2)).reshape(-1, 3, 3)


def _bent(rings: Sequence[NDArray[np.float64]], whole: shapely.Geometry, plane: Plane) -> list[Facet]:
    """Triangles of a polygon that is not plane, on its own corners."""
    corners = np.concatenate(rings)
    tree = cKDTree(plane.to_plane(corners)[:, :2])
    facets = []
    for polygon in polygons_of(whole):
        for triangle in corners[tree.query(triangulated(polygon))[1]]:
            vector = newell_normal(triangle)
            if np.linalg.norm(vector) > 0:
                own = plane_through(triangle[0], vector)
                flat = shapely.Polygon(own.to_plane(triangle)[:, :2])
                facets += [Facet(own, one) for one in polygons_of(flat)]
    return facets


def _wound(room: DrawnRoom, meshes: list[NDArray[np.float64]], issues: list[Issue]) -> list[NDArray[np.float64]]:
    """The parts' triangles with their normals out of the room."""
    shell = np.concatenate(meshes)
    if len(shell) and open_edges(shell):
        vertices = welded(shell.reshape(-1, 3))
        index = cKDTree(vertices).query(shell.reshape(-1, 3))[1].reshape(-1, 3)
        turned = (wound_alike(vertices, index) != index).any(axis=1)
        ends = np.cumsum([len(mesh) for mesh in meshes])[:-1]
        flips = [bool(part.sum() * 2 > len(part)) for part in np.split(turned, ends)]
        again = [m[:, ::-1] if flip else m for m, flip in zip(meshes, flips, strict=True)]
        if open_edges(np.concatenate(again)) < open_edges(shell):
            values = {"room": room.name, "count": sum(flips)}
            issues.append(Issue("polygons-inside-out", room.guid, values))
            meshes = again
    if len(shell) and enclosed_volume(np.concatenate(meshes)) < 0:
        meshes = [mesh[:, ::-1] for mesh in meshes]
    return meshes


def _faces_and_windows(
    parts: Sequence[_Part], meshes: Sequence[NDArray[np.float64]]
) -> tuple[list[Face], list[Window]]:
    """Faces in the file's order; exterior windows, all panes of one opening as one."""
    faces: list[Face] = []
    panes: dict[str, list[tuple[_Part, NDArray[np.float64]]]] = {}
    count: Counter[str] = Counter()
    for part, triangles in zip(parts, meshes, strict=True):
        if not len(triangles) or not np.linalg.norm(newell_normal(triangles[0])) > 0:
            continue
        opening = part.opening
        if opening is not None and opening.glazing is not None and part.face.adjacency == "outside":
            panes.setdefault(opening.guid, []).append((part, triangles))
            continue
        faces.append(_face(part, triangles, count))
    return faces, [_window(own) for own in panes.values()]


def _face(part: _Part, triangles: NDArray[np.float64], count: Counter[str]) -> Face:
    face, opening = part.face, part.opening
    finish = face.finish if opening is None else opening.finish
    kind = "door" if opening is not None and opening.glazing is None else face.kind
    kind = kind or _kind_by_slope(triangles, face.adjacency)
    construction = finish.construction or default_construction(kind, face.adjacency)
    visible, solar = (ROOM_REFLECTANCE[kind] if finish.visible is None else finish.visible), None
    pane = None
    if opening is not None and opening.glazing is not None:  # towards another room
        visible, construction = GLASS_REFLECTANCE, glass_construction(opening.glazing.u_value)
        if face.neighbour is not None:
            pane = replace(_window([(part, triangles)]), guid=opening.both_sides or opening.guid)
    elif finish.solar is not None:
        solar = finish.solar
    name = face.name if opening is None else opening.name
    count[name] += 1
    name = name if count[name] == 1 else f"{name} {count[name]}"
    guid = face.guid if opening is None else opening.guid
    return Face(
        name,
        kind,
        triangles,
        face.adjacency,
        construction,
        visible,
        visible if solar is None else solar,
        finish.emissivity,
        face.neighbour,
        guid,
        finish.gloss,
        pane,
    )


def _kind_by_slope(triangles: NDArray[np.float64], adjacency: str) -> str:
    normal = newell_normal(triangles[0])
    z = normal[2] / np.linalg.norm(normal)
    if z < -0.7:
        return "floor"
    if z > 0.34:  # less than 70 degrees from level, as `bim.boundaries`
        return "roof" if adjacency == "outside" else "ceiling"
    return "wall"


def _window(parts: Sequence[tuple[_Part, NDArray[np.float64]]]) -> Window:
    part = parts[0][0]
    opening, values = part.opening, part.opening.glazing
    triangles = np.concatenate([triangles for _, triangles in parts])
    return Window(
        opening.guid,
        opening.name,
        triangles,
        part.face.guid,
        float(sum(one.facet.polygon.area for one, _ in parts)),
        values.u_value,
        values.g_value,
        values.visible,
        values.name,
        values.solar,
        values.panes,
        opening.states,
        glass=values.glass,
        up=opening.up,
    )


def _assumptions(space: Space, room: DrawnRoom) -> list[Issue]:
    """How many polygons of a room say nothing of their reflectance or construction."""
    opaque = [one.finish for face in room.faces for one in (face, *(o for o in face.openings if o.glazing is None))]
    codes = {"visible": "reflectance-assumed", "construction": "construction-assumed"}
    issues = []
    for field, code in codes.items():
        count = sum(getattr(finish, field) is None for finish in opaque)
        if count:
            issues.append(Issue(code, space.guid, {"room": space.label, "count": count}))
    open_to = [face for face in room.faces if face.is_open]
    if open_to:
        area = sum(float(np.linalg.norm(newell_normal(face.rings[0]))) for face in open_to)
        values = {"room": space.label, "area": area}
        issues.append(Issue("room-boundary-open", space.guid, values))
    return issues
