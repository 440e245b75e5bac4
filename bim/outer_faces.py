"""Where the outer faces of a room's walls are: beyond the elements that the walls are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Element, Space
from bim.rays import ray_mesh
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.surfaces import even_numbers, points_on_triangles

DEEPEST_WALL = 1.2  # [m] from its face in the room
TOUCHING = 0.05  # [m] wider gaps are outdoors: no cladding lies beyond them
PARALLEL = 0.9  # least |cosine| to the wall's normal of both faces of what is a part of the wall
OFF_THE_WALL = 0.02  # [m] sensors stand this far before the outer face
PLACES = 64  # on each surface, a power of two


@dataclass(frozen=True, slots=True)
class OuterFaces:
    """Points just outside the outer faces of a room's exterior surfaces."""

    surfaces: NDArray[np.int64]  # [N] of the zone
    points: NDArray[np.float64]  # [N, PLACES, 3] spread evenly over each surface [m]
    normals: NDArray[np.float64]  # [N, 3]
    depth: NDArray[np.float64]  # [N] of the outer face behind that in the room, in the middle [m]
    windows: NDArray[np.float64]  # [W, PLACES, 3] outside the glass [m]
    window_normals: NDArray[np.float64]  # [W, 3]


def outer_faces(building: Building, space: Space, room: ThermalRoom) -> OuterFaces:
    """The outer faces of a room's surfaces and windows.

    A face in the room is followed outwards through the element that it belongs to, or by the
    thickness of its layers where nothing of that element is drawn, and on through what touches it
    or begins within its layers and lies along it, as a cladding or the outer leaf beyond a cavity
    does; not through eaves, a balcony or a wall that stands out.
    """
    walls = _NearElements(building.elements, space)
    points, depths = [], []
    for number in room.outdoor:
        faces = [f for f, at in zip(space.faces, room.surface_of_face, strict=True) if at == number]
        counts = [len(face.triangles) for face in faces]
        inner, triangle = _places(np.concatenate([face.triangles for face in faces]))
        of = np.repeat(np.arange(len(faces)), counts)[triangle]
        thickness = np.array([face.construction.thickness for face in faces])[of]
        element = [faces[i].element for i in of]
        normal = room.zone.surfaces[number].normal
        deep = walls.depth(inner, normal, element, thickness)
        points.append(inner + (deep + OFF_THE_WALL)[:, None] * normal)
        depths.append(float(np.median(deep)))
    glass = [_places(window.triangles)[0] + OFF_THE_WALL / 2 * window.normal for window in space.windows]
    return OuterFaces(
        room.outdoor,
        np.array(points).reshape(-1, PLACES, 3),
        np.array([room.zone.surfaces[i].normal for i in room.outdoor]).reshape(-1, 3),
        np.array(depths),
        np.array(glass).reshape(-1, PLACES, 3),
        np.array([window.normal for window in space.windows]).reshape(-1, 3),
    )


def _places(triangles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points [PLACES, 3] spread over triangles by area, and the triangle of each."""
    return points_on_triangles(triangles, even_numbers(PLACES))


class _NearElements:
    """The elements around a room, for tracing rays."""

    def __init__(self, elements: Sequence[Element], space: Space) -> None:
        corners = space.shell.reshape(-1, 3)
        low, high = corners.min(axis=0) - DEEPEST_WALL, corners.max(axis=0) + DEEPEST_WALL
        none = np.empty((0, 3, 3))
        every = np.concatenate([none, *(element.triangles for element in elements)])
        first = np.cumsum([0, *(len(element.triangles) for element in elements)])[:-1]
        lowest, highest = np.minimum.reduceat(every.min(axis=1), first), np.maximum.reduceat(every.max(axis=1), first)
        is_near = (lowest <= high).all(axis=1) & (highest >= low).all(axis=1)
        near = list(compress(elements, is_near))
        triangles = np.concatenate([none, *(element.triangles for element in near)])
        self.mesh = ray_mesh(triangles)
        self.normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        self.normals /= np.maximum(np.linalg.norm(self.normals, axis=1), 1e-12)[:, None]
        self.corners = [element.triangles.reshape(-1, 3) for element in near]
        counts = [len(element.triangles) for element in near]
        self.of = np.repeat(np.arange(len(near)), counts)
        self.guids = np.repeat([element.guid for element in near], counts)

    def depth(
        self,
        points: NDArray[np.float64],
        normal: NDArray[np.float64],
        element: Sequence[str | None],
        thickness: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """How far [n] along the normal the last of the wall lies behind points in the room [m].

        Args: element: GUID of the wall at each point; thickness: [n] of its layers [m].
        """
        met = self._met(points, normal)
        own = np.array([guid or "" for guid in element])
        deep = np.zeros(len(points))
        for distance, triangle in met:
            here = (triangle >= 0) & (self.guids[triangle] == own)
            deep[here] = distance[here]
        deep = np.where(deep > 0, deep, thickness)
        going, narrowest = np.ones(len(points), dtype=bool), self._narrowest(normal)
        for number, (distance, triangle) in enumerate(met):
            further = (triangle >= 0) & (distance > deep + 1e-6)
            leaving = self.normals[triangle] @ normal > 0  # a solid that began before
            along = self._along(met[: number + 1], normal, narrowest)
            belongs = distance <= np.maximum(deep + TOUCHING, thickness)
            going &= ~further | np.where(leaving, along, belongs)
            deep = np.where(further & going, distance, deep)
        return deep

    def _along(
        self,
        met: Sequence[tuple[NDArray[np.float64], NDArray[np.int64]]],
        normal: NDArray[np.float64],
        narrowest: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """Whether the solids that rays leave at their last hit lie along the wall [n].

        Both faces are parallel to it, and the way between them is no longer than the solid's
        narrower side across: eaves, balconies and walls that stand out are not so.
        """
        distance, triangle = met[-1]
        began, entered = np.zeros(len(distance)), np.ones(len(distance))
        for before, other in met[:-1]:
            cosine = self.normals[other] @ normal
            into = (other >= 0) & (self.of[other] == self.of[triangle]) & (cosine < 0)
            began = np.where(into, before, began)
            entered = np.where(into, -cosine, entered)
        parallel = np.minimum(entered, self.normals[triangle] @ normal) > PARALLEL
        return parallel & (distance - began <= narrowest[self.of[triangle]] + 1e-6)

    def _narrowest(self, normal: NDArray[np.float64]) -> NDArray[np.float64]:
        """The smaller extent of each element across a normal [m]: level, and at right angles."""
        across = window_frame(normal)[:2]
        return np.array([np.ptp(corners @ across.T, axis=0).min() for corners in self.corners])

    def _met(
        self, points: NDArray[np.float64], normal: NDArray[np.float64]
    ) -> list[tuple[NDArray[np.float64], NDArray[np.int64]]]:
        """Distances [n] and triangles [n] (-1: none) that rays along the normal meet, in turn."""
        hits = [self.mesh.all_hits(point, normal, DEEPEST_WALL) for point in points]
        most = max((len(hit) for _, hit in hits), default=0)
        distance = np.full((most, len(points)), DEEPEST_WALL)
        triangle = np.full((most, len(points)), -1)
        for ray, (far, hit) in enumerate(hits):
            distance[: len(hit), ray], triangle[: len(hit), ray] = far, hit
        return list(zip(distance, triangle, strict=True))
