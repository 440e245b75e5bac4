"""Several rooms in one scene, with gaps that no ray of a room crosses.

One acceleration structure and one launch serve the rooms of a building.  Each room is moved as a
whole: what its rays meet is the same as in a scene of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import CacheEntry
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.trace.kernels.estimate import Estimate, JoinedEntry, Stopping, accumulate

FARTHEST = 100.0  # of a room from the middle of all, where float32 has steps of 8e-6 m [m]
ENTRIES = 1 << 22  # of the matrices that rooms in one scene have together
MARGIN = 0.05  # beyond a room's diagonal, that rays in it reach [m]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class TracedRoom:
    """Surfaces of a room, or in front of its windows, and the points that rays start from."""

    surfaces: Surfaces
    groups: Sequence[WindowGroup]
    points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))  # [S, 3]
    directions: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))  # [S, 3]
    number: int = 0  # among the owners of `SharedOutdoors`

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest coordinates [2, 3]."""
        panes = [window.triangles for group in self.groups for window in group.windows]
        parts = [self.surfaces.triangles, *panes]
        corners = np.concatenate([*(part.reshape(-1, 3) for part in parts), self.points])
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    @property
    def reach(self) -> float:
        """Length of the longest ray in the room [m]."""
        return float(np.linalg.norm(np.ptp(self.bounds, axis=0))) + MARGIN

    @property
    def kind(self) -> tuple[bool, bool]:
        """What rays draw random numbers by: whether surfaces are glossy, and whether panes."""
        return bool(self.surfaces.glossy), any(map(bool, self.surfaces.transmittance))

    def moved(self, shift: NDArray[np.float64]) -> TracedRoom:
        """The room elsewhere."""
        surfaces = replace(self.surfaces, triangles=self.surfaces.triangles + shift)
        groups = [_moved_group(group, shift) for group in self.groups]
        return replace(self, surfaces=surfaces, groups=groups, points=self.points + shift)


def _moved_group(group: WindowGroup, shift: NDArray[np.float64]) -> WindowGroup:
    windows = (WindowSurface(w.name, w.triangles + shift, w.up) for w in group.windows)
    return WindowGroup(group.name, tuple(windows))


def apart(rooms: Sequence[TracedRoom]) -> tuple[list[TracedRoom], float]:
    """The rooms on the places of a cubic grid about the origin, and the longest ray in any [m].

    A single room stays where it is.
    """
    if len(rooms) == 1:
        return list(rooms), np.inf
    reach = max(room.reach for room in rooms)
    side = _side(len(rooms))
    places = np.stack(np.unravel_index(np.arange(len(rooms)), (side,) * 3), axis=1)
    centres = (places - 0.5 * (side - 1)) * 2.0 * reach
    pairs = zip(rooms, centres, strict=True)
    return [room.moved(centre - room.bounds.mean(axis=0)) for room, centre in pairs], reach


def _side(count: int) -> int:
    """Places along an edge of the grid."""
    return int(np.ceil(count ** (1 / 3) - 1e-9))


def surface_counts(parts: Sequence[Surfaces]) -> list[int]:
    """How many numbers of surfaces each part has where several are joined."""
    return [max(int(p.surface.max(initial=-1)) + 1, len(p.gloss)) for p in parts]


def joined_surfaces(parts: Sequence[Surfaces]) -> Surfaces:
    """Surfaces of several rooms, numbered one after the other."""
    if len(parts) == 1:
        return parts[0]
    counts = surface_counts(parts)
    firsts = np.cumsum([0, *counts])
    return Surfaces(
        np.concatenate([p.triangles for p in parts]),
        np.concatenate([p.reflectance for p in parts]),
        np.concatenate([p.surface + first for p, first in zip(parts, firsts, strict=False)]),
        gloss=_padded([p.gloss for p in parts], counts),
        transmittance=_padded([p.transmittance for p in parts], counts),
    )


def _padded(parts: Sequence[tuple[T, ...]], counts: Sequence[int]) -> tuple[T | None, ...]:
    """Values by surface, None for those without; none at all where no surface has one."""
    if not any(parts):
        return ()
    pairs = zip(parts, counts, strict=True)
    return tuple(v for p, n in pairs for v in (*p[:n], *(None,) * (n - len(p))))


def batches_of_rooms(rooms: Sequence[TracedRoom], entries: Sequence[int], *, outdoors: bool) -> Iterator[list[int]]:
    """Numbers of the rooms that share a scene: few enough for memory; indoors alike in `kind`.

    Args: entries: of each room's matrix.
    """
    kinds: dict[tuple[bool, bool], list[int]] = {}
    for number, room in enumerate(rooms):
        kinds.setdefault((False, False) if outdoors else room.kind, []).append(number)
    for numbers in kinds.values():
        batch: list[int] = []
        total = 0
        of_room = {i: 0.0 if outdoors else rooms[i].reach for i in numbers}
        for number in sorted(numbers, key=lambda i: (of_room[i], i)):  # alike in size
            reach, total = of_room[number], total + entries[number]
            far = _side(len(batch) + 1) * reach > FARTHEST
            if batch and (far or total > ENTRIES):
                yield batch
                batch, total = [], entries[number]
            batch.append(number)
        if batch:
            yield batch


def of_rooms(
    rooms: Sequence[TracedRoom],
    traced: Callable[[Sequence[int]], Callable[[int], NDArray[np.float64]]],
    entries: Sequence[CacheEntry | None],
    *,
    shapes: Sequence[tuple[int, ...]],
    stopping: Stopping | None,
    label: str,
    progress: Progress = silent,
    outdoors: bool = False,
    layers: int = 1,
) -> list[Estimate]:
    """The matrix of each room, of several that are traced together.

    Those of the cache are taken where it has all of these: a room's place among the others, and so
    the rounding of its coordinates, does not depend on what is cached.

    Args:
        traced: gives batches of the matrices of some rooms, one after the other, the last axis
            whole; called where they are not in the cache.
        entries: of each room's matrix, layer by layer; shapes: of each room's matrix.
        outdoors: rather than indoors.
        layers: of the batches: matrices of each room that one pass gives, of all rooms each.
    """
    estimates: dict[int, Estimate] = {}
    sizes, count = [math.prod(shape) for shape in shapes], len(rooms)
    for some in batches_of_rooms(rooms, [layers * size for size in sizes], outdoors=outdoors):
        those = [layer * count + i for layer in range(layers) for i in some]
        of_each = [shapes[i % count] for i in those]
        rows = [math.prod(shape[:-1]) for shape in of_each]
        together = accumulate(
            _at_first_use(partial(traced, some)),
            stopping=stopping,
            label=label,
            progress=progress,
            entry=_joined_entry([entries[i] for i in those], of_each),
        )
        for i, shape, first, size in zip(those, of_each, np.cumsum(rows) - rows, rows, strict=True):
            estimates[i] = together.part(np.s_[first : first + size]).shaped(shape)
    return [estimates[number] for number in range(layers * count)]


def _at_first_use(prepare: Callable[[], Callable[[int], NDArray[np.float64]]]) -> Callable[[int], NDArray[np.float64]]:
    """A function that is prepared when it is first called."""
    prepared = cache(prepare)
    return lambda number: prepared()(number)


def _joined_entry(entries: Sequence[CacheEntry | None], shapes: Sequence[tuple[int, ...]]) -> JoinedEntry | None:
    """None without a cache."""
    some = [entry for entry in entries if entry is not None]
    return JoinedEntry(some, shapes) if some else None
