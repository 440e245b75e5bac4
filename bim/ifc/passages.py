"""Openings between two rooms that nothing fills: doorways, and boundaries with nothing on them.

An opening of the file leads from room to room where it goes through the wall to both.  Where two
rooms touch (a virtual boundary, an IfcVirtualElement or none), what lies open is their common face
less all that stands within half a metre of it: rooms may be drawn to the axis of a wall.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from numpy.typing import NDArray
from trimesh.intersections import slice_faces_plane

from bim.apertures import Aperture, Filling, aperture_of, shadow
from bim.boxes import Boxes
from bim.ifc.fillings import beside_opening, unfilled_openings
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import Outline
from bim.planes import GRID, Facet, Plane, polygons_of, triangulated
from bim.rooms import OVERLAP, Attachment, RoomSolid, attachments_of

THROUGH = 0.02  # an opening that stops this near a room's face goes through the wall [m]
TOUCHING = 0.05  # rooms nearer than this have no wall between them, or one that both reach into [m]
IN_WALL = 0.5  # half of the thickest wall to whose axis rooms are drawn [m]
OPPOSITE = -0.999  # cosine between the common faces of two rooms: 2.6 degrees
SMALLEST = 0.1  # smaller openings are for ducts, or slits of the drawing [m2]
NARROWEST = 0.1  # what is nowhere wider is a slit of the drawing [m]
LARGEST_DOOR = 3.0  # an opening up to this is a doorway: 1.3 by 2.3 m [m2]


@dataclass(frozen=True, slots=True)
class Passage:
    """An opening between two rooms, as each of them has it."""

    sides: tuple[Attachment, Attachment]
    outline: Outline  # of what fills the opening from one room into the other

    @property
    def opening(self) -> str:
        """GUID of the opening, or of the two rooms that touch there."""
        return self.sides[0].aperture.filling.guid

    @property
    def rooms(self) -> frozenset[str]:
        """GUIDs of the two rooms."""
        return frozenset(side.room for side in self.sides)

    @property
    def area(self) -> float:
        """What is open [m2]."""
        return float(self.sides[0].region.area)

    @property
    def is_large(self) -> bool:
        """Whether it is larger than a door."""
        return self.area > LARGEST_DOOR


@dataclass(frozen=True, slots=True)
class _Drawn:
    """Triangles [N, 3, 3] of all that may stand in an opening, and their boxes."""

    triangles: NDArray[np.float64]
    boxes: Boxes

    @classmethod
    def of(cls, triangles: NDArray[np.float64]) -> _Drawn:
        return cls(triangles, Boxes(triangles.min(axis=1), triangles.max(axis=1)))


def open_apertures(source: Source, records: Sequence[SpaceRecord], bodies: NDArray[np.float64]) -> list[Aperture]:
    """What may lie open between rooms: unfilled openings, and where rooms touch.

    Args: bodies: triangles [N, 3, 3] of all that may stand there [m].
    """
    result = []
    for opening, host in unfilled_openings(source.model):
        shape = source.shapes.get(opening.id())
        if shape is None:
            continue
        body = shape.triangles
        beside = None if host is None else beside_opening(source.shapes.get(host.id()), shape)
        filling = Filling(
            shape.guid,
            shape.name,
            "IfcOpeningElement",
            body,
            np.zeros(len(body), dtype=bool),
            opening=body,
            is_open=True,
            beside=beside,
        )
        aperture, _ = aperture_of(filling)
        if aperture is not None:
            result.append(replace(aperture, glass=aperture.opening))
    solids, drawn = [record.solid for record in records], _Drawn.of(bodies)
    for i, j in Boxes.of(solids).pairs(TOUCHING):
        result += _common_faces(solids[i], solids[j], drawn)
    return result


def passages(
    apertures: Sequence[Aperture], records: Sequence[SpaceRecord], bodies: NDArray[np.float64]
) -> list[Passage]:
    """Those of the apertures that lead from room to room."""
    solids, drawn = [record.solid for record in records], _Drawn.of(bodies)
    result = []
    for aperture in apertures:
        sides = attachments_of(aperture, solids)
        for one, other in combinations(sides, 2):
            if one.neighbour == other.room and other.neighbour == one.room:
                passage = _passage(one, other, drawn)
                result += [] if passage is None else [passage]
    return result


def _passage(one: Attachment, other: Attachment, bodies: _Drawn) -> Passage | None:
    """What is open between two rooms if the opening goes through to both."""
    plane = one.aperture.plane
    # the first room lies below the plane, the other one above
    low, high = one.nearest, -other.nearest
    through = one.aperture.filling.opening
    if through is not None:
        if high - low < TOUCHING:
            return None  # found as a common face
        heights = plane.to_plane(through)[..., 2]
        if heights.min() > low + THROUGH or heights.max() < high - THROUGH:
            return None
        region = _free(one.region, plane, (low - TOUCHING, high + TOUCHING), bodies)
        if region.area < SMALLEST:
            return None
        one, other = _narrowed(one, region), _narrowed(other, _mirrored(region))
    outline = one.region, plane, one.deepest - OVERLAP, -other.deepest + OVERLAP
    return Passage((one, other), outline)


def _narrowed(side: Attachment, region: shapely.Geometry) -> Attachment:
    return replace(side, region=region, aperture=replace(side.aperture, glass=region))


def _mirrored(region: shapely.Geometry) -> shapely.Geometry:
    return shapely.transform(region, lambda points: points * [-1.0, 1.0])


def _common_faces(one: RoomSolid, other: RoomSolid, bodies: _Drawn) -> Iterator[Aperture]:
    """Where two rooms touch and nothing stands, in the plane of the first one's faces."""
    guid = f"{one.guid} {other.guid}"
    name = f"boundary of {one.name} and {other.name}"
    for facet in one.facets:
        plane = facet.plane
        shared = shapely.union_all(
            [_shared(facet, back) for back in other.facets if back.plane.normal @ plane.normal < OPPOSITE]
        )
        if shared.area < SMALLEST:
            continue
        for part in polygons_of(_free(shared, plane, (-IN_WALL, IN_WALL), bodies)):
            flat = plane.to_world(triangulated(part).reshape(-1, 2)).reshape(-1, 3, 3)
            nothing = np.zeros(len(flat), dtype=bool)
            filling = Filling(guid, name, "IfcVirtualElement", flat, nothing, is_open=True)
            yield Aperture(filling, plane, part, part)


def _shared(facet: Facet, other: Facet) -> shapely.Geometry:
    """What a facet shares with one of another room that touches it, in its plane."""
    corners = other.plane.to_world(shapely.get_coordinates(other.polygon))
    if np.abs(facet.plane.to_plane(corners)[:, 2]).max() > TOUCHING:
        return shapely.Polygon()
    flat = shapely.transform(other.polygon, lambda points: facet.plane.to_plane(other.plane.to_world(points))[:, :2])
    return shapely.union_all(polygons_of(shapely.make_valid(flat).intersection(facet.polygon)))


def _free(region: shapely.Geometry, plane: Plane, heights: tuple[float, float], bodies: _Drawn) -> shapely.Geometry:
    """The part of a region [m] with nothing between two heights above its plane [m]."""
    box = np.array(shapely.bounds(region)).reshape(2, 2)
    corners = plane.to_world(np.array([[x, y, z] for x in box[:, 0] for y in box[:, 1] for z in heights]))
    near = bodies.boxes.near(corners.min(axis=0), corners.max(axis=0))
    local = plane.to_plane(bodies.triangles[near])
    for height, up in zip(heights, (1.0, -1.0), strict=True):
        local = _cut_off(local, height, up)
    upright = Plane(np.zeros(3), np.eye(3))
    left = region.difference(shadow(local, upright)) if len(local) else region
    left = shapely.set_precision(left, GRID)
    left = left.buffer(-NARROWEST / 2, join_style="mitre").buffer(NARROWEST / 2, join_style="mitre")
    kept = [part for part in polygons_of(left.intersection(region)) if part.area >= SMALLEST]
    return shapely.union_all(kept)


def _cut_off(triangles: NDArray[np.float64], height: float, up: float) -> NDArray[np.float64]:
    """What of triangles [N, 3, 3] lies above a height (up: 1) or below it (-1)."""
    if not len(triangles):
        return triangles
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    vertices, faces, _ = slice_faces_plane(
        triangles.reshape(-1, 3), faces, np.array([0.0, 0.0, up]), np.array([0.0, 0.0, height])
    )
    return vertices[faces].reshape(-1, 3, 3)
