"""Rooms that are alike, so that what depends on the room alone is computed once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bim.model import Face, Space, centroid
from mitsuba_cfs.surfaces import area_vectors

ALIKE = 0.005  # lengths may differ by this between rooms that are alike [m]
ALIKE_SHARE = 0.005  # and reflectances by this


def template_rooms(spaces: Sequence[Space]) -> list[tuple[Space, ...]]:
    """Groups of rooms alike in shape, orientation, reflectances, constructions and windows.

    Alike means: one comes from the other by a shift; a turn would change what sun the room gets.
    The first of each group is its template.  View matrices and heat capacities are the same for a
    group; daylight matrices only where the surroundings are the same too.
    """
    groups: list[list[Space]] = []
    features: list[NDArray[np.float64]] = []
    for space in spaces:
        features_here = room_features(space)
        for group, template in zip(groups, features, strict=True):
            if _same(features_here, template) and _same_constructions(space, group[0]):
                group.append(space)
                break
        else:
            groups.append([space])
            features.append(features_here)
    return [tuple(group) for group in groups]


def room_features(space: Space) -> NDArray[np.float64]:
    """Rows [N, 13] of faces, windows and furniture: place, normal, size and optics [m].

    Places count from the room's lowest corner; normals and reflectances are scaled so that a
    difference of `ALIKE` matters as much as that length.
    """
    corner = space.shell.reshape(-1, 3).min(axis=0)
    scale = ALIKE / ALIKE_SHARE
    rows = [
        [
            *(centroid(face.triangles) - corner),
            *(scale * face.normal),
            np.sqrt(face.area),
            0.0,
            scale * face.reflectance_visible,
            scale * face.reflectance_solar,
            scale * face.emissivity,
            *(scale * value for value in _gloss(face)),
        ]
        for face in space.faces
    ]
    rows += [
        [
            *(window.centre - corner),
            *(scale * window.normal),
            np.sqrt(window.area),
            10.0,
            np.sqrt(window.opening_area),
            window.u_value or 0.0,
            window.g_value or 0.0,
            0.0,
            0.0,
        ]
        for window in space.windows
    ]
    rows += [
        [
            *(centroid(part.triangles) - corner),
            0.0,
            0.0,
            0.0,
            np.sqrt(np.linalg.norm(area_vectors(part.triangles), axis=1).sum()),
            20.0,
            scale * part.reflectance_visible,
            scale * part.reflectance_solar,
            0.0,
            0.0,
            0.0,
        ]
        for part in space.furniture
    ]
    return np.array(rows).reshape(-1, 13)


def same_hues(a: Space, b: Space) -> bool:
    """Whether two rooms alike have the same colours, not reflectances alone."""
    return _same(_hues(a), _hues(b))


def _hues(space: Space) -> NDArray[np.float64]:
    """Rows [N, 6] of faces and furniture: place from the room's lowest corner [m], scaled hue."""
    corner, scale = space.shell.reshape(-1, 3).min(axis=0), ALIKE / ALIKE_SHARE
    rows = [
        [*(centroid(part.triangles) - corner), *(scale * value for value in part.hue)]
        for part in (*space.faces, *space.furniture)
    ]
    return np.array(rows).reshape(-1, 6)


def _gloss(face: Face) -> tuple[float, float]:
    """Reflectance at normal incidence and roughness of a face's gloss."""
    return (0.0, 0.0) if face.gloss is None else (face.gloss.at_normal, face.gloss.roughness)


def _same(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether each row has its own counterpart within the tolerance in every entry."""
    if a.shape != b.shape:
        return False
    distance, nearest = cKDTree(b).query(a, p=np.inf)
    return bool(distance.max(initial=0.0) <= ALIKE and len(set(nearest.tolist())) == len(a))


def _same_constructions(a: Space, b: Space) -> bool:
    def areas(space: Space) -> dict[str, Any]:
        table: dict[str, Any] = {}
        for face in space.faces:
            key = face.kind, face.adjacency, face.construction.layers
            table[key] = table.get(key, 0.0) + face.area
        return table

    areas_a, areas_b = areas(a), areas(b)
    return areas_a.keys() == areas_b.keys() and all(
        abs(areas_a[key] - areas_b[key]) <= ALIKE * max(1.0, areas_a[key]) for key in areas_a
    )
