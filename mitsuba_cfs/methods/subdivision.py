"""Window groups split into parts, where the view outdoors differs within a group.

A daylight matrix D is a mean over the windows of its group.  Below an overhang the top of a window
sees less sky than its sill, and a sensor sees some of the window better than the rest: V times the
mean of D is not the mean of V times D.  The error follows from D of small cells, traced with few
paths.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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
    daylight: NDArray[np.floating]  # [C, K, P] of Reinhart's sky of MF 1
    regions: tuple[Region, ...] = (Region.everything(),)

    def luminance(self, sky: Array) -> Array:
        """Luminance before the cells [C, K, H] under skies [P, H], in double precision.

        Cell by cell: D of all cells is large.
        """
        return np.stack([one.astype(float) @ sky for one in self.daylight])

    def error(self, points: Array, normals: Array, transmission: Array, sky: Array) -> Array:
        """Error of the direct light from the windows by D's means over the parts [S, H].

        Args:
            points, normals: [S, 3] sensors.
            transmission: T [K, K] of the group's system.
            sky: [P, H] luminance of Reinhart's sky of MF 1.
        """
        inside = np.einsum("kj,cjh->ckh", transmission, self.luminance(sky), optimize=True)
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
    outside = light.luminance(reference_skies())
    judge = Judge(light, outside)
    weight = np.sqrt(KLEMS_FULL.projected_solid_angles() / np.pi)[:, None]
    bright = np.maximum(level(outside), DARK)
    seen = (outside * weight / bright).reshape(len(outside), -1)
    regions = list(light.regions)
    cuts: list[_Cut] = []
    most = min(MOST_PARTS if parts is None else parts, len(seen))
    while len(regions) < most and (parts is not None or judge.error(regions) > limit):
        cuts += [_best_cut(light.cells, region, seen) for region in regions[len(cuts) :]]
        best = max(range(len(cuts)), key=lambda i: cuts[i].gain)
        cut = cuts.pop(best)
        if cut.gain < 0:
            break
        regions += regions.pop(best).halves(cut.axis, cut.place)
    return replace(light, regions=tuple(regions))


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


class _Cut(NamedTuple):
    """A plane across an axis of the frame."""

    gain: float = -1.0  # variance of the cells' luminance that it removes; below 0 where no plane cuts
    axis: int = 0
    place: float = 0.0  # [m]


def _best_cut(cells: Cells, region: Region, seen: Array) -> _Cut:
    """The cut of a region that removes the most variance of its cells' luminance [C, N]."""
    inside = region.holds(cells.centre)
    centre, area = cells.centre[inside], cells.area[inside]
    light = seen[inside] * area[:, None]
    best = _Cut()
    for axis in range(3):
        positions = np.unique(np.round(centre[:, axis], 6))
        places = 0.5 * (positions[1:] + positions[:-1])
        first = (centre[:, axis] < places[:, None]).astype(float)
        a, b = first @ area, (1.0 - first) @ area
        steps = (first @ light) / a[:, None] - ((1.0 - first) @ light) / b[:, None]
        gains = a * b / area.sum() * np.einsum("cn,cn->c", steps, steps)
        for gain, place in zip(gains, places, strict=True):
            gain = float(f"{gain:.6g}")  # equal ones stay so, whatever the order of summation
            if gain > best.gain:
                best = _Cut(gain, axis, float(place))
    return best
