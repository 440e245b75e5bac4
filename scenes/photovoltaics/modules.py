"""Photovoltaic modules: their active face, the cells on it, and how these are wired."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Element
from bim.planes import planar_facets
from bim.rays import RayMesh, hemisphere, ray_mesh
from mitsuba_cfs.surfaces import area_vectors

OFF_THE_FACE = 0.005  # distance of the sensors from the glass [m]
NEARLY_AS_BIG = 0.8  # share of the biggest face's area that the other side of a module has
RAYS = 64  # that tell the free side from the side towards the wall
TOUCHING = 0.5  # what stops a ray so near covers that side [m]


@dataclass(frozen=True, slots=True)
class PvModule:
    """One module: a rectangle of cells in strips, each strip with its bypass diode."""

    guid: str
    name: str
    outline: NDArray[np.float64]  # [N, 3] of the active face, counter-clockwise from outside [m]
    normal: NDArray[np.float64]  # [3]
    area: float  # of the active face [m2]
    points: NDArray[np.float64]  # [N, 3] middles of the groups of cells, just before the face
    edges: NDArray[np.float64]  # [N, 2, 3] sides of each group [m]
    substring: NDArray[np.int64]  # [N]

    @property
    def azimuth_deg(self) -> float:
        """Where the face looks: degrees from north, clockwise."""
        return float(np.degrees(np.arctan2(self.normal[0], self.normal[1])) % 360)

    @property
    def tilt_deg(self) -> float:
        """From horizontal (0: looks up) [degrees]."""
        return float(np.degrees(np.arccos(np.clip(self.normal[2], -1, 1))))


def pv_modules(
    elements: Sequence[Element], guids: frozenset[str], *, substrings: int = 3, along: int = 4
) -> list[PvModule]:
    """The modules among a model's elements, in the order of their GUIDs' first appearance.

    A module's active face is its biggest flat one; of two alike, that with the freer view.

    Args:
        substrings: strips across the short side, each with a bypass diode.
        along: groups of equally lit cells along each strip.
    """
    parts: dict[str, list[Element]] = {}
    for element in elements:
        if element.guid in guids:
            parts.setdefault(element.guid, []).append(element)
    mesh = ray_mesh(np.concatenate([e.triangles for e in elements] or [np.empty((0, 3, 3))]))
    return [_module(part, mesh, substrings, along) for part in parts.values()]


def _module(parts: Sequence[Element], mesh: RayMesh, substrings: int, along: int) -> PvModule:
    first = parts[0]
    triangles = np.concatenate([part.triangles for part in parts])
    facets = planar_facets(triangles)
    biggest = max(facets, key=lambda facet: facet.polygon.area)
    rivals = [f for f in facets if f.polygon.area > NEARLY_AS_BIG * biggest.polygon.area]
    if _is_sheet(triangles):  # one face without a back: either side may be the front
        face, side = biggest, _freer_side(biggest, mesh)
    else:
        face, side = max(rivals, key=lambda facet: _freedom(facet, 1.0, mesh)), 1.0
    normal = side * face.plane.normal
    middle, axes = _rectangle(face)
    across, lengthwise = sorted(axes, key=np.linalg.norm)
    u = (np.arange(substrings) + 0.5) / substrings - 0.5
    v = (np.arange(along) + 0.5) / along - 0.5
    strip, place = (one.ravel() for one in np.meshgrid(np.arange(substrings), v, indexing="ij"))
    points = middle + u[strip][:, None] * across + place[:, None] * lengthwise
    edges = np.broadcast_to(np.stack([across / substrings, lengthwise / along]), (len(points), 2, 3))
    ring = np.asarray(shapely.orient_polygons(face.polygon).exterior.coords)[:-1]
    outline = face.plane.to_world(ring)
    return PvModule(
        first.guid,
        first.name,
        outline if side > 0 else outline[::-1],
        normal,
        float(face.polygon.area),
        points + OFF_THE_FACE * normal,
        edges,
        strip,
    )


def _is_sheet(triangles: NDArray[np.float64]) -> bool:
    """Whether the triangles face one way only: their area vectors do not cancel."""
    vectors = area_vectors(triangles)
    total = np.linalg.norm(vectors, axis=1).sum()
    return bool(np.linalg.norm(vectors.sum(axis=0)) > 0.5 * total)


def _rectangle(facet) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Middle [3] and sides [3] of the smallest rectangle round a face."""
    box = np.asarray(shapely.minimum_rotated_rectangle(facet.polygon).exterior.coords)
    corners = facet.plane.to_world(box[:4])
    return corners.mean(axis=0), [corners[1] - corners[0], corners[2] - corners[1]]


def _freer_side(facet, mesh: RayMesh) -> float:
    return 1.0 if _freedom(facet, 1.0, mesh) >= _freedom(facet, -1.0, mesh) else -1.0


def _freedom(facet, side: float, mesh: RayMesh) -> float:
    """Share of the rays from one side of a face that nothing stops at once, then those upwards."""
    normal = side * facet.plane.normal
    middle, _ = _rectangle(facet)
    directions = hemisphere(normal, RAYS)
    origins = np.tile(middle + OFF_THE_FACE * normal, (len(directions), 1))
    distance, _ = mesh.first_hits(origins, directions)
    return float(np.mean(distance > TOUCHING) + 0.1 * np.isinf(distance).mean() + 0.01 * normal[2])
