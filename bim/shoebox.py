"""A box-shaped room with rectangular windows, as the same `Building` that an IFC file gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.defaults import ROOM_REFLECTANCE, default_construction
from bim.model import BOX_SIDES, Building, Construction, Element, Face, Space, Window
from bim.planes import Facet, Plane, plane_through, polygons_of
from bim.shell import conforming_triangles
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.gloss import Gloss

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class WindowRectangle:
    """An opening in one side of the box; x to the right seen from outdoors, from its left edge."""

    x: float  # left edge [m]
    sill: float  # lower edge above the floor; for "ceiling" from the front [m]
    width: float  # [m]
    height: float  # [m]
    side: str = "front"  # one of BOX_SIDES but "floor"
    frame: float = 0.0  # width of an opaque frame all round inside the opening [m]
    name: str = ""  # for control groups; none: "window 1" and so on


@dataclass(frozen=True, slots=True)
class Plate:
    """An overhang or a fin: a plate that stands square out of a line on one side of the box."""

    start: tuple[float, float]  # x to the right seen from outdoors, y above the floor [m]
    end: tuple[float, float]
    depth: float  # from the plane of the glass [m]
    side: str = "front"  # one of BOX_SIDES
    reflectance: float = 0.2  # diffuse, in both bands


@dataclass(frozen=True, slots=True)
class SideFacet:
    """A polygon of the box: what it is, on which side, and of which window (-1: of none)."""

    facet: Facet
    kind: str  # one of `bim.model.FACE_KINDS` or "glass"
    side: str
    window: int = -1


def shoebox(
    width: float = 4.0,
    depth: float = 6.0,
    height: float = 3.0,
    *,
    windows: Sequence[WindowRectangle] = (WindowRectangle(0.5, 0.9, 3.0, 1.8),),
    facing_deg: float = 180.0,
    recess: float = 0.0,
    reflectance: Mapping[str, float] | None = None,
    reflectance_solar: Mapping[str, float] | None = None,
    adjacency: Mapping[str, str] | None = None,
    constructions: Mapping[str, Construction] | None = None,
    gloss: Mapping[str, Gloss] | None = None,
    emissivity: float = 0.9,
    latitude_deg: float | None = None,
    longitude_deg: float | None = None,
    plates: Sequence[Plate] = (),
    elements: Sequence[Element] = (),
    name: str = "room",
) -> Building:
    """A room whose front wall, `width` wide, faces `facing_deg` (from north to east; 180: south).

    The floor's front left corner (seen from outdoors) is at the origin, the floor at z = 0.
    Mappings are keyed by side ("front", "right", "back", "left" as seen from outdoors in front,
    "floor", "ceiling") or by face kind ("wall", "window frame", "reveal"), the side first.
    By default the sides with windows are outside and the others adiabatic.

    Args:
        recess: depth of the openings from the inner wall surface to the glass [m].
        reflectance: visible diffuse reflectances; `reflectance_solar`: solar ones, else the same.
        gloss: what parts reflect like a mirror besides, `mitsuba_cfs.gloss`.
        adjacency: what lies beyond a side, one of `bim.model.ADJACENCIES`.
        plates, elements: of the surroundings.
    """
    if min(width, depth, height) <= 0 or recess < 0:
        raise RoomError("width, depth and height must be positive, the recess not negative")
    for w in windows:
        if w.side not in BOX_SIDES or w.side == "floor":
            raise ValueError(f"window side {w.side!r}: expected one of {BOX_SIDES}, not the floor")
    facets: list[SideFacet] = []
    sides = _side_planes(width, depth, height, facing_deg)
    for side, (plane, size) in sides.items():
        holes = [(i, w) for i, w in enumerate(windows) if w.side == side]
        facets += _side_facets(side, plane, size, holes, recess)
    meshes = conforming_triangles([part.facet for part in facets])

    stated = _Stated(reflectance, reflectance_solar, adjacency, constructions, gloss, emissivity)
    glazed = {w.side for w in windows}
    faces: list[Face] = []
    apertures: dict[int, Window] = {}
    for part, triangles in zip(facets, meshes, strict=True):
        if part.kind == "glass":
            apertures[part.window] = _window(name, part, triangles, windows[part.window])
            continue
        label = part.side if part.window < 0 else f"{part.side} {part.kind} {len(faces)}"
        face = stated.face(label, part, triangles, glazed=part.side in glazed)
        faces.append(replace(face, element=f"{name}-{part.side}"))
    volume = width * depth * height
    recesses = sum(w.width * w.height for w in windows) * recess
    space = Space(
        f"{name}-guid",
        name,
        "storey",
        volume + recesses,
        width * depth,
        tuple(faces),
        tuple(apertures[i] for i in range(len(windows))),
        volume,
    )
    outdoors = [_plate(f"{name}-plate-{i}", p, sides, recess) for i, p in enumerate(plates)]
    return Building(name, (space,), (*outdoors, *elements), (), latitude_deg, longitude_deg)


def _plate(guid: str, plate: Plate, sides: Mapping[str, tuple[Plane, tuple[float, float]]], recess: float) -> Element:
    """A plate before a side of the box."""
    if plate.depth <= 0 or plate.start == plate.end:
        raise RoomError(f"{guid}: needs a depth and two ends that differ")
    plane = sides[plate.side][0]
    near = plane.to_world(np.array([plate.start, plate.end])) + recess * plane.normal
    far = near[::-1] + plate.depth * plane.normal
    corners = np.concatenate([near, far])
    triangles = corners[[[0, 1, 2], [0, 2, 3]]]
    rho = plate.reflectance
    return Element(guid, "plate", "IfcShadingDevice", triangles, rho, rho)


@dataclass(frozen=True, slots=True)
class _Stated:
    """Properties of a box's parts, by side or kind."""

    reflectance: Mapping[str, float] | None
    reflectance_solar: Mapping[str, float] | None
    adjacency: Mapping[str, str] | None
    constructions: Mapping[str, Construction] | None
    gloss: Mapping[str, Gloss] | None
    emissivity: float

    def face(self, label: str, part: SideFacet, triangles: NDArray[np.float64], *, glazed: bool) -> Face:
        """A part as the face of a room; glazed: whether its side has windows."""
        side, kind = part.side, part.kind
        exposed = glazed and kind != "reveal"  # reveals lie inside the wall
        beyond = _pick(self.adjacency, side, kind, "outside" if exposed else "adiabatic")
        construction = _pick(self.constructions, side, kind, default_construction(kind, beyond))
        visible = _pick(self.reflectance, side, kind, ROOM_REFLECTANCE[kind])
        solar = _pick(self.reflectance_solar, side, kind, visible)
        gloss = _pick(self.gloss, side, kind, None)
        return Face(label, kind, triangles, beyond, construction, visible, solar, self.emissivity, gloss=gloss)


def _window(room: str, part: SideFacet, triangles: NDArray[np.float64], w: WindowRectangle) -> Window:
    return Window(
        f"{room}-window-{part.window}",
        w.name or f"window {part.window + 1}",
        triangles,
        f"{room}-{part.side}",
        w.width * w.height,
    )


def _pick(table: Mapping[str, T] | None, side: str, kind: str, default: T) -> T:
    """Entry of the side (not for reveals and frames), else of the kind, else the default."""
    table = {} if table is None else table
    if kind not in ("reveal", "window frame") and side in table:
        return table[side]
    return table.get(kind, default)


def _side_planes(
    width: float, depth: float, height: float, facing_deg: float
) -> dict[str, tuple[Plane, tuple[float, float]]]:
    """Plane (origin at the lower left seen from outdoors, normal out) and size of each side."""
    azimuth = np.radians(facing_deg)
    out = np.array([np.sin(azimuth), np.cos(azimuth), 0.0])  # horizontal normal of the front
    right = np.array([-out[1], out[0], 0.0])  # to the right seen from outdoors
    inward, up = -out, np.array([0.0, 0.0, 1.0])
    far_right, far_left = right * width + inward * depth, inward * depth

    def side(origin: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]) -> Plane:
        return Plane(origin, np.stack([u, v, np.cross(u, v)]))

    zero = np.zeros(3)
    return {
        "front": (side(zero, right, up), (width, height)),
        "right": (side(right * width, inward, up), (depth, height)),
        "back": (side(far_right, -right, up), (width, height)),
        "left": (side(far_left, out, up), (depth, height)),
        "floor": (side(far_left, right, out), (width, depth)),
        "ceiling": (side(up * height, right, inward), (width, depth)),
    }


def _side_facets(
    side: str, plane: Plane, size: tuple[float, float], holes: list[tuple[int, WindowRectangle]], recess: float
) -> list[SideFacet]:
    """The wall of one side, and the reveals, frames and glass of its openings."""
    wall = shapely.box(0, 0, *size)
    facets: list[SideFacet] = []
    outer = Plane(plane.origin + recess * plane.normal, plane.axes)
    for index, w in holes:
        x1, y1 = w.x + w.width, w.sill + w.height
        opening = shapely.box(w.x, w.sill, x1, y1)
        if w.width <= 0 or w.height <= 0 or not shapely.box(0, 0, *size).covers(opening):
            raise RoomError(f"window {index}: does not lie inside the {side} side")
        if not wall.covers(opening):
            raise RoomError(f"window {index}: overlaps another window")
        if not 0 <= 2 * w.frame < min(w.width, w.height):
            raise RoomError(f"window {index}: the frame covers the opening")
        wall = wall.difference(opening)
        glass = shapely.box(w.x + w.frame, w.sill + w.frame, x1 - w.frame, y1 - w.frame)
        frame = polygons_of(opening.difference(glass))
        facets.append(SideFacet(Facet(outer, glass), "glass", side, index))
        facets += [SideFacet(Facet(outer, p), "window frame", side, index) for p in frame]
        if recess > 0:
            facets += _reveals(plane, opening, recess, side, index)
    kind = side if side in ("floor", "ceiling") else "wall"
    return [SideFacet(Facet(plane, p), kind, side) for p in polygons_of(wall)] + facets


def _reveals(plane: Plane, opening: shapely.Polygon, recess: float, side: str, index: int) -> list[SideFacet]:
    """The four surfaces between the wall's inner surface and the glazing plane."""
    x0, y0, x1, y1 = opening.bounds
    corners = plane.to_world(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))
    facets = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = end - start
        reveal = plane_through(start, np.cross(along, plane.normal))
        ring = np.stack([start, end, end + recess * plane.normal, start + recess * plane.normal])
        polygon = shapely.Polygon(reveal.to_plane(ring)[:, :2])
        facets.append(SideFacet(Facet(reveal, polygon), "reveal", side, index))
    return facets
