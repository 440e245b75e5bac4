"""Floors of a building on the ground: area, exposed perimeter and depth, as ISO 13370 takes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bim.model import Building, Space

UPRIGHT = 0.3  # largest vertical part of the normal of an outer wall
DOWNWARDS = -0.7  # z of a floor's normal
SAME_WALL = 0.6  # [m] parts of one wall (its door, its glass) lie in planes that differ by less


def ground_floor(building: Building) -> tuple[float, float]:
    """Area [m2] of a building's floors on the ground, and their exposed perimeter [m].

    The perimeter is the length of the outer walls, inside, of the rooms with such floors (ISO 13370, 7).
    """
    area = perimeter = 0.0
    for space in building.spaces:
        floors = [f.area for f in space.faces if f.adjacency == "ground" and f.normal[2] < DOWNWARDS]
        if floors:
            area += sum(floors)
            perimeter += _outer_length(space)
    return area, perimeter


def buried_depth(space: Space) -> float:
    """Height [m] over which walls of a room touch the ground."""
    walls = [f.triangles[..., 2] for f in space.faces if f.adjacency == "ground" and abs(f.normal[2]) <= UPRIGHT]
    return max((float(z.max()) for z in walls), default=0.0) - min((float(z.min()) for z in walls), default=0.0)


def _outer_length(space: Space) -> float:
    """Length [m] in plan of a room's upright faces to outdoors or ground, doors and windows included."""
    spans: dict[int, list[tuple[float, float, float]]] = {}  # by azimuth: plane, start, end
    outer = [f for f in space.faces if f.adjacency in ("outside", "ground") and f.kind != "reveal"]
    parts = [(f.normal, f.triangles) for f in outer] + [(w.normal, w.triangles) for w in space.windows]
    for normal, triangles in parts:
        if abs(normal[2]) > UPRIGHT:
            continue
        azimuth = np.arctan2(normal[1], normal[0])
        out = np.array([np.cos(azimuth), np.sin(azimuth)])
        along = triangles[..., :2] @ np.array([-out[1], out[0]])
        plane = float(triangles[..., :2].reshape(-1, 2).mean(axis=0) @ out)
        key = round(float(np.degrees(azimuth))) % 360
        spans.setdefault(key, []).extend((plane, float(a.min()), float(a.max())) for a in along)
    return sum(_covered(one) for one in spans.values())


def _covered(parts: Sequence[tuple[float, float, float]]) -> float:
    """Length [m] that parts of walls of one azimuth cover, plane by plane."""
    total = 0.0
    walls: list[list[tuple[float, float, float]]] = []
    for part in sorted(parts):
        if not walls or part[0] - walls[-1][-1][0] > SAME_WALL:
            walls.append([])
        walls[-1].append(part)
    for wall in walls:
        reached = -np.inf
        for _, start, end in sorted(wall, key=lambda part: part[1]):
            total += max(end - max(start, reached), 0.0)
            reached = max(reached, end)
    return total
