"""Window groups cut into parts, where what stands outdoors is not the same before all of a group.

A daylight matrix D is a mean over its group's windows.  Below an overhang the top of a window sees
less of the sky than its sill, and a sensor does not see all of the window alike: V times the mean
is not the mean of V times D.  How much that is follows from D of small cells, traced cheaply.
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

LIMIT = 0.01  # share of the light that D's mean may be wrong by, root mean square of the places
MOST_PARTS = 8  # of a group
SKY = ReinhartSky(1)  # of the cells' matrices
SUN_ALTITUDE = np.radians(35)  # of the clear skies that the parts are judged by
DEPTHS = (0.5, 1.0, 2.0, 4.0)  # into the room, of the places that the parts are judged at [m]
INDIRECT = 0.05  # of a window's exitance, falls on a place by reflection
DARK = 1e-9  # least luminance to divide by: a window behind a wall sees none
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CellLight:
    """D of the cells of a window group, and the parts that the group is cut into."""

    group: WindowGroup
    cells: Cells
    daylight: Array  # [C, K, P] of Reinhart's sky of MF 1
    regions: tuple[Region, ...] = (Region.everything(),)

    def error(self, points: Array, normals: Array, transmission: Array, sky: Array) -> Array:
        """What D's means over the parts change in the light straight from the windows [S, H].

        Args:
            points, normals: [S, 3] sensors.
            transmission: [K, K] of what fills the group.
            sky: [P, H] luminance of Reinhart's sky of MF 1.
        """
        inside = np.einsum("kj,cjh->ckh", transmission, self.daylight @ sky, optimize=True)
        return np.abs(Straight(self, points, normals).error(inside, self.regions))


class Straight:
    """The light of cells straight at sensors, nothing hidden, one direction for each pair."""

    def __init__(self, light: CellLight, points: Array, normals: Array) -> None:
        """Of sensors [S, 3]."""
        self._cells, frame = light.cells, light.group.frame
        way = light.cells.centre[None] - (np.atleast_2d(points) @ frame.T)[:, None]  # [S, C, 3]
        distance = np.maximum(np.linalg.norm(way, axis=-1), 1e-3)
        way = way / distance[..., None]
        cosine = np.maximum(np.einsum("scx,sx->sc", way, np.atleast_2d(normals) @ frame.T), 0)
        cosine = np.where(way[..., 2] > 0, cosine * way[..., 2], 0.0)
        area = light.cells.area
        self._weight = cosine * area / np.maximum(distance**2, area)
        theta = np.arccos(np.clip(way[..., 2], 0, 1))
        self._patch = KLEMS_FULL.index(theta, incident_azimuth(way))

    def light(self, luminance: Array) -> Array:
        """Illuminance [S, H] by the luminance [C, K, H] of the cells."""
        seen = luminance[np.arange(len(luminance)), self._patch]
        return np.einsum("sc,sch->sh", self._weight, seen, optimize=True)

    def error(self, luminance: Array, regions: Sequence[Region]) -> Array:
        """What changes [S, H] with the mean of each region in place of its cells' own."""
        total = -self.light(luminance)
        for region in regions:
            held = region.holds(self._cells.centre)
            if held.any():
                mean = np.tensordot(self._cells.area[held], luminance[held], 1)
                mean /= self._cells.area[held].sum()
                seen = mean[self._patch[:, held]]
                total += np.einsum("sc,sch->sh", self._weight[:, held], seen, optimize=True)
        return total


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts Q of a scene's window groups, and the cells that say what each leaves as error."""

    groups: tuple[WindowGroup, ...]  # [Q], each with matrices of its own
    group: NDArray[np.int64]  # [Q] the window group of each
    cells: tuple[CellLight, ...] = ()  # of those that look outdoors; none where it is empty

    @classmethod
    def whole(cls, groups: Sequence[WindowGroup]) -> Parts:
        """Each group in one part."""
        return cls(tuple(groups), np.arange(len(groups)))

    @classmethod
    def of_cells(cls, cells: Iterable[CellLight]) -> Parts:
        """Each group in the parts of its cells."""
        cells = tuple(cells)
        pieces = [cut_group(light.group, light.regions) for light in cells]
        group = np.repeat(np.arange(len(cells)), [len(found) for found in pieces])
        return cls(tuple(part for found in pieces for part in found), group, cells)

    def and_inner(self, pieces: Iterable[Sequence[WindowGroup]]) -> Parts:
        """These and the parts of groups that look into another room, which come after them."""
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
    """The error that D's means may have where its patches have so many paths each.

    `LIMIT` of a full run; with fewer paths as much more as D's noise is: every part is more work.
    """
    return LIMIT * max(float(np.sqrt(Sampling().patch_samples / samples)), 1.0)


def subdivided(light: CellLight, parts: int | None = None, *, limit: float = LIMIT) -> CellLight:
    """A group cut until the error of D's means is below a limit of the light, or into `parts`.

    Each cut is the one, across height or width or between windows of different depth, that leaves
    least variance of what the cells see under five skies.
    """
    outside = light.daylight @ judging_skies()  # [C, K, H]
    judge = Judge(light, outside)
    weight = np.sqrt(KLEMS_FULL.projected_solid_angles() / np.pi)[:, None]
    bright = np.maximum(level(outside), DARK)
    seen = (outside * weight / bright).reshape(len(outside), -1)
    regions = light.regions
    most = min(MOST_PARTS if parts is None else parts, len(seen))
    while len(regions) < most and (parts is not None or judge.error(regions) > limit):
        cuts = [cut for region in regions if (cut := _best_cut(light.cells, region, seen))]
        if not cuts:
            break
        _, region, axis, place = max(cuts, key=lambda cut: cut[0])
        others = [r for r in regions if r is not region]
        regions = (*others, *region.halves(axis, place))
    return replace(light, regions=regions)


class Judge:
    """How much light behind a group D's means over some regions put in the wrong place."""

    def __init__(self, light: CellLight, outside: Array) -> None:
        """From the luminance before the cells under some skies [C, K, H]."""
        self._straight = Straight(light, *judging_places(light.group))
        omega = KLEMS_FULL.projected_solid_angles()
        even = np.einsum("k,ckh->ch", omega / np.pi, outside)[:, None]
        reflected = INDIRECT * np.pi * level(outside)[0]
        self._glazings = []  # clear, and one that scatters all: luminance, and light in all
        for luminance in (outside, np.broadcast_to(even, outside.shape)):
            whole = self._straight.light(luminance) + reflected
            self._glazings.append((luminance, np.maximum(whole, DARK)))

    def error(self, regions: Sequence[Region]) -> float:
        """Root mean square of the places, as a share of the light; worst of skies and glazings."""
        shares = (self._straight.error(lum, regions) / whole for lum, whole in self._glazings)
        return max(float(np.sqrt((share**2).mean(axis=0)).max()) for share in shares)


def judging_skies() -> Array:
    """The overcast sky, and the blue of clear ones with the sun in four quarters [P, 5]."""
    level, height = np.cos(SUN_ALTITUDE), np.sin(SUN_ALTITUDE)
    suns = [(level * x, level * y, height) for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))]
    clear = [cie_patches("clear", SKY, 1.0, sun=sun) for sun in suns]
    return np.stack([cie_patches("overcast", SKY, 1.0), *clear], axis=1)


def judging_places(group: WindowGroup) -> tuple[Array, Array]:
    """Places behind a group and their normals [S, 3]: looking along the panes' up, and at them."""
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
    """A sky [P, H] of any subdivision as the mean luminance of the patches of MF 1."""
    sky, fine = np.asarray(sky, dtype=float), ReinhartSky(subdivision)
    patch = SKY.index(fine.directions)
    total = np.zeros((SKY.size, sky.shape[1]))
    np.add.at(total, patch, fine.solid_angles[:, None] * sky)
    return total / np.bincount(patch, fine.solid_angles, minlength=SKY.size)[:, None]


def level(luminance: Array) -> Array:
    """Mean luminance before a group [1, 1, H], over its cells and over the projected hemisphere."""
    omega = KLEMS_FULL.projected_solid_angles()
    return np.einsum("ckh,k->h", luminance, omega / np.pi)[None, None] / len(luminance)


def _best_cut(cells: Cells, region: Region, seen: Array) -> tuple[float, Region, int, float] | None:
    """The cut of a region that takes away most variance of what its cells see [C, N]."""
    held = region.holds(cells.centre)
    centre, area, values = cells.centre[held], cells.area[held], seen[held]
    found = None
    for axis in range(3):
        places = np.unique(np.round(centre[:, axis], 6))
        for place in 0.5 * (places[1:] + places[:-1]):
            first = centre[:, axis] < place
            a, b = area[first], area[~first]
            step = np.average(values[first], 0, a) - np.average(values[~first], 0, b)
            gain = a.sum() * b.sum() / area.sum() * float(step @ step)
            gain = float(f"{gain:.6g}")  # equal ones stay so, whatever the order of summation
            if found is None or gain > found[0]:
                found = (gain, region, axis, float(place))
    return found
