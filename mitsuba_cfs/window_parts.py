"""Windows cut by planes of their group's frame, into cells or into parts with own matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.surfaces import WindowGroup, WindowSurface, triangle_areas

CELLS = 144  # of a group, about; a window has no fewer than `LEAST_CELLS`
LEAST_CELLS = 6
SLIVER = 1e-6  # [m2] of a cut window that is left out
FLAT = 1e-6  # share of its area by which a window's outline may exceed it


@dataclass(frozen=True, slots=True)
class Region:
    """A box in the frame of a window group: x to the right, y up, z outdoors."""

    low: NDArray[np.float64]  # [3] [m]
    high: NDArray[np.float64]  # [3] [m]

    @classmethod
    def everything(cls) -> Region:
        """The box that cuts nothing."""
        return cls(np.full(3, -np.inf), np.full(3, np.inf))

    def halves(self, axis: int, place: float) -> tuple[Region, Region]:
        """Both sides of a plane across an axis of the frame."""
        high, low = self.high.copy(), self.low.copy()
        high[axis] = low[axis] = place
        return Region(self.low, high), Region(low, self.high)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points [n, 3] of the frame are in the box [n]."""
        return np.all((points >= self.low) & (points < self.high), axis=1)


def even_regions(group: WindowGroup, size: float) -> list[Region]:
    """Boxes that cut a group's windows, taken together, evenly to pieces of about a size [m]."""
    corners = np.concatenate([w.triangles for w in group.windows]).reshape(-1, 3) @ group.frame.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    regions = [Region.everything()]
    for axis in (0, 1):
        count = max(1, round((high[axis] - low[axis]) / size))
        for place in np.linspace(low[axis], high[axis], count + 1)[1:-1]:
            last = [r for r in regions if np.isinf(r.high[axis])]
            cut = [half for r in last for half in r.halves(axis, float(place))]
            regions = [r for r in regions if not np.isinf(r.high[axis])] + cut
    return regions


@dataclass(frozen=True, slots=True)
class Cells:
    """Rectangles C that approximate the windows of a group."""

    corner: NDArray[np.float64]  # [C, 3] in the frame of the group [m]
    sides: NDArray[np.float64]  # [C, 2] along x and y [m]
    area: NDArray[np.float64]  # [C] of the glass in it [m2]

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centres [C, 3] in the frame of the group [m]."""
        return self.corner + np.pad(0.5 * self.sides, ((0, 0), (0, 1)))


def window_cells(group: WindowGroup) -> Cells:
    """The windows of a group as rectangles, about `CELLS` of them."""
    of_window = max(LEAST_CELLS, CELLS // len(group.windows))
    corners, sides, areas = [], [], []
    for window in group.windows:
        triangles = window.triangles @ group.frame.T
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        width, height = (high - low)[:2]
        rows = int(np.clip(round(np.sqrt(of_window * height / width)), 1, of_window))
        columns = max(1, of_window // rows)
        step = np.array([width / columns, height / rows])
        polygons = _polygons(triangles)
        for i, j in np.ndindex(columns, rows):
            corner = low + np.append(step * [i, j], 0.0)
            box = Region(np.array([*corner[:2], -np.inf]), np.array([*(corner[:2] + step), np.inf]))
            area = sum(float(triangle_areas(_fan(_cut(p, box))).sum()) for p in polygons)
            if area > SLIVER:
                corners.append(corner)
                sides.append(step)
                areas.append(area)
    return Cells(np.array(corners), np.array(sides), np.array(areas))


def cut_group(group: WindowGroup, regions: Sequence[Region]) -> list[WindowGroup]:
    """The parts of a group's windows in each region: one group for each region with any."""
    if len(regions) == 1:
        return [group]
    result = []
    for number, region in enumerate(regions, 1):
        windows = [w for window in group.windows if (w := _cut_window(window, group, region))]
        if windows:
            result.append(WindowGroup(f"{group.name}, part {number}", tuple(windows)))
    return result


def _cut_window(window: WindowSurface, group: WindowGroup, region: Region) -> WindowSurface | None:
    """The part of a window in a region; None if empty."""
    triangles = window.triangles @ group.frame.T
    depth = triangles[..., 2].mean()
    if not region.low[2] <= depth < region.high[2]:
        return None
    pieces = [_fan(_cut(polygon, region)) for polygon in _polygons(triangles)]
    kept = np.concatenate(pieces)
    kept = kept[triangle_areas(kept) > SLIVER]
    return replace(window, triangles=kept @ group.frame) if len(kept) else None


def _polygons(triangles: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The outline [n, 3] of a convex window, so that a cut makes few triangles; else its triangles.

    Args: triangles: [T, 3, 3] in the frame of the group.
    """
    corners = np.unique(np.round(triangles.reshape(-1, 3), 9), axis=0)
    about = corners[:, :2] - corners[:, :2].mean(axis=0)
    outline = corners[np.argsort(np.arctan2(about[:, 1], about[:, 0]))]
    area = triangle_areas(triangles).sum()
    turns = np.roll(outline, -1, axis=0)[:, :2] - outline[:, :2]
    following = np.roll(turns, -1, axis=0)
    convex = np.all(turns[:, 0] * following[:, 1] - turns[:, 1] * following[:, 0] > -1e-12)
    if convex and abs(triangle_areas(_fan(outline)).sum() - area) < FLAT * area:
        return [outline]
    return list(triangles)


def _cut(polygon: NDArray[np.float64], region: Region) -> NDArray[np.float64]:
    """The part of a convex polygon [n, 3] between a region's bounds in x and y.

    Source: Sutherland, Hodgman 1974, "Reentrant polygon clipping".
    """
    for axis in (0, 1):
        for sign, bound in ((1.0, region.low[axis]), (-1.0, region.high[axis])):
            if not np.isfinite(bound) or not len(polygon):
                continue
            beyond = sign * (polygon[:, axis] - bound)
            kept = []
            for i, end in enumerate(polygon):
                start, d0, d1 = polygon[i - 1], beyond[i - 1], beyond[i]
                if (d0 > 0) != (d1 > 0):
                    kept.append(start + (end - start) * (d0 / (d0 - d1)))
                if d1 > 0:
                    kept.append(end)
            polygon = np.array(kept).reshape(-1, 3)
    return polygon


def _fan(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [n - 2, 3, 3] of a convex polygon [n, 3]."""
    n = max(len(polygon) - 2, 0)
    return np.stack([polygon[[0] * n], polygon[1 : n + 1], polygon[2 : n + 2]], axis=1)
