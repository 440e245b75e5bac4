"""Window groups split into parts, where the view outdoors differs within a group.

A daylight matrix D is a mean over the windows of its group.  Below an overhang the top of a window
sees less sky than its sill, and a sensor sees some of the window better than the rest: V times the
mean of D is not the mean of V times D.  The error follows from D of small cells, traced with few
paths.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import incident_azimuth
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.cie import cie_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import WindowGroup
from mitsuba_cfs.window_parts import Cells, Region, cut_group

LIMIT = 0.01  # error of D's means as a share of the light, root mean square over test points
MOST_PARTS = 8  # of a group
SKY = ReinhartSky(1)  # of the cells' matrices
SUN_ALTITUDE = np.radians(35)  # of the clear skies that test the parts
DEPTHS = (0.5, 1.0, 2.0, 4.0)  # of the test points on the room side of the window [m]
INDIRECT = 0.05  # share of a window's exitance that reaches a test point by reflection
DARK = 1e-9  # least luminance to divide by: a window that faces a wall sees no sky
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CellLight:
    """D of the cells of a window group, and the parts that the group is split into."""

    group: WindowGroup
    cells: Cells
    daylight: Array  # [C, K, P] of Reinhart's sky of MF 1
    regions: tuple[Region, ...] = (Region.everything(),)

    def error(self, points: Array, normals: Array, transmission: Array, sky: Array) -> Array:
        """Error of the direct light from the windows by D's means over the parts [S, H].

        Args:
            points, normals: [S, 3] sensors.
            transmission: T [K, K] of the group's system.
            sky: [P, H] luminance of Reinhart's sky of MF 1.
        """
        inside = np.einsum("kj,cjh->ckh", transmission, self.daylight @ sky, optimize=True)
        return np.abs(DirectLight(self, points, normals).error(inside, self.regions))


class DirectLight:
    """Direct light of cells at sensors, without obstructions, in one direction for each pair."""

    def __init__(self, light: CellLight, points: Array, normals: Array) -> None:
        """Of sensors [S, 3]."""
        self._cells, frame = light.cells, light.group.frame
        towards = light.cells.centre[None] - (np.atleast_2d(points) @ frame.T)[:, None]  # [S, C, 3]
        distance = np.maximum(np.linalg.norm(towards, axis=-1), 1e-3)
        towards = towards / distance[..., None]
        cosine = np.maximum(np.einsum("scx,sx->sc", towards, np.atleast_2d(normals) @ frame.T), 0)
        cosine = np.where(towards[..., 2] > 0, cosine * towards[..., 2], 0.0)
        area = light.cells.area
        self._weight = cosine * area / np.maximum(distance**2, area)
        theta = np.arccos(np.clip(towards[..., 2], 0, 1))
        self._patch = KLEMS_FULL.index(theta, incident_azimuth(towards))

    def light(self, luminance: Array) -> Array:
        """Illuminance [S, H] by the luminance [C, K, H] of the cells."""
        seen = luminance[np.arange(len(luminance)), self._patch]
        return np.einsum("sc,sch->sh", self._weight, seen, optimize=True)

    def error(self, luminance: Array, regions: Sequence[Region]) -> Array:
        """Change of the illuminance [S, H] if each region has the mean luminance of its cells."""
        total = -self.light(luminance)
        for region in regions:
            inside = region.holds(self._cells.centre)
            if inside.any():
                mean = np.tensordot(self._cells.area[inside], luminance[inside], 1)
                mean /= self._cells.area[inside].sum()
                seen = mean[self._patch[:, inside]]
                total += np.einsum("sc,sch->sh", self._weight[:, inside], seen, optimize=True)
        return total


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts Q of a scene's window groups, and the cells that their error follows from."""

    groups: tuple[WindowGroup, ...]  # [Q], each with matrices of its own
    group: NDArray[np.int64]  # [Q] the window group of each
    cells: tuple[CellLight, ...] = ()  # of the groups that look outdoors; none on an open site

    @classmethod
    def whole(cls, groups: Sequence[WindowGroup]) -> Parts:
        """Each group in one part."""
        return cls(tuple(groups), np.arange(len(groups)))

    @classmethod
    def of_cells(cls, cells: Iterable[CellLight]) -> Parts:
        """Each group in the parts of its cells."""
        cells = tuple(cells)
        pieces = [cut_group(light.group, light.regions) for light in cells]
        group = np.repeat(np.arange(len(cells)), [len(parts) for parts in pieces])
        return cls(tuple(part for parts in pieces for part in parts), group, cells)

    def and_inner(self, pieces: Iterable[Sequence[WindowGroup]]) -> Parts:
        """These parts, followed by those of the groups that look into another room."""
        groups, group = list(self.groups), list(self.group)
        first = max(group, default=-1) + 1
        for g, parts in enumerate(pieces, first):
            groups += parts
            group += [g] * len(parts)
        return replace(self, groups=tuple(groups), group=np.array(group, dtype=np.int64))

    def outdoors(self, scene: DaylightScene) -> int:
        """How many of the parts, the first ones, look outdoors."""
        return int(np.count_nonzero(self.group < len(scene.outdoor_groups)))

    def of(self, g: int) -> NDArray[np.int64]:
        """The parts of a window group."""
        return np.flatnonzero(self.group == g)

    def of_groups(self, values: Array) -> Array:
        """The mean over each group [G, ...] of values of the parts [Q, ...], by area."""
        if len(self.groups) == len(set(self.group.tolist())):
            return values
        area = np.array([part.area for part in self.groups])
        share = np.where(np.arange(self.group.max() + 1)[:, None] == self.group, area, 0.0)
        return np.tensordot(share / share.sum(axis=1, keepdims=True), values, 1)


def allowed(samples: int) -> float:
    """The permitted error of D's means with so many paths for each of its patches.

    `LIMIT` in a full run; with fewer paths it grows as D's noise, because every part costs paths.
    """
    return LIMIT * max(float(np.sqrt(Sampling().patch_samples / samples)), 1.0)


def subdivided(light: CellLight, parts: int | None = None, *, limit: float = LIMIT) -> CellLight:
    """A group split until the error of D's means is below a limit of the light, or into `parts`.

    Each cut, across height or width or between windows of different depth, is the one that leaves
    the least variance of the cells' luminance under five skies.
    """
    outside = light.daylight @ reference_skies()  # [C, K, H]
    judge = Judge(light, outside)
    weight = np.sqrt(KLEMS_FULL.projected_solid_angles() / np.pi)[:, None]
    bright = np.maximum(level(outside), DARK)
    seen = (outside * weight / bright).reshape(len(outside), -1)
    regions = light.regions
    cuts: list[tuple[float, int, float]] = []  # the best of each region, as far as it has been needed
    most = min(MOST_PARTS if parts is None else parts, len(seen))
    while len(regions) < most and (parts is not None or judge.error(regions) > limit):
        cuts += [_best_cut(light.cells, region, seen) for region in regions[len(cuts) :]]
        best = max(range(len(cuts)), key=lambda number: cuts[number][0])
        gain, axis, place = cuts.pop(best)
        if not gain > -np.inf:
            break
        regions = (*regions[:best], *regions[best + 1 :], *regions[best].halves(axis, place))
    return replace(light, regions=regions)


class Judge:
    """Error of the light at test points behind a group by D's means over some regions."""

    def __init__(self, light: CellLight, outside: Array) -> None:
        """From the luminance before the cells under some skies [C, K, H]."""
        self._direct = DirectLight(light, *reference_points(light.group))
        omega = KLEMS_FULL.projected_solid_angles()
        even = np.einsum("k,ckh->ch", omega / np.pi, outside)[:, None]
        reflected = INDIRECT * np.pi * level(outside)[0]
        self._glazings = []  # clear, and one that scatters all: luminance, and light in all
        for luminance in (outside, np.broadcast_to(even, outside.shape)):
            whole = self._direct.light(luminance) + reflected
            self._glazings.append((luminance, np.maximum(whole, DARK)))

    def error(self, regions: Sequence[Region]) -> float:
        """Root mean square over the points as a share of the light; worst sky and glazing."""
        shares = (self._direct.error(lum, regions) / whole for lum, whole in self._glazings)
        return max(float(np.sqrt((share**2).mean(axis=0)).max()) for share in shares)


def reference_skies() -> Array:
    """The overcast sky, and clear skies with the sun in four quarters, without its beam [P, 5]."""
    level, height = np.cos(SUN_ALTITUDE), np.sin(SUN_ALTITUDE)
    suns = [(level * x, level * y, height) for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))]
    clear = [cie_patches("clear", SKY, 1.0, sun=sun) for sun in suns]
    return np.stack([cie_patches("overcast", SKY, 1.0), *clear], axis=1)


def reference_points(group: WindowGroup) -> tuple[Array, Array]:
    """Points behind a group and their normals [S, 3]: along the panes' height, and towards them."""
    corners = np.concatenate([w.triangles for w in group.windows]).reshape(-1, 3) @ group.frame.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = int(np.clip(np.ceil((high[0] - low[0]) / 2) + 2, 3, 9))
    x = np.linspace(low[0] - 0.5, high[0] + 0.5, count)
    points, normals = [], []
    for y, normal in ((low[1] - 0.1, group.frame[1]), (0.5 * (low + high)[1], group.frame[2])):
        for depth in DEPTHS:
            local = np.stack([x, np.full(count, y), np.full(count, low[2] - depth)], axis=1)
            points.append(local @ group.frame)
            normals.append(np.tile(normal, (count, 1)))
    return np.concatenate(points), np.concatenate(normals)


def coarse_sky(sky: ArrayLike, subdivision: int) -> Array:
    """Mean luminance of the patches of MF 1 of a sky [P, H] of any subdivision."""
    sky, fine = np.asarray(sky, dtype=float), ReinhartSky(subdivision)
    patch = SKY.index(fine.directions)
    total = np.zeros((SKY.size, sky.shape[1]))
    np.add.at(total, patch, fine.solid_angles[:, None] * sky)
    return total / np.bincount(patch, fine.solid_angles, minlength=SKY.size)[:, None]


def level(luminance: Array) -> Array:
    """Mean luminance before a group [1, 1, H], over its cells and over the projected hemisphere."""
    omega = KLEMS_FULL.projected_solid_angles()
    return np.einsum("ckh,k->h", luminance, omega / np.pi)[None, None] / len(luminance)


def _best_cut(cells: Cells, region: Region, seen: Array) -> tuple[float, int, float]:
    """The cut of a region that removes the most variance of its cells' luminance [C, N].

    Returns: the variance removed, minus infinity where nothing can be cut; axis; place.
    """
    inside = region.holds(cells.centre)
    centre, area, values = cells.centre[inside], cells.area[inside], seen[inside]
    places = [np.unique(np.round(along, 6)) for along in centre.T]
    cuts = [(axis, float(place)) for axis, at in enumerate(places) for place in 0.5 * (at[1:] + at[:-1])]
    if not cuts:
        return -np.inf, 0, 0.0
    first = np.stack([centre[:, axis] < place for axis, place in cuts])  # [n, C]
    sides = [np.where(side, area, 0.0) for side in (first, ~first)]
    a, b = (side.sum(axis=1) for side in sides)
    step = sides[0] @ values / a[:, None] - sides[1] @ values / b[:, None]
    gains = a * b / area.sum() * np.einsum("nk,nk->n", step, step)
    # equal ones stay so, whatever the order of summation
    rounded = [float(f"{gain:.6g}") for gain in gains]
    best = int(np.argmax(rounded))
    return rounded[best], *cuts[best]
