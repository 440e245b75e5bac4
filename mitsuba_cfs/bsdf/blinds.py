"""Slat blinds and louvres as periodic layers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial
from mitsuba_cfs.errors import check_number, check_type

LEAST_SIZE = 1e-6  # of a slat and of the distance of slats [m]


def venetian_blind(
    material: SlatMaterial,
    *,
    depth: float,
    spacing: float,
    tilt: float,
    radius: float = np.inf,
    thickness: float = 0.0,
    segments: int = 12,
    width: float | None = None,
) -> PeriodicLayer:
    """Horizontal slats.

    Args:
        depth: width of a slat from edge to edge, along its chord [m].
        spacing: distance of the slats, one above the other [m].
        tilt: angle of the chord; positive lowers the exterior edge [rad].
        radius: radius of curvature, the hollow side down; infinite for a flat slat [m].
        thickness: thickness of the slat; zero for a sheet [m].
        segments: number of flat strips that a curved slat is made of.
        width: width of the cell, along the slats; does not affect the result [m].
    """
    check_type("material", material, SlatMaterial)
    for name, value in (("depth", depth), ("spacing", spacing)):
        check_number(name, value, LEAST_SIZE)
    check_number("thickness", thickness, 0.0)
    check_number("tilt [rad]", tilt, -np.pi / 2, np.pi / 2)
    check_number("segments", segments, 1, whole=True)
    profile = slat_profile(depth, radius, thickness, 1 if np.isinf(radius) else segments)
    c, s = np.cos(tilt), np.sin(tilt)
    turned = np.stack([profile[..., 1] * c - profile[..., 0] * s, profile[..., 0] * c + profile[..., 1] * s], -1)
    width = width or max(spacing, depth)
    triangles = extrude(turned, width)
    return PeriodicLayer(triangles, np.zeros(len(triangles), dtype=np.int64), (material,), (width, spacing))


def vertical_louvre(material: SlatMaterial, **options: Any) -> PeriodicLayer:
    """Upright slats, as `venetian_blind` turned; positive tilt moves the exterior edge right."""
    flat = venetian_blind(material, **options)
    triangles = flat.triangles[..., [1, 0, 2]] * [-1, 1, 1]
    return PeriodicLayer(triangles, flat.material, flat.materials, flat.period[::-1])


def slat_profile(depth: float, radius: float, thickness: float, segments: int) -> NDArray[np.float64]:
    """Edges [N, 2, 2] of a slat's section: across (outwards) and up, seen along the slat [m]."""
    if not radius >= depth / 2:
        raise ValueError(f"radius: expected at least half the depth {depth} m, got {radius} m")
    if np.isinf(radius):
        across = np.linspace(-depth / 2, depth / 2, segments + 1)
        up = np.zeros_like(across)
    else:
        angle = np.linspace(-1, 1, segments + 1) * np.arcsin(depth / 2 / radius)
        across, up = radius * np.sin(angle), radius * np.cos(angle)
        up = up - 0.5 * (up.max() + up.min())
    line = np.stack([across, up], -1)
    if thickness == 0:
        return np.stack([line[:-1], line[1:]], axis=1)
    offset = np.array([0.0, thickness / 2])
    outline = np.concatenate([line + offset, (line - offset)[::-1]])
    return np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)


def extrude(edges: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Triangles [2 N, 3, 3] of (y, z) edges [N, 2, 2] drawn out from x = 0 to `width`."""
    left = np.concatenate([np.zeros((*edges.shape[:2], 1)), edges], axis=-1)
    right = left + np.array([width, 0.0, 0.0])
    a, b, c, d = left[:, 0], left[:, 1], right[:, 1], right[:, 0]
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
