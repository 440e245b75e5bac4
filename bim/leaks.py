"""Where the air of a would-be room leaks out between building elements.

The elements are sampled on a grid of cubes; D is the distance of a free cube to the nearest one
of an element.  A would-be room is air at least `ROOMY` from every element, below one and above
another.
Its leak is the narrowest place of the widest way from there to the outside: the largest D at which
room and outside are still connected.  A leak is closed and the next one searched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

FINEST = 0.05  # size of a cube [m]
MOST_CUBES = 1_000_000
ROOMY = 0.5  # from every element [m]
SMALLEST = 1.0  # volume of such air [m3]
OPEN = 0.8  # of a place's own D: it is outdoors, below eaves, if the way out is that wide
MOST_LEAKS = 6
STEPS = 9  # halvings of the width
COARSEST = 0.17  # cubes that tell of every room whether it is enclosed [m]: 4 x 2^0.5 + 1 across
MOST_FILLED = 50_000_000  # cubes


@dataclass(frozen=True, slots=True)
class Leak:
    """A gap through which a would-be room is open to the outside."""

    position: NDArray[np.float64]  # [3] [m]
    width: float  # of the narrowest place [m], to a cube's size
    room: NDArray[np.float64]  # [3] a point of the would-be room [m]


def leaks(elements: Sequence[NDArray[np.float64]]) -> tuple[list[Leak], float]:
    """The leaks of the air between elements, each of triangles [N, 3, 3], and a cube's size [m]."""
    triangles = np.concatenate([*elements, np.empty((0, 3, 3))])
    if not len(triangles):
        return [], FINEST
    low, high = triangles.min((0, 1)) - 1.0, triangles.max((0, 1)) + 1.0
    size = max(FINEST, float((np.prod(high - low) / MOST_CUBES) ** (1 / 3)))
    solid = np.zeros(np.ceil((high - low) / size).astype(int) + 1, dtype=bool)
    cells = np.floor((_samples(triangles, 0.7 * size) - low) / size).astype(int)
    solid[tuple(cells.T)] = True
    found: list[Leak] = []
    while len(found) < MOST_LEAKS:
        leak, cubes = _leak(solid, size)
        if leak is None:
            break
        found.append(Leak(low + size * (leak.position + 0.5), leak.width, low + size * leak.room))
        solid[cubes] = True
    return found, size


def may_enclose(elements: Sequence[NDArray[np.float64]], gap: float) -> bool:
    """Whether elements, each of triangles [N, 3, 3], may enclose a room once gaps [m] are closed.

    Air outside is filled from a corner on a grid whose solid cubes are widened by one, which
    closes gaps of two cubes: where no air is left, no room is enclosed.  A room of the smallest
    size leaves air in cubes of `COARSEST`; where there would be too many of these, it may.
    """
    triangles = np.concatenate([*elements, np.empty((0, 3, 3))])
    if not len(triangles) or not np.isfinite(triangles).all():
        return bool(len(triangles))
    low, high = triangles.min((0, 1)) - 1.0, triangles.max((0, 1)) + 1.0
    size = max(2 * FINEST, gap / 2, float((np.prod(high - low) / MOST_FILLED) ** (1 / 3)))
    if size > max(COARSEST, gap / 2):
        return True
    solid = np.zeros(np.ceil((high - low) / size).astype(int) + 1, dtype=bool)
    for body in elements:
        cells = np.floor((_samples(body, 0.7 * size) - low) / size).astype(int)
        solid[tuple(cells.T)] = True
    for axis in range(3):
        inner = np.swapaxes(solid, 0, axis)  # a view
        before = inner.copy()
        inner[1:] |= before[:-1]
        inner[:-1] |= before[1:]
    labels, count = ndimage.label(~solid)
    return count > 1 or not labels[0, 0, 0]


def _leak(solid: NDArray[np.bool_], size: float) -> tuple[Leak | None, tuple[NDArray[np.int64], ...]]:
    """The leak of the largest would-be room that has one, in cubes, and the cubes that close it."""
    distance = ndimage.distance_transform_edt(~solid) * size
    above = np.logical_or.accumulate(solid[..., ::-1], axis=2)[..., ::-1]
    covered = above & np.logical_or.accumulate(solid, axis=2) & (distance >= ROOMY)
    rooms, count = ndimage.label(covered)
    sizes = np.bincount(rooms.ravel(), minlength=count + 1)[1:]
    for room in np.argsort(-sizes)[: 4 * MOST_LEAKS]:
        if sizes[room] * size**3 < SMALLEST:
            break
        inside = np.argwhere(rooms == room + 1)
        seed = inside[distance[tuple(inside.T)].argmax()]
        narrow, wide = 0.0, float(distance[tuple(seed)])
        if not _connected(distance > 0, seed):
            continue
        for _ in range(STEPS):
            middle = (narrow + wide) / 2
            if _connected(distance >= middle, seed):
                narrow = middle
            else:
                wide = middle
        if narrow > OPEN * distance[tuple(seed)]:
            continue
        place, along = _neck(distance, narrow, wide, seed)
        reach = int(np.ceil(wide / size)) + 2
        plug = _plug(distance, place, along, reach)
        middle_height = (int(plug[2].min()) + int(plug[2].max())) / 2
        position = np.array([place[0], place[1], middle_height])
        return Leak(position, 2 * narrow, seed.astype(float)), plug
    return None, ()


def _connected(free: NDArray[np.bool_], seed: NDArray[np.int64]) -> bool:
    """Whether free cubes lead from a seed to the first corner, which is outside."""
    labels, _ = ndimage.label(free)
    return bool(labels[tuple(seed)] and labels[tuple(seed)] == labels[0, 0, 0])


def _neck(
    distance: NDArray[np.float64], narrow: float, wide: float, seed: NDArray[np.int64]
) -> tuple[NDArray[np.int64], int]:
    """The narrowest cube [3] of the way out, and the axis along which the way leads through it.

    Air that is free at `wide` is parted into the room's and that outside; at `narrow` a way of
    cubes joins them.  The cubes of the shortest such way have the least sum of steps to both.
    """
    free = distance >= narrow
    labels, _ = ndimage.label(distance >= wide)
    room = _steps(labels == labels[tuple(seed)], labels == labels[0, 0, 0], free)
    outside = _steps(labels == labels[0, 0, 0], labels == labels[tuple(seed)], free)
    way = np.where((room > 0) & (outside > 0), room + outside, np.iinfo(int).max)
    cubes = np.argwhere(way == way.min())
    place = cubes[distance[tuple(cubes.T)].argmin()]
    beside = [room[tuple(place + one)] - room[tuple(place - one)] for one in np.eye(3, dtype=int)]
    return place, int(np.abs(beside).argmax())


def _steps(start: NDArray[np.bool_], goal: NDArray[np.bool_], free: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Steps through free cubes from the start, 0 where the goal was reached before."""
    steps, reached = np.zeros(start.shape, dtype=int), start
    for number in range(1, max(start.shape)):
        grown = ndimage.binary_dilation(reached, mask=free)
        steps[grown & ~reached] = number
        if (grown & goal).any() or (grown == reached).all():
            break
        reached = grown
    return steps


def _plug(
    distance: NDArray[np.float64], place: NDArray[np.int64], along: int, reach: int
) -> tuple[NDArray[np.int64], ...]:
    """The cubes that close a gap: across the way, as wide as it is, as tall as it is open."""
    low, high = np.maximum(place - reach, 0), np.minimum(place + reach + 1, distance.shape)
    low[along], high[along] = max(place[along] - 1, 0), place[along] + 2
    if along != 2:  # a slit of a wall, from one solid cube below to one above
        column = np.flatnonzero(distance[place[0], place[1]] <= 0)
        low[2] = max([z for z in column if z < place[2]], default=0)
        high[2] = min([z for z in column if z > place[2]], default=distance.shape[2])
    box = np.meshgrid(*map(np.arange, low, high), indexing="ij")
    return tuple(axis.ravel() for axis in box)


def _samples(triangles: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Points [N, 3] on triangles, no farther apart than the spacing [m]."""
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    counts = np.maximum(1, np.ceil(longest / spacing)).astype(int)
    points = []
    for count in np.unique(counts):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        keep = i + j <= count
        u, v = i[keep] / count, j[keep] / count
        some = triangles[counts == count]
        weights = np.stack([1 - u - v, u, v], axis=1)
        points.append(np.einsum("kc,ncx->nkx", weights, some).reshape(-1, 3))
    return np.concatenate(points) if points else np.empty((0, 3))
