"""Flat sheets with holes, folds and fins as periodic layers: screens, pleats, overhangs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.blinds import extrude
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial, clear_body


def perforated_screen(
    material: SlatMaterial,
    *,
    spacing: float,
    openness: float,
    thickness: float = 0.0,
    segments: int = 24,
) -> PeriodicLayer:
    """A sheet with round holes in a square grid.

    Args:
        spacing: distance of the holes' centres [m].
        openness: share of the area that is hole, up to pi / 4.
        thickness: of the sheet; the walls of the holes have its material [m].
        segments: corners of the polygon that represents a hole, with the area of the circle.
    """
    if not 0 < openness < np.pi / 4:
        raise ValueError(f"openness: expected above 0 and below pi / 4, got {openness}")
    if segments % 4:
        raise ValueError(f"segments: expected a multiple of 4, got {segments}")
    # the polygon's area is n / 2 sin(2 pi / n) r2
    radius = spacing * np.sqrt(2 * openness / (segments * np.sin(2 * np.pi / segments)))
    angle = 2 * np.pi * np.arange(segments) / segments + np.pi / segments
    hole = radius * np.stack([np.cos(angle), np.sin(angle)], -1)
    if np.abs(hole).max() >= spacing / 2:
        raise ValueError("the holes touch: fewer segments or a smaller openness")
    reach = spacing / 2 / np.abs(np.stack([np.cos(angle), np.sin(angle)], -1)).max(axis=1)
    rim = reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    return _with_hole(hole, rim, thickness, material, spacing)


def woven_screen(
    material: SlatMaterial, *, spacing: float, openness: float, thickness: float
) -> PeriodicLayer:
    """Square holes between flat threads, the sheet `thickness` thick: a roller shade's fabric.

    Source: the square-mesh model of roller fabrics; openness is the direct transmittance at normal
    incidence.
    """
    if not 0 < openness < 1:
        raise ValueError(f"openness: expected above 0 and below 1, got {openness}")
    half = 0.5 * spacing * np.sqrt(openness)
    hole = half * np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=float)
    rim = 0.5 * spacing * np.sign(hole)
    return _with_hole(hole, rim, thickness, material, spacing)


def thread_screen(
    material: SlatMaterial, *, diameter: float, spacing: float, segments: int = 16
) -> PeriodicLayer:
    """Round upright threads before round level ones, on a square grid.

    Args:
        diameter: of a thread [m].
        spacing: distance of the threads' axes [m].
        segments: corners of the polygon that represents a thread, with its width.
    """
    if not 0 < diameter < spacing:
        raise ValueError(f"diameter: expected above 0 and below {spacing}, got {diameter}")
    angle = 2 * np.pi * np.arange(segments) / segments
    outline = diameter / 2 * np.stack([np.cos(angle), np.sin(angle)], -1)
    edges = np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)
    level = extrude(edges + np.array([spacing / 2, -diameter / 2]), spacing)
    upright = extrude(edges + np.array([spacing / 2, diameter / 2]), spacing)[..., [1, 0, 2]]
    triangles = np.concatenate([level, upright])
    # every triangle's front outdoors: of a thread's two halves these are the outside and the inside
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    inwards = np.cross(u, v)[:, 2] < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    kind = np.zeros(len(triangles), dtype=np.int64)
    return PeriodicLayer(triangles, kind, (material,), (spacing, spacing))


def _with_hole(
    hole: NDArray[np.float64],
    rim: NDArray[np.float64],
    thickness: float,
    material: SlatMaterial,
    spacing: float,
) -> PeriodicLayer:
    """A sheet with a hole in each period, from the corners of the hole and of the period [n, 2]."""
    face = _ring(hole, rim, spacing / 2)
    faces = [
        np.concatenate([face, np.full((*face.shape[:2], 1), z)], -1) for z in _faces(thickness)
    ]
    if thickness > 0:
        faces.append(_walls(hole, thickness))
    return _sheet(np.concatenate(faces), material, spacing)


def pleated_shade(material: SlatMaterial, *, depth: float, spacing: float) -> PeriodicLayer:
    """A fabric folded to and fro, `spacing` from fold to fold of one side and `depth` deep [m]."""
    edges = np.array(
        [
            [[0.0, 0.0], [spacing / 2, depth]],
            [[spacing / 2, depth], [spacing, 0.0]],
        ]
    )
    triangles = extrude(edges, max(spacing, depth))
    return PeriodicLayer(
        triangles,
        np.zeros(len(triangles), dtype=np.int64),
        (material,),
        (max(spacing, depth), spacing),
    )


def prism_panel(
    index: float, *, pitch: float, angle: float, thickness: float, channels: int = 1
) -> PeriodicLayer:
    """A clear panel, flat outside, with horizontal prisms towards the room.

    Args:
        pitch: height of a prism [m].
        angle: of its long face against the pane; the panel is thinner going down [rad].
        thickness: of the panel where it is thinnest [m].
    """
    if not 0 <= angle < np.pi / 2:
        raise ValueError(f"angle: expected 0 to below a right angle, got {angle}")
    drop = pitch * np.tan(angle)
    # (y, z) edges whose extruded triangles have their normals outwards: exterior, room, level
    edges = [[[pitch, 0.0], [0.0, 0.0]], [[0.0, -thickness], [pitch, -thickness - drop]]]
    if drop > 0:
        edges.append([[pitch, -thickness - drop], [pitch, -thickness]])
    triangles = extrude(np.array(edges), max(pitch, thickness + drop))
    material = clear_body("clear", index, channels=channels)
    return PeriodicLayer(
        triangles,
        np.zeros(len(triangles), dtype=np.int64),
        (material,),
        (max(pitch, thickness + drop), pitch),
    )


def _sheet(triangles: NDArray[Any], material: SlatMaterial, spacing: float) -> PeriodicLayer:
    """The layer of a cell drawn round the origin."""
    return PeriodicLayer(
        triangles + np.array([spacing / 2, spacing / 2, 0.0]),
        np.zeros(len(triangles), dtype=np.int64),
        (material,),
        (spacing, spacing),
    )


def _faces(thickness: float) -> tuple[float, ...]:
    return (0.0,) if thickness == 0 else (thickness / 2, -thickness / 2)


def _ring(inner: NDArray[Any], outer: NDArray[Any], half: float) -> NDArray[np.float64]:
    """Triangles [.., 3, 2] between a hole's outline and the square cell's border."""
    triangles = []
    count = len(inner)
    for a in range(count):
        b = (a + 1) % count
        triangles += [[inner[a], outer[a], outer[b]], [inner[a], outer[b], inner[b]]]
        corner = half * np.sign(outer[a] + outer[b])
        if not (np.isclose(outer[a], outer[b]).any() or np.isclose(corner, outer[a]).all()):
            triangles.append([outer[a], corner, outer[b]])
    return np.array(triangles)


def _walls(outline: NDArray[Any], thickness: float) -> NDArray[np.float64]:
    """Triangles of the walls of a hole, from one face to the other."""
    top = np.concatenate([outline, np.full((len(outline), 1), thickness / 2)], -1)
    bottom = top * [1, 1, -1]
    next_top, next_bottom = np.roll(top, -1, axis=0), np.roll(bottom, -1, axis=0)
    return np.concatenate(
        [np.stack([top, bottom, next_bottom], 1), np.stack([top, next_bottom, next_top], 1)]
    )
