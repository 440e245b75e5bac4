"""The air of a room: its solid united with the recesses of its windows, cut into plane pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import manifold3d
import numpy as np
import shapely
from numpy.typing import NDArray

from bim.apertures import Aperture
from bim.planes import GRID, Facet, Plane, planar_facets, polygons_of, without_slits
from bim.report.issue import Issue
from bim.solids import prism, triangles_of, union

REACH = 1.0  # a room's face this far inside the glazing plane still belongs to the window [m]
BEYOND = 0.5  # and this far outside of it: rooms drawn to the wall's axis or outer face [m]
FACING = 0.3  # cosine between window and face: up to 72 degrees for roof windows and curved walls
ALONG = 0.9  # cosine: a face turned by more from a window may only touch its edge
SMALLEST_SHARE = 0.05  # of the opening: a smaller part before a room is drawing noise
FLUSH = 0.005  # recesses shallower than this are none [m]
OVERLAP = 0.001  # the recess enters the room this far, so that the union leaves no slit [m]
ENDS = ("low", "high")  # corners of a room's box
SLIT = 1e-5  # halves of a region nearer than this are one: ten times what solids weld [m]
THIN = 0.002  # pieces thinner than this are not cut off [m]


@dataclass(frozen=True, slots=True)
class RoomSolid:
    """A room as drawn: a closed solid and its plane facets (normals out of the room)."""

    guid: str
    name: str
    manifold: manifold3d.Manifold
    facets: tuple[Facet, ...]
    low: NDArray[np.float64]  # [3] corner of its box
    high: NDArray[np.float64]  # [3]


@dataclass(frozen=True, slots=True)
class Attachment:
    """The part of an aperture that one room has; the aperture's normal points out of that room."""

    aperture: Aperture
    room: str  # GUID
    region: shapely.Geometry  # part of the opening before this room, in the aperture's plane
    deepest: float  # height of the room's farthest face below the glazing plane, negative [m]
    nearest: float  # height of its nearest face; positive where the room goes past the glass [m]
    neighbour: str | None = None  # GUID of the room on the other side

    @property
    def glass(self) -> shapely.Geometry:
        """The glass of this part."""
        return shapely.union_all(polygons_of(self.aperture.glass.intersection(self.region)))

    @property
    def recessed(self) -> bool:
        """Whether there is a recess between the room and the glass."""
        return self.nearest < -FLUSH


@dataclass(frozen=True, slots=True)
class Piece:
    """A plane part of a room's boundary before it is given its properties."""

    facet: Facet
    role: str  # "room", "reveal", "frame", "glass", "door", "inner glass"
    attachment: Attachment | None = None
    neighbour: str | None = None  # GUID of the room beyond, where found


def room_solid(guid: str, name: str, manifold: manifold3d.Manifold) -> RoomSolid:
    """The room with its facets."""
    triangles, _ = triangles_of(manifold)
    corners = triangles.reshape(-1, 3)
    facets = tuple(planar_facets(triangles))
    return RoomSolid(guid, name, manifold, facets, corners.min(axis=0), corners.max(axis=0))


def project(polygon: shapely.Geometry, source: Plane, target: Plane) -> shapely.Geometry:
    """A polygon of one plane in the axes of another, moved along the first one's normal."""
    n = source.normal

    def move(points: NDArray[np.float64]) -> NDArray[np.float64]:
        world = source.to_world(points)
        t = (target.origin - world) @ target.normal / (n @ target.normal)
        return target.to_plane(world + t[:, None] * n)[:, :2]

    moved = shapely.transform(polygon, move)
    return moved if moved.is_valid else shapely.make_valid(moved)


def attachments_of(aperture: Aperture, rooms: Sequence[RoomSolid]) -> list[Attachment]:
    """The rooms on either side of an aperture and the part of it that each has."""
    outline = aperture.plane.to_world(shapely.get_coordinates(aperture.opening))
    lows, highs = (np.array([getattr(r, end) for r in rooms]).reshape(-1, 3) for end in ENDS)
    near = np.all(lows <= outline.max(axis=0) + REACH, axis=1)
    near &= np.all(highs >= outline.min(axis=0) - REACH, axis=1)
    rooms = [rooms[i] for i in np.flatnonzero(near)]
    sides = [_one_side(side, rooms) for side in (aperture, aperture.turned)]
    attachments: list[Attachment] = []
    for here, there in (sides, sides[::-1]):
        for attachment in here:
            rest = attachment.region
            for other in there:
                back = shapely.transform(other.region, lambda p: p * [-1.0, 1.0])
                shared = rest.intersection(back)
                rest = rest.difference(back)
                attachments.append(replace(attachment, region=shared, neighbour=other.room))
            attachments.append(replace(attachment, region=rest))
    smallest = SMALLEST_SHARE * aperture.opening.area
    cleaned = [replace(a, region=shapely.union_all(polygons_of(a.region))) for a in attachments]
    return [a for a in cleaned if a.region.area > smallest]


def _one_side(aperture: Aperture, rooms: Sequence[RoomSolid]) -> list[Attachment]:
    """Attachments of the rooms behind an aperture whose normal points away from them."""
    pieces: list[tuple[float, float, str, shapely.Geometry]] = []
    for room in rooms:
        for facet in room.facets:
            if facet.plane.normal @ aperture.plane.normal < FACING:
                continue
            seen = _seen_from(aperture, facet)
            if seen is not None:
                pieces.append((*seen[:2], room.guid, seen[2]))
    pieces.sort(key=lambda item: abs(item[1]))
    covered = shapely.Polygon()
    regions: dict[str, tuple[list[shapely.Geometry], list[float], list[float]]] = {}
    for deepest, nearest, guid, region in pieces:
        new = region.difference(covered)
        if new.area < 1e-4:
            continue
        covered = shapely.union_all([covered, new])
        parts, deep, near = regions.setdefault(guid, ([], [], []))
        parts.append(new)
        deep.append(deepest)
        near.append(nearest)
    return [
        Attachment(aperture, guid, shapely.union_all(parts), min(deep), max(near))
        for guid, (parts, deep, near) in regions.items()
    ]


def _seen_from(aperture: Aperture, facet: Facet) -> tuple[float, float, shapely.Geometry] | None:
    """Heights (deepest, nearest) and region of a room's facet behind the opening, if any."""
    corners = facet.plane.to_world(shapely.get_coordinates(facet.polygon))
    heights = aperture.plane.to_plane(corners)[:, 2]
    if heights.min() > BEYOND or heights.max() < -REACH:
        return None
    flat = shapely.transform(facet.polygon, lambda p: aperture.plane.to_plane(facet.plane.to_world(p))[:, :2])
    region = shapely.make_valid(flat).intersection(aperture.opening)
    parts = polygons_of(region)
    if not parts:
        return None
    region = shapely.union_all(parts)
    onto = project(region, aperture.plane, facet.plane)
    points = facet.plane.to_world(shapely.get_coordinates(onto))
    heights = aperture.plane.to_plane(points)[:, 2]
    if heights.min() < -REACH or heights.max() > BEYOND:
        return None
    return float(heights.min()), float(heights.max()), region


def room_pieces(room: RoomSolid, attachments: Sequence[Attachment]) -> tuple[list[Piece], float, list[Issue]]:
    """Pieces that close the room's air, its volume [m3], and what had to be changed.

    A slit as thin as rounding in a region, as faces leave it that meet behind one window, is
    closed: the union of solids has lost the half of the glass beside one.
    """
    attachments = [replace(a, region=without_slits(a.region, SLIT)) for a in attachments]
    issues: list[Issue] = []
    recesses: dict[int, Attachment] = {}
    painted: list[Attachment] = []
    solids = [room.manifold]
    for attachment in attachments:
        filling = attachment.aperture.filling
        exterior_glass = attachment.neighbour is None and not attachment.glass.is_empty
        if attachment.nearest > FLUSH and exterior_glass:
            depth = 1000 * attachment.nearest
            values = {"element": filling.name, "depth_mm": depth, "room": room.name}
            issues.append(Issue("glass-inside-room", filling.guid, values))
        recess = None
        if exterior_glass and attachment.recessed:
            bottom = attachment.deepest - OVERLAP
            recess = prism(attachment.region, attachment.aperture.plane, bottom, 0.0)
        if recess is None:
            painted.append(attachment)
        else:
            recesses[recess.original_id()] = attachment
            solids.append(recess)
    painted.sort(key=_from_the_face)
    air = union(solids) if len(solids) > 1 else room.manifold
    triangles, ids = triangles_of(air)
    pieces: list[Piece] = []
    for facet in planar_facets(triangles, ids):
        attachment = recesses.get(facet.label)
        if attachment is None:
            pieces += _painted(facet, painted)
        elif _is_cap(facet, attachment):
            pieces += _cap(facet, attachment)
        else:
            pieces.append(Piece(facet, "reveal", attachment))
    return pieces, air.volume(), issues


def _from_the_face(attachment: Attachment) -> tuple[bool, float, str]:
    """Order in which openings take a face that several reach: the nearest first.

    The order of the file says nothing: it is another one where the building is in several files.
    """
    aperture = attachment.aperture
    distance = round(abs(attachment.nearest) / OVERLAP) * OVERLAP
    return aperture.filling.is_open, distance, aperture.filling.guid


def _is_cap(facet: Facet, attachment: Attachment) -> bool:
    """Whether a facet of a recess lies in the glazing plane."""
    plane = attachment.aperture.plane
    height = (facet.plane.origin - plane.origin) @ plane.normal
    return facet.plane.normal @ plane.normal > 0.999 and abs(height) < OVERLAP / 2


def _cap(facet: Facet, attachment: Attachment) -> list[Piece]:
    """Glass and frame in the glazing plane."""
    glass = project(attachment.glass, attachment.aperture.plane, facet.plane)
    inside, outside = cut(facet.polygon, glass)
    return [Piece(Facet(facet.plane, p), "glass", attachment) for p in inside] + [
        Piece(Facet(facet.plane, p), "frame", attachment) for p in outside
    ]


def _painted(facet: Facet, painted: Sequence[Attachment]) -> list[Piece]:
    """A facet of the room itself, cut where doors, flush glass and inner windows lie on it."""
    rest = [facet.polygon]
    pieces: list[Piece] = []
    for attachment in painted:
        plane = attachment.aperture.plane
        if facet.plane.normal @ plane.normal < FACING:
            continue
        height = plane.to_plane(facet.plane.to_world(shapely.get_coordinates(facet.polygon)))[:, 2]
        if height.max() < attachment.deepest - OVERLAP or height.min() > attachment.nearest + OVERLAP:
            continue
        region = project(attachment.region, plane, facet.plane)
        glass = project(attachment.glass, plane, facet.plane)
        if facet.plane.normal @ plane.normal < ALONG:
            met = sum(polygon.intersection(glass).area for polygon in rest)
            if met < SMALLEST_SHARE * attachment.glass.area:
                continue  # the edge of a roof that begins at the pane
        glazed = "glass" if attachment.neighbour is None else "inner glass"
        opaque = "door" if attachment.aperture.filling.is_door else "frame"
        left: list[shapely.Polygon] = []
        for polygon in rest:
            inside, outside = cut(polygon, region)
            left += outside
            for part in inside:
                panes, frames = cut(part, glass)
                pieces += [Piece(Facet(facet.plane, p), glazed, attachment) for p in panes]
                pieces += [Piece(Facet(facet.plane, p), opaque, attachment) for p in frames]
        rest = left
    return [Piece(Facet(facet.plane, p), "room") for p in rest] + pieces


def cut(polygon: shapely.Polygon, region: shapely.Geometry) -> tuple[list[shapely.Polygon], list[shapely.Polygon]]:
    """Parts of a polygon inside and outside a region; slivers stay with the other part.

    Nothing is lost: the parts cover the polygon.
    """
    region = shapely.union_all(polygons_of(region))
    if region.is_empty or not polygon.intersects(region):
        return [], [polygon]
    shared = shapely.intersection(polygon, region, grid_size=GRID)
    inside = [p for p in polygons_of(shared) if _is_thick(p)]
    if not inside:
        return [], [polygon]
    taken = shapely.union_all(inside, grid_size=GRID)
    outside = polygons_of(shapely.difference(polygon, taken, grid_size=GRID))
    slivers = [p for p in outside if not _is_thick(p)]
    outside = [p for p in outside if _is_thick(p)]
    return inside + slivers, outside


def _is_thick(polygon: shapely.Polygon) -> bool:
    return not polygon.buffer(-THIN / 2).is_empty
